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

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.grid import BITS, TEXEL, Grid, make_grid, slices_of
from firefly_sample.plan.lights.bounds import Bodies, pixel_scales
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.view import View

AT_ONCE = 8192
"""Bits whose bounds are found at a time: their columns stay in a core's cache."""
EDGE = 1e-4
"""Of a tile, by which bounds on the screen are wider: what rounding may move a light's place there."""


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
        By column of tiles, row, rising and falling diagonal, where `Grid.places_of` says. A cell's words are
        those of its four lines, "and"ed, from its slice's first word to the next slice's.
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


def find_clusters(lights: LightSet, grid: Grid, view: View) -> Clusters:
    """The cells that each light of a set may reach; spotlights as cones."""
    slices = grid.slices
    first, counts = slices_of(grid.edges, *lights.spans, view.lens.perspective)
    light = np.repeat(np.arange(len(lights)), counts)
    started = np.cumsum(counts) - counts
    slice_of = np.arange(len(light)) - np.repeat(started - first, counts)
    order = np.argsort(slice_of.astype(np.uint8), kind="stable")  # a byte sorts by counting
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
    # along columns, rows, and the two diagonals: which way, where 0 is, how many places, how wide each is
    ways = (
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
        for place, (along_x, along_z, center, count, width) in zip(grid.first_places, ways, strict=True):
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
