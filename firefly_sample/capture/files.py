"""Files of images: their names, contents and hashes, each written whole or not at all."""

from __future__ import annotations

import hashlib
import io
import itertools
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.frame import OUTPUTS, Image
from firefly_sample.whole_files import is_unfinished as is_unfinished
from firefly_sample.whole_files import open_whole as open_whole


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


_NAME = re.compile(r"([a-z_]+)_(\d{6})\.(png|npz)")


def named_frame(name: str) -> tuple[str, int] | None:
    """Return the output and the frame of a file that `file_name` names; None for another file."""
    match = _NAME.fullmatch(name)
    if match is None or match[1] not in OUTPUTS or file_name(match[1], int(match[2])) != name:
        return None
    return match[1], int(match[2])


def hash_file(path: Path) -> str | None:
    """Return the SHA-256 of a file's content; None if there is no such file, or it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


def file_name(output: str, index: int) -> str:
    """Return the file of an output of a frame, for example ``color_000012.png`` or ``depth_000012.npz``."""
    return f"{output}_{index:06d}.{'png' if OUTPUTS[output].dtype == 'uint8' else 'npz'}"


def as_folder(folder: str | Path) -> Path:
    """Return the path of an output folder; raise an OutputError if it is "", which is the working folder."""
    if folder == "":
        raise OutputError("the output folder must have a name, got ''; the working folder is '.'")
    return Path(folder)


def encode_image(output: str, image: Image) -> bytes:
    """Return an image as a file: display codes as PNG, others as compressed ``.npz`` with one array.

    The array is named `output`. The same pixels give the same bytes with the same versions of zlib, Pillow
    and NumPy.
    """
    file = io.BytesIO()
    if OUTPUTS[output].dtype == "uint8":
        import PIL.Image

        PIL.Image.fromarray(image).save(file, format="PNG")
    else:
        arrays: dict[str, Any] = {output: image}
        np.savez_compressed(file, **arrays)
    return file.getvalue()


def decode_image(output: str, content: bytes) -> Image:
    """Return the image in a file that `encode_image` made, or raise any exception if it is damaged."""
    if OUTPUTS[output].dtype == "uint8":
        import PIL.Image

        with PIL.Image.open(io.BytesIO(content)) as picture:
            return _pixels(picture, OUTPUTS[output].channels)
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        image: Image = arrays[output]
        return image


def _pixels(picture: Any, channels: int) -> Image:
    """Return the pixels of a PNG. Tools that make files smaller store the same pixels in other modes."""
    wanted = {3: "RGB", 4: "RGBA"}[channels]
    plain = picture.mode == wanted and "transparency" not in picture.info
    if plain or picture.mode not in ("1", "L", "LA", "P", "PA", "RGB", "RGBA"):
        return np.asarray(picture)
    rgba = np.asarray(picture.convert("RGBA"))
    return rgba[..., :channels] if (rgba[..., channels:] == 255).all() else rgba


def write_image(path: Path, output: str, image: Image) -> None:
    """Write one image as `encode_image` does."""
    with open_whole(path) as file:
        file.write(encode_image(output, image))


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
