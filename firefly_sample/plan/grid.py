"""How the view is cut up to find lights: into tiles of some samples a side and into slices of depth.

A tile's part of a slice is a cell. Tiles lie on lines: columns, rows, and diagonals of either kind, each of
which has a place for words of bits: `firefly_sample.plan.lights.clusters`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.lights.bounds import ROUNDING
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]
Spans = tuple[Float64, Float64]

BITS = 32
"""Of a word."""
TILE = 8
"""Samples along a tile's side; a power of two, so that a shader divides exactly."""
MOST_SLICES = 96
"""A byte numbers them."""
DEPTH = 0.04
"""A slice is about as deep as this share of the picture's shorter side is wide, whatever its size."""
MOST_WORDS = 1 << 22
"""Where there would be more, 16 MiB to make and upload each frame, cells are made larger."""
MOST_RECORDS = 1 << 20
"""Bits, each of which has its light's record in a table: 32 MiB of point lights."""
THINNEST = 1e-5
"""Of the distance: a slice's depth, so that edges are some float32 apart and a logarithm finds them."""
TEXEL = 4
"""Words that a shader fetches at once."""
MOST_A_LINE = TEXEL * 4096
"""Words of a line of tiles, which are a row of a texture: every driver has such."""
SLACK = 1e-3
"""Of the distances of what is in view: what a rasterizer may be off where it is steep."""


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

    @property
    def first_places(self) -> tuple[int, int, int, int]:
        """Where columns of tiles, rows, rising and falling diagonals begin among the places of words.

        Each has one place more than it has lines: there all that is on a line has ended.
        """
        columns, rows = self.tiles
        return 0, columns + 1, columns + rows + 2, 2 * (columns + rows) + 2

    @property
    def places(self) -> int:
        """How many, of all lines of tiles."""
        return 3 * sum(self.tiles) + 2

    def places_of(self, column: Any, row: Any) -> tuple[Any, Any, Any, Any]:
        """The places of a tile's column, row, rising and falling diagonal."""
        columns, rows, rising, falling = self.first_places
        up = self.tiles[1] - 1 - row
        return columns + column, rows + row, rising + column + row, falling + column + up


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
        fits = sum(words) * grid.places <= MOST_WORDS and BITS * sum(words) <= MOST_RECORDS
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
