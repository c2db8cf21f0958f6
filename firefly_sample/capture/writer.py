"""Write the files of frames in threads, and then their records."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

from firefly_sample.capture.drawn import Drawn
from firefly_sample.capture.files import sync_folder, thread_count
from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.work import Part
from firefly_sample.errors import FireflyError
from firefly_sample.whole_files import open_whole

WAITING = 8
"""Files of a frame that wait for the disk at a time: it takes eight of them in little more time than one."""


class FrameWriter:
    """A context manager that writes frames in threads, which wait for the disk at the same time.

    A frame is recorded when its files, and their names in the folder, are on the disk. On exit it waits until
    nothing is being written, and records the frames that are whole. After Ctrl-C, those that were not begun
    are dropped.
    """

    def __init__(self, folder: CaptureFolder) -> None:
        threads = thread_count()
        self._bound = threads + 1
        self._folder = folder
        self._made: set[Path] = set()
        self._writing: deque[tuple[Part, dict[str, Any], Future[None]]] = deque()
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="frame writer")

    def put(self, part: Part, drawn: Drawn) -> int:
        """Begin to write a frame, and return how many earlier ones were recorded meanwhile.

        Waits while too many are being written. Raises a FireflyError if a file cannot be written.
        """
        recorded = 0
        while self._writing and (len(self._writing) >= self._bound or self._writing[0][2].done()):
            recorded += self._record_first()
        self._folder.begin()
        paths = {key: part.job.names.path(key, drawn.index) for key in drawn.files}
        frame: dict[str, Any] = {
            "index": drawn.index,
            "time": drawn.time,
            "lights": drawn.lights,
            "camera": drawn.camera,
            "files": {output: paths[key] for output, key in drawn.keys.items()},
            "sha256": drawn.sha256,
            "file_sha256": drawn.file_sha256,
        }
        if part.job.views is not None:
            frame["view"] = part.job.view(drawn.index)
        if drawn.instances is not None:
            frame["instances"] = drawn.instances
            frame["categories"] = list(drawn.categories)
        if drawn.warnings:
            frame["warnings"] = list(drawn.warnings)
        if "id" in drawn.keys:
            frame["id_names"] = list(drawn.id_names)
        contents = {self._folder.path / paths[key]: drawn.files[key] for key in drawn.files}
        for path in contents:
            self._make(path.parent)
        self._writing.append((part, frame, self._pool.submit(_write, contents, self._folder)))
        return recorded

    def finish(self) -> int:
        """Wait until all frames are written, and return how many were recorded; raise as `put` does."""
        recorded = 0
        while self._writing:
            recorded += self._record_first()
        return recorded

    def _make(self, path: Path) -> None:
        """Make a folder below the capture's own, which is there."""
        if path != self._folder.path and path not in self._made:
            self._make(path.parent)
            try:
                path.mkdir(exist_ok=True)
                sync_folder(path.parent)
            except OSError as error:
                raise FireflyError(f"cannot make {path}: {error.strerror or error}") from error
            self._made.add(path)

    def _record_first(self) -> int:
        part, frame, written = self._writing[0]
        written.result()
        self._folder.add(part.description, frame)
        self._writing.popleft()
        return 1

    def __enter__(self) -> FrameWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        hurry = kind is not None and not issubclass(kind, Exception)
        self._pool.shutdown(wait=True, cancel_futures=hurry)
        for part, frame, written in self._writing:
            if not written.cancelled() and written.exception() is None:
                with suppress(FireflyError):  # the error that ended the capture is the one to tell
                    self._folder.add(part.description, frame)


def _write(contents: dict[Path, bytes], place: CaptureFolder) -> None:
    """Write the files of a frame, and wait until they and their names are on the disk."""
    if len(contents) == 1:
        _write_one(*next(iter(contents.items())), place)
    else:
        with ThreadPoolExecutor(min(WAITING, len(contents)), thread_name_prefix="file writer") as pool:
            writing = [pool.submit(_write_one, *each, place) for each in contents.items()]
        for each in writing:
            each.result()
    for folder in {path.parent for path in contents}:
        try:
            sync_folder(folder)
        except OSError as error:
            raise FireflyError(f"cannot write into {folder}: {error.strerror or error}") from error


def _write_one(path: Path, content: bytes, place: CaptureFolder) -> None:
    with open_whole(path, sync=True) as file:
        file.write(content)
    place.note_written()
