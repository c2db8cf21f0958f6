"""Mipmaps made on the CPU, so that cut-out leaves stay leaves when they are small.

Averaging alpha thins leaves out: ever fewer texels reach the cut-off. Each level's alpha is scaled until
as large a share of its texels passes as in the full image (Castaño, "Computing Alpha Mipmaps", 2010).
Colour is averaged with alpha as weight, so that the colour of what is cut away does not bleed in.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.srgb import srgb_to_linear

__all__ = ["alpha_coverage", "mip_chain", "texture_levels"]

Float32 = NDArray[np.float32]


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
    values = pixels[::-1].astype(np.float32) / np.float32(255.0)
    if not stored:
        decoded = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)
        values[..., :3] = decoded[pixels[::-1, :, :3]]
    return [np.round(level * np.float32(65535.0)).astype(np.uint16) for level in mip_chain(values, cutoff)]


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
