"""The engine that draws on the workers of a dask cluster."""

from __future__ import annotations

import asyncio
import os
import warnings
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Literal

from firefly_sample.capture.cluster_client import LOCAL, connected
from firefly_sample.capture.cluster_roster import POLL_SECONDS, Roster
from firefly_sample.capture.cluster_worker import Refused, draw, free
from firefly_sample.capture.drawn import Drawn, Failed
from firefly_sample.capture.job import Driver, Job, Task
from firefly_sample.errors import FireflyError, SoftwareDriverWarning
from firefly_sample.gpu.driver_checks import software_warning

if TYPE_CHECKING:
    from distributed import Client, Future

PATIENCE_SECONDS = 600.0
"""Seconds after which a capture ends whose cluster has no worker that can draw."""
_AHEAD = 2
"""Frames that each thread of a worker has: one is drawn, and one waits."""
_TRIES = 3
"""Attempts at a frame whose task fails, for example because its result was lost on the way."""
_DEATHS = 5
"""A capture ends when this many frames in a row have ended their workers."""
_FETCH_SECONDS = 2.0
"""Seconds that the first attempt to fetch a drawn frame may take; each further one may take twice as long."""
_FETCHERS = 8
"""Frames that are fetched at once."""
_FREE_SECONDS = 2.0


_Result = Drawn | Failed | Refused


@dataclass(frozen=True)
class _Flight:
    """A frame that the cluster has: who may draw it, its earlier tries, whether it is the only one.

    Its result must come within some seconds when it is drawn.
    """

    task: Task
    future: Future[_Result]
    workers: frozenset[str]
    tries: int
    alone: bool
    seconds: float = _FETCH_SECONDS


class ClusterEngine:
    """Draws on the workers of a dask cluster, which need the same firefly_sample, driver, plugins and files.

    A frame whose worker ends is drawn by another one. If a frame's workers end more often than the scheduler
    allows, the frame is drawn again while no other one is, because dask blames all frames that these workers
    had; if they end again, it is `Failed`. A worker whose driver, version, plugin or files differ is refused
    with a warning. Workers may come and go.

    Parameters
    ----------
    job : Job
        One of those that are going to be drawn.
    address : str
        The scheduler's address, for example ``tcp://host:8786``, the file in which a scheduler keeps it, or
        "local" for processes on this machine, which end with this one.
    workers : int, "auto" or None
        The number of processes of "local"; as many as there are cores unless it is a number.
    expected : Driver, optional
        The driver that all frames must have. If absent, the most common one of the workers that are there at
        the start; of several, that of the first address.
    patience : float
        How many seconds to wait while there is no worker that can draw. If there are workers and all are
        refused, the wait is at most 15 seconds, and at the start there is none.

    Raises
    ------
    MissingPackageError
        On entry, if distributed is not installed.
    GpuError
        On entry or later, if all workers have other drivers.
    FireflyError
        On entry or later, if the scheduler cannot be reached, or no worker can draw.
    """

    def __init__(
        self,
        job: Job,
        address: str,
        workers: int | Literal["auto"] | None = None,
        expected: Driver | None = None,
        patience: float = PATIENCE_SECONDS,
    ) -> None:
        self._job, self._address, self._workers = job, address, workers
        self._expected, self._patience = expected, patience
        self._folder = os.getcwd()
        self._done: SimpleQueue[str] = SimpleQueue()
        self._opened = ExitStack()
        self._client: Client
        self._roster: Roster
        self._flying: dict[str, _Flight] = {}
        self._again: deque[tuple[Task, int]] = deque()
        self._suspects: deque[tuple[Task, int]] = deque()
        self._deaths = 0
        self._is_exhausted = False
        self._threads: ThreadPoolExecutor

    @property
    def driver(self) -> Driver:
        """The driver of all frames; it is known inside the block."""
        assert self._roster.driver is not None
        return self._roster.driver

    def draw(self, tasks: Iterable[Task]) -> Iterator[tuple[Task, Drawn | Failed]]:
        """Draw frames in any order: see `Engine.draw`."""
        source, self._is_exhausted = iter(tasks), False
        try:
            while True:
                self._roster.update()
                yield from self._stranded()
                self._fill(source)
                if self._is_exhausted and not (self._flying or self._again or self._suspects):
                    return
                yield from self._landed(source)
        finally:
            self._cancel()

    def _fill(self, source: Iterator[Task]) -> None:
        """Submit frames until each worker has enough of them."""
        workers = self._roster.accepted
        if not workers:
            return
        if self._suspects or any(flight.alone for flight in self._flying.values()):
            if not self._flying:
                self._submit(*self._suspects.popleft(), workers, alone=True)
            return
        room = _AHEAD * sum(workers.values())
        while len(self._flying) < room:
            if self._again:
                self._submit(*self._again.popleft(), workers)
            elif (task := next(source, None)) is not None:
                self._submit(task, 0, workers)
            else:
                self._is_exhausted = True
                return

    def _submit(self, task: Task, tries: int, workers: Iterable[str], alone: bool = False) -> None:
        allowed = frozenset(workers)
        future = self._client.submit(
            draw,
            task,
            self.driver,
            self._folder,
            key=f"firefly-frame-{os.urandom(16).hex()}",
            workers=sorted(allowed),
            allow_other_workers=False,
            pure=False,
        )
        self._watch(_Flight(task, future, allowed, tries, alone))

    def _watch(self, flight: _Flight) -> None:
        self._flying[flight.future.key] = flight
        flight.future.add_done_callback(_Putting(self._done))

    def _landed(self, source: Iterator[Task]) -> Iterator[tuple[Task, Drawn | Failed]]:
        """Give the frames that are done, and submit others meanwhile; wait for one, but not for long."""
        try:
            keys = [self._done.get(timeout=POLL_SECONDS / 2)]
        except Empty:
            return
        while len(keys) < len(self._flying):
            try:
                keys.append(self._done.get_nowait())
            except Empty:
                break
        keys = [key for key in keys if not self._roster.answer(key)]
        flights = [self._flying.pop(key) for key in keys if key in self._flying]
        fetched = self._threads.map(_fetched, flights)
        self._fill(source)
        for flight, result in zip(flights, fetched, strict=True):
            if (final := self._final(flight, result)) is not None:
                yield flight.task, final

    def _final(self, flight: _Flight, result: _Result | BaseException) -> Drawn | Failed | None:
        """Return what becomes of a frame that is done, or None if it is to be drawn again."""
        from distributed import KilledWorker

        if isinstance(result, KilledWorker):
            return self._killed(flight, result.last_worker.address)
        if isinstance(result, TimeoutError) and flight.future.status != "error":
            # its worker is gone, so that it must be drawn again, or the network is slow
            self._watch(replace(flight, seconds=2 * flight.seconds))
            return None
        if isinstance(result, BaseException):
            self._roster.check_scheduler()
            return self._failed(flight, result)
        if isinstance(result, Refused):
            self._roster.refuse(result.address, result.reason)
            self._again.append((flight.task, flight.tries))
            return None
        self._deaths = 0
        return result

    def _killed(self, flight: _Flight, worker: str) -> Failed | None:
        """Return the failure of a frame that ends its worker when it is alone, too."""
        if flight.alone:
            return self._deadly(flight.task, f", the last one at {worker}")
        self._suspects.append((flight.task, 0))
        return None

    def _deadly(self, task: Task, where: str) -> Failed:
        """Return the failure of a frame that ends its workers; raise if all frames do."""
        self._deaths += 1
        text = f"frame {task.index} ended each worker that drew it{where}"
        if self._deaths >= _DEATHS:
            raise FireflyError(f"cluster {self._address}: {text}, as did the {_DEATHS - 1} frames before it")
        return Failed(task.index, FireflyError(text))

    def _failed(self, flight: _Flight, error: BaseException) -> Failed | None:
        """Return the failure of a frame whose task has failed too often."""
        tries = flight.tries + 1
        if tries < _TRIES:
            self._again.append((flight.task, tries))
            return None
        text = f"frame {flight.task.index}: {type(error).__name__}: {' '.join(str(error).split())}"
        return Failed(flight.task.index, FireflyError(text))

    def _stranded(self) -> Iterator[tuple[Task, Failed]]:
        """Take back the frames whose workers are all gone or refused; give those that have lost too many.

        Dask would keep them for these workers, and its nannies start new ones with other addresses.
        """
        workers = self._roster.accepted.keys()
        for key, flight in list(self._flying.items()):
            if not flight.workers.isdisjoint(workers) or flight.future.done():
                continue
            del self._flying[key]
            flight.future.cancel(force=True)
            if not flight.workers.isdisjoint(self._roster.refused):
                self._again.append((flight.task, flight.tries))
            elif flight.tries + 1 < _TRIES:
                self._suspects.append((flight.task, flight.tries + flight.alone))
            else:
                yield flight.task, self._deadly(flight.task, "")

    def _cancel(self) -> None:
        """Withdraw all frames that are not done."""
        flying, self._flying = self._flying, {}
        self._again.clear()
        self._suspects.clear()
        if flying and self._client.status == "running":
            with suppress(Exception):
                self._client.cancel([flight.future for flight in flying.values()], force=True)

    def _free_workers(self) -> None:
        """Free the renderers of workers that live on."""
        from distributed import wait

        with suppress(Exception):
            freed = [
                self._client.submit(free, workers=[address], pure=False, priority=10)
                for address in self._roster.accepted
            ]
            wait(freed, timeout=_FREE_SECONDS)

    def __enter__(self) -> ClusterEngine:
        with ExitStack() as opened:
            self._threads = opened.enter_context(ThreadPoolExecutor(_FETCHERS, thread_name_prefix="fetcher"))
            self._client = opened.enter_context(connected(self._address, self._workers))
            self._roster = Roster(
                self._client, self._address, self._job, self._done, self._expected, self._patience
            )
            opened.callback(self._roster.cancel)
            self._roster.choose_driver()
            if self.driver.software:
                warnings.warn(software_warning(self.driver.name), SoftwareDriverWarning, stacklevel=2)
            self._opened = opened.pop_all()
        return self

    def __exit__(self, *error: object) -> None:
        with self._opened:
            self._cancel()
            if error[0] is None and self._address != LOCAL:
                self._free_workers()


def _fetched(flight: _Flight) -> _Result | BaseException:
    """Return the result of a frame that is done, or the error of its task, and let its worker forget it."""
    try:
        result: _Result = flight.future.result(timeout=flight.seconds)
    except (Exception, asyncio.CancelledError) as error:  # noqa: BLE001  whatever its worker cannot do
        return error
    flight.future.release()
    return result


class _Putting:
    """A callback that puts a future's key into a queue, and keeps no future."""

    def __init__(self, queue: SimpleQueue[str]) -> None:
        self._queue = queue

    def __call__(self, future: Any) -> None:
        self._queue.put(future.key)
