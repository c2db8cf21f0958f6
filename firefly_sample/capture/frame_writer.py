"""Frames on their way to disk: encoded, hashed and written by threads while the next ones are drawn."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType

from firefly_sample.capture.manifest import FrameEntry, pixel_hash
from firefly_sample.capture.writers import file_name, write_image
from firefly_sample.frame import Frame, Image

_MOST_THREADS = 4
"""Beyond that, frames under way take more memory than threads save time."""


@dataclass(frozen=True, eq=False)
class _UnderWay:
    """A frame's entry, which lacks the hashes that come when its files are written."""

    entry: FrameEntry
    hashes: dict[str, Future[str]]


class FrameWriter:
    """Writes frames in threads; zlib and SHA-256 leave the interpreter to others meanwhile.

    A context manager. When it is left, nothing is being written any more: after an error every frame that was
    put is written first, after Ctrl-C only what has been begun.

    Parameters
    ----------
    folder : path
        Where to.
    threads : int, optional
        As many as there are processors, at most 4, when absent.

    Attributes
    ----------
    bound : int
        The most frames that are under way at once: one more than threads, so that none of these idles.
    """

    def __init__(self, folder: Path, threads: int | None = None) -> None:
        threads = threads if threads is not None else min(os.cpu_count() or 1, _MOST_THREADS)
        self.bound = threads + 1
        self._folder = folder
        self._under_way: deque[_UnderWay] = deque()
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="frame writer")

    def put(self, index: int, frame: Frame) -> list[FrameEntry]:
        """Begin to write a frame, and wait first until fewer than `bound` are under way.

        Returns
        -------
        list of FrameEntry
            Of earlier frames that are on disk by now, in the order in which they were put.

        Raises
        ------
        FireflyError
            If a file of an earlier frame cannot be written.
        """
        written = []
        while self._under_way and (len(self._under_way) >= self.bound or self._is_next_written()):
            written.append(self._next())
        entry: FrameEntry = {
            "index": index,
            "time": frame.time,
            "lights": asdict(frame.lights),
            "files": {output: file_name(output, index) for output in frame.images},
            "sha256": {},
        }
        if "id" in frame.images:
            entry["id_names"] = list(frame.id_names)
        hashes = {
            output: self._pool.submit(_write, self._folder / entry["files"][output], output, image)
            for output, image in frame.images.items()
        }
        self._under_way.append(_UnderWay(entry, hashes))
        return written

    def finish(self) -> Iterator[FrameEntry]:
        """Wait for the frames under way, in the order in which they were put.

        Raises
        ------
        FireflyError
            If a file cannot be written.
        """
        while self._under_way:
            yield self._next()

    def _is_next_written(self) -> bool:
        return all(done.done() for done in self._under_way[0].hashes.values())

    def _next(self) -> FrameEntry:
        oldest = self._under_way.popleft()
        oldest.entry["sha256"] = {output: done.result() for output, done in oldest.hashes.items()}
        return oldest.entry

    def __enter__(self) -> FrameWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        interrupted = kind is not None and not issubclass(kind, Exception)
        self._pool.shutdown(wait=True, cancel_futures=interrupted)


def _write(path: Path, output: str, image: Image) -> str:
    """Write one image; its hash."""
    write_image(path, output, image)
    return pixel_hash(image)
