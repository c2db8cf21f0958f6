"""A thread that draws: a GLX context that is current in Panda3D's thread would be in the way of ours."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from queue import SimpleQueue
from threading import Thread
from typing import Any, TypeVar

_Result = TypeVar("_Result")
_Job = tuple[Future[Any], Callable[[], Any]]


class Worker:
    """Calls functions in a thread of its own, one after the other. It ends with the process."""

    def __init__(self, name: str) -> None:
        self._jobs: SimpleQueue[_Job | None] = SimpleQueue()
        self._thread = Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def call(self, function: Callable[[], _Result]) -> _Result:
        """Return what a function returns in the thread, or raise what it raises there.

        Raises
        ------
        RuntimeError
            After `stop`.
        """
        if not self._thread.is_alive():
            raise RuntimeError("this thread has ended")
        done: Future[_Result] = Future()
        self._jobs.put((done, function))
        return done.result()

    def stop(self) -> None:
        """End the thread, and wait for its end."""
        self._jobs.put(None)
        self._thread.join()

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            done, function = job
            try:
                done.set_result(function())
            except BaseException as error:  # noqa: BLE001  it is raised where the job came from
                done.set_exception(error)
            del job, done, function  # what they hold is free while the thread waits
