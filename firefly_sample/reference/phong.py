"""float64 twin of ``shaders/include/phong.glsl``: how much of a light shiny surfaces send to the eye."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["highlight", "power_of_cosine"]

Float64 = NDArray[np.float64]


def power_of_cosine(cosine: ArrayLike, exponent: ArrayLike) -> Float64:
    """cos^m, 0 where the cosine is not above 0; with m = 0 it is 1, as in fixed-function OpenGL."""
    c, m = np.broadcast_arrays(np.asarray(cosine, dtype=np.float64), np.asarray(exponent, dtype=np.float64))
    power = np.where(c > 0.0, np.power(np.maximum(c, 0.0), m), 0.0)
    return np.where(m == 0.0, 1.0, power)


def highlight(
    normal: Float64, to_light: Float64, to_eye: Float64, shininess: ArrayLike, model: str
) -> Float64:
    """The highlight's strength for unit vectors (..., 3), before any colour.

    Parameters
    ----------
    model : {"phong", "blinn_phong"}
        The angle between the reflected light and the eye, or between the normal and the half-way vector.
    """
    if model == "phong":
        n_dot_l = np.einsum("...i,...i", normal, to_light)[..., None]
        cosine = np.einsum("...i,...i", 2.0 * n_dot_l * normal - to_light, to_eye)
    else:
        half = to_light + to_eye
        length = np.maximum(np.linalg.norm(half, axis=-1), 1e-15)
        cosine = np.einsum("...i,...i", normal, half) / length
    return power_of_cosine(cosine, shininess)
