"""Textures of numbers that shaders look up: they are written anew each frame and made once."""

from __future__ import annotations

import math
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

LOOSE = 2.5
"""How many times as many texels as were ever needed at once a texture may have."""


class Tables:
    """Textures by name. They grow and never shrink, so that a steady frame makes none."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._kept: dict[str, moderngl.Texture] = {}

    def write(self, name: str, texels: NDArray[Any]) -> moderngl.Texture:
        """The texture of that name with these texels in its corner; what else is in it is not for reading.

        Parameters
        ----------
        texels : ndarray of float32 or uint32, shape (height, width) or (height, width, 4)
        """
        height, width = texels.shape[:2]
        components = texels.shape[2] if texels.ndim == 3 else 1
        dtype = f"{texels.dtype.kind}4"
        kept = self._kept.get(name)
        if (
            kept is None
            or (kept.components, kept.dtype) != (components, dtype)
            or kept.width < width
            or kept.height < height
        ):
            size = max(width, 1), max(height, 1)
            if kept is not None:
                self._kept.pop(name).release()
                size = self._roomy(size, kept.size)
            kept = self._ctx.texture(size, components, dtype=dtype)
            kept.filter = moderngl.NEAREST, moderngl.NEAREST
            self._kept[name] = kept
        if texels.size:
            kept.write(np.ascontiguousarray(texels), viewport=(0, 0, width, len(texels)))
        return kept

    def _roomy(self, needed: tuple[int, int], old: tuple[int, int]) -> tuple[int, int]:
        """Half as much again where the old size was outgrown, but no box around a wide and a high table."""
        most = self._ctx.info["GL_MAX_TEXTURE_SIZE"]
        width, height = (
            max(new, min(new + new // 2, most)) if new > before else before
            for new, before in zip(needed, old, strict=True)
        )
        return (width, height) if width * height <= LOOSE * max(math.prod(needed), math.prod(old)) else needed

    def release(self) -> None:
        """Free all textures."""
        for texture in self._kept.values():
            texture.release()
        self._kept.clear()
