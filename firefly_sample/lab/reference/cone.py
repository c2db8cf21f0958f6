"""float64 twin of ``shaders/include/cone.glsl``: the strength of a spotlight in a direction."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.phong import power_of_cosine

Float64 = NDArray[np.float64]


def opening(to_light: Float64, axis: Float64) -> Float64:
    """1 - cos of the angle between a spotlight's axis and the way from it to a surface: unit vectors.

    Shapes (..., 3) in and (...) out. Half the square of the chord between the two, which is exact for small
    angles and large ones.
    """
    chord = to_light + axis
    return np.asarray(0.5 * np.einsum("...i,...i", chord, chord))


def cone_strength(opened: Float64, inner: float, outer: float, exponent: float) -> Float64:
    """The strength at openings 1 - cos(angle), for a cone given likewise.

    1 within `inner`, 0 beyond `outer`, a smooth step of the opening between; times cos(angle)^exponent.
    """
    if outer > inner:
        t = np.clip((outer - opened) / (outer - inner), 0.0, 1.0)
        edge = t * t * (3.0 - 2.0 * t)
    else:
        edge = np.where((opened <= outer) | (outer >= 2.0 - 1e-9), 1.0, 0.0)
    if exponent == 0.0:
        return np.asarray(edge)
    return np.asarray(edge * power_of_cosine(1.0 - opened, exponent))
