"""Write the files of frames in threads, and then their records."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

from firefly_sample.capture.drawing import Drawn
from firefly_sample.capture.files import open_whole, sync_folder, thread_count
from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.work import Part, file_path
from firefly_sample.errors import FireflyError


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
        paths = {output: file_path(part.job.folder, output, drawn.index) for output in drawn.files}
        frame: dict[str, Any] = {
            "index": drawn.index,
            "time": drawn.time,
            "lights": drawn.lights,
            "files": paths,
            "sha256": drawn.sha256,
            "file_sha256": drawn.file_sha256,
        }
        if drawn.warnings:
            frame["warnings"] = list(drawn.warnings)
        if "id" in drawn.files:
            frame["id_names"] = list(drawn.id_names)
        self._make(part.job.folder)
        contents = {self._folder.path / paths[output]: drawn.files[output] for output in drawn.files}
        self._writing.append((part, frame, self._pool.submit(_write, contents, self._folder)))
        return recorded

    def finish(self) -> int:
        """Wait until all frames are written, and return how many were recorded; raise as `put` does."""
        recorded = 0
        while self._writing:
            recorded += self._record_first()
        return recorded

    def _make(self, folder: str) -> None:
        path = self._folder.path / folder
        if folder and not path.is_dir():
            try:
                path.mkdir()
                sync_folder(self._folder.path)
            except OSError as error:
                raise FireflyError(f"cannot make {path}: {error.strerror or error}") from error

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
    for path, content in contents.items():
        with open_whole(path, sync=True) as file:
            file.write(content)
        place.note_written()
    for folder in {path.parent for path in contents}:
        try:
            sync_folder(folder)
        except OSError as error:
            raise FireflyError(f"cannot write into {folder}: {error.strerror or error}") from error
