"""Which lights may reach which part of the view: bits by screen tile and depth slice.

The view is cut into tiles of some pixels a side and into slices of depth; a tile's part of a slice is a
cell. For each slice the lights that reach it are numbered; a cell has one bit for each of them, thirty-two
to a word. A light's part of a slice lies between two columns of tiles, two rows, and two diagonals of either
kind, so that a cell's words are its column's, its row's and its diagonals' words, all of them "and"ed. Only
these lines have words, which a shader "and"s: no cell has words of its own, so that cells may be small.

    row 2   . . # # . .        column and row alone would keep the corners of the
    row 1   . # # # # .        rectangle around a round light: a fifth of its area;
    row 0   . . # # . .        the diagonals cut them off

Nothing is sorted, no cell has a limit, and a few operations on whole arrays make all words.

What is kept is never too little: bounds are those of the whole part of a slice, and a little more than
float64 and a shader's float32 may be off.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.light_bounds import ROUNDING, Bodies, pixel_scales
from firefly_sample.plan.light_set import LightSet
from firefly_sample.plan.view import View

__all__ = [
    "BITS",
    "MOST_SLICES",
    "TEXEL",
    "TILE",
    "Clusters",
    "Grid",
    "common_range",
    "find_clusters",
    "first_places",
    "lines_of",
    "make_grid",
    "plan_clusters",
    "slices_of",
]

Float64 = NDArray[np.float64]
Spans = tuple[Float64, Float64]

BITS = 32
"""Of a word."""
TILE = 8
"""Samples along a tile's side; a power of two, so that a shader divides exactly."""
MOST_SLICES = 96
DEPTH = 0.04
"""A slice is about as deep as this share of the picture's shorter side is wide, whatever its size."""
MOST_WORDS = 1 << 22
"""Where there would be more, 16 MiB to make and upload each frame, cells are made larger."""
MOST_RECORDS = 1 << 20
"""Bits, each of which has its light's record in a table: 48 MiB of most lights."""
THINNEST = 1e-5
"""Of the distance: a slice's depth, so that edges are some float32 apart and a logarithm finds them."""
TEXEL = 4
"""Words that a shader fetches at once."""
MOST_A_LINE = TEXEL * 4096
"""Words of a line of tiles, which are a row of a texture: every driver has such."""
SLACK = 1e-3
"""Of the distances of what is in view: what a rasterizer may be off where it is steep."""
AT_ONCE = 8192
"""Bits whose bounds are found at a time: their columns stay in a core's cache."""
EDGE = 1e-4
"""Of a tile, by which bounds on the screen are wider: what rounding may move a light's place there."""


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
        The first word of each slice, a multiple of `TEXEL`.
    members : ndarray of int32, shape (32 * words,)
        The light of each bit, an index into the set; 0 for bits that no cell has.
    words : ndarray of uint32, shape (places, words)
        By column of tiles, row, rising and falling diagonal, one after the other; `lines_of` says where. A
        cell's words are those of its four lines, "and"ed, from its slice's first word to the next slice's.
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
    parts = LightSet.walked_together(lights for lights in sets if lights.kind != "directional")
    if not parts or not nearest <= farthest:
        return ()
    grid = make_grid(parts, view, nearest, farthest)
    return tuple(find_clusters(lights, grid, view) for lights in parts)


def make_grid(sets: Sequence[LightSet], view: View, nearest: float, farthest: float) -> Grid:
    """Cut up what both lights and surfaces are in, as finely as there is room for.

    Parameters
    ----------
    nearest, farthest : float
        Of the geometry in view, along the view axis.
    """
    perspective = view.lens.perspective
    low, high = _widened(*common_range(sets, view, nearest, farthest), perspective)
    spans = [_in_range(lights.spans, low, high, perspective) for lights in sets]
    tile, depth, most, deeper = TILE, DEPTH, MOST_SLICES, True
    while True:
        grid = _cut(view, low, high, tile, depth, most)
        words = [-(-_count(*span, grid.slices) // BITS) + TEXEL * grid.slices for span in spans]
        fits = sum(words) * first_places(grid.tiles)[-1] <= MOST_WORDS and BITS * sum(words) <= MOST_RECORDS
        if (fits and max(words) <= MOST_A_LINE) or (grid.tiles == (1, 1) and grid.slices == 1):
            return grid
        # in turn, to keep cells in shape: twice as deep or as wide is half as many words
        if deeper:
            depth, most = 2.0 * depth, max(most // 2, 1)
        else:
            tile *= 2
        deeper = not deeper


def common_range(
    sets: Sequence[LightSet], view: View, nearest: float, farthest: float
) -> tuple[float, float]:
    """The distances that both what lights reach and what is in view have; a range of length 0 where none."""
    spans = [lights.spans for lights in sets]
    first = min((float(low.min(initial=np.inf)) for low, _ in spans), default=0.0)
    last = max((float(high.max(initial=-np.inf)) for _, high in spans), default=0.0)
    near, far = _drawn_range(view)
    low = max(nearest - SLACK * abs(nearest), near, first)
    return low, max(min(farthest + SLACK * abs(farthest), far, last), low)


def _drawn_range(view: View) -> tuple[float, float]:
    """Between which distances surfaces come out of a rasterizer: what is steep, also beyond the planes."""
    if view.lens.perspective:
        return 0.5 * view.near, 2.0 * view.far
    deep = view.far - view.near
    return view.near - deep, view.far + deep


def _widened(low: float, high: float, perspective: bool) -> tuple[float, float]:
    """A little more than a range of distances, and finite."""
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
    """Of slices, at least one."""
    return max(1, min(math.ceil(min(wanted, 1e6)), math.floor(min(possible, 1e6)), most))


def _in_range(spans: Spans, low: float, high: float, perspective: bool) -> Spans:
    """Where ranges of distances begin and end in a range that is cut evenly, as shares of it."""
    first, last = (np.clip(ends, low, high) for ends in spans)
    if perspective:
        scale = math.log(high / low)
        return np.log(first / low) / scale, np.log(last / low) / scale
    return (first - low) / (high - low), (last - low) / (high - low)


def _count(first: Float64, last: Float64, slices: int) -> int:
    """About how many slices all ranges meet together."""
    return int((np.floor(last * slices) - np.floor(first * slices)).sum()) + len(first)


def slices_of(
    edges: Float64, low: Float64, high: Float64, perspective: bool
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first slice that each range of distances meets, and how many: of a grid with these edges."""
    end = len(edges) - 2
    first, last = (
        np.minimum((shares * (end + 1)).astype(np.intp), end)
        for shares in _in_range((low, high), float(edges[0]), float(edges[-1]), perspective)
    )
    # a slice beside, by rounding: the edges themselves decide (and searching them takes three times as long)
    first += (low >= edges[first + 1]) & (first < end)
    first -= (low < edges[first]) & (first > 0)
    last += (high > edges[last + 1]) & (last < end)
    last -= (high <= edges[last]) & (last > 0)
    meets = (high > edges[0]) & (low < edges[-1])
    return first, np.where(meets, last - first + 1, 0)


def find_clusters(lights: LightSet, grid: Grid, view: View) -> Clusters:
    """The cells that each light of a set may reach; spotlights as cones."""
    slices = grid.slices
    first, counts = slices_of(grid.edges, *lights.spans, view.lens.perspective)
    light = np.repeat(np.arange(len(lights)), counts)
    started = np.cumsum(counts) - counts
    slice_of = np.arange(len(light)) - np.repeat(started - first, counts)
    order = np.argsort(slice_of.astype(np.uint8 if slices <= 256 else np.uint16), kind="stable")
    light, slice_of = light[order], slice_of[order]
    inside = np.bincount(slice_of, minlength=slices)
    first_word = np.concatenate([[0], np.cumsum(-(-inside // (BITS * TEXEL)))]) * TEXEL
    # where each light of a slice is among the bits: slices begin with a whole texel
    bit = np.arange(len(light)) - np.repeat(np.cumsum(inside) - inside - BITS * first_word[:-1], inside)
    members = np.zeros(BITS * first_word[-1], dtype=np.int32)
    members[bit] = light
    words = _words(lights, grid, view, light, slice_of, bit, int(first_word[-1]))
    return Clusters(lights, grid, first_word, members, words)


def _words(
    lights: LightSet,
    grid: Grid,
    view: View,
    light: NDArray[Any],
    slice_of: NDArray[Any],
    bit: NDArray[Any],
    number: int,
) -> NDArray[np.uint32]:
    """The words of `Clusters`, so many a place."""
    columns, rows = grid.tiles
    (x, x0), (z, z0) = ((scale / grid.tile, center / grid.tile) for scale, center in pixel_scales(view))
    *firsts, places = first_places(grid.tiles)
    # along columns, rows, and the two diagonals: which way, where 0 is, how many places, how wide each is
    ways = (
        (x, 0.0, x0, columns, 1.0),
        (0.0, z, z0, rows, 1.0),
        (x, z, x0 + z0, columns + rows - 1, 2.0),
        (x, -z, x0 - z0 + rows, columns + rows - 1, 2.0),
    )
    words = np.zeros((places, number), dtype=np.uint32)
    flat = words.reshape(-1)
    for first in range(0, len(light), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        near, far = grid.edges[slice_of[part]], grid.edges[slice_of[part] + 1]
        body = Bodies(lights, light[part], near, far, view.lens.perspective)
        word = bit[part] // BITS
        value = np.left_shift(np.uint32(1), (bit[part] & (BITS - 1)).astype(np.uint32))
        for place, (along_x, along_z, center, count, width) in zip(firsts, ways, strict=True):
            least, most = body.bounds(along_x, along_z)
            least += center - width - EDGE + 1.0
            most += center + EDGE + 1.0
            start, end = (np.clip(ends, 0.0, count).astype(np.intp) + place for ends in (least, most))
            # added where a range starts and taken away where it ends: once each, so that nothing carries
            np.add.at(flat, start * number + word, value)
            np.subtract.at(flat, np.maximum(start, end) * number + word, value)
    # where one kind of lines ends all bits have ended: the next begins with none
    for before, after in pairwise(words):
        after += before
    return words


def lines_of(grid: Grid, column: Any, row: Any) -> tuple[Any, Any, Any, Any]:
    """The places of a tile's column, row, rising and falling diagonal among the words of `Clusters`."""
    columns, rows, rising, falling, _ = first_places(grid.tiles)
    up = grid.tiles[1] - 1 - row
    return columns + column, rows + row, rising + column + row, falling + column + up


def first_places(tiles: tuple[int, int]) -> tuple[int, int, int, int, int]:
    """Where columns, rows and both kinds of diagonals begin, each with one place more; then the end."""
    columns, rows = tiles
    return 0, columns + 1, columns + rows + 2, 2 * (columns + rows) + 2, 3 * (columns + rows) + 2
