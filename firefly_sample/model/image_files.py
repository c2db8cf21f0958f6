"""Images that models name or hold, looked at before they are decoded."""

from __future__ import annotations

import io
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError
from firefly_sample.model.data import ImageData
from firefly_sample.model.gltf.pixels import decode_image, image_kind, image_size

_lock = threading.RLock()


def open_image(data: bytes, name: str, where: str, max_megapixels: float) -> ImageData | None:
    """Return an image that is decoded later, or None if `data` is not an image that can be read.

    Parameters
    ----------
    data : bytes
        A whole file: PNG, JPEG, or another format that Pillow reads.
    name, where : str
        Of the image, and the beginning of error messages, such as "model chair.obj".
    max_megapixels : float

    Raises
    ------
    ModelError
        If the image has more pixels; also by `decode`, if it is damaged.
    """
    try:
        size = _size(data)
    except Exception:  # noqa: BLE001 - Pillow's readers raise many kinds
        return None
    megapixels = size[0] * size[1] / 1e6
    if megapixels > max_megapixels:
        raise ModelError(
            f"{where}: the texture {name!r} has {size[0]}x{size[1]} pixels, more than "
            f"max_texture_megapixels={max_megapixels:g} allows: make it smaller, or raise that limit"
        )
    return ImageData(name, size, partial(_decode, data, name, where))


@contextmanager
def own_pixel_limit() -> Iterator[None]:
    """Lift Pillow's limit of pixels and silence its warnings during a block."""
    from PIL import Image

    with _lock, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        before = Image.MAX_IMAGE_PIXELS
        Image.MAX_IMAGE_PIXELS = None
        try:
            yield
        finally:
            Image.MAX_IMAGE_PIXELS = before


def _size(data: bytes) -> tuple[int, int]:
    """Return the width and height that an image's header gives."""
    from PIL import Image

    if _is_common(data):
        return image_size(data)
    with own_pixel_limit(), Image.open(io.BytesIO(data)) as image:
        return image.size


def _decode(data: bytes, name: str, where: str) -> NDArray[np.uint8]:
    """Return the pixels as uint8 RGBA, by the decoder of glTF's images or else by Pillow."""
    from PIL import Image

    try:
        if _is_common(data):
            return decode_image(data)
        with own_pixel_limit(), Image.open(io.BytesIO(data)) as image:
            return np.asarray(image.convert("RGBA"))
    except Exception as error:
        raise ModelError(f"{where}: the texture {name!r} is damaged: {one_line(error)}") from error


def _is_common(data: bytes) -> bool:
    """Return whether an image is of a kind that glTF knows too."""
    try:
        image_kind(data)
    except ValueError:
        return False
    return True


def one_line(error: BaseException) -> str:
    """Return the message of an error as one short line."""
    return " ".join(str(error).split())[:200] or type(error).__name__
