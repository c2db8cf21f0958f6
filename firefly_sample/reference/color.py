"""float64 twin of ``shaders/include/color.glsl``: sRGB and the tone curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["linear_to_srgb", "srgb_to_linear", "tone_curve"]

Float64 = NDArray[np.float64]


def linear_to_srgb(linear: ArrayLike) -> Float64:
    """The exact piecewise sRGB encoding (IEC 61966-2-1); what lies outside 0..1 is clipped."""
    x = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1.0 / 2.4) - 0.055)


def srgb_to_linear(code: ArrayLike) -> Float64:
    """The exact piecewise sRGB decoding of values in 0..1."""
    c = np.asarray(code, dtype=np.float64)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def tone_curve(radiance: ArrayLike, name: str) -> Float64:
    """Radiance to display-linear 0..1: "exponential" is 1 - exp(-L) in each channel, "none" clips at 1."""
    value = np.maximum(np.asarray(radiance, dtype=np.float64), 0.0)
    if name == "exponential":
        return -np.expm1(-value)
    return np.minimum(value, 1.0)
