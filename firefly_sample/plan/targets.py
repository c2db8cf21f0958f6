"""The one table of render targets: format, bytes a pixel, clear value.

A target is a bare noun; its format follows from the settings. Which of them exist in a frame is decided
in `firefly_sample.plan.steps`, and each carries the reason.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["FORMATS", "Target", "TargetFormat"]


@dataclass(frozen=True)
class TargetFormat:
    """A pixel format.

    Attributes
    ----------
    name : str
        As the plan shows it.
    bytes_per_pixel : int
    components : int
        Channels.
    dtype : str
        moderngl's dtype.
    gl_format : int or None
        The OpenGL internal format where the dtype alone does not say it.
    depth : bool
        True for a depth buffer.
    """

    name: str
    bytes_per_pixel: int
    components: int
    dtype: str
    gl_format: int | None = None
    depth: bool = False


FORMATS: dict[str, TargetFormat] = {
    entry.name: entry
    for entry in (
        TargetFormat("rgba8", 4, 4, "f1"),
        TargetFormat("rg16_snorm", 4, 2, "ni2", 0x8F99),
        TargetFormat("rg16", 4, 2, "nu2", 0x822C),
        TargetFormat("rgba16", 8, 4, "nu2", 0x805B),
        TargetFormat("r32f", 4, 1, "f4"),
        TargetFormat("r32ui", 4, 1, "u4"),
        TargetFormat("rg32ui", 8, 2, "u4"),
        TargetFormat("rgba32f", 16, 4, "f4"),
        TargetFormat("depth24", 4, 1, "f4", None, depth=True),
        TargetFormat("depth32f", 4, 1, "f4", 0x8CAC, depth=True),
    )
}
"""Formats by name. Depth counts four bytes also at 24 bits: drivers pad it."""


@dataclass(frozen=True)
class Target:
    """One image that passes write and read.

    Attributes
    ----------
    name : str
    format : str
        A key of `FORMATS`.
    because : str
        What in the scene, the settings or the outputs asked for it.
    clear : tuple of 4 floats
        What the first pass that writes it starts from; the first one is the depth of a depth buffer.
    per_sample : bool
        False for images of the output size when supersampling.
    size : (int, int), optional
        Texels across and down of an image that has a size of its own.
    compare : {"", "<=", ">="}
        How a depth buffer's texels are compared where shaders look them up instead of reading them.
    """

    name: str
    format: str
    because: str
    clear: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    per_sample: bool = True
    size: tuple[int, int] | None = None
    compare: str = ""

    @property
    def bytes_per_pixel(self) -> int:
        """Bytes of one pixel (of one sample when supersampling)."""
        return FORMATS[self.format].bytes_per_pixel
