"""Bound lights in view space: which are in view, along the view axis and across it, and by which proxy.

Bounds are never too small.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frustum import (
    FULLSCREEN_RADIUS,
    farthest_corner,
    sectors_in_frustum,
    spheres_in_frustum,
)
from firefly_sample.plan.lights.light_set import LightSet, Proxy, any_channel, one_minus_cos, sector_extent
from firefly_sample.plan.view import View
from firefly_sample.scene.arrays import Float64

BETWEEN = 0.05
"""Samples by which a surface may lie beside its line of sight, from float32 and the rasterizer."""
SLANTS = (0.0, 0.3, -0.3, 1.0, -1.0, 3.0, -3.0)
"""Shares of the view axis that are mixed in to find bounds of a cone's part of a slice."""
WIDEST_CONE = 53.0
"""Degrees: above this half-angle a sphere is the smaller proxy of a spotlight."""
_PROXIES: tuple[Proxy, ...] = ("sphere", "cone", "fullscreen")


def in_view(lights: LightSet, world_to_view: Float64, planes: Float64) -> LightSet:
    """Return the lights of a set in world space that can change the picture, in view space."""
    positions = lights.positions @ world_to_view[:3, :3] + world_to_view[3, :3]
    directions = lights.directions @ world_to_view[:3, :3]
    shines = any_channel(lights.colors) | any_channel(lights.specular_colors)
    useful = shines & (lights.reaches > 0.0)
    if lights.kind == "point":
        useful &= spheres_in_frustum(planes, positions, lights.reaches)
    elif lights.kind == "spot":
        useful &= sectors_in_frustum(planes, positions, directions, lights.reaches, lights.cones[:, 1])
    return replace(lights, positions=positions, directions=directions).take(np.flatnonzero(useful))


class Bodies:
    """Parts of lights' spheres, or cones, between two distances along the view axis."""

    def __init__(self, lights: LightSet, light: NDArray[Any], near: Float64, far: Float64, perspective: bool):
        self._near, self._far = near, far
        # reciprocals of the distances: dividing is slow
        self._scales = (1.0 / near, 1.0 / far) if perspective else None
        self._x, self._y, self._z = (lights.positions[:, axis][light] for axis in range(3))
        self._reach = lights.safe_reaches[light]
        away = np.maximum(near - self._y, self._y - far)
        np.maximum(away, 0.0, out=away)
        squared = (self._reach - away) * (self._reach + away)
        self._radius = np.sqrt(np.maximum(squared, 0.0, out=squared), out=squared)
        self._cones = (lights.directions[light], lights.cones[light, 1]) if lights.kind == "spot" else None

    def bounds(self, x: float, z: float) -> tuple[Float64, Float64]:
        """Return a lower and an upper bound of ``x*X/Y + z*Z/Y``, orthographic ``x*X + z*Z``."""
        across = self._across(x, z)
        radius = self._radius * math.hypot(x, z)
        least, most = across - radius, across + radius
        if self._cones is not None:
            least, most = np.maximum(least, -self._cone(-x, -z)), np.minimum(most, self._cone(x, z))
        if self._scales is None:
            return least, most
        near, far = self._scales
        return np.minimum(least * near, least * far), np.maximum(most * near, most * far)

    def _across(self, x: float, z: float) -> Float64:
        """Return the value of ``x*X + z*Z`` at the lights."""
        if x and z:
            return np.asarray(self._x * x + self._z * z)
        return np.asarray(self._x * x if x else self._z * z)

    def _cone(self, x: float, z: float) -> Float64:
        """Return an upper bound of ``x*X + z*Z`` in a cone's part.

        For any s, x*X + z*Z = (x*X + s*Y + z*Z) - s*Y. The first term is bounded by the whole cone, the
        second by the slice. The least of the bounds for some s is a bound too.
        """
        assert self._cones is not None
        axes, openings = self._cones
        length, across = math.hypot(x, z), self._across(x, z)
        largest = np.full(len(across), np.inf)
        for slant in SLANTS:
            s = slant * length
            n = np.array([x, s, z])
            size = float(np.linalg.norm(n))
            whole = across + s * self._y + self._reach * size * sector_extent(axes @ n / size, openings)
            np.minimum(largest, whole - s * (self._near if s >= 0.0 else self._far), out=largest)
        return largest


def pixel_scales(view: View) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return samples per slope (orthographic: per unit) and the sample of slope 0, across and up."""
    lens, (width, height) = view.lens, view.size
    across = 0.5 * width * lens.a, 0.5 * width * (1.0 + lens.x_offset)
    return across, (0.5 * height * lens.c, 0.5 * height * (1.0 + lens.z_offset))


def screen_bounds(lights: LightSet, view: View) -> tuple[tuple[Float64, Float64], tuple[Float64, Float64]]:
    """Return the least and largest sample that each light may reach: across, and up."""
    low, high = lights.spans
    low = np.maximum(low, view.near)
    body = Bodies(lights, np.arange(len(lights)), low, np.maximum(high, low), view.lens.perspective)
    (across, x0), (up, z0) = pixel_scales(view)
    (left, right), (bottom, top) = body.bounds(across, 0.0), body.bounds(0.0, up)
    return (x0 + left, x0 + right), (z0 + bottom, z0 + top)


def meet_samples(lights: LightSet, view: View) -> NDArray[np.bool_]:
    """Return which lights a line of sight through a sample's centre may meet, shape (n,).

    A distant or tiny light may fall between all of them: then it lights nothing that is seen.
    """
    scales = pixel_scales(view)
    nearest = lights.positions[:, 1] - lights.safe_reaches if view.lens.perspective else 1.0
    # a light as wide as a sample holds a centre, if it is in view at all
    small = np.flatnonzero(lights.safe_reaches * max(scale for scale, _ in scales) < np.maximum(nearest, 0.0))
    met = np.ones(len(lights), dtype=bool)
    if len(small):
        positions, reach = lights.positions[small], lights.safe_reaches[small]
        for axis, (scale, center), size in zip((0, 2), scales, view.size, strict=True):
            low, high = _tangents(positions[:, axis], positions[:, 1], reach, view.lens.perspective)
            first = np.ceil(center + scale * low - 0.5 - BETWEEN)
            last = np.floor(center + scale * high - 0.5 + BETWEEN)
            met[small] &= np.maximum(first, 0.0) <= np.minimum(last, size - 1.0)
    return met


def _tangents(x: Float64, y: Float64, reach: Float64, perspective: bool) -> tuple[Float64, Float64]:
    """Return the least and largest x/Y (orthographic: x) of spheres in front of the eye."""
    if not perspective:
        return x - reach, x + reach
    square = (y - reach) * (y + reach)
    half = reach * np.sqrt(x * x + square)
    return (x * y - half) / square, (x * y + half) / square


def choose_proxies(lights: LightSet, corners: Float64) -> list[LightSet]:
    """Return a set for each proxy, with and without shadow maps and particle shadows, in drawing order.

    `corners`, shape (8, 3), are the view's.
    """
    # seen from any point, the farthest corner is at least half as far as two corners are apart
    farthest = np.full(len(lights), np.inf)
    large = lights.reaches >= 0.5 * np.linalg.norm(corners[0] - corners[-1])
    farthest[large] = farthest_corner(corners, lights.positions[large])
    heights = np.minimum(lights.reaches, farthest)
    endless = heights >= FULLSCREEN_RADIUS
    fullscreen = endless | (lights.reaches >= farthest) | (lights.kind == "directional")
    cone = np.zeros(len(lights), dtype=bool)
    if lights.kind == "spot":
        cone = (lights.cones[:, 1] <= one_minus_cos(WIDEST_CONE)) & ~endless
    lights = replace(lights, heights=heights)
    # the sets' numbers, in drawing order
    number_of = (
        4 * np.where(cone, 1, 2 * fullscreen) + 2 * (lights.casters >= 0) + lights.shadowed_by_particles
    )
    return [
        lights.take(
            np.flatnonzero(number_of == number), proxy=_PROXIES[number // 4], shadowed=bool(number & 2)
        )
        for number in np.flatnonzero(np.bincount(number_of))
    ]
