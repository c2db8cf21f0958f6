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

`cell_masks`, `cell_lights` and `list_lengths` are the float64 twin of ``shaders/include/clusters.glsl``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.lights.bounds import Bodies, pixel_scales
from firefly_sample.plan.lights.light_set import ROUNDING, LightSet
from firefly_sample.plan.view import View
from firefly_sample.scene.arrays import Float64

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
MOST_WORDS_PER_LINE = TEXEL * 4096
"""A line of tiles is a row of a texture that every driver supports."""
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

    No surface that a light reaches lies before the first edge or behind the last. The ratios of edges are
    equal in perspective, where a tile grows with the distance, else the steps are.
    """

    tile: int  # samples along its side
    tiles: tuple[int, int]  # across and up, from the lower left corner
    edges: Float64  # (slices + 1,), rising distances along the view axis between slices, each a float32

    @property
    def slices(self) -> int:
        """The number of slices."""
        return len(self.edges) - 1

    @property
    def first_lines(self) -> tuple[int, int, int, int]:
        """The index of the first tile column, tile row, rising and falling diagonal among all lines of tiles.

        Each direction has one line more than there are tiles along it, in which all bits have ended.
        """
        columns, rows = self.tiles
        return 0, columns + 1, columns + rows + 2, 2 * (columns + rows) + 2

    @property
    def lines(self) -> int:
        """The number of lines of tiles, of all directions."""
        return 3 * sum(self.tiles) + 2

    def lines_of(self, column: Any, row: Any) -> tuple[Any, Any, Any, Any]:
        """Return the indices of a tile's column, row, rising and falling diagonal."""
        columns, rows, rising, falling = self.first_lines
        up = self.tiles[1] - 1 - row
        return columns + column, rows + row, rising + column + row, falling + column + up


@dataclass(frozen=True, eq=False)
class Clusters:
    """The lights of a set by cell."""

    lights: LightSet
    grid: Grid
    first_words: NDArray[np.int64]  # (slices + 1,), where each slice's masks begin, a multiple of `TEXEL`
    members: NDArray[np.int32]  # (32 * words,), each bit's light, an index into the set; 0 for unused bits
    masks: NDArray[np.uint32]  # (lines, words), bit masks of lines of tiles: see `Grid.lines_of`


def plan_clusters(
    sets: Iterable[LightSet], view: View, nearest: float, farthest: float
) -> tuple[Clusters, ...]:
    """Return the clusters of all lights that have a position, one for each loop of a shader.

    `nearest` and `farthest` bound the geometry in view along the view axis.
    """
    parts = LightSet.joined_for_loops(lights for lights in sets if lights.kind != "directional")
    if not parts or not nearest <= farthest:
        return ()
    grid = make_grid(parts, view, nearest, farthest)
    return tuple(find_clusters(lights, grid, view) for lights in parts)


def make_grid(sets: Sequence[LightSet], view: View, nearest: float, farthest: float) -> Grid:
    """Return a grid of the distances that lights and surfaces share, as fine as the limits allow."""
    perspective = view.lens.perspective
    low, high = _widened(*common_range(sets, view, nearest, farthest), perspective)
    spans = [_shares(lights.spans, low, high, perspective) for lights in sets]
    tile, depth, most, deeper = TILE, DEPTH, MOST_SLICES, True
    while True:
        grid = _cut(view, low, high, tile, depth, most)
        words = [-(-_count(*span, grid.slices) // BITS) + TEXEL * grid.slices for span in spans]
        fits = sum(words) * grid.lines <= MOST_WORDS and BITS * sum(words) <= MOST_RECORDS
        if (fits and max(words) <= MOST_WORDS_PER_LINE) or (grid.tiles == (1, 1) and grid.slices == 1):
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
        deep, thinnest = math.log(high / low), THINNEST
    else:
        deep, thinnest = high - low, THINNEST * max(abs(low), abs(high))
    wanted, possible = min(deep / wide, 1e6), min(deep / thinnest, 1e6)
    slices = max(1, min(math.ceil(wanted), math.floor(possible), most))
    if view.lens.perspective:
        edges = low * (high / low) ** (np.arange(slices + 1) / slices)
    else:
        edges = np.linspace(low, high, slices + 1)
    return Grid(tile, (-(-across // tile), -(-up // tile)), edges.astype(np.float32).astype(np.float64))


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
    first, counts = slices_of(grid.edges, *lights.spans, view.lens.perspective)
    light = np.repeat(np.arange(len(lights)), counts)
    started = np.cumsum(counts) - counts
    slice_of = np.arange(len(light)) - np.repeat(started - first, counts)
    order = np.argsort(slice_of.astype(np.uint8), kind="stable")  # a byte sorts by counting
    light, slice_of = light[order], slice_of[order]
    inside = np.bincount(slice_of, minlength=grid.slices)
    first_words = np.concatenate([[0], np.cumsum(-(-inside // (BITS * TEXEL)))]) * TEXEL
    # the bit of each light of a slice: slices begin with a whole texel
    bit = np.arange(len(light)) - np.repeat(np.cumsum(inside) - inside - BITS * first_words[:-1], inside)
    members = np.zeros(BITS * first_words[-1], dtype=np.int32)
    members[bit] = light
    masks = np.zeros((grid.lines, first_words[-1]), dtype=np.uint32)
    for first_bit in range(0, len(light), AT_ONCE):
        part = slice(first_bit, first_bit + AT_ONCE)
        near, far = grid.edges[slice_of[part]], grid.edges[slice_of[part] + 1]
        _mark(masks, grid, view, Bodies(lights, light[part], near, far, view.lens.perspective), bit[part])
    # all bits have ended in the last line of each direction, so the sums need not begin anew
    for before, after in pairwise(masks):
        after += before
    return Clusters(lights, grid, first_words, members, masks)


def _mark(masks: NDArray[np.uint32], grid: Grid, view: View, bodies: Bodies, bit: NDArray[Any]) -> None:
    """Add each body's bit to the line where it begins, and subtract it where it has ended.

    No bit is added twice, so there are no carries.
    """
    columns, rows = grid.tiles
    (x, x0), (z, z0) = ((scale / grid.tile, center / grid.tile) for scale, center in pixel_scales(view))
    # columns, rows and the two diagonals: slopes along X and Z, the line of 0, number of lines, width of one
    directions = (
        (x, 0.0, x0, columns, 1.0),
        (0.0, z, z0, rows, 1.0),
        (x, z, x0 + z0, columns + rows - 1, 2.0),
        (x, -z, x0 - z0 + rows, columns + rows - 1, 2.0),
    )
    flat, number = masks.reshape(-1), masks.shape[1]
    word = bit // BITS
    value = np.left_shift(np.uint32(1), (bit & (BITS - 1)).astype(np.uint32))
    for line, (along_x, along_z, center, count, width) in zip(grid.first_lines, directions, strict=True):
        least, most = bodies.bounds(along_x, along_z)
        least += center - width - EDGE + 1.0
        most += center + EDGE + 1.0
        start, end = (np.clip(ends, 0.0, count).astype(np.intp) + line for ends in (least, most))
        np.add.at(flat, start * number + word, value)
        np.subtract.at(flat, np.maximum(start, end) * number + word, value)


def cell_masks(clusters: Clusters, column: NDArray[Any], row: NDArray[Any]) -> NDArray[np.uint32]:
    """Return the bit masks of some columns and rows of tiles, of all slices, shape (..., words)."""
    one, *others = (clusters.masks[line] for line in clusters.grid.lines_of(column, row))
    return reduce(np.bitwise_and, others, one)


def cell_lights(clusters: Clusters, column: int, row: int, y: float) -> NDArray[np.int64]:
    """Return the lights of one sample's cell, indices into the set, rising; see `list_lengths`."""
    inside, k = _slice(clusters.grid, np.array(y))
    if not inside:
        return np.zeros(0, dtype=np.int64)
    first, end = int(clusters.first_words[k]), int(clusters.first_words[k + 1])
    tile = clusters.grid.tile
    words = cell_masks(clusters, np.array(column // tile), np.array(row // tile))[first:end]
    bits = np.unpackbits(words.view(np.uint8), bitorder="little")
    return np.sort(clusters.members[BITS * first : BITS * end][bits.astype(bool)]).astype(np.int64)


def list_lengths(
    clusters: Clusters, column: NDArray[Any], row: NDArray[Any], y: Float64
) -> NDArray[np.int64]:
    """Return the number of lights in the cells of some samples, shape (...,).

    `column` and `row` count samples from the left and from the bottom, `y` is the distance along the view
    axis; samples where it is not finite have no cell.
    """
    grid = clusters.grid
    inside, k = _slice(grid, y)
    lengths = np.zeros(np.shape(y), dtype=np.int64)
    across, up = np.broadcast_to(column // grid.tile, k.shape), np.broadcast_to(row // grid.tile, k.shape)
    every = np.arange(grid.tiles[0])
    for tile_row in np.unique(up[inside]):  # a row of tiles at a time: the masks of all are many
        before = np.zeros((len(every), clusters.masks.shape[1] + 1), dtype=np.int64)
        np.cumsum(np.bitwise_count(cell_masks(clusters, every, tile_row)), axis=1, out=before[:, 1:])
        here = inside & (up == tile_row)
        first, end = clusters.first_words[k[here]], clusters.first_words[k[here] + 1]
        lengths[here] = before[across[here], end] - before[across[here], first]
    return lengths


def _slice(grid: Grid, y: Float64) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Return whether distances lie in the grid, and in which slice: a slice begins with its nearer edge."""
    inside = (y >= grid.edges[0]) & (y <= grid.edges[-1])
    k = np.searchsorted(grid.edges, np.where(inside, y, grid.edges[0]), side="right") - 1
    return inside, np.clip(k, 0, grid.slices - 1)
