"""Threads that encode, hash and write frames while the next ones are drawn."""

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
"""More threads would save little time, and take the memory of more frames."""


@dataclass(frozen=True, eq=False)
class _UnderWay:
    """A frame's entry, which still lacks its hashes, and the threads' results that are these hashes."""

    entry: FrameEntry
    hashes: dict[str, Future[str]]


class FrameWriter:
    """A context manager that writes frames in threads; zlib and SHA-256 release the interpreter's lock.

    On exit it waits until nothing is being written: after an error every frame that was put is written first,
    after Ctrl-C only the files that were begun.

    Parameters
    ----------
    folder : path
        The folder to write to.
    threads : int, optional
        The number of processors, at most 4, when absent.

    Attributes
    ----------
    bound : int
        The most frames in progress at once: one more than threads, so that no thread idles.
    """

    def __init__(self, folder: Path, threads: int | None = None) -> None:
        threads = threads if threads is not None else min(os.cpu_count() or 1, _MOST_THREADS)
        self.bound = threads + 1
        self._folder = folder
        self._under_way: deque[_UnderWay] = deque()
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="frame writer")

    def put(self, index: int, frame: Frame) -> list[FrameEntry]:
        """Wait until fewer than `bound` frames are in progress, then begin to write another one.

        Returns
        -------
        list of FrameEntry
            Earlier frames that are on disk by now, in the order in which they were put.

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
        """Yield the frames in progress as they are written, in the order in which they were put.

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
    """Write one image and return its hash."""
    write_image(path, output, image)
    return pixel_hash(image)
