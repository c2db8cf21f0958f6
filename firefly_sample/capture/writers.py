"""Image files, written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

import numpy as np

from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.frame import OUTPUTS, Image


def file_name(output: str, index: int) -> str:
    """Return the file of an output of a frame, for example ``color_000012.png`` or ``depth_000012.npz``."""
    return f"{output}_{index:06d}.{'png' if OUTPUTS[output].dtype == 'uint8' else 'npz'}"


def as_folder(folder: str | Path) -> Path:
    """Return the path of an output folder.

    Raises
    ------
    OutputError
        If it is empty text, which would be the working folder.
    """
    if folder == "":
        raise OutputError("the output folder must have a name, got ''; the working folder is '.'")
    return Path(folder)


def write_image(path: Path, output: str, image: Image) -> None:
    """Write one image: display codes as PNG, others as compressed ``.npz`` with one array named `output`.

    Raises
    ------
    FireflyError
        If the file cannot be written.
    """
    with open_whole(path) as file:
        if path.suffix == ".png":
            import PIL.Image

            PIL.Image.fromarray(image).save(file, format="PNG")
        else:
            arrays: dict[str, Any] = {output: image}
            np.savez_compressed(file, **arrays)


@contextmanager
def open_whole(path: Path) -> Iterator[IO[bytes]]:
    """Open a file for writing that gets its name only when it is complete.

    It has a temporary name in the same folder until then, because renaming within a folder is atomic.

    Raises
    ------
    FireflyError
        If the file cannot be written, for example because the disk is full.
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
    """Make a folder and check that it can be written; if the block fails, remove it again.

    Folders that already existed, or that hold files, stay.

    Raises
    ------
    FireflyError
        If the folder cannot be made or written.
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
