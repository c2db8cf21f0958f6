"""The twin of ``shaders/include/clusters.glsl``: which lights a pixel's cell holds."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.lights.clusters import BITS, Clusters

Float64 = NDArray[np.float64]


def list_lengths(
    clusters: Clusters, column: NDArray[Any], row: NDArray[Any], y: Float64
) -> NDArray[np.int64]:
    """How many lights are in the cells of some pixels.

    Parameters
    ----------
    column, row : ndarray of int, shape (...,)
        Samples from the left and from the bottom.
    y : ndarray of float64, shape (...,)
        Distances along the view axis; those that are not finite have no cell.
    """
    grid = clusters.grid
    inside, k = _slice(clusters, y)
    lengths = np.zeros(np.shape(y), dtype=np.int64)
    across, up = np.broadcast_to(column // grid.tile, k.shape), np.broadcast_to(row // grid.tile, k.shape)
    every = np.arange(grid.tiles[0])
    for line in np.unique(up[inside]):  # the words of a row of tiles at a time: those of all are many
        before = np.zeros((len(every), clusters.words.shape[1] + 1), dtype=np.int64)
        np.cumsum(np.bitwise_count(cell_words(clusters, every, line)), axis=1, out=before[:, 1:])
        here = inside & (up == line)
        first, end = clusters.first[k[here]], clusters.first[k[here] + 1]
        lengths[here] = before[across[here], end] - before[across[here], first]
    return lengths


def cell_lights(clusters: Clusters, column: int, row: int, y: float) -> NDArray[np.int64]:
    """The lights of one pixel's cell, indices into the set, rising."""
    inside, k = _slice(clusters, np.array(y))
    if not inside:
        return np.zeros(0, dtype=np.int64)
    first, end = int(clusters.first[k]), int(clusters.first[k + 1])
    tile = clusters.grid.tile
    words = cell_words(clusters, np.array(column // tile), np.array(row // tile))[first:end]
    bits = np.unpackbits(words.view(np.uint8), bitorder="little")
    return np.sort(clusters.members[BITS * first : BITS * end][bits.astype(bool)]).astype(np.int64)


def cell_words(clusters: Clusters, column: NDArray[Any], row: NDArray[Any]) -> NDArray[np.uint32]:
    """The words of some columns and rows of tiles, shape (..., words)."""
    one, *others = (clusters.words[line] for line in clusters.grid.places_of(column, row))
    return functools.reduce(np.bitwise_and, others, one)


def _slice(clusters: Clusters, y: Float64) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Whether distances lie in the grid, and in which slice: a slice begins with its nearer edge."""
    edges = clusters.grid.edges
    inside = (y >= edges[0]) & (y <= edges[-1])
    k = np.searchsorted(edges, np.where(inside, y, edges[0]), side="right") - 1
    return inside, np.clip(k, 0, clusters.grid.slices - 1)
