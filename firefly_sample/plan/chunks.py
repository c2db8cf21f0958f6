"""Find the triangles of a Geom that may reach into a convex region, without a look at every vertex.

The triangles are put into chunks of neighbours, each with a box; few chunks are near a small region. Chunks
are made when they are first asked for, and kept as long as their Geom.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.geom import Geom

Float64 = NDArray[np.float64]

CHUNK = 1 << 8
"""Triangles in a chunk."""
TOGETHER = 16
"""Chunks that are looked at together, before more are."""
CELLS = 32
"""Cells along each side of a Geom's box; triangles of a cell are neighbours."""


class _Boxes(NamedTuple):
    """Middles and half sizes of the boxes of chunks, shape (k, 3), at a revision of their Geom."""

    revision: int
    middles: Float64
    halves: Float64


_order: WeakKeyDictionary[Geom, NDArray[np.intp]] = WeakKeyDictionary()
_boxes: WeakKeyDictionary[Geom, _Boxes] = WeakKeyDictionary()


def corners_near(geom: Geom, planes: Float64, touch: float) -> Iterator[Float64]:
    """Yield corners, shape (n, 3, 3), of triangles that have no plane of a region all before them.

    Parameters
    ----------
    geom : Geom
    planes : ndarray of float64, shape (p, 4)
        Rows (nx, ny, nz, d) in the Geom's own space; nx*x + ny*y + nz*z + d > `touch` inside.
    touch : float
    """
    triangles, vertices = geom.triangles, geom.vertices
    if len(triangles) <= CHUNK:
        parts: Any = (slice(None),)
    else:
        order, boxes = _order_of(geom), _boxes_of(geom)
        nearest = boxes.middles @ planes[:, :3].T + boxes.halves @ np.abs(planes[:, :3]).T + planes[:, 3]
        chosen = np.flatnonzero((nearest > touch).all(axis=1))
        starts = range(0, len(chosen), TOGETHER)
        parts = (
            np.concatenate([order[CHUNK * k : CHUNK * (k + 1)] for k in chosen[start : start + TOGETHER]])
            for start in starts
        )
    for part in parts:
        corners = vertices[triangles[part]]
        beyond = corners.reshape(-1, 3) @ planes[:, :3].T + planes[:, 3] <= touch
        yield corners[~beyond.reshape(len(corners), 3, -1).all(axis=1).any(axis=1)]


def _order_of(geom: Geom) -> NDArray[np.intp]:
    """Return indices of triangles, cell by cell. They stay when vertices move, for boxes may overlap."""
    order = _order.get(geom)
    if order is None:
        first = geom.vertices[geom.triangles[:, 0]]
        low, high = geom.bounds
        size = np.where(high > low, high - low, 1.0)
        cells = np.minimum((first - low) / size * CELLS, CELLS - 1).astype(np.uint16)
        keys = cells @ np.array([CELLS * CELLS, CELLS, 1], dtype=np.uint16)
        order = _order[geom] = np.argsort(keys, kind="stable")
    return order


def _boxes_of(geom: Geom) -> _Boxes:
    """Return the boxes of the chunks of `_order_of`."""
    boxes = _boxes.get(geom)
    if boxes is None or boxes.revision != geom.revision:
        indices = geom.triangles[_order_of(geom)].ravel()
        starts = np.arange(0, len(indices), 3 * CHUNK)
        lows, highs = np.empty((2, len(starts), 3))
        for axis in range(3):  # one by one takes a third of the time
            places = np.ascontiguousarray(geom.vertices[:, axis])[indices]
            lows[:, axis] = np.minimum.reduceat(places, starts)
            highs[:, axis] = np.maximum.reduceat(places, starts)
        boxes = _boxes[geom] = _Boxes(geom.revision, 0.5 * (lows + highs), 0.5 * (highs - lows))
    return boxes
