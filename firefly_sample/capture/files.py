"""Folders, hashes and screenshots: what all parts of a capture need of the file system."""

from __future__ import annotations

import hashlib
import itertools
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.frame import Image
from firefly_sample.showing import png_bytes
from firefly_sample.whole_files import is_unfinished


def pixel_hash(image: Image) -> str:
    """Return the SHA-256 of an image's raw pixels (C order, little-endian) as hexadecimal digits.

    Files are not hashed, because different versions of zlib compress the same pixels to different bytes.
    """
    little = np.ascontiguousarray(image, dtype=image.dtype.newbyteorder("<"))
    return hashlib.sha256(little.data).hexdigest()


def thread_count() -> int:
    """Return the number of threads that encode, write or hash files: one for each core, at most four.

    More would save little time, and take the memory of more frames.
    """
    return min(os.cpu_count() or 1, 4)


def hash_file(path: Path) -> str | None:
    """Return the SHA-256 of a file's content; None if there is no such file, or it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


def as_folder(folder: str | Path) -> Path:
    """Return the path of an output folder; raise an OutputError if it is "", which is the working folder."""
    if folder == "":
        raise OutputError("the output folder must have a name, got ''; the working folder is '.'")
    return Path(folder)


def save_screenshot(folder: Path, name: str, picture: Image) -> Path:
    """Write `picture`, shape (height, width, 3), to the first free ``<name>_0001.png`` in `folder`."""
    content = png_bytes(np.asarray(picture, np.uint8))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FireflyError(f"cannot write into {folder}: {error.strerror or error}") from error
    for number in itertools.count(1):
        path = folder / f"{name}_{number:04d}.png"
        try:
            # exclusive, so that two windows that save at the same time get different names
            with path.open("xb") as file:
                file.write(content)
            break
        except FileExistsError:
            continue
        except OSError as error:
            with suppress(OSError):
                path.unlink()
            raise FireflyError(f"cannot write {path}: {error.strerror or error}") from error
    return path


def sync_folder(folder: Path) -> None:
    """Wait until the names of the files in a folder are on the disk."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def remove_unfinished(folder: Path) -> None:
    """Remove the files that `open_whole` had not finished when its process was killed."""
    try:
        paths = list(folder.iterdir())
    except PermissionError:  # for example lost+found, where nobody captures into
        return
    for path in paths:
        if is_unfinished(path.name):
            with suppress(OSError):
                path.unlink()


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
