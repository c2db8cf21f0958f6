"""Grey PNG with 16 bits, as data sets have it, for depth and ids.

======  ===============================  =====================
output  code                             where nothing is drawn
======  ===============================  =====================
depth   round(depth / depth_scale)       0
id      id + 1                           0
======  ===============================  =====================
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.encoding.format import Choices, Format
from firefly_sample.errors import OutputError
from firefly_sample.frame import Image

LARGEST = 65535
"""The largest code."""


class Png16(Format):
    """PNG with one channel of 16 bits."""

    name = "png16"
    suffixes = (".png",)

    def refusal(self, output: str) -> str:
        """Return why it cannot hold an output; "" if it can."""
        return "" if output in ("depth", "id") else "it is for depth and id"

    def is_exact(self, output: str, choices: Choices) -> bool:
        """Return whether an output's bits survive."""
        return output == "id"

    def choices_for(self, output: str) -> frozenset[str]:
        """Return the names of the `Choices` that an output's file depends on."""
        return frozenset({"depth_scale"} if output == "depth" else ())

    def encode(self, images: Mapping[str, Image], choices: Choices) -> bytes:
        """Return a file with one image."""
        import PIL.Image

        ((output, image),) = images.items()
        codes = _codes_of_depth(image, choices.depth_scale) if output == "depth" else _codes_of_ids(image)
        file = io.BytesIO()
        PIL.Image.fromarray(codes).save(file, format="PNG")
        return file.getvalue()

    def decode(self, content: bytes, outputs: tuple[str, ...], choices: Choices) -> dict[str, Image]:
        """Return the images of a file."""
        import PIL.Image

        (output,) = outputs
        with PIL.Image.open(io.BytesIO(content), formats=["PNG"]) as picture:
            codes = _codes(picture)
        if output == "id":
            return {output: codes.astype(np.int32) - 1}
        depth = (codes * np.float64(choices.depth_scale)).astype(np.float32)
        depth[codes == 0] = np.inf
        return {output: depth}


def _codes_of_depth(depth: Image, scale: float) -> NDArray[np.uint16]:
    drawn = ~np.isposinf(depth)
    numbers = depth[drawn].astype(np.float64)
    if numbers.size:
        lowest, highest = float(numbers.min()), float(numbers.max())
        if not _fits(lowest, highest, scale):
            raise OutputError(_misfit(lowest, highest, scale))
    codes = np.zeros(depth.shape, np.uint16)
    codes[drawn] = np.rint(numbers / scale)
    return codes


def _fits(lowest: float, highest: float, scale: float) -> bool:
    # NaN fits nowhere
    return bool(np.rint(lowest / scale) >= 1 and np.rint(highest / scale) <= LARGEST)


def _misfit(lowest: float, highest: float, scale: float) -> str:
    """Return the message about depths that do not fit, with a scale that does."""
    if np.rint(highest / scale) > LARGEST:
        problem = f"the largest depth is {highest:.6g}, and png16 ends at {LARGEST * scale:.6g}"
        better = _two_digits(highest / LARGEST, up=True)
    else:
        problem = f"the smallest depth is {lowest:.6g}, and png16 begins at {scale:.6g}"
        better = _two_digits(lowest, up=False)
    text = f"output 'depth': {problem} with depth_scale {scale:.6g}"
    if better and _fits(lowest, highest, better):
        return f"{text}: set depth_scale to {better:g}, or choose npz or exr"
    return f"{text}: no depth_scale holds {lowest:.6g} to {highest:.6g}, choose npz or exr"


def _two_digits(number: float, up: bool) -> float:
    """Return a positive number rounded up or down to two significant digits; 0 for others."""
    if not 0 < number < math.inf:
        return 0.0
    exponent = math.floor(math.log10(number)) - 1
    digits = number / 10.0**exponent
    return float(f"{math.ceil(digits) if up else math.floor(digits)}e{exponent}")


def _codes_of_ids(ids: Image) -> NDArray[np.uint16]:
    if ids.size and ids.max() >= LARGEST:
        raise OutputError(
            f"output 'id': the largest id is {ids.max()}, and png16 ends at {LARGEST - 1}: choose npz or exr"
        )
    if ids.size and ids.min() < -1:
        raise OutputError(f"output 'id': the smallest id is {ids.min()}, and png16 begins at -1")
    return (ids + 1).astype(np.uint16)


def _codes(picture: Any) -> NDArray[np.uint16]:
    """Return the codes of a PNG. Tools that make files smaller store two equal bytes as one."""
    if picture.mode in ("I;16", "I"):  # Pillow's modes of 16-bit grey
        return np.asarray(picture).astype(np.uint16)
    if picture.mode in ("1", "L"):
        return np.asarray(picture.convert("L")).astype(np.uint16) * np.uint16(257)
    raise ValueError(f"a picture of mode {picture.mode} has no 16-bit codes")
