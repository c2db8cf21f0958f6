"""The shadow of particles in float64: exact, and as slices approximate it.

`exact_taken` sums over all particles between a position and the light, one by one. The rest is the twin of
``shaders/particle_shadow_slices.frag``, ``particle_shadow_sums.frag``, ``particle_shadow_blur_*.frag`` and
``include/particle_shadow.glsl``: it differs from the GPU by rounding alone. Positions are in texels and
slices: `firefly_sample.plan.particles.shadow`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.particles.shadow import ParticleShadowPlan, blur_weights, own_contributions, splats

Float64 = NDArray[np.float64]

MOST_CELLS = 256
"""Cells across all discs, by which positions are sorted."""


def exact_taken(
    particle_shadow: ParticleShadowPlan, places: Float64, rows: NDArray[np.intp] | None = None
) -> Float64:
    """Return the sum of the strengths of all particles between positions and the light, shape (m, 3).

    Parameters
    ----------
    places : ndarray of float64, shape (m, 3)
        Positions: texels across and up, and slices; NaN gets 0.
    rows : ndarray of int, shape (m,), optional
        The particle at whose centre a position is, -1 for none: it casts no shadow on itself.
    """
    taken = np.zeros((len(places), 3))
    if not len(particle_shadow):
        return taken
    low = (particle_shadow.positions[:, :2] - particle_shadow.radii[:, None]).min(axis=0)
    high = (particle_shadow.positions[:, :2] + particle_shadow.radii[:, None]).max(axis=0)
    with np.errstate(invalid="ignore"):
        reached = ((places[:, :2] >= low) & (places[:, :2] <= high)).all(axis=1) & (places[:, 2] > -np.inf)
    known = np.flatnonzero(reached)
    if not len(known):
        return taken
    # sort positions by cells as wide as the largest disc, row by row: a disc reaches three ranges of cells
    cell = max(float(particle_shadow.radii.max()), float((high - low).max()) / MOST_CELLS)
    grid = np.floor((places[known, :2] - low) / cell).astype(np.int64)
    wide, tall = (grid.max(axis=0) + 3).tolist()
    codes = (grid[:, 1] + 1) * wide + (grid[:, 0] + 1)
    order = known[np.argsort(codes, kind="stable")]
    codes = np.sort(codes)
    x, y, depth = places[order].T.copy()
    own = None if rows is None else rows[order]
    strengths = particle_shadow.strengths.T
    if (strengths == strengths[0]).all():
        strengths = strengths[:1]  # grey: one channel is every channel
    sums = np.zeros((len(strengths), len(order)))
    middle = np.floor((particle_shadow.positions[:, :2] - low) / cell).astype(np.int64) + 1
    starts = np.searchsorted(codes, np.arange(tall * wide + 1))
    discs = zip(
        middle.tolist(), particle_shadow.positions.tolist(), (particle_shadow.radii**2).tolist(), strict=True
    )
    for row, ((column, line), (u, v, d), square) in enumerate(discs):
        first, last = max(column - 1, 0), min(column + 1, wide - 1)
        if first > last:
            continue
        for there in range(max(line - 1, 0), min(line + 1, tall - 1) + 1):
            part = slice(starts[there * wide + first], starts[there * wide + last + 1])
            if part.start == part.stop:
                continue
            before = depth[part] > d
            if own is not None:
                before &= own[part] != row
            squares = ((x[part] - u) ** 2 + (y[part] - v) ** 2) / square
            share = np.maximum(1.0 - squares, 0.0) ** 2 * before
            sums[:, part] += strengths[:, row, None] * share
    taken[order] = sums.T
    return taken


def light_left(particle_shadow: ParticleShadowPlan, taken: Float64) -> Float64:
    """Return the share of the light that is left after sums of strengths `taken`."""
    return np.exp(-taken) if particle_shadow.method == "optical_depth" else np.maximum(1.0 - taken, 0.0)


def slice_sums(particle_shadow: ParticleShadowPlan) -> Float64:
    """Return the texture's contents by slice, shape (slices, tile, tile, 3), first row at the bottom.

    With "optical_depth" and "blend", each slice holds the sum up to its end; with "loop", its own particles
    alone.
    """
    view = particle_shadow.view
    tile = view.tile
    sums = np.zeros((view.slices, tile, tile, 3))
    radii, factors = splats(particle_shadow)
    which = np.clip(np.floor(particle_shadow.positions[:, 2]), 0, view.slices - 1).astype(np.int64)
    for place, index, radius, strength in zip(
        particle_shadow.positions, which, radii, particle_shadow.strengths * factors[:, None], strict=True
    ):
        columns, rows = _texels(place[0], radius, tile), _texels(place[1], radius, tile)
        squares = ((rows + 0.5 - place[1])[:, None] ** 2 + (columns + 0.5 - place[0]) ** 2) / radius**2
        share = np.maximum(1.0 - squares, 0.0) ** 2
        if share.size:
            box = np.s_[index, rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
            sums[box] += share[..., None] * strength
    if particle_shadow.method != "loop":
        sums = np.cumsum(sums, axis=0)
    if particle_shadow.blur > 0.0:
        weights = blur_weights(particle_shadow.blur, particle_shadow.kernel)
        reach = math.ceil(particle_shadow.blur)
        for axis in (1, 2):
            pads = [(reach, reach) if index == axis else (0, 0) for index in range(4)]
            padded = np.pad(sums, pads)
            sums = sum(
                weight * np.take(padded, np.arange(tile) + index, axis=axis)
                for index, weight in enumerate(weights)
            )
    return np.asarray(sums)


def _texels(middle: float, radius: float, tile: int) -> NDArray[np.int64]:
    """Return the texels whose centres may lie in a disc."""
    low, high = max(math.floor(middle - radius - 0.5), 0), min(math.ceil(middle + radius), tile)
    return np.arange(low, max(high, low))


def sliced_light(
    particle_shadow: ParticleShadowPlan, sums: Float64, places: Float64, rows: NDArray[np.intp] | None = None
) -> Float64:
    """Return the share of the light that a lookup in `slice_sums` gives at some positions, shape (m, 3).

    Parameters
    ----------
    places, rows
        As `exact_taken` takes them.
    """
    view, count = particle_shadow.view, len(places)
    tile, slices = view.tile, view.slices
    inside = (places[:, 2] > 0.0) & ((places[:, :2] >= 0.0) & (places[:, :2] <= tile)).all(axis=1)
    place = np.where(inside[:, None], places, 0.5)
    first = np.floor(place[:, :2] - 0.5).astype(np.int64)
    part = place[:, :2] - 0.5 - first
    depth = np.minimum(place[:, 2], slices)
    index = np.minimum(np.floor(depth).astype(np.int64), slices - 1)
    at = np.clip(np.stack([first, first + 1]), 0, tile - 1)

    def texels(chosen: NDArray[np.int64]) -> Float64:
        found = np.zeros((count, 3))
        for j, i in ((0, 0), (0, 1), (1, 0), (1, 1)):
            weight = np.where(i, part[:, 0], 1.0 - part[:, 0]) * np.where(j, part[:, 1], 1.0 - part[:, 1])
            value = sums[np.maximum(chosen, 0), at[j, :, 1], at[i, :, 0]]
            found += np.where(chosen >= 0, weight, 0.0)[:, None] * value
        return found

    here = texels(index)
    if particle_shadow.method == "loop":
        before = np.zeros((count, 3))
        for back in range(1, min(particle_shadow.reads, slices) + 1):
            before += texels(index - back)
    else:
        before = texels(index - 1)
        here = here - before
    own = np.zeros((count, 3))
    if rows is not None and len(particle_shadow):
        own = np.where((rows >= 0)[:, None], own_contributions(particle_shadow)[rows], 0.0)
    ends = particle_shadow.interpolate | (depth >= slices)
    others = np.maximum(here - own, 0.0) * (depth - index)[:, None]
    left = light_left(particle_shadow, before + np.where(ends[:, None], others, 0.0))
    return np.where(inside[:, None], left, 1.0)
