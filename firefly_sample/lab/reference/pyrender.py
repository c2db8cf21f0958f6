"""pyrender's formula for metallic-roughness surfaces in float64: the twin of PYRENDER in ``metallic.glsl``.

It is that of `firefly_sample.lab.reference.metallic` but for these terms. Dielectrics reflect diffusely by
0.96 of their base colour. Masking and shadowing is Schlick's approximation of Smith's, with r the roughness:

    k = (r + 1)^2 / 8        G = |N.L| |N.V| / ((|N.L| (1 - k) + k) (|N.V| (1 - k) + k))

N.L and |N.V| are at least 0.001, so that a light also reaches surfaces that face away, 0.001 is added to
4 |N.L| |N.V|, and where H is below the surface, D is what it is at N.H = 0. Roughness is 0.04 or more.

All functions work on arrays; colours and vectors have the shape (..., 3), numbers the shape (...,).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.lab.reference.metallic import DIELECTRIC, diffuse_color, fresnel, head_on_reflectance

Float64 = NDArray[np.float64]

SMOOTHEST = 0.04
"""The least roughness."""
GRAZING = 0.001
"""The least cosine, and what is added to 4 |N.L| |N.V|."""


def cosine_of_light(n_dot_l: ArrayLike) -> Float64:
    """Return the cosine by which light arrives, shape (...,)."""
    return np.asarray(np.maximum(np.asarray(n_dot_l, dtype=np.float64), GRAZING))


def reflected(
    base: ArrayLike,
    metallic: ArrayLike,
    roughness: ArrayLike,
    normal: ArrayLike,
    to_light: ArrayLike,
    to_eye: ArrayLike,
) -> tuple[Float64, Float64]:
    """Return the diffuse share and the highlight, times pi, shapes (..., 3).

    A light of colour c makes a surface c (diffuse + highlight) `cosine_of_light` bright. The parameters are
    those of `firefly_sample.lab.reference.metallic.reflected`.
    """
    n, light, eye = (np.asarray(unit, dtype=np.float64) for unit in (normal, to_light, to_eye))
    between = light + eye
    length = np.linalg.norm(between, axis=-1)
    half = between / np.where(length > 0.0, length, 1.0)[..., None]
    share = fresnel(0.5 * length, head_on_reflectance(base, metallic))

    rough = np.clip(np.asarray(roughness, dtype=np.float64), SMOOTHEST, 1.0)
    square, above = rough**4, np.einsum("...i,...i", n, half) > 0.0
    across = np.cross(n, half)
    spread = np.einsum("...i,...i", across, across) + square * np.einsum("...i,...i", n, half) ** 2
    facets = square / np.where(above, spread, 1.0) ** 2  # times pi

    k = (rough + 1.0) ** 2 / 8.0
    n_dot_l = cosine_of_light(np.einsum("...i,...i", n, light))
    n_dot_v = np.maximum(np.abs(np.einsum("...i,...i", n, eye)), GRAZING)
    masked = n_dot_l * n_dot_v / ((n_dot_l * (1.0 - k) + k) * (n_dot_v * (1.0 - k) + k))
    bright = facets * masked / (4.0 * n_dot_l * n_dot_v + GRAZING)
    diffuse = (1.0 - DIELECTRIC) * diffuse_color(base, metallic)
    return (1.0 - share) * diffuse, share * bright[..., None]
