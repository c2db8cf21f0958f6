"""Image files that models hold or name, read by Pillow: sizes before anything is decoded, and pixels.

Colour profiles and orientations are ignored, as glTF 2.0 says in section 3.8.3.
"""

from __future__ import annotations

import io
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError
from firefly_sample.model.data import ImageData

if TYPE_CHECKING:
    from PIL.Image import Image

GLTF_FORMATS = ("PNG", "JPEG", "WEBP")
_lock = threading.RLock()


class UnreadableImageError(ModelError):
    """An image is of no known format, or its header is damaged."""


def open_image(
    data: bytes, name: str, what: str, max_megapixels: float, formats: tuple[str, ...] | None = None
) -> ImageData:
    """Return an image that is decoded later.

    Parameters
    ----------
    data : bytes
        A whole file. Its first bytes tell the format, because media types and suffixes are often wrong.
    name : str
    what : str
        The beginning of error messages, such as "model chair.glb: image 'wood'".
    max_megapixels : float
    formats : tuple of str, optional
        Pillow's names of the formats that are allowed; all that it reads when absent.

    Raises
    ------
    UnreadableImageError
        If it is of another format, or its header is damaged.
    ModelError
        If it has more pixels; `decode` raises it for damaged pixels.
    """
    try:
        with _opened(data, formats) as image:
            size = image.size
    except Exception as error:  # noqa: BLE001 - Pillow raises many kinds
        raise UnreadableImageError(f"{what} cannot be read: {_reason(data, error, formats)}") from None
    if size[0] * size[1] > max_megapixels * 1e6:
        raise ModelError(
            f"{what} has {size[0]}x{size[1]} pixels, more than max_texture_megapixels={max_megapixels:g} "
            "allows: make it smaller, or raise that limit"
        )
    return ImageData(name, size, partial(_decode, data, what, formats))


def made_image(pixels: NDArray[np.uint8], name: str) -> ImageData:
    """Return an image that is in no file."""
    height, width, _ = pixels.shape
    return ImageData(name, (width, height), partial(_same, pixels))


def _same(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return pixels


def _decode(data: bytes, what: str, formats: tuple[str, ...] | None) -> NDArray[np.uint8]:
    try:
        with _opened(data, formats) as image:
            return _rgba(image)
    except Exception as error:
        raise ModelError(f"{what} is damaged: {one_line(error)}") from error


@contextmanager
def own_pixel_limit() -> Iterator[None]:
    """Lift Pillow's limit of pixels and silence its warnings during a block."""
    from PIL import Image

    with _lock, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        before, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            yield
        finally:
            Image.MAX_IMAGE_PIXELS = before


@contextmanager
def _opened(data: bytes, formats: tuple[str, ...] | None) -> Iterator[Image]:
    from PIL import Image

    with own_pixel_limit(), Image.open(io.BytesIO(data), formats=formats) as image:
        yield image


def _rgba(image: Image) -> NDArray[np.uint8]:
    """Return the pixels, shape (height, width, 4).

    Of coloured PNGs of 16 bits, Pillow keeps the high bytes. Of grey ones it converts neither the samples nor
    the one colour that is transparent, and of those of 2 and 4 bits it converts only the samples.
    """
    key = image.info.get("transparency")
    if image.mode.startswith("I"):
        grey = np.asarray(image).astype(np.int64)
        pixels = np.empty((*grey.shape, 4), dtype=np.uint8)
        pixels[..., :3] = ((np.clip(grey, 0, 65535) + 128) // 257)[..., None]
        pixels[..., 3] = np.where(grey == key, 0, 255) if isinstance(key, int) else 255
        return pixels
    tiles = getattr(image, "tile", None)
    raw_mode = tiles[0][3] if tiles else None
    if raw_mode in ("L;2", "L;4") and isinstance(key, int):
        image.info["transparency"] = key * (85 if raw_mode == "L;2" else 17)
    return np.asarray(image.convert("RGBA"))


def _reason(data: bytes, error: Exception, formats: tuple[str, ...] | None) -> str:
    from PIL import UnidentifiedImageError

    if not isinstance(error, UnidentifiedImageError):
        return one_line(error)
    if data.startswith((b"\x89PNG", b"\xff\xd8\xff", b"RIFF")):
        return "its header is damaged"
    allowed = "a format that Pillow reads" if formats is None else f"one of {', '.join(formats)}"
    return f"its first bytes are {data[:8]!r}, and those of {allowed} are expected"


def one_line(error: BaseException) -> str:
    """Return the message of an error as one short line."""
    if isinstance(error, KeyError):
        return f"{error} is missing"
    return " ".join(str(error).split())[:200] or type(error).__name__
