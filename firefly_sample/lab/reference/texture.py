"""A texture sampler in float64, as OpenGL 3.3 specifies it: every wrap mode and filter of a `Texture`.

Its texels are the GPU's own, 16 bits per channel, from `firefly_sample.mipmaps`; only the filtering differs.
In the looks "pyrender" and "flat" a GPU has 8 bits, and its driver makes the mipmaps: but for rounding, they
are the same where each level has an even number of texels.
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
from firefly_sample.scene.texture import Sampling, Texture, Wrap
from firefly_sample.srgb import srgb_to_linear

Float64 = NDArray[np.float64]
Index = NDArray[np.intp]

_DEFAULT = Sampling("repeat", "repeat", "linear_mipmap_linear", "linear")


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
    """A texture of mipmap levels (height, width, 4), the lowest row first. `size` is (width, height).

    Its rules are those of the OpenGL 3.3 core specification, sections 3.8.11 and 3.8.12.
    """

    def __init__(self, levels: Sequence[NDArray[np.uint16]], sampling: Sampling = _DEFAULT) -> None:
        self.size = (levels[0].shape[1], levels[0].shape[0])
        self._sampling = sampling
        self._heights, self._widths = np.array([level.shape[:2] for level in levels]).T
        self._starts = np.concatenate([[0], np.cumsum(self._heights * self._widths)[:-1]])
        self._texels = np.concatenate([level.reshape(-1, 4) for level in levels])
        within, _, between = sampling.minfilter.partition("_mipmap_")
        self._min_linear, self._between = within == "linear", between
        self._mag_linear = sampling.magfilter == "linear"
        # what is magnified linearly and minified by nearest texels changes over half a level later
        self.largest_magnified = 0.5 if self._mag_linear and within == "nearest" and between else 0.0

    def sample(self, texcoords: Float64, level: Float64) -> Float64:
        """Return linear colour and alpha (n, 4) at texture coordinates (n, 2) and mipmap levels (n,)."""
        magnified = level <= self.largest_magnified
        large, small = np.flatnonzero(magnified), np.flatnonzero(~magnified)
        color = np.empty((len(level), 4))
        color[large] = self._texel(texcoords[large], np.zeros(len(large), dtype=np.intp), self._mag_linear)
        color[small] = self._minified(texcoords[small], level[small])
        return color

    def _minified(self, texcoords: Float64, level: Float64) -> Float64:
        last = len(self._starts) - 1
        if not self._between:
            level = np.zeros_like(level)
        elif self._between == "nearest":
            level = np.ceil(np.clip(level, 0.5, last + 0.5) + 0.5) - 1.0
        level = np.clip(level, 0.0, last)
        fine = np.minimum(np.floor(level).astype(np.intp), max(last - 1, 0))
        if self._between != "linear":
            return self._texel(texcoords, level.astype(np.intp), self._min_linear)
        color = self._texel(texcoords, fine, self._min_linear)
        between = np.flatnonzero(level > fine)
        if len(between):
            share = (level - fine)[between, None]
            coarse = self._texel(texcoords[between], fine[between] + 1, self._min_linear)
            color[between] += share * (coarse - color[between])
        return color

    def _texel(self, texcoords: Float64, level: Index, linear: bool) -> Float64:
        """Return the nearest texels of some levels, or a mix of the four around each place."""
        width, height, start = self._widths[level], self._heights[level], self._starts[level]
        x = _unwrapped(texcoords[:, 0], self._sampling.wrap_u) * width
        y = _unwrapped(texcoords[:, 1], self._sampling.wrap_v) * height
        if not linear:
            column, row = (np.floor(place).astype(np.intp) for place in (x, y))
            column = _wrapped(column, width, self._sampling.wrap_u)
            row = _wrapped(row, height, self._sampling.wrap_v)
            return np.asarray(self._texels[start + row * width + column] / 65535.0)
        x, y = x - 0.5, y - 0.5
        left, low = np.floor(x), np.floor(y)
        columns = [_wrapped(left.astype(np.intp) + step, width, self._sampling.wrap_u) for step in (0, 1)]
        rows = [
            start + _wrapped(low.astype(np.intp) + step, height, self._sampling.wrap_v) * width
            for step in (0, 1)
        ]
        across, up = (x - left)[:, None], (y - low)[:, None]
        below, above = (
            self._texels[row + columns[0]] * (1.0 - across) + self._texels[row + columns[1]] * across
            for row in rows
        )
        return np.asarray((below * (1.0 - up) + above * up) / 65535.0)


def _unwrapped(texcoord: Float64, wrap: Wrap) -> Float64:
    """Return texture coordinates moved near the image, so that texels have small numbers."""
    if wrap == "clamp":
        return np.clip(texcoord, -1.0, 2.0)
    period = 1.0 if wrap == "repeat" else 2.0
    return np.asarray(texcoord - period * np.floor(texcoord / period))


def _wrapped(texel: Index, size: Index, wrap: Wrap) -> Index:
    """Return the texels of an image that stand for texels beyond it, along one axis."""
    if wrap == "clamp":
        return np.clip(texel, 0, size - 1)
    if wrap == "repeat":
        return np.asarray(texel % size)
    texel = texel % (2 * size)
    return np.asarray(np.minimum(texel, 2 * size - 1 - texel))


class Samplers:
    """A thread-safe cache of samplers, which filter colours as a look does."""

    def __init__(self, look: str = "correct") -> None:
        self.look = look
        self._made: dict[tuple[int, float | None, bool], tuple[Texture, Sampler]] = {}
        self._lock = Lock()

    def of(self, texture: Texture, cutoff: float | None, stored: bool = False) -> Sampler:
        """Return the sampler of a texture; `cutoff` is the alpha test's limit, None without a test.

        With `stored`, the texture's numbers are not colours: they are sampled as they are stored.
        """
        stored = stored or self.look != "correct"
        key = (texture.serial, cutoff, stored)
        with self._lock:
            if key not in self._made:
                self._made[key] = (
                    texture,
                    Sampler(texture_levels(texture.pixels, cutoff, stored), texture.sampling),
                )
            return self._made[key][1]

    def decoded(self, colors: Float64) -> Float64:
        """Return filtered colours (n, 3) as the look uses them: "pyrender" decodes them after the filter."""
        return np.asarray(srgb_to_linear(colors)) if self.look == "pyrender" else colors
