"""Mipmaps made on the CPU, so that cut-out leaves stay leaves when they are small.

Averaging alpha thins leaves out: ever fewer texels reach the cut-off. Each level's alpha is scaled until
as large a share of its texels passes as in the full image (Castaño, "Computing Alpha Mipmaps", 2010).
Colour is averaged with alpha as weight, so that the colour of what is cut away does not bleed in.
"""

from __future__ import annotations

from functools import cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from firefly_sample.derived import derived_folder, fingerprint, load_derived, save_derived
from firefly_sample.srgb import srgb_to_linear

__all__ = ["Picture", "alpha_coverage", "kept_texture_levels", "mip_chain", "texture_levels"]

Float32 = NDArray[np.float32]

VERSION = 1
"""Of the levels' numbers: counts up whenever one bit of them changes, or those that were kept stay in use."""


class Picture(Protocol):
    """What has levels: a scene's Texture is one."""

    size: tuple[int, int]
    digest: str | None

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """As `texture_levels` takes them."""


def texture_levels(
    pixels: NDArray[np.uint8], cutoff: float | None, stored: bool = False
) -> list[NDArray[np.uint16]]:
    """All levels of an image as they are sampled: 16 bits a channel, the first row at the bottom.

    Decoded once to linear colour, which costs no more to sample than 8 bits of sRGB and errs less.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (height, width, 4)
        sRGB colour and linear alpha, the first row on top.
    cutoff : float or None
        As `mip_chain` takes it.
    stored : bool
        Keep colours as they are stored, not decoded: the classic look.
    """
    colors, alphas = _decoded(stored)
    rows = np.ascontiguousarray(pixels[::-1])
    values, first = colors.take(rows), _as_texels(colors).take(rows)
    values[..., 3], first[..., 3] = alphas.take(rows[..., 3]), _as_texels(alphas).take(rows[..., 3])
    return [first, *map(_as_texels, mip_chain(values, cutoff)[1:])]


def kept_texture_levels(
    image: Picture, cutoff: float | None, stored: bool = False
) -> list[NDArray[np.uint16]]:
    """`texture_levels` of an image; of one that has a digest they are kept: see `firefly_sample.derived`."""
    if image.digest is None or derived_folder() is None:
        return texture_levels(image.pixels, cutoff, stored)
    key = f"texture-{fingerprint(VERSION, np.__version__, image.digest, cutoff, stored)}"
    kept = load_derived(key)
    if kept is not None:
        levels = list(kept.arrays.values())
        whole = all(level.dtype == np.uint16 for level in levels)
        if whole and [level.shape for level in levels] == _shapes(image.size):
            return levels
    levels = texture_levels(image.pixels, cutoff, stored)
    save_derived(key, {}, {str(number): level for number, level in enumerate(levels)})
    return levels


def _shapes(size: tuple[int, int]) -> list[tuple[int, ...]]:
    """Of every level's array."""
    width, height = size
    count = max(width, height).bit_length()
    return [(max(height >> level, 1), max(width >> level, 1), 4) for level in range(count)]


@cache
def _decoded(stored: bool) -> tuple[Float32, Float32]:
    """What the 256 codes of a colour and of alpha are in 0..1: one look-up is cheaper than arithmetic."""
    alphas = np.arange(256, dtype=np.float32) / np.float32(255.0)
    return alphas if stored else srgb_to_linear(np.arange(256) / 255.0).astype(np.float32), alphas


def _as_texels(values: Float32) -> NDArray[np.uint16]:
    scaled = values * np.float32(65535.0)
    np.rint(scaled, out=scaled)
    return scaled.astype(np.uint16)


def alpha_coverage(alpha: NDArray[np.floating], cutoff: float) -> float:
    """The share of texels whose alpha is at least `cutoff`."""
    return float(np.mean(alpha >= cutoff))


def mip_chain(pixels: Float32, cutoff: float | None) -> list[Float32]:
    """All levels down to one texel.

    Parameters
    ----------
    pixels : ndarray of float32, shape (height, width, 4)
        Linear colour and alpha, 0..1.
    cutoff : float or None
        Keep the coverage at this alpha; None for opaque textures, whose alpha does not matter.
    """
    levels = [pixels]
    coverage = None if cutoff is None else alpha_coverage(pixels[..., 3], cutoff)
    current = pixels
    while max(current.shape[:2]) > 1:
        current = _halve(current, weighted=cutoff is not None)
        level = current
        if cutoff is not None and coverage is not None:
            level = current.copy()
            level[..., 3] = _rescale_alpha(current[..., 3], coverage, cutoff)
        levels.append(level)
    return levels


def _halve(pixels: Float32, weighted: bool) -> Float32:
    """The next level: each texel the average of the area that it covers."""
    if weighted:
        weight = pixels[..., 3:] + np.float32(1e-4)
        pixels = np.concatenate([pixels[..., :3] * weight, pixels[..., 3:]], axis=2)
    pixels = _halve_rows(_halve_rows(pixels).swapaxes(0, 1)).swapaxes(0, 1)
    if weighted:
        weight = pixels[..., 3:] + np.float32(1e-4)
        pixels = np.concatenate([pixels[..., :3] / weight, pixels[..., 3:]], axis=2)
    return pixels


def _halve_rows(pixels: Float32) -> Float32:
    """Half the rows, rounded down as OpenGL does; of an odd count each new row covers two and a bit."""
    rows = len(pixels)
    if rows == 1:
        return pixels
    if rows % 2 == 0:
        return np.asarray(np.float32(0.5) * (pixels[0::2] + pixels[1::2]))
    half = rows // 2
    before = ((half - np.arange(half)) / rows).astype(np.float32)[:, None, None]
    after = ((np.arange(half) + 1) / rows).astype(np.float32)[:, None, None]
    middle = np.float32(half / rows)
    return np.asarray(before * pixels[0:-1:2] + middle * pixels[1::2] + after * pixels[2::2])


def _rescale_alpha(alpha: Float32, coverage: float, cutoff: float) -> Float32:
    """Scale `alpha` so that the share `coverage` of it reaches `cutoff`: the cut-off quantile moves there."""
    passing = round(coverage * alpha.size)
    if passing == 0:
        return np.minimum(alpha, np.float32(cutoff * 0.5))
    ranked = np.sort(alpha, axis=None)
    threshold = ranked[alpha.size - passing]
    # texels of equal alpha pass together: take them all or none, whichever comes closer
    first, end = np.searchsorted(ranked, threshold, "left"), np.searchsorted(ranked, threshold, "right")
    if end < alpha.size and alpha.size - first - passing > passing - (alpha.size - end):
        first, threshold = end, ranked[end]
    if threshold <= 0:
        return alpha
    # the cut-off comes to lie between the last texel that passes and the first that does not
    pivot = 0.5 * (threshold + ranked[first - 1]) if first > 0 else threshold
    return np.asarray(np.clip(alpha * np.float32(cutoff / pivot), 0.0, 1.0), dtype=np.float32)
