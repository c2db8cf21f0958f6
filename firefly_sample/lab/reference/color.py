"""float64 twin of ``shaders/include/color.glsl``: the tone curve, and sRGB from `firefly_sample.srgb`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def tone_curve(radiance: ArrayLike, name: str) -> NDArray[np.float64]:
    """Radiance to display-linear 0..1: "exponential" is 1 - exp(-L) in each channel, "none" clips at 1."""
    value = np.maximum(np.asarray(radiance, dtype=np.float64), 0.0)
    if name == "exponential":
        return -np.expm1(-value)
    return np.minimum(value, 1.0)
