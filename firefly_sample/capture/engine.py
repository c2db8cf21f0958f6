"""Where frames are drawn: what all engines have in common, and the engine that draws in this process."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple, Protocol

from firefly_sample.capture.drawing import Artist
from firefly_sample.capture.drawn import Drawn, Encoded, Failed, Sight, as_drawn, encode, encode_masks
from firefly_sample.capture.files import thread_count
from firefly_sample.capture.job import Driver, Job, Task
from firefly_sample.encoding.formats import Encoding
from firefly_sample.errors import FireflyError
from firefly_sample.frame import Image


class Engine(Protocol):
    """Draws frames, in this process or in others. A context manager."""

    @property
    def driver(self) -> Driver:
        """The driver of all frames; it is known inside the block."""

    def draw(self, tasks: Iterable[Task]) -> Iterator[tuple[Task, Drawn | Failed]]:
        """Draw frames, and give them in any order.

        Tasks are taken from the iterable only when there is room to draw them, so that it may have any
        number of them. Raises a FireflyError if no frame can be drawn any more.
        """

    def __enter__(self) -> Engine: ...

    def __exit__(self, *_: object) -> None: ...


class HereEngine:
    """Draws in this process; a few threads encode frames while the next ones are drawn.

    On exit it waits for the threads.
    """

    def __init__(self, job: Job) -> None:
        self._job = job
        self._artist: Artist | None = None
        self._caught: list[warnings.WarningMessage] = []
        self._threads = thread_count()
        self._pool = ThreadPoolExecutor(self._threads, thread_name_prefix="encoder")

    @property
    def driver(self) -> Driver:
        """The driver of all frames; it is known inside the block."""
        assert self._artist is not None
        return self._artist.driver

    def draw(self, tasks: Iterable[Task]) -> Iterator[tuple[Task, Drawn | Failed]]:
        """Draw frames in their order: see `Engine.draw`."""
        assert self._artist is not None
        waiting: deque[_Encoding] = deque()
        for task, sight in self._artist.draw(tasks):
            # one frame more than threads, so that no thread idles
            while waiting and (len(waiting) > self._threads or waiting[0].is_done()):
                yield waiting.popleft().result()
            futures: list[Future[dict[str, Encoded]]] = []
            if not isinstance(sight, Failed):
                self._warn()
                encoding, images = task.job.encoding, sight.frame.images
                futures = [self._pool.submit(_encode, encoding, key, images) for key in encoding.files()]
                if sight.annotations is not None:
                    futures.append(self._pool.submit(encode_masks, sight.annotations.masks))
                del images
            waiting.append(_Encoding(task, sight, futures))
            del sight
        while waiting:
            yield waiting.popleft().result()

    def _warn(self) -> None:
        """Warn of what was warned of while the renderer was made."""
        while self._caught:
            caught = self._caught.pop(0)
            warnings.warn(caught.message, caught.category, stacklevel=3)

    def __enter__(self) -> HereEngine:
        # where no frame can be drawn, its error is all that counts
        with warnings.catch_warnings(record=True) as self._caught:
            warnings.simplefilter("always")
            self._artist = Artist(self._job)
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)
        if self._artist is not None:
            self._artist.close()


def _encode(encoding: Encoding, key: str, images: Mapping[str, Image]) -> dict[str, Encoded]:
    return {key: encode(encoding, key, images)}


class _Encoding(NamedTuple):
    """A frame whose images are being encoded."""

    task: Task
    sight: Sight | Failed
    futures: list[Future[dict[str, Encoded]]]

    def is_done(self) -> bool:
        return all(future.done() for future in self.futures)

    def result(self) -> tuple[Task, Drawn | Failed]:
        """Wait until all files are encoded."""
        if isinstance(self.sight, Failed):
            return self.task, self.sight
        try:
            encoded = {key: one for future in self.futures for key, one in future.result().items()}
        except FireflyError as error:
            return self.task, Failed(self.task.index, error)
        return self.task, as_drawn(self.task, self.sight, encoded)
