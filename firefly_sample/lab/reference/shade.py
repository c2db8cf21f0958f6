"""Brute-force shading of a decoded G-buffer in float64: every light on every pixel, no volume, no culling.

The lighting passes must agree with `shade_lights`; the formula is in
`firefly_sample.lab.reference.one_light`. `count_pairs` counts the (pixel, light) pairs in range, which is the
least that any method must shade.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.chunks import Progress, run_all, tiles_of
from firefly_sample.lab.reference.one_light import LitChunk, OneLight, Shadows, lengths
from firefly_sample.lab.reference.shading import opening
from firefly_sample.plan.light_set import LightSet
from firefly_sample.readback import GBuffer
from firefly_sample.scene.falloff import Falloff
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

TILE = (64, 128)
"""Pixels down and across that are shaded together: few lights reach pixels so close to each other, and their
data stay in a processor's cache."""
PAIRS_TILE = (16, 16)
"""Pixels down and across whose pairs are counted together: the bounding box of so few decides most lights."""
ROUNDING = 1e-13
"""Far more than the relative rounding error of a distance."""
PAIRS_LIGHTS = 1024
"""Lights whose distances to a tile's pixels are computed at once: 8 MB."""


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
    """Shade a G-buffer by all lights.

    Parameters
    ----------
    gbuffer : GBuffer
        Pixels without a position get 0.
    sets : iterable of LightSet
        View space.
    settings : Settings
        `specular_model`, `range_falloff` and `clamp_light` count.
    shadows : callable, optional
        See `Shadows`; no shadows when absent.
    threads, progress : optional
        As `firefly_sample.lab.reference.chunks.run_all` takes them; `shadows` is called from these threads.

    Returns
    -------
    radiance, light : ndarray of float64, shape (..., 3)
        Linear; the second is the radiance of white surfaces without highlights.
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
            total += sum(_within_cone(one, covered) for one in each_light([lights]))
    return total


def _within_cone(one: OneLight, position: Float64) -> int:
    """Return how many positions (n, 3) a spotlight reaches."""
    to_light, _ = one.directions(position[one.in_reach(position)])
    opened = opening(to_light, one.lights.directions[one.row])
    return int(np.count_nonzero(opened <= one.lights.cones[one.row, 1]))


def pairs_in_reach(position: Float64, lights: LightSet) -> int:
    """Return the number of pairs with d < R, of pixels whose position is finite.

    Pixels are taken by small tiles. The bounding box of a tile's positions mostly decides whether a light
    reaches all of them or none; only the other pairs are measured.

    Parameters
    ----------
    position : ndarray of float64, shape (..., 3)
        View space.
    lights : LightSet
        Point lights, or spotlights, whose cones do not count.
    """
    flat = position.reshape(-1, 3)
    known = np.asarray(np.isfinite(flat).all(axis=1))
    tiles = (tile[known[tile]] for tile in tiles_of(position.shape[:-1], PAIRS_TILE))
    return sum(_pairs_of_tile(flat[pixels], lights) for pixels in tiles if len(pixels))


def _pairs_of_tile(position: Float64, lights: LightSet) -> int:
    """Count the pairs of one tile's positions, shape (n, 3)."""
    low, high = position.min(axis=0), position.max(axis=0)
    to_low, to_high = low - lights.positions, lights.positions - high
    nearest = lengths(np.maximum(np.maximum(to_low, to_high), 0.0))
    farthest = lengths(np.maximum(np.abs(to_low), np.abs(to_high)))
    whole = farthest * (1.0 + ROUNDING) < lights.reaches
    partly = np.flatnonzero(~whole & (nearest * (1.0 - ROUNDING) < lights.reaches))
    total = int(np.count_nonzero(whole)) * len(position)
    for first in range(0, len(partly), PAIRS_LIGHTS):
        rows = partly[first : first + PAIRS_LIGHTS]
        offsets = position[:, None] - lights.positions[rows]
        distances = lengths(offsets.reshape(-1, 3)).reshape(offsets.shape[:2])
        total += int(np.count_nonzero(distances < lights.reaches[rows]))
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
