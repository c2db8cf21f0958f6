"""A worker process: it draws the frames that its parent sends it, and ends when its parent does.

It gets a `Job`, then any number of `Task`s, over one connection. It answers the job with `Started`, or with
the error that keeps it from drawing, and each task with `Drawn` or `Failed`, in their order.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
import traceback
import warnings
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any, NoReturn

from firefly_sample.capture.drawing import Artist
from firefly_sample.capture.drawn import Failed
from firefly_sample.capture.job import Driver, Job
from firefly_sample.errors import FireflyError, SoftwareDriverWarning


@dataclass(frozen=True)
class Started:
    """The answer to a job: the driver, and what was warned of meanwhile."""

    driver: Driver
    said: tuple[str, ...]


@dataclass(frozen=True)
class Ended:
    """The last message of a worker that cannot go on: its error, for people."""

    reason: str


def main(descriptor: int) -> NoReturn:
    """Work for the process at the other end of a connection."""
    _keep_stdout_clean()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what Ctrl-C ends
    connection: Connection[Any, Any] = Connection(descriptor)
    received: SimpleQueue[Any] = SimpleQueue()
    threading.Thread(target=_receive, args=(connection, received), daemon=True).start()
    try:
        _work(connection, received)
    except ConnectionError:  # the parent is gone
        os._exit(1)
    except BaseException as error:  # noqa: BLE001 - MemoryError, for one: the parent starts another process
        traceback.print_exc()
        with suppress(OSError, MemoryError):
            connection.send(Ended(_one_line(error)))
        os._exit(1)


def _keep_stdout_clean() -> None:
    """Send what is printed, by Python or by a library, to stderr: the parent's stdout may carry data."""
    sys.stdout = sys.stderr
    with suppress(OSError):
        os.dup2(2, 1)


def _receive(connection: Connection[Any, Any], received: SimpleQueue[Any]) -> NoReturn:
    """Put what comes into a queue. End the process as soon as the parent is gone, whatever it is drawing."""
    try:
        while True:
            received.put(connection.recv())
    except (EOFError, OSError):
        pass
    except BaseException:  # noqa: BLE001 - the thread must not end alone: nothing would come any more
        traceback.print_exc()
    os._exit(1)


def _work(connection: Connection[Any, Any], received: SimpleQueue[Any]) -> NoReturn:
    job: Job = received.get()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", SoftwareDriverWarning)  # the parent warns, once
        try:
            artist = Artist(job)
        except FireflyError as error:
            connection.send(_portable(error))
            raise
    connection.send(Started(artist.driver, tuple(str(one.message) for one in caught)))
    while True:
        result = artist.draw_one(received.get())
        if isinstance(result, Failed):
            result = replace(result, error=_portable(result.error))
        connection.send(result)
        del result  # its files take memory


def _portable(error: FireflyError) -> FireflyError:
    """Return an error that any process can unpickle: itself, unless its class is in the way."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001 - a plugin's class may raise anything
        return FireflyError(_one_line(error))
    return error


def _one_line(error: BaseException) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}".removesuffix(": ")
