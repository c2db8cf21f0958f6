"""The light that one source adds to pixels, in float64.

Columns have one array per coordinate, which NumPy walks fastest. Each light that a surface faces adds

    (albedo * color * max(N.L, 0) + specular * specular_color * highlight) * falloff * cone * shadow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.shading import cone_strength, falloff, highlight_of_cosines, opening
from firefly_sample.plan.light_set import LightSet
from firefly_sample.readback import GBuffer
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OneLight:
    """One light: a row of a `LightSet`."""

    lights: LightSet
    row: int

    def in_reach(self, position: Float64) -> NDArray[np.bool_]:
        """Return which positions (n, 3) are nearer than the light's reach."""
        if self.lights.kind == "directional":
            return np.asarray(np.isfinite(position).all(axis=1))
        offset = position - self.lights.positions[self.row]
        return np.asarray(lengths(offset) < self.lights.reaches[self.row])

    def directions(self, position: Float64) -> tuple[Float64, Float64]:
        """Return unit vectors from positions (n, 3) to the light, and distances."""
        if self.lights.kind == "directional":
            to_light = np.broadcast_to(-self.lights.directions[self.row], position.shape)
            return to_light, np.full(len(position), np.inf)
        offset = self.lights.positions[self.row] - position
        distance = np.maximum(lengths(offset), 1e-300)
        return offset / distance[:, None], distance

    def strength(self, to_light: Float64, distance: Float64, settings: Settings) -> Float64:
        """Return the factor of the light's colour, without shadows; `to_light` has shape (3, n)."""
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
"""``shadows(light, pixels, n_dot_l)``: the lit share of pixels by their flat indices, shape (n,), or (3, n)
for a share per colour."""


class LitChunk:
    """Some pixels of a flat G-buffer, and the sum of the light added to them.

    Parameters
    ----------
    gbuffer : GBuffer
        Of shapes (n, 3) and (n,).
    pixels : ndarray of int
        Indices of pixels that have a position.
    settings, shadows
        As `firefly_sample.lab.reference.shade.shade_lights` takes them.
    """

    def __init__(
        self, gbuffer: GBuffer, pixels: NDArray[np.intp], settings: Settings, shadows: Shadows | None
    ) -> None:
        self._pixels, self._settings, self._shadows = pixels, settings, shadows
        self._position = np.ascontiguousarray(gbuffer.position[pixels].T)
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
        """Return the lights of a set whose reach meets the bounding box of these pixels."""
        if lights.kind == "directional":
            return list(range(len(lights)))
        low, high = self._position.min(axis=1), self._position.max(axis=1)
        away = np.maximum(np.maximum(low - lights.positions, lights.positions - high), 0.0)
        # a little farther, to allow for rounding
        return np.flatnonzero(lengths(away) * (1.0 - 1e-12) < lights.reaches).tolist()

    def add(self, one: OneLight) -> None:
        """Add the light of one source."""
        chosen, to_light, n_dot_l, distance = self._facing(one)
        if not len(chosen):
            return
        lights, row = one.lights, one.row
        strength = one.strength(to_light, distance, self._settings)
        if self._shadows is not None and (lights.shadowed or lights.clouded):
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
        """Return pixels in reach that face a light, unit vectors to it (3, n), cosines and distances."""
        lights, row = one.lights, one.row
        if lights.kind == "directional":
            direction = -lights.directions[row]
            cosine = dot(self._normal, direction)
            chosen = np.flatnonzero(cosine > 0.0)
            to_light = np.broadcast_to(direction[:, None], (3, len(chosen)))
            return chosen, to_light, cosine[chosen], np.full(len(chosen), np.inf)
        offset = lights.positions[row][:, None] - self._position
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
        """Return radiance, and the light on white surfaces, shapes (n, 3)."""
        glint = self._glint if self._settings.clamp_light else self._glint * self._specular
        return (self._albedo * self._light + glint).T, self._light.T


def _channel(strength: Float64, channel: int) -> Float64:
    """Return the strength of one colour channel; `strength` has shape (n,) or (3, n)."""
    return np.asarray(strength[channel]) if strength.ndim == 2 else strength


def dot(one: Float64, other: Float64) -> Float64:
    """Return dot products of vectors (3, n) with vectors (3, n) or one vector (3,), shape (n,)."""
    return np.asarray(one[0] * other[0] + one[1] * other[1] + one[2] * other[2])


def lengths(vectors: Float64) -> Float64:
    """Return lengths of vectors (n, 3), several times as fast as ``numpy.linalg.norm``."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))
