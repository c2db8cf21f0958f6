"""float64 twin of ``shaders/include/phong.glsl``: how much of a light shiny surfaces send to the eye."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float64 = NDArray[np.float64]


def power_of_cosine(cosine: ArrayLike, exponent: ArrayLike) -> Float64:
    """cos^m, 0 where the cosine is not above 0; with m = 0 it is 1, as in fixed-function OpenGL."""
    c, m = np.broadcast_arrays(np.asarray(cosine, dtype=np.float64), np.asarray(exponent, dtype=np.float64))
    # half as long as numpy.power takes; the smallest positive number's power of 0 is 1, too
    power = np.where(c > 0.0, np.exp(m * np.log(np.maximum(c, 1e-300))), 0.0)
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
    n_dot_l = np.einsum("...i,...i", normal, to_light)
    n_dot_e = np.einsum("...i,...i", normal, to_eye)
    l_dot_e = np.einsum("...i,...i", to_light, to_eye)
    return highlight_of_cosines(n_dot_l, n_dot_e, l_dot_e, shininess, model)


def highlight_of_cosines(
    n_dot_l: Float64, n_dot_e: Float64, l_dot_e: Float64, shininess: ArrayLike, model: str
) -> Float64:
    """The same from the cosines between normal, light and eye, any shape: no vector need be made."""
    if model == "phong":
        cosine = 2.0 * n_dot_l * n_dot_e - l_dot_e
    else:
        half = np.sqrt(np.maximum(2.0 + 2.0 * l_dot_e, 1e-30))
        cosine = (n_dot_l + n_dot_e) / half
    return power_of_cosine(cosine, shininess)
