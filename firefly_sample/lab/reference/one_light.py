"""What one light does to pixels, in float64: arrays of numbers by coordinate, which NumPy walks fastest.

A surface shows, of each light that it faces,

    (albedo * color * max(N.L, 0) + specular * specular_color * highlight) * falloff * cone * shadow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.cone import cone_strength, opening
from firefly_sample.lab.reference.falloff import falloff
from firefly_sample.lab.reference.phong import highlight_of_cosines
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.settings import Settings

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
        return np.asarray(lengths(offset) < self.lights.reaches[self.row])

    def ways(self, position: Float64) -> tuple[Float64, Float64]:
        """Unit vectors to the light, and distances, from positions (n, 3)."""
        if self.lights.kind == "directional":
            to_light = np.broadcast_to(-self.lights.directions[self.row], position.shape)
            return to_light, np.full(len(position), np.inf)
        offset = self.lights.positions[self.row] - position
        distance = np.maximum(lengths(offset), 1e-300)
        return offset / distance[:, None], distance

    def strength(self, to_light: Float64, distance: Float64, settings: Settings) -> Float64:
        """How much of the light's colour arrives, shadows apart; the unit vectors to it have shape (3, n)."""
        lights, row = self.lights, self.row
        if lights.kind == "directional":
            return np.ones(len(distance))
        end, coefficients = float(lights.ends[row]), lights.attenuations[row]
        strength = falloff(lights.falloff, distance, end, coefficients, settings.range_falloff)
        if lights.kind == "spot":
            strength = strength * cone_strength(
                opening(to_light.T, lights.directions[row]), *lights.cones[row]
            )
        return strength


Shadows = Callable[[OneLight, NDArray[np.intp], Float64], Float64]
"""``shadows(light, pixels, n_dot_l)``: the lit share of the pixels of these (flat) indices, shape (n,), or
(3, n), of each colour."""


class LitChunk:
    """Some pixels of a flat G-buffer, and the light that they have got so far.

    Parameters
    ----------
    gbuffer : GBuffer
        Of shapes (n, 3) and (n,).
    pixels : ndarray of int
        Indices into it; each has a position.
    settings, shadows
        As `firefly_sample.lab.reference.shade.shade_lights` takes them.
    """

    def __init__(
        self, gbuffer: GBuffer, pixels: NDArray[np.intp], settings: Settings, shadows: Shadows | None
    ) -> None:
        self._pixels, self._settings, self._shadows = pixels, settings, shadows
        self._place = np.ascontiguousarray(gbuffer.position[pixels].T)
        self._normal = np.ascontiguousarray(gbuffer.normal[pixels].T)
        self._eye = np.ascontiguousarray(gbuffer.to_eye[pixels].T)
        self._n_dot_e = dot(self._normal, self._eye)
        self._albedo, self._specular = gbuffer.albedo[pixels].T, gbuffer.specular[pixels].T
        self._shininess = gbuffer.shininess[pixels]
        self._shiny = np.asarray(self._specular.any(axis=0))
        self._any_shiny = bool(self._shiny.any())
        self._light = np.zeros((3, len(pixels)))
        self._glint = np.zeros((3, len(pixels)))

    def rows_in_reach(self, lights: LightSet) -> list[int]:
        """Those lights of a set that may reach a pixel here: by the box around them all."""
        if lights.kind == "directional":
            return list(range(len(lights)))
        low, high = self._place.min(axis=1), self._place.max(axis=1)
        away = np.maximum(np.maximum(low - lights.positions, lights.positions - high), 0.0)
        # some more, since it is rounded
        return np.flatnonzero(lengths(away) * (1.0 - 1e-12) < lights.reaches).tolist()

    def add(self, one: OneLight) -> None:
        """Add a light."""
        chosen, to_light, n_dot_l, distance = self._facing(one)
        if not len(chosen):
            return
        lights, row = one.lights, one.row
        strength = one.strength(to_light, distance, self._settings)
        if self._shadows is not None and (lights.shadowed or lights.particle_shadowed):
            strength = strength * self._shadows(one, self._pixels[chosen], n_dot_l)
        clamp = self._settings.clamp_light
        for channel, color in enumerate(lights.colors[row].tolist()):
            if color > 0.0:
                diffuse = np.minimum(color * n_dot_l, 1.0) if clamp else color * n_dot_l
                self._light[channel][chosen] += diffuse * _channel(strength, channel)
        if self._any_shiny and lights.specular_colors[row].any():
            self._add_highlight(one, chosen, to_light, n_dot_l, strength)

    def _add_highlight(
        self, one: OneLight, chosen: NDArray[np.intp], to_light: Float64, n_dot_l: Float64, strength: Float64
    ) -> None:
        if not self._shiny.all():
            shiny = np.flatnonzero(self._shiny[chosen])
            chosen, to_light = chosen[shiny], to_light[:, shiny]
            n_dot_l, strength = n_dot_l[shiny], strength[..., shiny]
        l_dot_e = dot(to_light, self._eye[:, chosen])
        model = self._settings.specular_model
        shine = highlight_of_cosines(n_dot_l, self._n_dot_e[chosen], l_dot_e, self._shininess[chosen], model)
        for channel, color in enumerate(one.lights.specular_colors[one.row].tolist()):
            if color > 0.0 and self._settings.clamp_light:
                glint = np.minimum(color * shine * self._specular[channel][chosen], 1.0)
                self._glint[channel][chosen] += glint * _channel(strength, channel)
            elif color > 0.0:
                self._glint[channel][chosen] += color * shine * _channel(strength, channel)

    def _facing(self, one: OneLight) -> tuple[NDArray[np.intp], Float64, Float64, Float64]:
        """Pixels that a light reaches and that face it; unit vectors to it (3, n), cosines, distances."""
        lights, row = one.lights, one.row
        if lights.kind == "directional":
            way = -lights.directions[row]
            cosine = dot(self._normal, way)
            chosen = np.flatnonzero(cosine > 0.0)
            to_light = np.broadcast_to(way[:, None], (3, len(chosen)))
            return chosen, to_light, cosine[chosen], np.full(len(chosen), np.inf)
        offset = lights.positions[row][:, None] - self._place
        facing = dot(self._normal, offset)
        square, reach = dot(offset, offset), float(lights.reaches[row])
        reached = facing > 0.0
        if reach < np.inf:
            reached &= np.sqrt(square) < reach
        chosen = np.flatnonzero(reached)
        distance = np.maximum(np.sqrt(square[chosen]), 1e-150)
        share = 1.0 / distance
        return chosen, offset[:, chosen] * share, facing[chosen] * share, distance

    def sums(self) -> tuple[Float64, Float64]:
        """Radiance, and light on white surfaces, shapes (n, 3)."""
        glint = self._glint if self._settings.clamp_light else self._glint * self._specular
        return (self._albedo * self._light + glint).T, self._light.T


def _channel(strength: Float64, channel: int) -> Float64:
    """A colour's strength, where colours have their own."""
    return np.asarray(strength[channel]) if strength.ndim == 2 else strength


def dot(one: Float64, other: Float64) -> Float64:
    """Products of vectors (3, n), or of them with one vector (3,), shape (n,)."""
    return np.asarray(one[0] * other[0] + one[1] * other[1] + one[2] * other[2])


def lengths(vectors: Float64) -> Float64:
    """Lengths of vectors (n, 3), several times as fast as ``numpy.linalg.norm`` finds them."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))
