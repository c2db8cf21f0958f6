"""Brute-force shading of a decoded G-buffer in float64: every light on every pixel, no volume, no culling.

What the point-light pass must agree with. The lighting is Lambert's: albedo * color * max(N.L, 0) *
falloff(d).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frame_plan import LightSet
from firefly_sample.reference.falloff import falloff

__all__ = ["count_pairs", "nearest_light", "shade_point_lights"]

Float64 = NDArray[np.float64]


def shade_point_lights(
    position: Float64, normal: Float64, albedo: Float64, lights: Iterable[LightSet]
) -> Float64:
    """Linear radiance of point lights.

    Parameters
    ----------
    position, normal, albedo : ndarray of float64, shape (..., 3)
        View space; positions that are NaN (nothing was drawn) get 0.
    lights : iterable of LightSet

    Returns
    -------
    ndarray of float64, shape (..., 3)
    """
    shape = position.shape
    place, unit = position.reshape(-1, 3), normal.reshape(-1, 3)
    irradiance = np.zeros_like(place)
    for light_set in lights:
        for center, color, radius in zip(light_set.positions, light_set.colors, light_set.radii, strict=True):
            offset = center - place
            distance = np.linalg.norm(offset, axis=1)
            near = np.flatnonzero(distance < radius)
            d = np.maximum(distance[near], 1e-15)
            n_dot_l = np.maximum(np.einsum("ij,ij->i", unit[near], offset[near]) / d, 0.0)
            irradiance[near] += color * (n_dot_l * falloff(light_set.falloff, d, radius))[:, None]
    return irradiance.reshape(shape) * albedo


def count_pairs(position: Float64, lights: Iterable[LightSet]) -> int:
    """How many (pixel, light) pairs are in range: a covered pixel with d < R, whatever its normal."""
    place = position.reshape(-1, 3)
    place = place[np.isfinite(place).all(axis=1)]
    total = 0
    for light_set in lights:
        for center, radius in zip(light_set.positions, light_set.radii, strict=True):
            offset = place - center
            total += int(np.count_nonzero(np.einsum("ij,ij->i", offset, offset) < radius * radius))
    return total


def nearest_light(position: Float64, lights: Iterable[LightSet]) -> Float64:
    """For each pixel the smallest d/R of all lights, shape (...,); infinity where none is in range."""
    place = position.reshape(-1, 3)
    smallest = np.full(len(place), np.inf)
    for light_set in lights:
        for center, radius in zip(light_set.positions, light_set.radii, strict=True):
            distance = np.linalg.norm(place - center, axis=1)
            smallest = np.where(distance < radius, np.minimum(smallest, distance / radius), smallest)
    return smallest.reshape(position.shape[:-1])
