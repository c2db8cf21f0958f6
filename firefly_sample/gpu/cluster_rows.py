"""The lists of clusters as texels of one texture of whole numbers."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.clusters import Clusters

__all__ = ["ClusterLists", "cluster_lists"]

WIDTH = 2048
"""Texels a row; as in ``shaders/include/clusters.glsl``."""


class ClusterLists(NamedTuple):
    """What a shader needs to find the lights of a pixel's cell.

    Attributes
    ----------
    texels : ndarray of uint32, shape (rows, `WIDTH`)
        Edges of slices, as the bits of float32; their first words; the words.
    tiling : (int, int, int, int)
        Samples along a tile's side, tiles across and up, words a tile.
    parts : (int, int, int)
        Slices; where first words, and where words begin.
    slicing : (float, float, float, float)
        From log2 of the distance, orthographic from the distance, to the number of a slice; the first and
        the last edge.
    """

    texels: NDArray[np.uint32]
    tiling: tuple[int, int, int, int]
    parts: tuple[int, int, int]
    slicing: tuple[float, float, float, float]


def cluster_lists(clusters: Clusters, perspective: bool) -> ClusterLists:
    """The lists of a set's clusters."""
    grid = clusters.grid
    slices, words = grid.slices, clusters.words.shape[2]
    edges = grid.edges.astype(np.float32)
    sections = (
        edges.view(np.uint32),
        clusters.first.astype(np.uint32),
        clusters.words.reshape(-1),
    )
    starts = np.cumsum([len(section) for section in sections])
    texels = np.empty((-(-int(starts[-1]) // WIDTH), WIDTH), dtype=np.uint32)
    np.concatenate(sections, out=texels.reshape(-1)[: starts[-1]])
    low, high = (math.log2(edge) if perspective else edge for edge in (grid.edges[0], grid.edges[-1]))
    scale = slices / (high - low)
    return ClusterLists(
        texels,
        (grid.tile, *grid.tiles, words),
        (slices, int(starts[0]), int(starts[1])),
        (scale, -low * scale, float(edges[0]), float(edges[-1])),
    )
