"""float64 twin of ``shaders/include/falloff.glsl``: how lights fade with distance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.scene.falloff import Falloff

Float64 = NDArray[np.float64]


def ramp_squared(distance: ArrayLike, radius: ArrayLike) -> Float64:
    """(1 - d/R)^2, exactly 0 from the radius on; both in scene units."""
    d, r = np.asarray(distance, dtype=np.float64), np.asarray(radius, dtype=np.float64)
    return np.asarray(np.maximum(1.0 - d / r, 0.0) ** 2)


def window(distance: ArrayLike, end: ArrayLike, kind: str) -> Float64:
    """How a light ends at its max distance R: "karis" is (1 - (d/R)^4)^2, "gltf" 1 - (d/R)^4."""
    s = np.asarray(distance, dtype=np.float64) / np.asarray(end, dtype=np.float64)
    square = s * s  # a power of 4 takes NumPy twenty times as long
    inside = np.maximum(1.0 - square * square, 0.0)
    return np.asarray(inside**2 if kind == "karis" else inside)


def attenuation(distance: ArrayLike, coefficients: ArrayLike) -> Float64:
    """1/(constant + linear*d + quadratic*d^2)."""
    d = np.asarray(distance, dtype=np.float64)
    constant, linear, quadratic = np.asarray(coefficients, dtype=np.float64)
    return np.asarray(1.0 / (constant + d * (linear + d * quadratic)))


def falloff(kind: Falloff, distance: ArrayLike, end: float, coefficients: ArrayLike, ending: str) -> Float64:
    """The factor of one light at distances in scene units.

    Parameters
    ----------
    end : float
        Radius of `Falloff.RAMP_SQUARED`, or max distance, perhaps infinite.
    coefficients : array_like, shape (3,)
        Of `Falloff.ATTENUATION`.
    ending : {"karis", "gltf"}
        The window.
    """
    if kind is Falloff.RAMP_SQUARED:
        return ramp_squared(distance, end)
    fading = attenuation(distance, coefficients)
    return fading if np.isinf(end) else np.asarray(fading * window(distance, end, ending))
