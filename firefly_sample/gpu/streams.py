"""Buffers and textures whose content changes from frame to frame."""

from __future__ import annotations

import math
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

LOOSE = 2.5
"""The most texels that a texture may have, as a multiple of the most that were ever needed at once."""


class Streams:
    """Buffers and textures by name. They grow and do not shrink, so that most frames make none."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._buffers: dict[str, moderngl.Buffer] = {}
        self._textures: dict[str, moderngl.Texture] = {}

    def buffer(self, name: str, rows: NDArray[Any]) -> moderngl.Buffer:
        """Write rows, and return the buffer: a new one, twice as large as needed, if it had to grow."""
        data = np.ascontiguousarray(rows)
        buffer = self._buffers.get(name)
        if buffer is None or buffer.size < data.nbytes:
            if buffer is not None:
                self._buffers.pop(name).release()
            buffer = self._ctx.buffer(reserve=2 * max(data.nbytes, 64), dynamic=True)
            self._buffers[name] = buffer
        if data.nbytes:
            buffer.write(data)
        return buffer

    def texture(self, name: str, texels: NDArray[Any], exact: bool = False) -> moderngl.Texture:
        """Write texels into the texture's corner, and return it; its other texels are undefined.

        Parameters
        ----------
        texels : ndarray of float32 or uint32, shape (height, width) or (height, width, channels)
        exact : bool
            Make the texture as large as the texels, smaller too: for large ones that change rarely.
        """
        height, width = texels.shape[:2]
        components = texels.shape[2] if texels.ndim == 3 else 1
        dtype = f"{texels.dtype.kind}4"
        kept = self._textures.get(name)
        if (
            kept is None
            or (kept.components, kept.dtype) != (components, dtype)
            or kept.width < width
            or kept.height < height
            or (exact and kept.size != (width, height))
        ):
            size = max(width, 1), max(height, 1)
            if kept is not None:
                self._textures.pop(name).release()
                size = size if exact else self._roomy(size, kept.size)
            kept = self._ctx.texture(size, components, dtype=dtype)
            kept.filter = moderngl.NEAREST, moderngl.NEAREST
            self._textures[name] = kept
        if texels.size:
            kept.write(np.ascontiguousarray(texels), viewport=(0, 0, width, height))
        return kept

    def _roomy(self, needed: tuple[int, int], old: tuple[int, int]) -> tuple[int, int]:
        """Add half to a side that was outgrown, unless a wide and a high need would add up to a large box."""
        most = self._ctx.info["GL_MAX_TEXTURE_SIZE"]
        width, height = (
            max(new, min(new + new // 2, most)) if new > before else before
            for new, before in zip(needed, old, strict=True)
        )
        return (width, height) if width * height <= LOOSE * max(math.prod(needed), math.prod(old)) else needed

    def release(self) -> None:
        """Free all buffers and textures."""
        for kept in (self._buffers, self._textures):
            for made in kept.values():
                made.release()
            kept.clear()
