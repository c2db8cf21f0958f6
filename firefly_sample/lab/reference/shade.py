"""Brute-force shading of a decoded G-buffer in float64: every light on every pixel, no volume, no culling.

What the passes of light must agree with. A surface shows, of each light that it faces,

    (albedo * color * max(N.L, 0) + specular * specular_color * highlight) * falloff * cone * shadow.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.chunks import Progress, run_all, tiles_of
from firefly_sample.lab.reference.cone import opening
from firefly_sample.lab.reference.one_light import GBuffer, LitChunk, OneLight, Shadows, lengths
from firefly_sample.lab.reference.pairs import pairs_in_reach
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.scene.falloff import Falloff
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

TILE = (64, 128)
"""Pixels down and across that are shaded together: they lie near each other, so that few lights reach them,
and what is known of them stays in a processor's cache."""


def each_light(sets: Iterable[LightSet]) -> Iterator[OneLight]:
    """All lights of some sets, one by one."""
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
    threads, progress : optional
        As `firefly_sample.lab.reference.chunks.run_all` takes them; `shadows` is called from these threads.

    Returns
    -------
    radiance, light : ndarray of float64, shape (..., 3)
        Linear; the second is what a white surface without highlights would show.
    """
    sets = tuple(sets)
    shape = gbuffer.position.shape
    flat = GBuffer(
        position=gbuffer.position.reshape(-1, 3),
        normal=gbuffer.normal.reshape(-1, 3),
        to_eye=gbuffer.to_eye.reshape(-1, 3),
        albedo=gbuffer.albedo.reshape(-1, 3),
        specular=gbuffer.specular.reshape(-1, 3),
        shininess=gbuffer.shininess.reshape(-1),
    )
    radiance, light = np.zeros_like(flat.position), np.zeros_like(flat.position)
    known = np.asarray(np.isfinite(flat.position).all(axis=1))

    def work(pixels: NDArray[np.intp]) -> None:
        chunk = LitChunk(flat, pixels, settings, shadows)
        for lights in sets:
            for row in chunk.rows_in_reach(lights):
                chunk.add(OneLight(lights, row))
        radiance[pixels], light[pixels] = chunk.sums()

    parts = (tile[known[tile]] for tile in tiles_of(shape[:-1], TILE))
    run_all(work, [pixels for pixels in parts if len(pixels)], threads, progress)
    return radiance.reshape(shape), light.reshape(shape)


def count_pairs(position: Float64, sets: Iterable[LightSet]) -> int:
    """How many (pixel, light) pairs are in range: covered pixels with d < R, whatever their normals.

    A spotlight's must lie within its cone, too; a directional light's range is everything.
    """
    place = position.reshape(-1, 3)
    place = place[np.isfinite(place).all(axis=1)]
    total = 0
    for lights in sets:
        if lights.kind == "point":
            total += pairs_in_reach(position, lights)
        elif lights.kind == "directional":
            total += len(lights) * len(place)
        else:
            total += sum(_within_cone(one, place) for one in each_light([lights]))
    return total


def _within_cone(one: OneLight, place: Float64) -> int:
    """How many positions (n, 3) a spotlight reaches."""
    to_light, _ = one.ways(place[one.in_reach(place)])
    opened = opening(to_light, one.lights.directions[one.row])
    return int(np.count_nonzero(opened <= one.lights.cones[one.row, 1]))


def nearest_light(position: Float64, sets: Iterable[LightSet], longest: float = np.inf) -> Float64:
    """For each pixel the smallest d/R of all lights, shape (...,); infinity where none is in range.

    The R of an attenuation counts as `longest` at most: of a light that hardly fades, it says little.
    """
    place = position.reshape(-1, 3)
    smallest = np.full(len(place), np.inf)
    for one in each_light(sets):
        if one.lights.kind == "directional":
            continue
        distance = lengths(place - one.lights.positions[one.row])
        reach = float(one.lights.reaches[one.row])
        if one.lights.falloff is Falloff.ATTENUATION:
            reach = min(reach, longest)
        smallest = np.where(distance < reach, np.minimum(smallest, distance / reach), smallest)
    return smallest.reshape(position.shape[:-1])
