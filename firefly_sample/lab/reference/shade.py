"""Brute-force shading of a decoded G-buffer in float64: every light on every pixel, no volume, no culling.

Each light that a surface faces adds

    (albedo * color * max(N.L, 0) + specular * specular_color * highlight) * falloff * cone * shadow,

or, with a metallic-roughness material, what `firefly_sample.lab.reference.metallic` reflects of its colour.
In the look "pyrender", such materials reflect light by `firefly_sample.lab.reference.pyrender`, also of
lights that they do not face; in the look "panda3d", other materials have the highlights of
`firefly_sample.lab.reference.panda3d`.
The lighting passes must agree with `shade_lights`. `count_pairs` counts the (pixel, light) pairs in range,
which is the least that any method must shade.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference import metallic, panda3d, pyrender
from firefly_sample.lab.reference.chunks import Progress, run_all, tiles_of
from firefly_sample.lab.reference.shading import cone_strength, falloff, highlight_of_cosines, opening
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.readback import GBuffer
from firefly_sample.scene.light import Falloff
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

TILE = (64, 128)
"""Pixels down and across that are shaded together: few lights reach all of so small a tile, and its data stay
in a processor's cache."""
PAIRS_TILE = (16, 16)
"""Pixels down and across whose pairs are counted together: the bounding box of so few decides most lights."""
ROUNDING = 1e-13
"""Far more than the relative rounding error of a distance."""
PAIRS_LIGHTS = 256
"""Lights whose distances to a tile's pixels are computed at once: they stay in a processor's cache."""


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
            opened = opening(to_light.T, lights.directions[row])
            inner, outer, exponent = lights.cones[row].tolist()
            strength = strength * cone_strength(opened, inner, outer, exponent, settings.look)
        return strength


Shadows = Callable[[OneLight, NDArray[np.intp], Float64], Float64]
"""``shadows(light, pixels, n_dot_l)``: the lit share of pixels by their flat indices, shape (n,), or (3, n)
for a share per colour."""


class _LitTile:
    """Some pixels of a flat G-buffer that have positions, and the sum of the light added to them."""

    def __init__(
        self, gbuffer: GBuffer, pixels: NDArray[np.intp], settings: Settings, shadows: Shadows | None
    ) -> None:
        self._pixels, self._settings, self._shadows = pixels, settings, shadows
        self._position, self._normal, self._eye = (
            np.ascontiguousarray(vectors[pixels].T)
            for vectors in (gbuffer.position, gbuffer.normal, gbuffer.to_eye)
        )
        self._n_dot_e = _dot(self._normal, self._eye)
        self._albedo, self._specular = gbuffer.albedo[pixels].T, gbuffer.specular[pixels].T
        self._shininess = gbuffer.shininess[pixels]
        self._metallic, self._roughness = gbuffer.metallic[pixels], gbuffer.roughness[pixels]
        self._metal = self._metallic >= 0.0
        self._any_metal = bool(self._metal.any())
        self._shiny = np.asarray(self._specular.any(axis=0))
        self._by_pyrender = settings.look == "pyrender" and self._any_metal
        self._by_panda3d = settings.look == "panda3d"
        self._model = panda3d.HIGHLIGHTS if self._by_panda3d else settings.specular_model
        if self._any_metal:
            self._shiny &= ~self._metal
            self._reflected = np.zeros((3, len(pixels)))
        self._any_shiny = bool(self._shiny.any())
        self._light, self._glint = np.zeros((2, 3, len(pixels)))

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
        if self._shadows is not None and (lights.shadowed or lights.particle_shadowed):
            strength = strength * self._shadows(one, self._pixels[chosen], n_dot_l)
        clamp = self._settings.clamp_light
        for channel, color in enumerate(lights.colors[row].tolist()):
            if color > 0.0:
                arriving = color * np.maximum(n_dot_l, 0.0)
                diffuse = np.minimum(arriving, 1.0) if clamp else arriving
                self._light[channel][chosen] += diffuse * _channel(strength, channel)
        if self._any_shiny and lights.specular_colors[row].any():
            self._add_highlight(one, *_only(self._shiny, chosen, to_light, n_dot_l, strength))
        if self._any_metal:
            self._add_reflected(one, *_only(self._metal, chosen, to_light, n_dot_l, strength))

    def _add_highlight(
        self, one: OneLight, chosen: NDArray[np.intp], to_light: Float64, n_dot_l: Float64, strength: Float64
    ) -> None:
        l_dot_e = _dot(to_light, self._eye[:, chosen])
        cosines = n_dot_l, self._n_dot_e[chosen], l_dot_e
        shine = highlight_of_cosines(*cosines, self._shininess[chosen], self._model)
        for channel, color in enumerate(one.lights.specular_colors[one.row].tolist()):
            if color > 0.0 and self._settings.clamp_light:
                glint = np.minimum(color * shine * self._specular[channel][chosen], 1.0)
                self._glint[channel][chosen] += glint * _channel(strength, channel)
            elif color > 0.0:
                self._glint[channel][chosen] += color * shine * _channel(strength, channel)

    def _add_reflected(
        self, one: OneLight, chosen: NDArray[np.intp], to_light: Float64, n_dot_l: Float64, strength: Float64
    ) -> None:
        """Add the light that metallic-roughness surfaces reflect."""
        vectors = (self._normal[:, chosen].T, to_light.T, self._eye[:, chosen].T)
        material = self._albedo[:, chosen].T, self._metallic[chosen], self._roughness[chosen]
        if self._by_pyrender:
            matt, glint = pyrender.reflected(*material, *vectors)
            n_dot_l = pyrender.cosine_of_light(n_dot_l)
        else:
            matt, glint = metallic.reflected(*material, *vectors)
        for channel, color in enumerate(one.lights.colors[one.row].tolist()):
            if color > 0.0:
                arriving = color * n_dot_l
                diffuse, bright = matt[:, channel] * arriving, glint[:, channel] * arriving
                if self._settings.clamp_light:
                    diffuse = matt[:, channel] * np.minimum(arriving, 1.0)
                    bright = np.minimum(bright, 1.0)
                self._reflected[channel][chosen] += (diffuse + bright) * _channel(strength, channel)

    def _facing(self, one: OneLight) -> tuple[NDArray[np.intp], Float64, Float64, Float64]:
        """Return pixels in reach that a light lights, unit vectors to it (3, n), cosines and distances."""
        lights, row = one.lights, one.row
        if lights.kind == "directional":
            direction = -lights.directions[row]
            cosine = _dot(self._normal, direction)
            chosen = np.flatnonzero(self._lit(cosine))
            to_light = np.broadcast_to(direction[:, None], (3, len(chosen)))
            return chosen, to_light, cosine[chosen], np.full(len(chosen), np.inf)
        offset = lights.positions[row][:, None] - self._position
        facing = _dot(self._normal, offset)
        square, reach = _dot(offset, offset), float(lights.reaches[row])
        reached = self._lit(facing)
        if reach < np.inf:
            reached &= np.sqrt(square) < reach
        chosen = np.flatnonzero(reached)
        distance = np.maximum(np.sqrt(square[chosen]), 1e-150)
        share = 1.0 / distance
        return chosen, offset[:, chosen] * share, facing[chosen] * share, distance

    def _lit(self, cosine: Float64) -> NDArray[np.bool_]:
        """Return which pixels a light lights at these cosines, of any factor above 0."""
        if self._by_pyrender:
            return np.asarray((cosine > 0.0) | self._metal)
        return np.asarray((cosine > 0.0) | self._shiny) if self._by_panda3d else np.asarray(cosine > 0.0)

    def sums(self) -> tuple[Float64, Float64, Float64]:
        """Return radiance without Phong highlights, these, and the light on white surfaces, shapes (n, 3)."""
        glint = self._glint if self._settings.clamp_light else self._glint * self._specular
        matt = self._albedo * self._light
        if self._any_metal:
            matt = np.where(self._metal, self._reflected, matt)
        return matt.T, glint.T, self._light.T


def _only(
    wanted: NDArray[np.bool_],
    chosen: NDArray[np.intp],
    to_light: Float64,
    n_dot_l: Float64,
    strength: Float64,
) -> tuple[NDArray[np.intp], Float64, Float64, Float64]:
    """Return chosen pixels, and what belongs to them, without those that are not wanted."""
    if wanted.all():
        return chosen, to_light, n_dot_l, strength
    kept = np.flatnonzero(wanted[chosen])
    return chosen[kept], to_light[:, kept], n_dot_l[kept], strength[..., kept]


def _channel(strength: Float64, channel: int) -> Float64:
    """Return the strength of one colour channel; `strength` has shape (n,) or (3, n)."""
    return np.asarray(strength[channel]) if strength.ndim == 2 else strength


def _dot(one: Float64, other: Float64) -> Float64:
    """Return dot products of vectors (3, n) with vectors (3, n) or one vector (3,), shape (n,)."""
    return np.asarray(one[0] * other[0] + one[1] * other[1] + one[2] * other[2])


def lengths(vectors: Float64) -> Float64:
    """Return lengths of vectors (n, 3), several times as fast as ``numpy.linalg.norm``."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))


def each_light(sets: Iterable[LightSet]) -> Iterator[OneLight]:
    """Yield all lights of some sets, one by one."""
    for lights in sets:
        for row in range(len(lights)):
            yield OneLight(lights, row)


def shade_lights(
    gbuffer: GBuffer,
    sets: Iterable[LightSet],
    settings: Settings,
    shadows: Shadows | None = None,
    *,
    threads: int | None = 1,
    progress: Progress | None = None,
) -> tuple[Float64, Float64]:
    """Shade a G-buffer by all lights, in view space; `shadows` is called from all threads.

    Returns
    -------
    radiance, light : ndarray of float64, shape (..., 3)
        Linear; the second is the radiance of white surfaces without highlights. Pixels without a position
        get 0.
    """
    matt, gloss, light = shade_apart(gbuffer, sets, settings, shadows, threads=threads, progress=progress)
    return matt + gloss, light


def shade_apart(
    gbuffer: GBuffer,
    sets: Iterable[LightSet],
    settings: Settings,
    shadows: Shadows | None = None,
    *,
    threads: int | None = 1,
    progress: Progress | None = None,
) -> tuple[Float64, Float64, Float64]:
    """Return what `shade_lights` does, but radiance in two parts: without Phong highlights, and these."""
    sets = tuple(sets)
    shape = gbuffer.position.shape
    flat = GBuffer(*(image.reshape(-1, *image.shape[len(shape) - 1 :]) for image in vars(gbuffer).values()))
    matt, gloss, light = np.zeros((3, *flat.position.shape))
    known = np.asarray(np.isfinite(flat.position).all(axis=1))

    def work(pixels: NDArray[np.intp]) -> None:
        tile = _LitTile(flat, pixels, settings, shadows)
        for lights in sets:
            for row in tile.rows_in_reach(lights):
                tile.add(OneLight(lights, row))
        matt[pixels], gloss[pixels], light[pixels] = tile.sums()

    parts = (tile[known[tile]] for tile in tiles_of(shape[:-1], TILE))
    run_all(work, [pixels for pixels in parts if len(pixels)], threads, progress)
    return matt.reshape(shape), gloss.reshape(shape), light.reshape(shape)


def count_pairs(position: Float64, sets: Iterable[LightSet]) -> int:
    """Return how many (pixel, light) pairs are in range: covered pixels with d < R, whatever their normals.

    A spotlight's pixels must also lie in its cone. A directional light is in range of all pixels.
    """
    covered = position.reshape(-1, 3)
    covered = covered[np.isfinite(covered).all(axis=1)]
    total = 0
    for lights in sets:
        if lights.kind == "point":
            total += pairs_in_reach(position, lights)
        elif lights.kind == "directional":
            total += len(lights) * len(covered)
        else:
            for one in each_light([lights]):
                to_light, _ = one.directions(covered[one.in_reach(covered)])
                opened = opening(to_light, lights.directions[one.row])
                total += int(np.count_nonzero(opened <= lights.cones[one.row, 1]))
    return total


def pairs_in_reach(position: Float64, lights: LightSet) -> int:
    """Return the number of pairs with d < R, of pixels (..., 3) in view space whose position is finite.

    Pixels are taken by small tiles. The bounding box of a tile's positions mostly decides whether a light
    reaches all of them or none; only the other pairs are measured. The cones of spotlights do not count.
    """
    flat = position.reshape(-1, 3)
    known = np.asarray(np.isfinite(flat).all(axis=1))
    tiles = (tile[known[tile]] for tile in tiles_of(position.shape[:-1], PAIRS_TILE))
    return sum(_pairs_of_tile(np.ascontiguousarray(flat[pixels]), lights) for pixels in tiles if len(pixels))


def _pairs_of_tile(position: Float64, lights: LightSet) -> int:
    """Count the pairs of one tile's positions, shape (n, 3), as `OneLight.in_reach` decides them."""
    low, high = position.min(axis=0), position.max(axis=0)
    to_low, to_high = low - lights.positions, lights.positions - high
    nearest = lengths(np.maximum(np.maximum(to_low, to_high), 0.0))
    farthest = lengths(np.maximum(np.abs(to_low), np.abs(to_high)))
    inner, outer = lights.reaches * (1.0 - ROUNDING), lights.reaches * (1.0 + ROUNDING)
    whole = farthest < inner
    partly = np.flatnonzero(~whole & (nearest < outer))
    total = int(np.count_nonzero(whole)) * len(position)
    for first in range(0, len(partly), PAIRS_LIGHTS):
        rows = partly[first : first + PAIRS_LIGHTS]
        square = np.zeros((len(rows), len(position)))
        for light, pixel in zip(lights.positions[rows].T, position.T, strict=True):
            offset = light[:, None] - pixel  # by coordinate: NumPy is slow along an axis of three
            offset *= offset
            square += offset
        inside, near = square < inner[rows, None] ** 2, square < outer[rows, None] ** 2
        total += int(np.count_nonzero(inside))
        if np.count_nonzero(near) > np.count_nonzero(inside):
            row, column = np.nonzero(near & ~inside)
            exact = lengths(position[column] - lights.positions[rows[row]])
            total += int(np.count_nonzero(exact < lights.reaches[rows[row]]))
    return total


def nearest_light(position: Float64, sets: Iterable[LightSet], longest: float = np.inf) -> Float64:
    """Return the smallest d/R of all lights for each pixel, shape (...,); infinity where none is in range.

    The R of an attenuation is limited to `longest`: for a light that hardly fades, the R itself says little.
    """
    flat = position.reshape(-1, 3)
    smallest = np.full(len(flat), np.inf)
    for one in each_light(sets):
        if one.lights.kind == "directional":
            continue
        distance = lengths(flat - one.lights.positions[one.row])
        reach = float(one.lights.reaches[one.row])
        if one.lights.falloff is Falloff.ATTENUATION:
            reach = min(reach, longest)
        smallest = np.where(distance < reach, np.minimum(smallest, distance / reach), smallest)
    return smallest.reshape(position.shape[:-1])
