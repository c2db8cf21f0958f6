"""The lists of clusters as texels of two textures of whole numbers: the slices, and the bit masks."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.lights.clusters import MOST_SLICES, TEXEL, Clusters


class ClusterLists(NamedTuple):
    """What a shader needs to find the lights of a pixel's cell.

    Attributes
    ----------
    slices : ndarray of uint32, shape (1, `MOST_SLICES`, 4)
        Of each slice: its nearer and its farther edge, as the bits of float32; its first word, and the next
        slice's. As wide however many there are, so that the texture stays.
    number : int
        Of slices.
    masks : ndarray of uint32, shape (lines, texels, 4)
        Bit masks: a row for each line of tiles; four words are a texel.
    tiling : (int, int, int)
        Samples along a tile's side, tiles across and up.
    first_lines : (int, int, int, int)
        The first one of columns of tiles, rows, rising and falling diagonals.
    slicing : (float, float, float, float)
        From log2 of the distance, orthographic from the distance, to the number of a slice; the first and
        the last edge.
    """

    slices: NDArray[np.uint32]
    number: int
    masks: NDArray[np.uint32]
    tiling: tuple[int, int, int]
    first_lines: tuple[int, int, int, int]
    slicing: tuple[float, float, float, float]


def cluster_lists(clusters: Clusters, perspective: bool) -> ClusterLists:
    """The lists of a set's clusters."""
    grid = clusters.grid
    edges = grid.edges.astype(np.float32)
    bits, first = edges.view(np.uint32), clusters.first_words
    slices = np.zeros((1, MOST_SLICES, 4), dtype=np.uint32)
    slices[0, : grid.slices] = np.stack([bits[:-1], bits[1:], first[:-1], first[1:]], axis=1)
    low, high = (math.log2(edge) if perspective else edge for edge in (grid.edges[0], grid.edges[-1]))
    scale = grid.slices / (high - low)
    return ClusterLists(
        slices,
        grid.slices,
        clusters.masks.reshape(len(clusters.masks), -1, TEXEL),
        (grid.tile, *grid.tiles),
        grid.first_lines,
        (scale, -low * scale, float(edges[0]), float(edges[-1])),
    )
