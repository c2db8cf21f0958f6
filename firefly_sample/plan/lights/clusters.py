"""Find which lights may reach which part of the view: bit masks by screen tile and depth slice.

The view is cut into tiles of some samples a side and into slices of depth; a tile's part of a slice is a
cell. The lights that reach a slice are numbered, and each has one bit in the masks of the slice. A light's
part of a slice lies between two columns of tiles, two rows, and two diagonals of each direction. Only these
lines of tiles have masks: a cell's mask is the bitwise AND of those of its column, row and diagonals, which
the shader computes. Cells have no masks of their own, so they may be small.

    row 2   . . # # . .        column and row alone would keep the corners of the
    row 1   . # # # # .        rectangle around a round light: a fifth of its area;
    row 0   . . # # . .        the diagonals cut them off

Nothing is sorted, no cell has a limit, and a few operations on whole arrays make all masks. Bounds are never
too small: they hold the light's whole part of a slice, and margins cover the rounding of float64 and of a
shader's float32.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.lights.bounds import Bodies, pixel_scales
from firefly_sample.plan.lights.light_set import ROUNDING, LightSet
from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]
Spans = tuple[Float64, Float64]

BITS = 32
"""Of a word of a mask."""
TEXEL = 4
"""Words that a shader fetches at once."""
TILE = 8
"""Samples along a tile's side; a power of two, so that a shader divides exactly."""
DEPTH = 0.04
"""A slice's depth, as a share of the width that the picture's shorter side has there."""
MOST_SLICES = 96
"""A byte numbers them."""
MOST_WORDS = 1 << 22
"""Cells are made larger above this number, 16 MiB to make and upload each frame."""
MOST_RECORDS = 1 << 20
"""Bits, each of which has its light's record in a table: 32 MiB of point lights."""
MOST_A_LINE = TEXEL * 4096
"""Words of a line of tiles, which is a row of a texture that every driver supports."""
THINNEST = 1e-5
"""A slice's least depth, as a share of its distance, so that its edges differ in float32."""
SLACK = 1e-3
"""Share of a distance in view by which a rasterizer may be off on steep surfaces."""
AT_ONCE = 8192
"""Bits whose bounds are found at a time: their columns stay in a core's cache."""
EDGE = 1e-4
"""Share of a tile by which bounds on the screen are widened, for the rounding of positions there."""


@dataclass(frozen=True, eq=False)
class Grid:
    """The tiles and slices into which the view is cut.

    Attributes
    ----------
    tile : int
        Samples along a tile's side.
    tiles : (int, int)
        Across and up, from the lower left corner.
    edges : ndarray of float64, shape (slices + 1,)
        Rising distances along the view axis between slices, each a float32. No surface that a light reaches
        lies before the first or behind the last. The ratios are equal in perspective, where a tile grows
        with the distance, else the steps are.
    """

    tile: int
    tiles: tuple[int, int]
    edges: Float64

    @property
    def slices(self) -> int:
        """The number of slices."""
        return len(self.edges) - 1

    @property
    def first_places(self) -> tuple[int, int, int, int]:
        """The row of masks where tile columns, tile rows, rising and falling diagonals begin.

        Each has one row more than it has lines, in which all bits have ended.
        """
        columns, rows = self.tiles
        return 0, columns + 1, columns + rows + 2, 2 * (columns + rows) + 2

    @property
    def places(self) -> int:
        """The number of rows of masks, of all lines of tiles."""
        return 3 * sum(self.tiles) + 2

    def places_of(self, column: Any, row: Any) -> tuple[Any, Any, Any, Any]:
        """Return the rows of masks of a tile's column, row, rising and falling diagonal."""
        columns, rows, rising, falling = self.first_places
        up = self.tiles[1] - 1 - row
        return columns + column, rows + row, rising + column + row, falling + column + up


@dataclass(frozen=True, eq=False)
class Clusters:
    """The lights of a set by cell.

    Attributes
    ----------
    lights : LightSet
    grid : Grid
    first : ndarray of int64, shape (slices + 1,)
        The first word of each slice, a multiple of `TEXEL`.
    members : ndarray of int32, shape (32 * words,)
        The light of each bit, an index into the set; 0 for unused bits.
    words : ndarray of uint32, shape (places, words)
        The bit masks of tile columns, tile rows, rising and falling diagonals, in the rows that
        `Grid.places_of` gives. A cell's mask is the bitwise AND of its four lines', from its slice's first
        word to the next slice's.
    """

    lights: LightSet
    grid: Grid
    first: NDArray[np.int64]
    members: NDArray[np.int32]
    words: NDArray[np.uint32]


def plan_clusters(
    sets: Iterable[LightSet], view: View, nearest: float, farthest: float
) -> tuple[Clusters, ...]:
    """Return the clusters of all lights that have a position, one for each loop of a shader.

    Parameters
    ----------
    nearest, farthest : float
        Of the geometry in view, along the view axis.
    """
    parts = LightSet.walked_together(lights for lights in sets if lights.kind != "directional")
    if not parts or not nearest <= farthest:
        return ()
    grid = make_grid(parts, view, nearest, farthest)
    return tuple(find_clusters(lights, grid, view) for lights in parts)


def make_grid(sets: Sequence[LightSet], view: View, nearest: float, farthest: float) -> Grid:
    """Return a grid of the distances that lights and surfaces share, as fine as the limits allow.

    Parameters
    ----------
    nearest, farthest : float
        Of the geometry in view, along the view axis.
    """
    perspective = view.lens.perspective
    low, high = _widened(*common_range(sets, view, nearest, farthest), perspective)
    spans = [_shares(lights.spans, low, high, perspective) for lights in sets]
    tile, depth, most, deeper = TILE, DEPTH, MOST_SLICES, True
    while True:
        grid = _cut(view, low, high, tile, depth, most)
        words = [-(-_count(*span, grid.slices) // BITS) + TEXEL * grid.slices for span in spans]
        fits = sum(words) * grid.places <= MOST_WORDS and BITS * sum(words) <= MOST_RECORDS
        if (fits and max(words) <= MOST_A_LINE) or (grid.tiles == (1, 1) and grid.slices == 1):
            return grid
        # in turn, to keep the cells' shape: twice as deep or as wide needs half as many words
        if deeper:
            depth, most = 2.0 * depth, max(most // 2, 1)
        else:
            tile *= 2
        deeper = not deeper


def common_range(
    sets: Sequence[LightSet], view: View, nearest: float, farthest: float
) -> tuple[float, float]:
    """Return the range of distances that lights and surfaces in view share, of length 0 if there is none."""
    spans = [lights.spans for lights in sets]
    first = min((float(low.min(initial=np.inf)) for low, _ in spans), default=0.0)
    last = max((float(high.max(initial=-np.inf)) for _, high in spans), default=0.0)
    # a rasterizer may put fragments of steep surfaces beyond the planes
    deep = view.far - view.near
    near, far = view.near - deep, view.far + deep
    if view.lens.perspective:
        near, far = 0.5 * view.near, 2.0 * view.far
    low = max(nearest - SLACK * abs(nearest), near, first)
    return low, max(min(farthest + SLACK * abs(farthest), far, last), low)


def _widened(low: float, high: float, perspective: bool) -> tuple[float, float]:
    """Return a slightly wider range of distances, finite."""
    if perspective:
        return low * (1.0 - 2.0 * ROUNDING), min(high * (1.0 + 2.0 * ROUNDING), 1e37)
    margin = ROUNDING * max(abs(low), abs(high), high - low, 1e-30)
    return max(low - margin, -1e37), min(high + margin, 1e37)


def _cut(view: View, low: float, high: float, tile: int, depth: float, most: int) -> Grid:
    across, up = view.size
    wide = depth * 2.0 / max(view.lens.a, view.lens.c)
    if view.lens.perspective:
        deep = math.log(high / low)
        slices = _number(deep / wide, deep / THINNEST, most)
        edges = low * (high / low) ** (np.arange(slices + 1) / slices)
    else:
        thinnest = THINNEST * max(abs(low), abs(high))
        slices = _number((high - low) / wide, (high - low) / thinnest, most)
        edges = np.linspace(low, high, slices + 1)
    return Grid(tile, (-(-across // tile), -(-up // tile)), edges.astype(np.float32).astype(np.float64))


def _number(wanted: float, possible: float, most: int) -> int:
    """Return the number of slices, at least one."""
    return max(1, min(math.ceil(min(wanted, 1e6)), math.floor(min(possible, 1e6)), most))


def _shares(spans: Spans, low: float, high: float, perspective: bool) -> Spans:
    """Return the ends of ranges of distances as shares, 0 to 1, of the grid from `low` to `high`."""
    first, last = (np.clip(ends, low, high) for ends in spans)
    if perspective:
        scale = math.log(high / low)
        return np.log(first / low) / scale, np.log(last / low) / scale
    return (first - low) / (high - low), (last - low) / (high - low)


def _count(first: Float64, last: Float64, slices: int) -> int:
    """Return about how many slices all ranges meet together."""
    return int((np.floor(last * slices) - np.floor(first * slices)).sum()) + len(first)


def slices_of(
    edges: Float64, low: Float64, high: Float64, perspective: bool
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first slice that each range of distances meets, and the number of slices that it meets."""
    end = len(edges) - 2
    first, last = (
        np.minimum((shares * (end + 1)).astype(np.intp), end)
        for shares in _shares((low, high), float(edges[0]), float(edges[-1]), perspective)
    )
    # rounding may give a neighbouring slice, so the edges decide; a search would take three times as long
    first += (low >= edges[first + 1]) & (first < end)
    first -= (low < edges[first]) & (first > 0)
    last += (high > edges[last + 1]) & (last < end)
    last -= (high <= edges[last]) & (last > 0)
    meets = (high > edges[0]) & (low < edges[-1])
    return first, np.where(meets, last - first + 1, 0)


def find_clusters(lights: LightSet, grid: Grid, view: View) -> Clusters:
    """Return the cells that each light of a set may reach; spotlights as cones."""
    slices = grid.slices
    first, counts = slices_of(grid.edges, *lights.spans, view.lens.perspective)
    light = np.repeat(np.arange(len(lights)), counts)
    started = np.cumsum(counts) - counts
    slice_of = np.arange(len(light)) - np.repeat(started - first, counts)
    order = np.argsort(slice_of.astype(np.uint8), kind="stable")  # a byte sorts by counting
    light, slice_of = light[order], slice_of[order]
    inside = np.bincount(slice_of, minlength=slices)
    first_word = np.concatenate([[0], np.cumsum(-(-inside // (BITS * TEXEL)))]) * TEXEL
    # the bit of each light of a slice: slices begin with a whole texel
    bit = np.arange(len(light)) - np.repeat(np.cumsum(inside) - inside - BITS * first_word[:-1], inside)
    members = np.zeros(BITS * first_word[-1], dtype=np.int32)
    members[bit] = light
    words = _masks(lights, grid, view, light, slice_of, bit, int(first_word[-1]))
    return Clusters(lights, grid, first_word, members, words)


def _masks(
    lights: LightSet,
    grid: Grid,
    view: View,
    light: NDArray[Any],
    slice_of: NDArray[Any],
    bit: NDArray[Any],
    number: int,
) -> NDArray[np.uint32]:
    """Return `Clusters.words`, with a number of words in each row."""
    columns, rows = grid.tiles
    (x, x0), (z, z0) = ((scale / grid.tile, center / grid.tile) for scale, center in pixel_scales(view))
    # columns, rows and the two diagonals: slopes along X and Z, the line of 0, number of lines, width of one
    lines = (
        (x, 0.0, x0, columns, 1.0),
        (0.0, z, z0, rows, 1.0),
        (x, z, x0 + z0, columns + rows - 1, 2.0),
        (x, -z, x0 - z0 + rows, columns + rows - 1, 2.0),
    )
    words = np.zeros((grid.places, number), dtype=np.uint32)
    flat = words.reshape(-1)
    for first in range(0, len(light), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        near, far = grid.edges[slice_of[part]], grid.edges[slice_of[part] + 1]
        body = Bodies(lights, light[part], near, far, view.lens.perspective)
        word = bit[part] // BITS
        value = np.left_shift(np.uint32(1), (bit[part] & (BITS - 1)).astype(np.uint32))
        for place, (along_x, along_z, center, count, width) in zip(grid.first_places, lines, strict=True):
            least, most = body.bounds(along_x, along_z)
            least += center - width - EDGE + 1.0
            most += center + EDGE + 1.0
            start, end = (np.clip(ends, 0.0, count).astype(np.intp) + place for ends in (least, most))
            # each bit is added once where its range starts and subtracted once where it ends: no carries
            np.add.at(flat, start * number + word, value)
            np.subtract.at(flat, np.maximum(start, end) * number + word, value)
    # all bits have ended in the last row of each kind of lines, so the sums need not begin anew
    for before, after in pairwise(words):
        after += before
    return words
