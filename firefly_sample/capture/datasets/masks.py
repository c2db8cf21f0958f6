"""Masks of instances: boxes around their pixels, and their encodings as PNG and as COCO's run lengths."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.capture.layout import MASKS
from firefly_sample.errors import MissingPackageError
from firefly_sample.extras import install_command
from firefly_sample.frame import OUTPUTS, OutputInfo
from firefly_sample.showing import png_bytes

Mask = NDArray[np.bool_]
"""Pixels of a picture, shape (height, width)."""
Gray = NDArray[np.uint8]
"""A mask as a picture, shape (height, width), of 0 and 255."""
Box = tuple[int, int, int, int]
"""Left column, top row, width and height in pixels; a width of 1 is one column. (0, 0, 0, 0) is empty."""

_INFO = OutputInfo("uint8", 1, "screen", "255 or 0", "0", "where an instance is")
EXTRA = "datasets"
"""The extra that installs pycocotools."""


def box_of(mask: Mask) -> Box:
    """Return the smallest box around a mask's pixels, as pycocotools' ``toBbox`` does."""
    columns, rows = (np.flatnonzero(mask.any(axis=axis)) for axis in (0, 1))
    if not len(rows):
        return (0, 0, 0, 0)
    left, top = int(columns[0]), int(rows[0])
    return left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1


def join_boxes(one: Box, other: Box) -> Box:
    """Return the smallest box around two."""
    if not one[2]:
        return other
    if not other[2]:
        return one
    left, top = min(one[0], other[0]), min(one[1], other[1])
    right, bottom = max(one[0] + one[2], other[0] + other[2]), max(one[1] + one[3], other[1] + other[3])
    return left, top, right - left, bottom - top


def mask_png(mask: Mask | Gray) -> bytes:
    """Return a mask as a grey PNG of 8 bits, 255 where it is not 0, as BOP has them."""
    return png_bytes(as_gray(mask))


def read_mask(content: bytes) -> Gray:
    """Return the picture in a file that `mask_png` made, or raise any exception if it is damaged."""
    import PIL.Image

    with PIL.Image.open(io.BytesIO(content)) as picture:
        return np.asarray(picture)


def as_gray(mask: Mask | Gray) -> Gray:
    """Return a mask as a picture: 255 where it is not 0, 0 elsewhere."""
    return np.where(mask, np.uint8(255), np.uint8(0))


def encode_rle(mask: Mask) -> dict[str, Any]:
    """Return a mask as COCO's compressed run lengths: "size", [height, width], and "counts", as text.

    It raises a `MissingPackageError` without pycocotools.
    """
    require_rle()
    from pycocotools.mask import encode

    encoded = encode(np.asfortranarray(mask, dtype=np.uint8))
    return {"size": [int(side) for side in encoded["size"]], "counts": encoded["counts"].decode("ascii")}


def require_rle() -> None:
    """Raise a MissingPackageError if `encode_rle` lacks its package."""
    try:
        import pycocotools.mask  # noqa: F401
    except ImportError as error:
        raise MissingPackageError(
            f"COCO's run lengths need the package pycocotools ({error}): run {install_command(EXTRA)}"
        ) from error


def image_info(name: str) -> OutputInfo | None:
    """Return the meaning of an output's values, or of a mask's ("mask/3"); None for another name."""
    if name in OUTPUTS:
        return OUTPUTS[name]
    kind, slash, _ = name.partition("/")
    return _INFO if slash and kind in MASKS else None


def known_info(name: str) -> OutputInfo:
    """Return what `image_info` does; KeyError for a name that it does not know."""
    info = image_info(name)
    if info is None:
        raise KeyError(name)
    return info
