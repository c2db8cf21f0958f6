"""Write images, each whole or not at all, and the manifest that describes those of a capture."""

from __future__ import annotations

import hashlib
import io
import itertools
import json
import os
import tempfile
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import IO, Any, NotRequired, TypedDict

import numpy as np

from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.frame import OUTPUTS, Frame, Image

_MANIFEST = "manifest.json"
_MOST_THREADS = 4
"""More threads would save little time, and take the memory of more frames."""


class FrameEntry(TypedDict):
    """One frame of a manifest.

    Attributes
    ----------
    time : float
        Seconds.
    lights : dict of str to int
        Counts: in_scene, in_view, dropped.
    files, sha256 : dict of str to str
        By output: its path, relative to the manifest, and the `pixel_hash` of its image.
    id_names : list of str
        Only if they differ from the manifest's own.
    """

    index: int
    time: float
    lights: dict[str, int]
    files: dict[str, str]
    sha256: dict[str, str]
    id_names: NotRequired[list[str]]


class Manifest(TypedDict):
    """The description of a capture.

    Attributes
    ----------
    scene : str
        The scene's name as given.
    parameters, settings : dict
        All parameters of the scene and all of `Settings`, with the values that were used.
    exposure : float
        The setting of that name as a number: if it is "auto", the one that was measured for all frames.
    seed : int or None
        The scene's parameter "seed"; None if it has none.
    driver, driver_version : str
        The GL renderer and version strings; the version is that of Mesa or of the GPU's driver. Machines with
        the same two strings draw the same bytes.
    software : bool
        True if the driver is a software rasteriser.
    version : str
        The version of firefly_sample.
    warnings : list of str
        Every warning of a frame once, in order: for example the properties of a model that are not drawn.
    id_names : list of str
        Only with the output "id": the name of each value.
    """

    scene: str
    parameters: dict[str, Any]
    settings: dict[str, Any]
    exposure: float
    seed: int | None
    driver: str
    driver_version: str
    software: bool
    version: str
    warnings: list[str]
    frames: list[FrameEntry]
    id_names: NotRequired[list[str]]


def pixel_hash(image: Image) -> str:
    """Return the SHA-256 of an image's raw pixels (C order, little-endian) as hexadecimal digits.

    Files are not hashed, because different versions of zlib compress the same pixels to different bytes.
    """
    little = np.ascontiguousarray(image, dtype=image.dtype.newbyteorder("<"))
    return hashlib.sha256(little.data).hexdigest()


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write ``manifest.json``, whole or not at all."""
    with open_whole(folder / _MANIFEST) as file:
        file.write((json.dumps(manifest, indent=2, allow_nan=False) + "\n").encode())


def remove_manifest(folder: Path) -> None:
    """Remove the manifest of an earlier capture, which would describe files that are about to change."""
    path = folder / _MANIFEST
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise FireflyError(f"cannot replace {path}: {error.strerror or error}") from error


class FrameWriter:
    """A context manager that writes frames in threads; zlib and SHA-256 release the interpreter's lock.

    On exit it waits until nothing is being written: after an error every frame that was put is written first,
    after Ctrl-C only the files that were begun.
    """

    def __init__(self, folder: Path, threads: int | None = None) -> None:
        threads = threads or min(os.cpu_count() or 1, _MOST_THREADS)
        # the most frames in progress at once: one more than threads, so that no thread idles
        self.bound = threads + 1
        self._folder = folder
        self._in_progress: deque[tuple[FrameEntry, dict[str, Future[str]]]] = deque()
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="frame writer")

    def put(self, index: int, frame: Frame) -> list[FrameEntry]:
        """Wait until fewer than `bound` frames are in progress, then begin to write another one.

        Returns the earlier frames that are on disk by now, in the order in which they were put, or raises a
        FireflyError if a file of one cannot be written.
        """
        written = []
        while self._in_progress and (len(self._in_progress) >= self.bound or self._is_first_written()):
            written.append(self._wait_for_first())
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
        self._in_progress.append((entry, hashes))
        return written

    def finish(self) -> Iterator[FrameEntry]:
        """Yield the frames in progress as they are written, in order; raise as `put` does."""
        while self._in_progress:
            yield self._wait_for_first()

    def _is_first_written(self) -> bool:
        return all(future.done() for future in self._in_progress[0][1].values())

    def _wait_for_first(self) -> FrameEntry:
        entry, hashes = self._in_progress.popleft()
        entry["sha256"] = {output: future.result() for output, future in hashes.items()}
        return entry

    def __enter__(self) -> FrameWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        interrupted = kind is not None and not issubclass(kind, Exception)
        self._pool.shutdown(wait=True, cancel_futures=interrupted)


def _write(path: Path, output: str, image: Image) -> str:
    """Write one image and return its hash."""
    write_image(path, output, image)
    return pixel_hash(image)


def file_name(output: str, index: int) -> str:
    """Return the file of an output of a frame, for example ``color_000012.png`` or ``depth_000012.npz``."""
    return f"{output}_{index:06d}.{'png' if OUTPUTS[output].dtype == 'uint8' else 'npz'}"


def as_folder(folder: str | Path) -> Path:
    """Return the path of an output folder; raise an OutputError if it is "", which is the working folder."""
    if folder == "":
        raise OutputError("the output folder must have a name, got ''; the working folder is '.'")
    return Path(folder)


def write_image(path: Path, output: str, image: Image) -> None:
    """Write one image: display codes as PNG, others as compressed ``.npz`` with one array named `output`."""
    with open_whole(path) as file:
        if path.suffix == ".png":
            import PIL.Image

            PIL.Image.fromarray(image).save(file, format="PNG")
        else:
            arrays: dict[str, Any] = {output: image}
            np.savez_compressed(file, **arrays)


def save_screenshot(folder: Path, name: str, picture: Image) -> Path:
    """Write `picture`, shape (height, width, 3), to the first free ``<name>_0001.png`` in `folder`."""
    import PIL.Image

    png = io.BytesIO()
    PIL.Image.fromarray(picture).save(png, format="PNG")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FireflyError(f"cannot write into {folder}: {error.strerror or error}") from error
    for number in itertools.count(1):
        path = folder / f"{name}_{number:04d}.png"
        try:
            # exclusive, so that two windows that save at the same time get different names
            with path.open("xb") as file:
                file.write(png.getbuffer())
            break
        except FileExistsError:
            continue
        except OSError as error:
            with suppress(OSError):
                path.unlink()
            raise FireflyError(f"cannot write {path}: {error.strerror or error}") from error
    return path


@contextmanager
def open_whole(path: Path) -> Iterator[IO[bytes]]:
    """Open a file for writing that gets its name only when it is complete; raise a FireflyError if it fails.

    It has a temporary name in the same folder until then, because renaming within a folder is atomic.
    """
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with unfinished.open("wb") as file:
            yield file
        unfinished.replace(path)
    except BaseException as error:
        with suppress(OSError):
            unfinished.unlink()
        if isinstance(error, OSError):
            raise FireflyError(f"cannot write {path}: {error.strerror or error}") from error
        raise


@contextmanager
def output_folder(folder: Path) -> Iterator[None]:
    """Make a folder and check that it can be written, or raise a FireflyError.

    If the block fails, the folder is removed again, unless it already existed or holds files.
    """
    made = [path for path in (folder, *folder.parents) if not os.path.exists(path)]
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
        except OSError as error:
            reason = error.strerror or error
            raise FireflyError(f"cannot write into folder {folder} ({reason}): choose another one") from error
        yield
    except BaseException:
        with suppress(OSError):
            for path in made:
                path.rmdir()
        raise
