"""Render targets and their pixel formats, by the settings that choose them.

`firefly_sample.plan.frame_graph` chooses the targets of a frame.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class TargetFormat:
    """A pixel format."""

    name: str  # as the plan shows it
    bytes_per_pixel: int
    components: int  # channels
    dtype: str  # moderngl's
    gl_format: int | None = None  # OpenGL's internal format where the dtype alone does not say it
    depth: bool = False
    srgb: bool = False  # True if the driver encodes what is written and decodes what is read


FORMATS: dict[str, TargetFormat] = {
    entry.name: entry
    for entry in (
        TargetFormat("rgba8", 4, 4, "f1"),
        TargetFormat("r8", 1, 1, "f1"),
        TargetFormat("rg8", 2, 2, "f1"),
        TargetFormat("srgb8_alpha8", 4, 4, "f1", 0x8C43, srgb=True),
        TargetFormat("rgb10_a2", 4, 4, "nu2", 0x8059),
        TargetFormat("r11f_g11f_b10f", 4, 3, "f4", 0x8C3A),
        TargetFormat("rgba16f", 8, 4, "f2"),
        TargetFormat("rg16_snorm", 4, 2, "ni2", 0x8F99),
        TargetFormat("rg16", 4, 2, "nu2", 0x822C),
        TargetFormat("rgba16", 8, 4, "nu2", 0x805B),
        TargetFormat("r16f", 2, 1, "f2"),
        TargetFormat("r32f", 4, 1, "f4"),
        TargetFormat("r32ui", 4, 1, "u4"),
        TargetFormat("rg32ui", 8, 2, "u4"),
        TargetFormat("rg32f", 8, 2, "f4"),
        TargetFormat("rgba32f", 16, 4, "f4"),
        TargetFormat("depth16", 2, 1, "f4", 0x81A5, depth=True),
        TargetFormat("depth24", 4, 1, "f4", None, depth=True),
        TargetFormat("depth32f", 4, 1, "f4", 0x8CAC, depth=True),
    )
}
"""Formats by name. Depth counts four bytes also at 24 bits: drivers pad it."""

NORMAL_FORMATS: dict[str, tuple[str, str]] = {
    "oct16": ("rg16_snorm", "oct16"),
    "rgb10a2": ("rgb10_a2", "unorm"),
    "rgba8": ("rgba8", "unorm"),
    "oct8": ("rg8", "oct8"),
    "rgba16f": ("rgba16f", "float"),
    "rgba32f": ("rgba32f", "float"),
}
"""Texture format and encoding of each setting `normal_format`."""
UNSIGNED = ("rg16", "oct16_unorm")
"""The same of "oct16" where a driver cannot draw into signed targets."""
ALBEDO_FORMATS: dict[str, tuple[str, str]] = {
    "sqrt10": ("r32ui", "sqrt10"),
    "sqrt8": ("rgba8", "sqrt8"),
    "srgb8": ("srgb8_alpha8", "linear"),
    "rgba8": ("rgba8", "linear"),
    "rgba16f": ("rgba16f", "linear"),
    "rgba32f": ("rgba32f", "linear"),
}
"""Texture format and encoding of each setting `albedo_format`."""
ACCUMULATION_FORMATS = {
    "rgba32f": "rgba32f",
    "rgba16f": "rgba16f",
    "r11g11b10f": "r11f_g11f_b10f",
    "rgba8": "rgba8",
}
"""Format of each setting `accumulation_format`."""
STORED_POSITIONS = {"stored16f": "rgba16f", "stored32f": "rgba32f"}
"""Format of each `position_method` that stores whole positions."""
PARTICLE_SHADOW_FORMATS = {
    "float32": ("r32f", "rgba32f"),
    "float16": ("r16f", "rgba16f"),
    "unorm8": ("r8", "rgba8"),
}
"""Format of each setting `particle_shadow_format`: of one number a texel, and of one for each colour."""
PARTICLE_ROW = 1024
"""Particles in a row of texels."""
COARSE_DEPTH = {"depth24": "depth24", "depth16": "depth16", "inverse_matrix": "depth24"}
"""Format of each `position_method` that needs a standard depth buffer; others take the best one."""
_NUMBERS: dict[str, tuple[Any, float]] = {
    "f4": (np.float32, 1.0),
    "f2": (np.float16, 1.0),
    "f1": (np.uint8, 255.0),
    "nu2": (np.uint16, 65535.0),
    "ni2": (np.int16, 32767.0),
}
"""By moderngl's dtype, NumPy's and the number that stands for 1."""


def mask_target(names: Container[str], perspective: bool) -> str:
    """Return the target that is 0 where nothing was drawn, of a frame that keeps one.

    A distance is never 0 in perspective. A depth marks nothing, because far geometry may round to the value
    that stands for the background, nor does a normal.
    """
    return "distance" if "distance" in names and (perspective or "albedo" not in names) else "albedo"


def stored_dtype(form: TargetFormat) -> Any:
    """Return NumPy's dtype of the numbers read from a format that holds fractions or floats."""
    return _NUMBERS[form.dtype][0]


def stored_fractions(form: TargetFormat, values: NDArray[Any]) -> NDArray[np.float64]:
    """Return the values of numbers read from a format, any shape, as fractions of 1; sRGB is not decoded."""
    fractions = values.astype(np.float64) / _NUMBERS[form.dtype][1]
    if form.name == "rgb10_a2":  # read with more bits than it has
        return np.asarray(np.round(fractions * 1023.0) / 1023.0)
    return np.maximum(fractions, -1.0) if form.dtype == "ni2" else fractions


def particle_texels(count: int) -> tuple[int, int]:
    """Return width and height of a texture with a texel for each particle, row by row.

    They are powers of two, so that the texture stays while particles come into view and leave it.
    """
    width = min(1 << max(count - 1, 0).bit_length(), PARTICLE_ROW)
    rows = -(-count // width)
    return width, 1 << max(rows - 1, 0).bit_length()


@dataclass(frozen=True)
class Target:
    """One image that passes write and read."""

    name: str
    format: str  # a key of `FORMATS`
    because: str  # the part of the scene, the settings or the outputs that asked for it
    clear: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # at first; of a depth buffer, its depth
    per_sample: bool = True  # False for images of the output size when supersampling
    size: tuple[int, int] | None = None  # texels across and down of an image that has a size of its own
    compare: str = ""  # "<=" or ">=" if shaders look a depth buffer's texels up by comparing
    encoding: str = ""  # of normals or colours: see `firefly_sample.plan.variants`
    half: bool = False  # True for half the samples across and half down, rounded up

    @property
    def bytes_per_pixel(self) -> int:
        """Bytes of one pixel of its own (of one sample when supersampling)."""
        return FORMATS[self.format].bytes_per_pixel
