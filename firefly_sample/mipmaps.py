"""Mipmaps made on the CPU, which keep the coverage of cut-out leaves at every size.

Averaging alpha thins leaves out: ever fewer texels reach the cut-off. Each mipmap level's alpha is scaled so
that the same fraction of its texels passes as in the full image (Castaño, "Computing Alpha Mipmaps", 2010).
Colour is averaged with alpha as weight, so that the colour of transparent texels does not bleed in.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from firefly_sample.disk_cache import derived_folder, fingerprint, load_derived, save_derived
from firefly_sample.srgb import srgb_to_linear

Float32 = NDArray[np.float32]

VERSION = 1
"""Version of the mipmaps; counts up whenever a bit of them changes, so that cached ones are not used."""

_HALF = np.float32(0.5)
_ALPHAS = np.arange(256, dtype=np.float32) / np.float32(255.0)
"""The alpha of each 8-bit code."""
_STRIP = 2**16
"""Texels that are decoded at once, so that they stay in the processor's cache."""


class Picture(Protocol):
    """An image with mipmaps, such as a scene's Texture."""

    size: tuple[int, int]
    digest: str | None

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """The pixels, as for `texture_levels`."""


def texture_levels(
    pixels: NDArray[np.uint8], cutoff: float | None, stored: bool = False
) -> list[NDArray[np.uint16]]:
    """Return all mipmap levels of an image: linear, 16 bits per channel, the first row at the bottom.

    They cost no more to sample than 8-bit sRGB and are more accurate.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (height, width, 4)
        sRGB colour and linear alpha, the first row on top.
    cutoff : float or None
        As for `mip_chain`.
    stored : bool
        Do not decode colours: for looks that filter codes.
    """
    texels, values = _tables(stored)
    image = pixels[::-1]
    height, width = image.shape[:2]
    level = np.empty((height, width, 4), dtype=np.uint16)
    halved = np.empty((max(height // 2, 1), max(width // 2, 1), 4), dtype=np.float32)
    for rows in _strips(height, width):
        pairs = np.ascontiguousarray(image[rows]).view(np.uint16).astype(np.intp)
        level[rows] = _look_up(pairs, *texels).view(np.uint16)
        into = slice(rows.start // 2, max(rows.stop // 2, 1))
        halved[into] = _halve(_look_up(pairs, *values).view(np.float32), weighted=cutoff is not None)
    if level.shape[:2] == (1, 1):
        return [level]
    coverage = None if cutoff is None else alpha_coverage(_ALPHAS.take(image[..., 3]), cutoff)
    return [level, *map(_as_texels, _smaller(halved, cutoff, coverage))]


def kept_texture_levels(
    image: Picture, cutoff: float | None, stored: bool = False
) -> list[NDArray[np.uint16]]:
    """Return `texture_levels`, from the cache if the image has a digest: see `firefly_sample.disk_cache`."""
    if image.digest is None or derived_folder() is None:
        return texture_levels(image.pixels, cutoff, stored)
    key = f"texture-{fingerprint(VERSION, np.__version__, image.digest, cutoff, stored)}"
    kept = load_derived(key)
    if kept is not None:
        expected = [(str(number), "<u2", shape) for number, shape in enumerate(_shapes(image.size))]
        if [(name, level.dtype.str, level.shape) for name, level in kept.arrays.items()] == expected:
            return list(kept.arrays.values())
    levels = texture_levels(image.pixels, cutoff, stored)
    save_derived(key, {}, {str(number): level for number, level in enumerate(levels)})
    return levels


def _shapes(size: tuple[int, int]) -> list[tuple[int, ...]]:
    """Return the shape of every level's array."""
    width, height = size
    count = max(width, height).bit_length()
    return [(max(height >> level, 1), max(width >> level, 1), 4) for level in range(count)]


def _strips(height: int, width: int) -> Iterator[slice]:
    """Yield an even number of rows each, so that strips are halved separately; an odd total at once."""
    step = height if height % 2 else max(_STRIP // width, 2) // 2 * 2
    for start in range(0, height, step):
        yield slice(start, min(start + step, height))


@cache
def _tables(stored: bool) -> tuple[tuple[NDArray[Any], ...], ...]:
    """Return tables from two 8-bit codes to two texels of 16 bits, and to two float32.

    There is a table for red and green and one for blue and alpha: two codes at once halve the look-ups.
    """
    colors = _ALPHAS if stored else srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)
    pairs = np.arange(2**16, dtype=np.uint16).view(np.uint8).reshape(-1, 2)
    values = colors[pairs], np.stack([colors[pairs[:, 0]], _ALPHAS[pairs[:, 1]]], axis=1)
    return (
        tuple(_as_texels(table).view(np.uint32) for table in values),
        tuple(table.view(np.uint64) for table in values),
    )


def _look_up(pairs: NDArray[np.intp], red_green: NDArray[Any], blue_alpha: NDArray[Any]) -> NDArray[Any]:
    """Return the entries of both tables for each texel, from its two pairs of codes."""
    found = np.empty(pairs.shape, dtype=red_green.dtype)
    found[..., 0] = red_green.take(pairs[..., 0])
    found[..., 1] = blue_alpha.take(pairs[..., 1])
    return found


def _as_texels(values: Float32) -> NDArray[np.uint16]:
    scaled = values * np.float32(65535.0)
    np.rint(scaled, out=scaled)
    return scaled.astype(np.uint16, order="C")


def alpha_coverage(alpha: NDArray[np.floating], cutoff: float) -> float:
    """Return the fraction of texels whose alpha is at least `cutoff`."""
    return float(np.mean(alpha >= cutoff))


def mip_chain(pixels: Float32, cutoff: float | None) -> list[Float32]:
    """Return all levels down to one texel.

    Parameters
    ----------
    pixels : ndarray of float32, shape (height, width, 4)
        Linear colour and alpha, 0..1.
    cutoff : float or None
        Keep the coverage at this alpha; None for opaque textures, whose alpha does not matter.
    """
    if max(pixels.shape[:2]) == 1:
        return [pixels]
    coverage = None if cutoff is None else alpha_coverage(pixels[..., 3], cutoff)
    return [pixels, *_smaller(_halve(pixels, weighted=cutoff is not None), cutoff, coverage)]


def _smaller(current: Float32, cutoff: float | None, coverage: float | None) -> Iterator[Float32]:
    """Yield all levels below the full image, from the first one, which is halved already."""
    while True:
        level = current
        if cutoff is not None and coverage is not None:
            level = current.copy()
            level[..., 3] = _rescale_alpha(current[..., 3], coverage, cutoff)
        yield level
        if max(current.shape[:2]) == 1:
            return
        current = _halve(current, weighted=cutoff is not None)


# Below, channels are computed one by one: NumPy is slow in loops over four numbers.


def _halve(pixels: Float32, weighted: bool) -> Float32:
    """Return the next level, each texel the average of the area that it covers."""
    if not weighted:
        return _halve_columns(_halve_rows(pixels))
    halved = _halve_columns(_halve_rows(_weigh(np.multiply, pixels)))
    return _weigh(np.divide, halved)


def _weigh(function: np.ufunc, pixels: Float32) -> Float32:
    """Multiply colours by alpha, or divide them again."""
    weight = pixels[..., 3] + np.float32(1e-4)
    weighed = np.empty_like(pixels)
    for channel in range(3):
        function(pixels[..., channel], weight, out=weighed[..., channel])
    weighed[..., 3] = pixels[..., 3]
    return weighed


def _halve_columns(pixels: Float32) -> Float32:
    rows, columns, channels = pixels.shape
    if columns == 1 or columns % 2:
        return _halve_rows(pixels.swapaxes(0, 1)).swapaxes(0, 1)
    halved = np.empty((rows, columns // 2, channels), dtype=np.float32)
    for channel in range(channels):
        np.add(pixels[:, 0::2, channel], pixels[:, 1::2, channel], out=halved[..., channel])
    halved *= _HALF
    return halved


def _halve_rows(pixels: Float32) -> Float32:
    """Halve the rows, rounded down as in OpenGL; of an odd number each row covers a bit more than two."""
    rows = len(pixels)
    if rows == 1:
        return pixels
    if rows % 2 == 0:
        halved = pixels[0::2] + pixels[1::2]
        halved *= _HALF
        return np.asarray(halved)
    half = rows // 2
    before = ((half - np.arange(half)) / rows).astype(np.float32)[:, None, None]
    after = ((np.arange(half) + 1) / rows).astype(np.float32)[:, None, None]
    middle = np.float32(half / rows)
    return np.asarray(before * pixels[0:-1:2] + middle * pixels[1::2] + after * pixels[2::2])


def _rescale_alpha(alpha: Float32, coverage: float, cutoff: float) -> Float32:
    """Scale `alpha` so that the fraction `coverage` of it reaches `cutoff`, by its quantile."""
    passing = round(coverage * alpha.size)
    if passing == 0:
        return np.minimum(alpha, np.float32(cutoff * 0.5))
    place = alpha.size - passing
    threshold = np.partition(alpha, place, axis=None)[place]
    # texels of equal alpha pass together: take all or none of them, whichever is closer
    below, above = alpha < threshold, alpha > threshold
    first, end = np.count_nonzero(below), alpha.size - np.count_nonzero(above)
    if end < alpha.size and alpha.size - first - passing > passing - (alpha.size - end):
        below, threshold = ~above, alpha[above].min()
    if threshold <= 0:
        return alpha
    # put the cut-off between the last texel that passes and the first that does not
    pivot = 0.5 * (threshold + alpha[below].max()) if below.any() else threshold
    return np.asarray(np.clip(alpha * np.float32(cutoff / pivot), 0.0, 1.0), dtype=np.float32)
