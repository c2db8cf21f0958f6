"""Dots and particles in float64: the light on each, their shadow, and the picture of them in exact order.

The twin of ``shaders/plain.vert`` and ``plain.frag`` (soft round dots, added to the radiance), and of
``particle_light.frag``, ``particles.vert`` and ``particles.frag``.

`exact_sums` gives the shadow of particles: it sums over all of them between a position and the light, one by
one. `slice_sums` and `sliced_light` approximate it by slices as ``particle_shadow_slices.frag``,
``particle_shadow_sums.frag``, ``particle_shadow_blur_*.frag`` and ``include/particle_shadow.glsl`` do: they
differ from the GPU by rounding alone. Places are positions in texels and slices: see
`firefly_sample.plan.particles.shadow`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.shade import OneLight, each_light
from firefly_sample.plan.frame_plan import FramePlan, SpriteSet
from firefly_sample.plan.particles.shadow import ParticleShadowPlan, blur_weights, own_contributions, splats
from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]
Lit = Callable[[Float64, OneLight], Float64]
"""``lit(points, light)``: the share of a light that surfaces let through to points in view space."""

SMALLEST = 1.0
"""Radius in pixels: a smaller dot is drawn in this size and fainter by the same factor."""
MOST_CELLS = 256
"""Cells across all discs, by which positions are sorted."""


# --- The picture ---


@dataclass(frozen=True, eq=False)
class Square:
    """The pixels that a dot may touch.

    Attributes
    ----------
    box : (slice, slice)
        Rows and columns, the first row on top.
    profile : ndarray of float64
        (1 - r^2)^2 of each pixel, r its distance from the centre in radii; 0 outside.
    radius : float
        Scene units: the dot's own, or `SMALLEST` pixels.
    fainter : float
        The factor of its strength.
    """

    box: tuple[slice, slice]
    profile: Float64
    radius: float
    fainter: float


def square_of(view: View, position: Float64, radius: float) -> Square | None:
    """Return the square of a dot at a position in view space, or None if the picture has no pixel of it."""
    lens, (width, height) = view.lens, view.size
    x, y, z = position.tolist()
    if not view.near <= y <= view.far:
        return None  # the dot faces the camera: a plane cuts off all of it or nothing
    w = y if lens.perspective else 1.0
    pixels = radius * lens.c * (height / 2) / max(w, 1e-30)
    grow = max(SMALLEST / max(pixels, 1e-30), 1.0)
    size = radius * grow
    columns = _span(lens.a * x / w + lens.x_offset, lens.a * size / w, width)
    rows = _span(-(lens.c * z / w + lens.z_offset), lens.c * size / w, height)
    if not (columns and rows):
        return None
    ndc_x = (np.arange(columns.start, columns.stop) + 0.5) / (width / 2) - 1.0
    ndc_y = 1.0 - (np.arange(rows.start, rows.stop) + 0.5) / (height / 2)
    across = ((ndc_x - lens.x_offset) / lens.a * w - x) / size
    up = ((ndc_y - lens.z_offset) / lens.c * w - z) / size
    squares: Float64 = np.maximum(1.0 - (across**2 + up[:, None] ** 2), 0.0)
    box = np.s_[rows.start : rows.stop, columns.start : columns.stop]
    return Square(box, squares * squares, size, 1.0 / (grow * grow))


def _span(middle: float, half: float, count: int) -> range:
    """Return the pixels, of `count`, with centres in an interval of NDC, and at most one more per side."""
    low = max(math.floor((max(middle - half, -2.0) + 1.0) * (count / 2) - 0.5), 0)
    high = min(math.ceil((min(middle + half, 2.0) + 1.0) * (count / 2) - 0.5), count - 1)
    return range(low, high + 1)


def sprite_radiance(
    dots: SpriteSet, index: int, view: View, distance: Float64, start: Float64 | None = None
) -> tuple[tuple[slice, slice], Float64] | None:
    """Return the rows and columns that one dot touches, and the radiance that it adds there.

    `distance` is that of the surfaces along the view axis, shape (height, width), infinite where there is
    none. A surface nearer than a dot's centre hides the dot, and so does one at `start`, of the same shape,
    that is not nearer: it is drawn before that surface, not behind.
    """
    position, color = dots.positions[index], dots.colors[index]
    square = square_of(view, position, float(dots.radii[index]))
    if square is None:
        return None
    shown = distance[square.box] >= position[1]
    if start is not None:
        shown &= start[square.box] < position[1]
    strength = np.where(shown, square.profile, 0.0)
    return square.box, strength[..., None] * (color * square.fainter)


def add_sprites(
    radiance: Float64, dots: SpriteSet, view: View, distance: Float64, start: Float64 | None = None
) -> None:
    """Add all dots to the radiance, shape (height, width, 3), first row on top; see `sprite_radiance`."""
    for index in range(len(dots)):
        _add_sprite(radiance, dots, index, view, distance, start)


def _add_sprite(
    radiance: Float64, dots: SpriteSet, index: int, view: View, distance: Float64, start: Float64 | None
) -> None:
    made = sprite_radiance(dots, index, view, distance, start)
    if made is not None:
        box, light = made
        radiance[box] += light


def add_particles(
    radiance: Float64,
    plan: FramePlan,
    distance: Float64,
    light: Float64,
    order: NDArray[np.intp] | None = None,
    start: Float64 | None = None,
) -> None:
    """Draw particles, and the soft dots among them, over a picture from back to front.

    Parameters
    ----------
    radiance, distance : ndarray of float64
        As `add_sprites` takes them.
    light : ndarray of float64, shape (n, 3)
        Of `particle_light`.
    order : ndarray of int, optional
        As in `firefly_sample.plan.particles.ParticleSet`; by exact distance along the view axis when absent.
    start : ndarray of float64, optional
        The distance, of the same shape, behind which they are drawn; minus infinity when absent.
    """
    particles, dots, count = plan.particles, plan.sprites, len(plan.particles)
    if order is None:
        depths = np.concatenate([particles.positions[:, 1], dots.positions[:, 1]])
        order = np.argsort(-depths, kind="stable")
    for index in order.tolist():
        if index >= count:
            _add_sprite(radiance, dots, index - count, plan.view, distance, start)
            continue
        square = square_of(plan.view, particles.drawn[index], float(particles.radii[index]))
        if square is None:
            continue
        middle = float(particles.positions[index, 1])
        before = share_before(distance[square.box], middle, square.radius)
        if start is not None:
            before = np.maximum(before - share_before(start[square.box], middle, square.radius), 0.0)
        depth = particles.optical_depths[index] * square.fainter * square.profile * before
        opacity = -np.expm1(-depth)[..., None]
        radiance[square.box] += opacity * (light[index] - radiance[square.box])


def share_before(distance: Float64, middle: float, radius: float) -> Float64:
    """Return the share of a particle that is before a distance: 0 to 1 as it is crossed."""
    return np.clip(0.5 + 0.5 * (distance - middle) / radius, 0.0, 1.0)


# --- The light on particles ---


def particle_light(plan: FramePlan, lit: Lit | None = None) -> Float64:
    """Return the radiance of each particle in view, shape (n, 3)."""
    particles, shadow = plan.particles, plan.particle_shadow
    position = particles.positions
    total = np.tile(plan.ambient, (len(position), 1))
    left = np.ones((len(position), 3))
    if shadow is not None and len(position):
        sums = exact_sums(shadow, shadow.positions[particles.rows], particles.rows)
        left = np.where((particles.rows >= 0)[:, None], transmittance(shadow, sums), 1.0)
    for one in each_light(plan.lights):
        reached = np.flatnonzero(one.in_reach(position))
        to_light, distance = one.directions(position[reached])
        strength = one.strength(to_light.T, distance, plan.settings)
        if one.lights.shadowed and lit is not None:
            strength = strength * lit(position[reached], one)
        arriving = strength[:, None] * one.lights.colors[one.row]
        if one.lights.particle_shadowed:
            arriving = arriving * left[reached] * particles.attenuations[reached, None]
        total[reached] += arriving
    return np.asarray(total * particles.colors)


# --- The shadow of particles ---


def exact_sums(shadow: ParticleShadowPlan, places: Float64, rows: NDArray[np.intp] | None = None) -> Float64:
    """Return the sum of the strengths of all particles between positions and the light, shape (m, 3).

    Parameters
    ----------
    places : ndarray of float64, shape (m, 3)
        Positions: texels across and up, and slices; NaN gets 0.
    rows : ndarray of int, shape (m,), optional
        The particle at whose centre a position is, -1 for none: it casts no shadow on itself.
    """
    result = np.zeros((len(places), 3))
    if not len(shadow):
        return result
    low = (shadow.positions[:, :2] - shadow.radii[:, None]).min(axis=0)
    high = (shadow.positions[:, :2] + shadow.radii[:, None]).max(axis=0)
    with np.errstate(invalid="ignore"):
        reached = ((places[:, :2] >= low) & (places[:, :2] <= high)).all(axis=1) & (places[:, 2] > -np.inf)
    known = np.flatnonzero(reached)
    if not len(known):
        return result
    # sort positions by cells as wide as the largest disc, row by row: a disc reaches three ranges of cells
    cell = max(float(shadow.radii.max()), float((high - low).max()) / MOST_CELLS)
    grid = np.floor((places[known, :2] - low) / cell).astype(np.int64)
    wide, tall = (grid.max(axis=0) + 3).tolist()
    codes = (grid[:, 1] + 1) * wide + (grid[:, 0] + 1)
    order = known[np.argsort(codes, kind="stable")]
    codes = np.sort(codes)
    x, y, depth = places[order].T.copy()
    own = None if rows is None else rows[order]
    strengths = shadow.strengths.T
    if (strengths == strengths[0]).all():
        strengths = strengths[:1]  # grey: one channel is every channel
    sums = np.zeros((len(strengths), len(order)))
    middle = np.floor((shadow.positions[:, :2] - low) / cell).astype(np.int64) + 1
    starts = np.searchsorted(codes, np.arange(tall * wide + 1))
    discs = zip(middle.tolist(), shadow.positions.tolist(), (shadow.radii**2).tolist(), strict=True)
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
    result[order] = sums.T
    return result


def transmittance(shadow: ParticleShadowPlan, sums: Float64) -> Float64:
    """Return the share of the light that is left after sums of strengths."""
    return np.exp(-sums) if shadow.method == "optical_depth" else np.maximum(1.0 - sums, 0.0)


def slice_sums(shadow: ParticleShadowPlan) -> Float64:
    """Return the texture's contents by slice, shape (slices, tile, tile, 3), first row at the bottom.

    With "optical_depth" and "blend", each slice holds the sum up to its end; with "loop", its own particles
    alone.
    """
    tile, slices = shadow.view.tile, shadow.view.slices
    sums = np.zeros((slices, tile, tile, 3))
    radii, factors = splats(shadow)
    which = np.clip(np.floor(shadow.positions[:, 2]), 0, slices - 1).astype(np.int64)
    for place, index, radius, strength in zip(
        shadow.positions, which, radii, shadow.strengths * factors[:, None], strict=True
    ):
        columns, rows = _texels(place[0], radius, tile), _texels(place[1], radius, tile)
        squares = ((rows + 0.5 - place[1])[:, None] ** 2 + (columns + 0.5 - place[0]) ** 2) / radius**2
        share = np.maximum(1.0 - squares, 0.0) ** 2
        if share.size:
            box = np.s_[index, rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
            sums[box] += share[..., None] * strength
    if shadow.method != "loop":
        sums = np.cumsum(sums, axis=0)
    if shadow.blur > 0.0:
        weights = blur_weights(shadow.blur, shadow.kernel)
        reach = math.ceil(shadow.blur)
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
    shadow: ParticleShadowPlan, sums: Float64, places: Float64, rows: NDArray[np.intp] | None = None
) -> Float64:
    """Return the share of the light that a lookup in `slice_sums` gives at some places, shape (m, 3).

    `places` and `rows` are as `exact_sums` takes them.
    """
    count, tile, slices = len(places), shadow.view.tile, shadow.view.slices
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
    if shadow.method == "loop":
        before = np.zeros((count, 3))
        for back in range(1, min(shadow.reads, slices) + 1):
            before += texels(index - back)
    else:
        before = texels(index - 1)
        here = here - before
    own = np.zeros((count, 3))
    if rows is not None and len(shadow):
        own = np.where((rows >= 0)[:, None], own_contributions(shadow)[rows], 0.0)
    ends = shadow.interpolate | (depth >= slices)
    others = np.maximum(here - own, 0.0) * (depth - index)[:, None]
    left = transmittance(shadow, before + np.where(ends[:, None], others, 0.0))
    return np.where(inside[:, None], left, 1.0)
