"""A texture sampler in float64, as OpenGL 3.3 specifies it: trilinear, repeating, magnified linearly.

Its texels are the GPU's own, 16 bits per channel, from `firefly_sample.mipmaps`; only the filtering differs.
A driver takes the level of detail from differences between neighbours in a block of 2x2 pixels, and may use
weights of 8 bits: llvmpipe's error reaches 0.006 with 8-bit textures. Here the level follows from the exact
derivatives at the pixel, and the weights are float64. The difference is the driver's filtering error, which
reports keep apart from the errors of packing and shading.
"""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from firefly_sample.mipmaps import texture_levels
from firefly_sample.scene.material import Texture

Float64 = NDArray[np.float64]


def level_of_detail(right: Float64, down: Float64, size: tuple[int, int]) -> Float64:
    """Return the mipmap level that fits each pixel, shape (n,).

    It is the base 2 logarithm of the longer derivative, in texels (OpenGL 3.3 core specification, section
    3.8.11). Below 0 the texture is magnified.

    Parameters
    ----------
    right, down : ndarray of float64, shape (n, 2)
        Derivatives of the texture coordinates per pixel.
    size : (int, int)
        Of the texture, width and height.
    """
    scale = np.array(size, dtype=np.float64)
    square = np.maximum(((right * scale) ** 2).sum(axis=1), ((down * scale) ** 2).sum(axis=1))
    return np.asarray(0.5 * np.log2(np.maximum(square, 1e-300)))


class Sampler:
    """A texture of mipmap levels (height, width, 4), the lowest row first. `size` is (width, height)."""

    def __init__(self, levels: Sequence[NDArray[np.uint16]]) -> None:
        self.size = (levels[0].shape[1], levels[0].shape[0])
        self._heights, self._widths = np.array([level.shape[:2] for level in levels]).T
        self._starts = np.concatenate([[0], np.cumsum(self._heights * self._widths)[:-1]])
        self._texels = np.concatenate([level.reshape(-1, 4) for level in levels])

    def sample(self, texcoords: Float64, level: Float64) -> Float64:
        """Return linear colour and alpha (n, 4) at texture coordinates (n, 2) and mipmap levels (n,)."""
        last = len(self._starts) - 1
        level = np.clip(level, 0.0, last)
        fine = np.minimum(np.floor(level).astype(np.intp), max(last - 1, 0))
        color = self._bilinear(texcoords, fine)
        between = np.flatnonzero(level > fine)
        if len(between):
            share = (level - fine)[between, None]
            coarse = self._bilinear(texcoords[between], fine[between] + 1)
            color[between] += share * (coarse - color[between])
        return color

    def _bilinear(self, texcoords: Float64, level: NDArray[np.intp]) -> Float64:
        width, height, start = self._widths[level], self._heights[level], self._starts[level]
        x = (texcoords[:, 0] - np.floor(texcoords[:, 0])) * width - 0.5
        y = (texcoords[:, 1] - np.floor(texcoords[:, 1])) * height - 0.5
        left, low = np.floor(x), np.floor(y)
        columns = [(left.astype(np.intp) + step) % width for step in (0, 1)]
        rows = [start + (low.astype(np.intp) + step) % height * width for step in (0, 1)]
        across, up = (x - left)[:, None], (y - low)[:, None]
        below, above = (
            self._texels[row + columns[0]] * (1.0 - across) + self._texels[row + columns[1]] * across
            for row in rows
        )
        return np.asarray((below * (1.0 - up) + above * up) / 65535.0)


class Samplers:
    """A thread-safe cache of samplers.

    With `stored`, colours are sampled as they are stored, not decoded: the look "classic".
    """

    def __init__(self, stored: bool = False) -> None:
        self._stored = stored
        self._made: dict[tuple[int, float | None], tuple[Texture, Sampler]] = {}
        self._lock = Lock()

    def of(self, texture: Texture, cutoff: float | None) -> Sampler:
        """Return the sampler of a texture; `cutoff` is the alpha test's limit, None without a test."""
        key = (texture.serial, cutoff)
        with self._lock:
            if key not in self._made:
                self._made[key] = texture, Sampler(texture_levels(texture.pixels, cutoff, self._stored))
            return self._made[key][1]
