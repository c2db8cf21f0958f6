"""An engine that draws in processes of this machine, any of which may die.

Workers are started as programs of their own, and not by `multiprocessing`, whose children run the parent's
script again to have its names: they need nothing of it. So scripts need no guard
``if __name__ == "__main__"``, and notebooks and ``python -c`` work as well.
"""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import warnings
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import suppress
from multiprocessing.connection import Connection, Pipe, wait
from pathlib import Path
from typing import Any, Literal

from firefly_sample.capture.drawn import Drawn, Failed
from firefly_sample.capture.job import Driver, Job, Task
from firefly_sample.capture.machine import usable_cores, usable_memory
from firefly_sample.capture.worker import Ended, Started
from firefly_sample.errors import FireflyError, GpuError, OutputError, SceneError, SoftwareDriverWarning
from firefly_sample.gpu.driver_checks import software_warning
from firefly_sample.settings import to_whole

MOST_DEATHS = 3
"""A frame that has ended this many workers fails. A worker that died so often at its start is given up."""
IN_FLIGHT = 2
"""Tasks of a worker at a time: one is drawn, one waits, so that the worker never does."""
MOST_LOST = 3
"""A capture ends when this many frames have failed so, and none was drawn."""
WORKER_MEMORY = 2**30
"""The bytes that a worker is assumed to take: three times what one takes for the forest at 800x600."""
MOST_ON_A_GPU = 4
"""More processes would wait for each other on one GPU, and take its memory."""
_THREADS = "LP_NUM_THREADS"
"""The variable with the number of threads of Mesa's software driver, for each process."""

_log = logging.getLogger("firefly_sample")
_Result = tuple[Task, Drawn | Failed]


def choose_workers(asked: int | Literal["auto"], frames: int, root: Path = Path("/")) -> int:
    """Return the number of workers for some frames: `asked`, or for "auto" one for each core.

    It is never above the number of frames, and for "auto" at most what the memory allows. `root` is the
    folder that holds ``proc`` and ``sys``.

    Raises
    ------
    OutputError
        If `asked` is neither "auto" nor a whole number from 1.
    """
    if asked == "auto":
        room = min(usable_cores(root), usable_memory(root) // WORKER_MEMORY)
        number = room
    else:
        whole = to_whole(asked)
        if whole is None or whole < 1:
            raise OutputError(f"workers must be 'auto' or a whole number from 1, got {asked!r}")
        number = whole
    return max(min(number, frames), 1)


class ProcessEngine:
    """Draws in worker processes: see `Engine`. On exit it ends them without waiting for their frames.

    A worker that dies is replaced, and the frame that it was drawing is drawn again. A frame that ends
    `MOST_DEATHS` workers is `Failed`. All workers must have the same driver.

    Parameters
    ----------
    job : Job
        One of those that are going to be drawn: see `Artist`.
    workers : int
    auto : bool
        The user has not chosen this number: at most `MOST_ON_A_GPU` draw on a GPU.

    Raises
    ------
    FireflyError
        In ``with``: if no worker can start. In `draw`: if none is left, or if every frame ends its worker.
    GpuError
        If two workers have different drivers.
    """

    def __init__(self, job: Job, workers: int, auto: bool = False) -> None:
        if job.scene.partition(":")[0] == "__main__":
            raise SceneError(
                f"scene {job.scene!r} is in the program that runs, which workers do not: put it into a "
                "module of its own, or draw in one process (workers=1)"
            )
        self._job = job
        self._threads = max(usable_cores() // workers, 1)
        self._driver: Driver | None = None
        self._first = 0
        first = min(workers, MOST_ON_A_GPU) if auto else workers
        # the others start when the first have said that they draw without a GPU
        self._workers = [_Worker(number) for number in range(1, first + 1)]
        self._later = [_Worker(number) for number in range(first + 1, workers + 1)]
        self._again: deque[_Tried] = deque()
        self._said: set[str] = set()
        self._drawn = 0
        self._lost = 0

    @property
    def driver(self) -> Driver:
        """The driver of all frames; it is known inside the block."""
        assert self._driver is not None
        return self._driver

    def environment(self, number: int) -> dict[str, str]:
        """Return the environment variables that worker `number`, from 1, has beside those of this process.

        The cores are shared out among the software drivers' threads, unless the user has chosen their number.
        """
        return {} if _THREADS in os.environ else {_THREADS: str(self._threads)}

    def draw(self, tasks: Iterable[Task]) -> Iterator[_Result]:
        """Draw frames, in any order: see `Engine.draw`."""
        todo = (_Tried(task) for task in tasks)
        results: list[_Result] = []
        try:
            while True:
                self._hand_out(todo)  # before the caller gets its results, so that no worker waits for it
                yield from results
                if not self._again and not any(worker.tasks for worker in self._workers):
                    if (tried := next(todo, None)) is None:
                        return
                    self._again.append(tried)
                results = self._receive()
        finally:
            self._again.clear()
            for worker in self._workers:
                if worker.tasks:  # nobody wants them any more
                    worker.end()
                    worker.tasks.clear()

    def _hand_out(self, todo: Iterator[_Tried]) -> None:
        """Give tasks to workers that have room, those that are to be drawn again first."""
        while free := [worker for worker in self._workers if worker.has_room]:
            tried = self._again.popleft() if self._again else next(todo, None)
            if tried is None:
                return
            min(free, key=lambda one: len(one.tasks)).give(tried)

    def _receive(self) -> list[_Result]:
        """Wait until any worker says something, and return the results."""
        for worker in list(self._workers):
            if worker.connection is None:
                try:
                    worker.start(self._job, self.environment(worker.number))
                except OSError as error:  # too many processes, or too little memory
                    worker.end()
                    text = f"worker {worker.number} cannot be started: {error}"
                    self._give_up(worker, FireflyError(text))
        ready = wait([worker.connection for worker in self._workers if worker.connection is not None])
        return [
            result
            for worker in [one for one in self._workers if one.connection in ready]
            for result in self._answer(worker, worker.receive())
        ]

    def _answer(self, worker: _Worker, message: object) -> list[_Result]:
        """Act on what a worker said; return a result, or those frames that it ended with."""
        if isinstance(message, Drawn | Failed):
            self._drawn += 1
            return [(worker.tasks.popleft().task, message)]
        if isinstance(message, Started):
            self._check_driver(worker, message.driver)
            worker.started, worker.failed_starts = True, 0
            self._warn(message.said)
            return []
        how = worker.end()
        if isinstance(message, FireflyError):
            self._give_up(worker, message)
            return []
        return self._bury(worker, message.reason if isinstance(message, Ended) else how)

    def _check_driver(self, worker: _Worker, driver: Driver) -> None:
        if self._driver is None:
            self._driver, self._first = driver, worker.number
            if driver.software:
                warnings.warn(software_warning(driver.name), SoftwareDriverWarning, stacklevel=2)
        elif driver != self._driver:
            raise GpuError(
                f"worker {worker.number} draws with another driver: {driver.name} ({driver.version}), and "
                f"worker {self._first} with {self._driver.name} ({self._driver.version}), whose frames would "
                "differ: give both the same environment, or draw in one process (workers=1)"
            )

    def _warn(self, texts: Iterable[str]) -> None:
        """Warn of what workers were warned of at their start, once for all of them."""
        for text in texts:
            if text not in self._said:
                self._said.add(text)
                warnings.warn(text, stacklevel=2)

    def _bury(self, worker: _Worker, how: str) -> list[_Result]:
        """Note that a worker died, and see to its tasks; a new one is started in its place."""
        tasks, worker.tasks = worker.tasks, deque()
        if not worker.started:
            worker.failed_starts += 1
            if worker.failed_starts >= MOST_DEATHS:
                start = f"worker {worker.number} ended {MOST_DEATHS} times before it could draw: {how}"
                self._give_up(worker, FireflyError(start))
            return []
        if not tasks:
            _log.info("worker %d ended (%s) and is replaced", worker.number, how)
            return []
        drawing = tasks[0]  # it draws them in their order
        drawing.deaths += 1
        index = drawing.task.index
        _log.info("worker %d ended (%s) in frame %d and is replaced", worker.number, how, index)
        if drawing.deaths < MOST_DEATHS:
            self._again.extend(tasks)
            return []
        tasks.popleft()
        self._again.extend(tasks)
        self._lost += 1
        error = FireflyError(f"frame {index} ended its worker process {MOST_DEATHS} times: {how}")
        if not self._drawn and self._lost >= MOST_LOST:
            raise FireflyError(f"no worker has drawn a frame: {error}")
        return [(drawing.task, Failed(index, error))]

    def _give_up(self, worker: _Worker, error: FireflyError) -> None:
        """Go on without a worker that cannot start; raise its error if no other is left."""
        self._workers.remove(worker)
        if not self._workers:
            raise error
        warnings.warn(f"worker {worker.number} is left out: {error}", stacklevel=2)

    def __enter__(self) -> ProcessEngine:
        try:
            while self._driver is None:
                self._receive()
            if self._driver.software:
                self._workers += self._later
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def _end(self) -> None:
        for worker in self._workers:
            worker.kill()
        for worker in self._workers:
            worker.end()


class _Tried:
    """A task, and how many workers have died while they drew it."""

    def __init__(self, task: Task) -> None:
        self.task = task
        self.deaths = 0


class _Worker:
    """One worker and its process, which may be replaced.

    Attributes
    ----------
    number : int
        From 1.
    connection : Connection or None
        To its process, if there is one. It is closed by the system when the process at either end dies.
    started : bool
        True if it can draw.
    failed_starts : int
        How often in a row its process died before that.
    tasks : deque of _Tried
        Those that it has, in the order in which it draws them.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        self.connection: Connection[Any, Any] | None = None
        self.started = False
        self.failed_starts = 0
        self.tasks: deque[_Tried] = deque()
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def has_room(self) -> bool:
        """True if it can be given one more task."""
        return self.connection is not None and self.started and len(self.tasks) < IN_FLIGHT

    def start(self, job: Job, environment: dict[str, str]) -> None:
        """Start a process, which makes its renderer for a job."""
        self.started = False
        self.connection, theirs = Pipe()
        with theirs:
            self._process = subprocess.Popen(
                _command(theirs.fileno()),
                env={**os.environ, **environment},
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=_stderr(),  # not this process's stdout, which may carry data
                process_group=0,  # Ctrl-C in a terminal is for this process alone
            )
        self._send(job)

    def give(self, tried: _Tried) -> None:
        """Give it one more task."""
        self.tasks.append(tried)
        self._send(tried.task)

    def _send(self, message: Job | Task) -> None:
        assert self.connection is not None
        with suppress(OSError):  # its process is dead, which `receive` will find
            self.connection.send(message)

    def receive(self) -> object:
        """Return the next message, or None if its process is dead."""
        assert self.connection is not None
        try:
            return self.connection.recv()
        except (EOFError, OSError):
            return None

    def kill(self) -> None:
        """End its process without waiting for that."""
        if self._process is not None:
            self._process.kill()

    def end(self) -> str:
        """End its process, if it has not ended by itself; return how it ended, for people."""
        if self.connection is not None:
            self.connection.close()
            self.connection = None
        if self._process is None:
            return ""
        self._process.kill()
        code = self._process.wait()
        if code >= 0:
            return f"exit code {code}"
        with suppress(ValueError):
            return f"killed by signal {-code} ({signal.Signals(-code).name})"
        return f"killed by signal {-code}"


def _command(descriptor: int) -> list[str]:
    """Return the command of a worker, which finds the same modules as this process."""
    path = ascii([str(folder) for folder in sys.path])
    start = f"from firefly_sample.capture.worker import main; main({descriptor})"
    flags: list[str] = subprocess._args_from_interpreter_flags()  # type: ignore[attr-defined]
    return [sys.executable, *flags, "-c", f"import sys; sys.path[:] = {path}; {start}"]


def _stderr() -> int:
    """Return the descriptor of stderr, or that of nothing if it is closed."""
    try:
        os.fstat(2)
    except OSError:
        return subprocess.DEVNULL
    return 2
