"""The sRGB transfer function in float64 (IEC 61966-2-1, the exact pieces)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float64 = NDArray[np.float64]


def linear_to_srgb(linear: ArrayLike) -> Float64:
    """Return display codes 0..1 of linear values, which are clipped to 0..1, as by a display."""
    x = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1.0 / 2.4) - 0.055)


def srgb_to_linear(code: ArrayLike) -> Float64:
    """Return linear values of display codes in 0..1."""
    c = np.asarray(code, dtype=np.float64)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
