"""Which lights may reach which part of the view: bits by screen tile and depth slice.

The view is cut into tiles of some pixels a side and into slices of depth; a tile's part of a slice is a
cell. For each slice the lights that reach it are numbered; a cell has one bit for each of them, thirty-two
to a word. Nothing is sorted, no cell has a limit, and what a cell holds is made by a few operations on whole
arrays: a light's part of a slice lies between two columns of tiles, two rows, and two diagonals of either
kind, so that a cell's words are its column's, its row's and its diagonals' words, all of them "and"ed.

    row 2   . . # # . .        column and row alone would keep the corners of the
    row 1   . # # # # .        rectangle around a round light: a fifth of its area;
    row 0   . . # # . .        the diagonals cut them off

What is kept is never too little: bounds are those of the whole part of a slice, and a little more than
float64 and a shader's float32 may be off.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.light_set import LightSet
from firefly_sample.plan.view import View

__all__ = [
    "TILE",
    "Clusters",
    "Grid",
    "common_range",
    "find_clusters",
    "make_grid",
    "plan_clusters",
    "tile_bounds",
]

Float64 = NDArray[np.float64]

BITS = 32
"""Of a word."""
TILE = 16
"""Samples along a tile's side; a power of two, so that a shader divides exactly."""
MOST_SLICES = 96
DEPTH = 1.5
"""A slice is about as deep as this many tiles are wide."""
MOST_WORDS = 1 << 21
"""Where there would be more, 8 MiB to make and upload each frame, cells are made larger."""
MOST_TOGETHER = 32768
"""Lights of one draw: llvmpipe ends a shader's loops after 65,535 turns, and says nothing."""
ROUNDING = 2e-6
"""Of distances, by which everything is taken larger: what a shader's float32 may be off, with room."""
EDGE = 1e-4
"""Of a tile: the same of a light's place on the screen."""
SLANTS = (0.0, 0.3, -0.3, 1.0, -1.0, 3.0, -3.0)
"""How much of the view axis is mixed in where bounds of a cone's part of a slice are looked for."""


@dataclass(frozen=True, eq=False)
class Grid:
    """How the view is cut up.

    Attributes
    ----------
    tile : int
        Samples along a tile's side.
    tiles : (int, int)
        Across and up, from the lower left corner.
    edges : ndarray of float64, shape (slices + 1,)
        Distances along the view axis between slices, rising, each a float32. Nothing that a light reaches
        lies before the first or behind the last. Equal ratios apart in perspective, where a tile grows with
        the distance, else equal steps.
    """

    tile: int
    tiles: tuple[int, int]
    edges: Float64

    @property
    def slices(self) -> int:
        """How many."""
        return len(self.edges) - 1


@dataclass(frozen=True, eq=False)
class Clusters:
    """The lights of a set by cell.

    Attributes
    ----------
    lights : LightSet
    grid : Grid
    first : ndarray of int64, shape (slices + 1,)
        The first word of each slice.
    members : ndarray of int32, shape (32 * words,)
        The light of each bit, an index into the set; 0 for bits that no cell has.
    words : ndarray of uint32, shape (rows of tiles, columns of tiles, words)
        A cell's bits are those of its tile, between its slice's first word and the next slice's.
    """

    lights: LightSet
    grid: Grid
    first: NDArray[np.int64]
    members: NDArray[np.int32]
    words: NDArray[np.uint32]


def plan_clusters(
    sets: Iterable[LightSet], view: View, nearest: float, farthest: float
) -> tuple[Clusters, ...]:
    """The clusters of all lights that have a place, those together that one shader can walk.

    Parameters
    ----------
    nearest, farthest : float
        Of the geometry in view, along the view axis.
    """
    alike = LightSet.alike(lights for lights in sets if lights.kind != "directional")
    alike = [part for lights in alike for part in lights.parts(MOST_TOGETHER)]
    if not alike or not nearest <= farthest:
        return ()
    grid = make_grid(alike, view, nearest, farthest)
    return tuple(find_clusters(lights, grid, view) for lights in alike)


def make_grid(
    sets: Sequence[LightSet], view: View, nearest: float, farthest: float, tile: int = TILE
) -> Grid:
    """Cut up what both lights and surfaces are in, as finely as there is room for.

    Parameters
    ----------
    nearest, farthest : float
        Of the geometry in view, along the view axis.
    tile : int
        Samples along a tile's side, if there is room.
    """
    spans = [_distances(lights) for lights in sets]
    low, high = _widened(*_common(spans, view, nearest, farthest), view.lens.perspective)
    depth, most = DEPTH, MOST_SLICES
    while True:
        grid = _cut(view, low, high, tile, depth, most)
        words = sum(-(-int(_slices_of(grid, *span)[1].sum()) // BITS) + grid.slices // 2 for span in spans)
        if words * math.prod(grid.tiles) <= MOST_WORDS or grid.tiles == (1, 1):
            return grid
        # in turn, to keep cells in shape: twice as deep is half as many words, twice as wide a quarter
        if depth < 2.0 * DEPTH:
            depth, most = 2.0 * depth, max(most // 2, 1)
        else:
            tile, depth = 2 * tile, DEPTH


def common_range(
    sets: Sequence[LightSet], view: View, nearest: float, farthest: float
) -> tuple[float, float]:
    """The distances that both what lights reach and what is in view have; a range of length 0 where none."""
    return _common([_distances(lights) for lights in sets], view, nearest, farthest)


def _common(
    spans: Sequence[tuple[Float64, Float64]], view: View, nearest: float, farthest: float
) -> tuple[float, float]:
    first = min((float(low.min(initial=np.inf)) for low, _ in spans), default=0.0)
    last = max((float(high.max(initial=-np.inf)) for _, high in spans), default=0.0)
    low = max(nearest, view.near, first)
    return low, max(min(farthest, view.far, last), low)


def _widened(low: float, high: float, perspective: bool) -> tuple[float, float]:
    """A little more than a range of distances, and finite."""
    if perspective:
        return low * (1.0 - 2.0 * ROUNDING), min(high * (1.0 + 2.0 * ROUNDING), 1e37)
    margin = ROUNDING * max(abs(low), abs(high), high - low, 1e-30)
    return max(low - margin, -1e37), min(high + margin, 1e37)


def _cut(view: View, low: float, high: float, tile: int, depth: float, most: int) -> Grid:
    across, up = view.size
    wide = 2.0 * tile / (across * view.lens.a)
    if view.lens.perspective:
        slices = int(np.clip(math.ceil(math.log(high / low) / (depth * wide)), 1, most))
        edges = low * (high / low) ** (np.arange(slices + 1) / slices)
    else:
        slices = int(np.clip(math.ceil(min((high - low) / (depth * wide), 1e6)), 1, most))
        edges = np.linspace(low, high, slices + 1)
    return Grid(tile, (-(-across // tile), -(-up // tile)), edges.astype(np.float32).astype(np.float64))


def _slices_of(grid: Grid, low: Float64, high: Float64) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first slice that each range of distances meets, and how many."""
    first = np.searchsorted(grid.edges, low, side="right") - 1
    last = np.searchsorted(grid.edges, high, side="left") - 1
    meets = (last >= 0) & (first < grid.slices)
    first, last = np.clip(first, 0, grid.slices - 1), np.clip(last, 0, grid.slices - 1)
    return first, np.where(meets, last - first + 1, 0)


def find_clusters(lights: LightSet, grid: Grid, view: View) -> Clusters:
    """The cells that each light of a set may reach; spotlights as cones."""
    slices = grid.slices
    first, counts = _slices_of(grid, *_distances(lights))
    light = np.repeat(np.arange(len(lights), dtype=np.int32), counts)
    started = np.cumsum(counts) - counts
    slice_of = np.arange(len(light)) - np.repeat(started - first, counts)
    order = np.argsort(slice_of.astype(np.uint8 if slices <= 256 else np.uint16), kind="stable")
    light, slice_of = light[order], slice_of[order]
    inside = np.bincount(slice_of, minlength=slices)
    words = -(-inside // BITS)
    first_word = np.concatenate([[0], np.cumsum(words)])
    # where each light of a slice is among the bits: slices begin with a whole word
    bit = np.arange(len(light)) - np.repeat(np.cumsum(inside) - inside - BITS * first_word[:-1], inside)
    members = np.zeros(BITS * first_word[-1], dtype=np.int32)
    members[bit] = light
    return Clusters(lights, grid, first_word, members, _words(lights, grid, view, light, slice_of, bit))


def _words(
    lights: LightSet,
    grid: Grid,
    view: View,
    light: NDArray[Any],
    slice_of: NDArray[Any],
    bit: NDArray[Any],
) -> NDArray[np.uint32]:
    near, far = grid.edges[slice_of], grid.edges[slice_of + 1]
    columns, rows = grid.tiles
    size = -(-(int(bit[-1]) + 1) // BITS) * BITS if len(bit) else 0
    (x, x0), (z, z0) = ((scale / grid.tile, center / grid.tile) for scale, center in _pixels(view))
    # along columns, rows, and the two diagonals: which way, where 0 is, how many places, how wide each is
    ways = (
        (x, 0.0, x0, columns, 1.0),
        (0.0, z, z0, rows, 1.0),
        (x, z, x0 + z0, columns + rows - 1, 2.0),
        (x, -z, x0 - z0 + rows, columns + rows - 1, 2.0),
    )
    body = _Bodies(lights, light, near, far, view.lens.perspective)
    planes = []
    for along_x, along_z, center, count, width in ways:
        least, most = body.bounds(along_x, along_z)
        start = np.clip(np.floor(center + least - width - EDGE) + 1.0, 0, count).astype(np.int32)
        end = np.clip(np.floor(center + most + EDGE), -1, count - 1).astype(np.int32)
        planes.append(_bits(start, end, count, bit, size))
    column, row, rising, falling = planes
    across, up = np.arange(columns), np.arange(rows)[:, None]
    words = row[:, None] & column[None]
    words &= rising[across + up]
    words &= falling[across - up + rows - 1]
    return words


def _bits(
    first: NDArray[Any], last: NDArray[Any], count: int, bit: NDArray[Any], size: int
) -> NDArray[np.uint32]:
    """For each of `count` places the words of those whose range holds it, shape (count, words)."""
    small: Any = np.uint8 if count < 255 else np.uint16
    low = np.ones(size, dtype=small)
    high = np.zeros(size, dtype=small)
    low[bit], high[bit] = first + 1, last + 1  # place 0 is 1, so that 0 is before all
    places = np.arange(1, count + 1, dtype=small)[:, None]
    held = (places >= low) & (places <= high)
    return np.packbits(held, axis=1, bitorder="little").view("<u4")


def _distances(lights: LightSet) -> tuple[Float64, Float64]:
    """From where to where along the view axis each light may reach."""
    reach = _reaches(lights)
    y = lights.positions[:, 1]
    if lights.kind != "spot":
        return y - reach, y + reach
    forward = np.array([0.0, 1.0, 0.0])
    high = y + reach * _share(lights.directions @ forward, lights.cones[:, 1])
    low = y - reach * _share(lights.directions @ -forward, lights.cones[:, 1])
    return low, high


def _reaches(lights: LightSet) -> Float64:
    """The reaches, a little longer, as what float32 may be off needs it; finite."""
    size = np.abs(lights.positions).max(axis=1, initial=0.0)
    return np.asarray(np.minimum(lights.reaches * (1.0 + ROUNDING) + ROUNDING * size, 1e150))


def _share(cosine: Float64, opening: Float64) -> Float64:
    """How far a spherical sector of radius 1 goes along a unit vector with this cosine to its axis.

    1 where the vector lies within the cone; else the rim's, the cosine of the angle to the cone's side; 0,
    the tip's, where even that is beyond a right angle. A little more than that, as angles are rounded.
    """
    within = 1.0 - np.clip(opening, 0.0, 2.0)
    sine = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))
    side = np.sqrt(np.maximum(1.0 - within * within, 0.0))
    rim = np.maximum(cosine * within + sine * side, 0.0)
    return np.asarray(np.where(cosine >= within - 1e-9, 1.0, np.minimum(rim + 1e-6, 1.0)))


class _Bodies:
    """Parts of lights' balls, or cones, between two distances."""

    def __init__(self, lights: LightSet, light: NDArray[Any], near: Float64, far: Float64, perspective: bool):
        self._perspective = perspective
        self._near, self._far = near, far
        self._places = lights.positions[light]
        self._reach = _reaches(lights)[light]
        y = self._places[:, 1]
        away = np.maximum(np.maximum(near - y, y - far), 0.0)
        self._radius = np.sqrt(np.maximum((self._reach - away) * (self._reach + away), 0.0))
        self._axes = lights.directions[light] if lights.kind == "spot" else None
        self._openings = lights.cones[light, 1]

    def bounds(self, x: float, z: float) -> tuple[Float64, Float64]:
        """The least and the largest value of ``x*X/Y + z*Z/Y``, orthographic ``x*X + z*Z``; not too tight."""
        most = self._slope(self._support(x, z))
        least = -self._slope(self._support(-x, -z))
        return np.clip(least, -1e9, 1e9), np.clip(most, -1e9, 1e9)

    def _slope(self, value: Float64) -> Float64:
        if not self._perspective:
            return value
        return value / np.where(value >= 0.0, self._near, self._far)

    def _support(self, x: float, z: float) -> Float64:
        """The largest value of ``x*X + z*Z``."""
        length = math.hypot(x, z)
        across = self._places[:, 0] * x + self._places[:, 2] * z
        largest = across + self._radius * length
        if self._axes is None:
            return np.asarray(largest)
        # A sum of half-spaces: for any s, x*X + z*Z = (x*X + s*Y + z*Z) - s*Y, whose first part is the whole
        # cone's largest and whose second is known from the slice. The least of some such bounds is one, too.
        for slant in SLANTS:
            s = slant * length
            n = np.array([x, s, z])
            size = float(np.linalg.norm(n))
            share = _share(self._axes @ n / size, self._openings)
            whole = across + s * self._places[:, 1] + self._reach * size * share
            largest = np.minimum(largest, whole - s * (self._near if s >= 0.0 else self._far))
        return np.asarray(largest)


def _pixels(view: View) -> tuple[tuple[float, float], tuple[float, float]]:
    """Samples a slope (orthographic: a unit), and the sample of 0, across and up."""
    lens, (width, height) = view.lens, view.size
    across = 0.5 * width * lens.a, 0.5 * width * (1.0 + lens.x_offset)
    return across, (0.5 * height * lens.c, 0.5 * height * (1.0 + lens.z_offset))


def tile_bounds(lights: LightSet, view: View, axis: int) -> tuple[Float64, Float64]:
    """From where to where each light may reach on the screen, in samples across (axis 0) or up (1)."""
    low, high = _distances(lights)
    low = np.maximum(low, view.near)
    body = _Bodies(lights, np.arange(len(lights)), low, np.maximum(high, low), view.lens.perspective)
    scale, center = _pixels(view)[axis]
    least, most = body.bounds(*((scale, 0.0) if axis == 0 else (0.0, scale)))
    return center + least, center + most
