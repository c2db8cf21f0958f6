"""Metallic-roughness surfaces in float64: the twin of the shaders' reflectance.

glTF 2.0, appendix B.3, defines it, in the form of its simplified implementation: a diffuse share after
Lambert, and highlights of microfacets with the distribution of Trowbridge and Reitz (GGX), Smith's separable
masking and shadowing, and Schlick's Fresnel term. With unit vectors N (normal), L (to the light), V (to the
eye) and H (half-way between L and V), m the share of metal, and a the square of the roughness,

    c_diff = (1 - m) base            f0 = 0.04 (1 - m) + m base
    F = f0 + (1 - f0) (1 - V.H)^5
    f = (1 - F) c_diff / pi + F D G / (4 |V.N| |L.N|)

All functions work on arrays; colours and vectors have the shape (..., 3), numbers the shape (...,).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.plan.instances import SMOOTHEST

Float64 = NDArray[np.float64]

DIELECTRIC = 0.04
"""Reflectance of a surface without metal, seen head-on: that of an index of refraction of 1.5."""


def diffuse_color(base: ArrayLike, metallic: ArrayLike) -> Float64:
    """Return c_diff, the colour of the diffuse share, shape (..., 3)."""
    return np.asarray(base, dtype=np.float64) * (1.0 - np.asarray(metallic, dtype=np.float64))[..., None]


def head_on_reflectance(base: ArrayLike, metallic: ArrayLike) -> Float64:
    """Return f0, the reflectance of a smooth surface seen head-on, shape (..., 3)."""
    share = np.asarray(metallic, dtype=np.float64)[..., None]
    return np.asarray(DIELECTRIC * (1.0 - share) + np.asarray(base, dtype=np.float64) * share)


def width(roughness: ArrayLike) -> Float64:
    """Return a, the width of the distribution of microfacets: the roughness, `SMOOTHEST` or more, squared."""
    return np.asarray(np.maximum(np.asarray(roughness, dtype=np.float64), SMOOTHEST) ** 2)


def fresnel(v_dot_h: ArrayLike, f0: ArrayLike) -> Float64:
    """Return F, the share of light that a microfacet reflects, shape (..., 3), by Schlick's approximation.

    Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", Computer Graphics Forum 13(3), 1994.

    Parameters
    ----------
    v_dot_h : array_like, shape (...,)
        The cosine of the angle at which light meets the microfacet; its sign does not matter.
    f0 : array_like, shape (..., 3)
    """
    short = 1.0 - np.minimum(np.abs(np.asarray(v_dot_h, dtype=np.float64)), 1.0)
    square = short * short  # a power of 5 takes NumPy twenty times as long
    start = np.asarray(f0, dtype=np.float64)
    return np.asarray(start + (1.0 - start) * (square * square * short)[..., None])


def distribution(n_dot_h: ArrayLike, n_cross_h_squared: ArrayLike, a: ArrayLike) -> Float64:
    """Return D, the density of microfacets along H, by Trowbridge and Reitz; 0 where H is below the surface.

    glTF's denominator ((N.H)^2 (a^2 - 1) + 1)^2 loses all digits where N.H is near 1. The same number is
    |N x H|^2 + a^2 (N.H)^2, whose terms are not negative.

    Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, equation 33.
    """
    cosine, square = np.asarray(n_dot_h, dtype=np.float64), np.asarray(a, dtype=np.float64) ** 2
    above = cosine > 0.0
    spread = np.asarray(n_cross_h_squared, dtype=np.float64) + square * cosine * cosine
    return np.asarray(np.where(above, square / (np.pi * np.where(above, spread, 1.0) ** 2), 0.0))


def smith(cosine: ArrayLike, a: ArrayLike) -> Float64:
    """Return the share of microfacets that are not hidden in a direction with this cosine to the normal.

    G is the product of these shares for light and eye; both are 0 where H faces away from either.
    """
    along = np.abs(np.asarray(cosine, dtype=np.float64))
    return np.asarray(2.0 * along / _smith_sum(along, a))


def visibility(n_dot_l: ArrayLike, n_dot_v: ArrayLike, a: ArrayLike) -> Float64:
    """Return G / (4 |N.L| |N.V|), which is finite also where a cosine is 0.

    The Heaviside steps of H.L and H.V are left out: H is half-way, so neither is ever negative.
    """
    to_light, to_eye = (np.abs(np.asarray(cosine, dtype=np.float64)) for cosine in (n_dot_l, n_dot_v))
    return np.asarray(1.0 / (_smith_sum(to_light, a) * _smith_sum(to_eye, a)))


def _smith_sum(cosine: Float64, a: ArrayLike) -> Float64:
    square = np.asarray(a, dtype=np.float64) ** 2
    return np.asarray(cosine + np.sqrt(square + (1.0 - square) * cosine * cosine))


def reflected(
    base: ArrayLike,
    metallic: ArrayLike,
    roughness: ArrayLike,
    normal: ArrayLike,
    to_light: ArrayLike,
    to_eye: ArrayLike,
) -> tuple[Float64, Float64]:
    """Return the diffuse share and the highlight of f, times pi, shapes (..., 3).

    A light of colour c, which makes a white Phong surface c N.L bright, makes this one
    c N.L (diffuse + highlight) bright. Where L and V are opposite there is no H, and no highlight.

    Parameters
    ----------
    base : array_like, shape (..., 3)
        Linear base colours.
    metallic, roughness : array_like, shape (...,)
    normal, to_light, to_eye : array_like, shape (..., 3)
        Unit vectors, of one space.
    """
    n, light, eye = (np.asarray(unit, dtype=np.float64) for unit in (normal, to_light, to_eye))
    between = light + eye
    length = np.sqrt(_dot(between, between))
    scale = 1.0 / np.where(length > 0.0, length, 1.0)
    n_dot_h, v_dot_h = _dot(n, between) * scale, 0.5 * length
    a, share = width(roughness), fresnel(v_dot_h, head_on_reflectance(base, metallic))
    facets = distribution(n_dot_h, _cross_squared(n, between) * scale * scale, a)
    bright = np.pi * facets * visibility(_dot(n, light), _dot(n, eye), a)
    return (1.0 - share) * diffuse_color(base, metallic), share * bright[..., None]


def ambient_reflectance(base: ArrayLike, metallic: ArrayLike) -> Float64:
    """Return the share of uniform ambient light that is reflected, shape (..., 3): f0 + (1 - f0) c_diff.

    It is what a smooth surface reflects head-on, from all directions: no more than arrives, and a metal's
    base colour. The angle and the roughness do not count.
    """
    f0 = head_on_reflectance(base, metallic)
    return np.asarray(f0 + (1.0 - f0) * diffuse_color(base, metallic))


def _dot(one: Float64, other: Float64) -> Float64:
    """Return dot products (...,), by coordinate: NumPy is slow along an axis of three."""
    return np.asarray(one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1] + one[..., 2] * other[..., 2])


def _cross_squared(one: Float64, other: Float64) -> Float64:
    """Return squared lengths of cross products, shape (...,)."""
    (x, y, z), (u, v, w) = np.moveaxis(one, -1, 0), np.moveaxis(other, -1, 0)
    return np.asarray((y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2)
