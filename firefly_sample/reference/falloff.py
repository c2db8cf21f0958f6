"""float64 twin of ``shaders/include/falloff.glsl``: how lights fade with distance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.scene.lights import Falloff

__all__ = ["falloff"]


def falloff(kind: Falloff, distance: ArrayLike, radius: ArrayLike) -> NDArray[np.float64]:
    """The factor of a light at `distance`, both in scene units; exactly 0 from `radius` on."""
    d = np.asarray(distance, dtype=np.float64)
    r = np.asarray(radius, dtype=np.float64)
    if kind is Falloff.RAMP_SQUARED:
        return np.maximum(1.0 - d / r, 0.0) ** 2
    raise AssertionError(kind)
