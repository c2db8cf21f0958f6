"""The light that reaches points in the world: what white matt surfaces there would show, without shadows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.light import Falloff
from firefly_sample.settings import Settings

BLOCK_PAIRS = 2**15
"""Pairs of a point and a light that are computed at once: as many as stay in a processor's cache."""
LEAST_BLOCK = 16
"""Points that are not halved any more: there would be too many blocks."""


def count_pairs(positions: Float64, sets: Sequence[LightSet]) -> float:
    """Return about how many pairs of a position, shape (n, 3), and a light `incident_light` would compute.

    A light counts by the share of the positions' bounding box that its own box covers.
    """
    if not len(positions):
        return 0.0
    low, high = positions.min(axis=0), positions.max(axis=0)
    total = 0.0
    for lights in sets:
        shares = np.ones(len(lights))
        if lights.kind != "directional":
            ends = lights.ends[:, None]
            common = np.minimum(lights.positions + ends, high) - np.maximum(lights.positions - ends, low)
            size = np.where(high > low, high - low, 1.0)
            along = np.where(high > low, np.clip(common / size, 0.0, 1.0), common >= 0.0)
            shares = along.prod(axis=1)
        total += float(shares.sum()) * len(positions)
    return total


def incident_light(
    positions: Float64, normals: Float64, sets: Sequence[LightSet], settings: Settings
) -> Float64:
    """Return the radiance of white matt surfaces, shape (n, 3): all lights' diffuse share, nothing else.

    Nothing stands in a light's way, and no light is cut off before its own end.

    Parameters
    ----------
    positions, normals : ndarray of float64, shape (n, 3)
        World space; unit normals. A normal of zeros faces no light.
    sets : sequence of LightSet
        In world space, as `firefly_sample.plan.lights.light_set.gather_lights` returns them.
    settings : Settings
        `range_falloff`, `clamp_light` and `look` count.
    """
    light = np.zeros_like(positions)
    if len(positions):
        _add_light(light, positions, normals, np.arange(len(positions)), sets, settings)
    return light


def _add_light(
    light: Float64,
    positions: Float64,
    normals: Float64,
    chosen: NDArray[np.intp],
    sets: Sequence[LightSet],
    settings: Settings,
) -> None:
    """Add the light at the `chosen` positions to `light`.

    Many positions are halved across their longest side, so that fewer lights reach each half.
    """
    mine = positions[chosen]
    near = [part for lights in sets if len(part := _in_reach(lights, mine))]
    pairs = len(chosen) * sum(len(lights) for lights in near)
    if pairs > BLOCK_PAIRS and len(chosen) > LEAST_BLOCK:
        order = np.argsort(mine[:, int(np.argmax(np.ptp(mine, axis=0)))], kind="stable")
        for half in np.array_split(chosen[order], 2):
            _add_light(light, positions, normals, half, near, settings)
        return
    place, normal = np.ascontiguousarray(mine.T), np.ascontiguousarray(normals[chosen].T)
    for lights in near:
        most = max(BLOCK_PAIRS // len(chosen), 1)
        for first in range(0, len(lights), most):
            part = lights.take(np.arange(first, min(first + most, len(lights))))
            light[chosen] += _light_of(part, place, normal, settings)


def _in_reach(lights: LightSet, positions: Float64) -> LightSet:
    """Return the lights whose end lies beyond the nearest point of the box around positions (n, 3)."""
    if lights.kind == "directional" or np.isinf(lights.ends).all():
        return lights
    low, high = positions.min(axis=0), positions.max(axis=0)
    x, y, z = np.maximum(np.maximum(low - lights.positions, lights.positions - high), 0.0).T
    # a little farther, to allow for rounding
    return lights.take(np.flatnonzero(np.sqrt(x * x + y * y + z * z) * (1.0 - 1e-12) <= lights.ends))


def _light_of(lights: LightSet, place: Float64, normal: Float64, settings: Settings) -> Float64:
    """Return the light of one set at positions (3, n), shape (n, 3)."""
    if lights.kind == "directional":
        cosine, strength = np.maximum(-(lights.directions @ normal), 0.0), None
    else:
        x, y, z = (lights.positions[:, axis, None] - place[axis] for axis in range(3))
        distance = np.maximum(np.sqrt(x * x + y * y + z * z), 1e-150)
        cosine = np.maximum(x * normal[0] + y * normal[1] + z * normal[2], 0.0) / distance
        strength = _falloff(lights, distance, settings.range_falloff)
        if lights.kind == "spot":
            ways = x / distance, y / distance, z / distance
            strength = strength * _cone(lights, *ways, squared=settings.look == "pyrender")
    if settings.clamp_light:
        channels = [np.minimum(color[:, None] * cosine, 1.0) for color in lights.colors.T]
        lit = channels if strength is None else [channel * strength for channel in channels]
        return np.stack([channel.sum(axis=0) for channel in lit], axis=1)
    factor = cosine if strength is None else cosine * strength
    return np.asarray(factor.T @ lights.colors)


def _falloff(lights: LightSet, distance: Float64, ending: str) -> Float64:
    """Return the factors of lights at distances, shape (lights, n); see `Falloff`."""
    end = lights.ends[:, None]
    with np.errstate(divide="ignore", over="ignore"):
        if lights.falloff is Falloff.RAMP_SQUARED:
            return np.asarray(np.maximum(1.0 - distance / end, 0.0) ** 2)
        constant, linear, quadratic = (column[:, None] for column in lights.attenuations.T)
        # bounded, so that a channel without light stays without
        factor = np.minimum(1.0 / (constant + distance * (linear + distance * quadratic)), 1e100)
        if np.isinf(lights.ends).all():
            return np.asarray(factor)
        square = (distance / end) ** 2
        inside = np.maximum(1.0 - square * square, 0.0)
    return np.asarray(factor * (inside**2 if ending == "karis" else inside))


def _cone(lights: LightSet, x: Float64, y: Float64, z: Float64, squared: bool) -> Float64:
    """Return the strength of spotlights for unit vectors to them, each of shape (lights, n).

    An opening is 1 - cos of the angle from a light's axis: half the square of the chord between the two,
    which is exact for small angles as well. With `squared`, the edge is that of the look "pyrender".
    """
    axis_x, axis_y, axis_z = (column[:, None] for column in lights.directions.T)
    opened = 0.5 * ((x + axis_x) ** 2 + (y + axis_y) ** 2 + (z + axis_z) ** 2)
    inner, outer, exponent = (column[:, None] for column in lights.cones.T)
    soft = outer > inner
    wide = np.maximum(outer - inner, 1e-3) if squared else np.where(soft, outer - inner, 1.0)
    t = np.clip((outer - opened) / wide, 0.0, 1.0)
    if squared:
        edge = t * t
    else:
        edge = np.where(soft, t * t * (3.0 - 2.0 * t), (opened <= outer) | (outer >= 2.0 - 1e-9))
    cosine = np.maximum(1.0 - opened, 0.0)
    return np.asarray(edge * np.where(exponent > 0.0, cosine**exponent, 1.0))
