"""Mipmaps made on the CPU, so that cut-out leaves stay leaves when they are small.

Averaging alpha thins leaves out: ever fewer texels reach the cut-off. Each level's alpha is scaled until
as large a share of its texels passes as in the full image (Castaño, "Computing Alpha Mipmaps", 2010).
Colour is averaged with alpha as weight, so that the colour of what is cut away does not bleed in.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["alpha_coverage", "mip_chain"]

Float32 = NDArray[np.float32]


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
    """Average 2x2 texels; an odd last row or column is averaged with itself."""
    if weighted:
        weight = pixels[..., 3:] + np.float32(1e-4)
        pixels = np.concatenate([pixels[..., :3] * weight, pixels[..., 3:]], axis=2)
    height, width = pixels.shape[:2]
    if (height > 1 and height % 2) or (width > 1 and width % 2):
        pixels = np.pad(
            pixels, ((0, height % 2 if height > 1 else 0), (0, width % 2 if width > 1 else 0), (0, 0)), "edge"
        )
    if pixels.shape[0] > 1:
        pixels = np.float32(0.5) * (pixels[0::2] + pixels[1::2])
    if pixels.shape[1] > 1:
        pixels = np.float32(0.5) * (pixels[:, 0::2] + pixels[:, 1::2])
    if weighted:
        weight = pixels[..., 3:] + np.float32(1e-4)
        pixels = np.concatenate([pixels[..., :3] / weight, pixels[..., 3:]], axis=2)
    return pixels


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
