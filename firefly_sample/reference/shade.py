"""Brute-force shading of a decoded G-buffer in float64: every light on every pixel, no volume, no culling.

What the passes of light must agree with. A surface shows, of each light that it faces,

    (albedo * color * max(N.L, 0) + specular * specular_color * highlight) * falloff * cone * shadow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.light_set import LightSet
from firefly_sample.reference.cone import cone_strength, opening
from firefly_sample.reference.falloff import falloff
from firefly_sample.reference.phong import highlight
from firefly_sample.scene.falloff import Falloff
from firefly_sample.settings import Settings

__all__ = ["GBuffer", "OneLight", "count_pairs", "each_light", "nearest_light", "shade_lights"]

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GBuffer:
    """What is known of each pixel, view space, float64; shapes (..., 3) but for `shininess`, (...).

    Attributes
    ----------
    position : ndarray
        NaN where nothing was drawn.
    normal, to_eye : ndarray
        Unit vectors.
    albedo, specular : ndarray
        Linear.
    shininess : ndarray
    """

    position: Float64
    normal: Float64
    to_eye: Float64
    albedo: Float64
    specular: Float64
    shininess: Float64


@dataclass(frozen=True, eq=False)
class OneLight:
    """One light of a set: `row` of its columns."""

    lights: LightSet
    row: int

    def in_reach(self, position: Float64) -> NDArray[np.bool_]:
        """Which positions (n, 3) are nearer than the light's reach."""
        if self.lights.kind == "directional":
            return np.asarray(np.isfinite(position).all(axis=1))
        offset = position - self.lights.positions[self.row]
        return np.asarray(_lengths(offset) < self.lights.reaches[self.row])

    def ways(self, position: Float64) -> tuple[Float64, Float64]:
        """Unit vectors to the light, and distances, from positions (n, 3)."""
        if self.lights.kind == "directional":
            to_light = np.broadcast_to(-self.lights.directions[self.row], position.shape)
            return to_light, np.full(len(position), np.inf)
        offset = self.lights.positions[self.row] - position
        distance = np.maximum(_lengths(offset), 1e-15)
        return offset / distance[:, None], distance

    def strength(self, to_light: Float64, distance: Float64, settings: Settings) -> Float64:
        """How much of the light's colour arrives there, shadows apart."""
        lights, row = self.lights, self.row
        if lights.kind == "directional":
            return np.ones(len(distance))
        end, coefficients = float(lights.ends[row]), lights.attenuations[row]
        strength = falloff(lights.falloff, distance, end, coefficients, settings.window)
        if lights.kind == "spot":
            strength = strength * cone_strength(opening(to_light, lights.directions[row]), *lights.cones[row])
        return strength


Shadows = Callable[[OneLight, NDArray[np.intp], Float64], Float64]
"""``shadows(light, pixels, n_dot_l)``: the lit share of the pixels of these (flat) indices."""


def each_light(sets: Iterable[LightSet]) -> Iterator[OneLight]:
    """All lights of some sets, one by one."""
    for lights in sets:
        for row in range(len(lights)):
            yield OneLight(lights, row)


def shade_lights(
    gbuffer: GBuffer, sets: Iterable[LightSet], settings: Settings, shadows: Shadows | None = None
) -> tuple[Float64, Float64]:
    """What all lights do to a G-buffer.

    Parameters
    ----------
    gbuffer : GBuffer
        Pixels without a position get 0.
    sets : iterable of LightSet
        View space.
    settings : Settings
        Of them, the specular model, the window and the clamps.
    shadows : callable, optional
        See `Shadows`; nothing is in shadow when absent.

    Returns
    -------
    radiance, light : ndarray of float64, shape (..., 3)
        Linear; the second is what a white surface without highlights would show.
    """
    place, unit = gbuffer.position.reshape(-1, 3), gbuffer.normal.reshape(-1, 3)
    eye, albedo = gbuffer.to_eye.reshape(-1, 3), gbuffer.albedo.reshape(-1, 3)
    specular, shininess = gbuffer.specular.reshape(-1, 3), gbuffer.shininess.reshape(-1)
    radiance, light = np.zeros_like(place), np.zeros_like(place)
    for one in each_light(sets):
        near = np.flatnonzero(one.in_reach(place))
        to_light, distance = one.ways(place[near])
        n_dot_l = np.einsum("ij,ij->i", unit[near], to_light)
        facing = np.flatnonzero(n_dot_l > 0.0)
        near, to_light, n_dot_l = near[facing], to_light[facing], n_dot_l[facing]
        strength = one.strength(to_light, distance[facing], settings)
        if shadows is not None and one.lights.shadowed:
            strength = strength * shadows(one, near, n_dot_l)
        diffuse = one.lights.colors[one.row] * n_dot_l[:, None]
        shine = highlight(unit[near], to_light, eye[near], shininess[near], settings.specular)
        glint = specular[near] * one.lights.specular_colors[one.row] * shine[:, None]
        if settings.clamp_light:
            diffuse, glint = np.minimum(diffuse, 1.0), np.minimum(glint, 1.0)
        light[near] += diffuse * strength[:, None]
        radiance[near] += (albedo[near] * diffuse + glint) * strength[:, None]
    return radiance.reshape(gbuffer.position.shape), light.reshape(gbuffer.position.shape)


def count_pairs(position: Float64, sets: Iterable[LightSet]) -> int:
    """How many (pixel, light) pairs are in range: covered pixels with d < R, whatever their normals.

    A spotlight's must lie within its cone, too; a directional light's range is everything.
    """
    place = position.reshape(-1, 3)
    place = place[np.isfinite(place).all(axis=1)]
    total = 0
    for one in each_light(sets):
        near = one.in_reach(place)
        if one.lights.kind == "spot":
            to_light, _ = one.ways(place[near])
            opened = opening(to_light, one.lights.directions[one.row])
            total += int(np.count_nonzero(opened <= one.lights.cones[one.row, 1]))
        else:
            total += int(np.count_nonzero(near))
    return total


def nearest_light(position: Float64, sets: Iterable[LightSet], longest: float = np.inf) -> Float64:
    """For each pixel the smallest d/R of all lights, shape (...,); infinity where none is in range.

    The R of an attenuation counts as `longest` at most: of a light that hardly fades, it says little.
    """
    place = position.reshape(-1, 3)
    smallest = np.full(len(place), np.inf)
    for one in each_light(sets):
        if one.lights.kind == "directional":
            continue
        distance = _lengths(place - one.lights.positions[one.row])
        reach = float(one.lights.reaches[one.row])
        if one.lights.falloff is Falloff.ATTENUATION:
            reach = min(reach, longest)
        smallest = np.where(distance < reach, np.minimum(smallest, distance / reach), smallest)
    return smallest.reshape(position.shape[:-1])


def _lengths(vectors: Float64) -> Float64:
    """Lengths of vectors (n, 3), several times as fast as ``numpy.linalg.norm`` finds them."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))
