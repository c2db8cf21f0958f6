"""Normals of meshes that have none: smooth where triangles meet at a small angle, sharp elsewhere.

A cube keeps its edges, and a sphere of many triangles looks round. The triangles around a vertex fall into
fans, which end at sharp edges; the corners of a fan share one normal, the mean of its triangles by area.
Vertices at one position count as one, so that neither seams of textures nor the separate triangles of STL
files show.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.groups import Int, connected, row_ids

CREASE_DEGREES = 30.0
"""Edges are smooth up to this angle between the normals of their triangles."""
BY_ANGLE = -1
"""The smoothing group of triangles whose edges are smooth or sharp by their angle."""
FLAT = 0
"""The smoothing group of triangles with sharp edges only."""


def split_at_creases(
    vertices: Float64, triangles: Int, groups: Int | None = None, merge: bool = False
) -> tuple[Int, Int, Float64]:
    """Return which vertex each new vertex copies (k,), the new triangles (m, 3), and the unit normals (k, 3).

    Parameters
    ----------
    vertices : ndarray of float64, shape (n, 3)
    triangles : ndarray of int64, shape (m, 3)
    groups : ndarray of int64, shape (m,), optional
        The smoothing group of each triangle: edges between triangles of one group are smooth and all others
        sharp, but see `FLAT` and `BY_ANGLE`, the group of all triangles when absent.
    merge : bool
        Whether vertices at one position are one vertex, because they differ in nothing else.
    """
    places = row_ids(vertices)
    areas = _area_vectors(vertices, triangles)
    if groups is None:
        groups = np.full(len(triangles), BY_ANGLE)
    fans = connected(triangles.size, *_links(places[triangles], areas, groups))
    shares = np.repeat(areas, 3, axis=0)  # of the corners
    sums = np.stack([np.bincount(fans, shares[:, axis], triangles.size) for axis in range(3)], axis=1)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    normals = np.where(lengths > 0.0, sums / np.where(lengths > 0.0, lengths, 1.0), (0.0, 0.0, 1.0))

    identities = (places if merge else np.arange(len(vertices)))[triangles].ravel()
    _, first, new = np.unique(identities * triangles.size + fans, return_index=True, return_inverse=True)
    return triangles.ravel()[first], new.reshape(-1, 3), normals[fans[first]]


def _area_vectors(vertices: Float64, triangles: Int) -> Float64:
    """Return the normals of triangles times their areas, up to one factor for all of them."""
    _, exponent = np.frexp(np.abs(vertices).max(initial=0.0))  # products of edges must not overflow
    corners = np.ldexp(vertices, -exponent)[triangles]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _links(places: Int, areas: Float64, groups: Int) -> tuple[Int, Int]:
    """Return pairs of corners (0 to 3 m - 1) that share a fan: corners of triangles with a smooth edge."""
    corners = np.arange(places.size).reshape(-1, 3)
    starts, ends = places.ravel(), np.roll(places, -1, axis=1).ravel()
    start_corners, end_corners = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    forwards = starts < ends
    low = np.where(forwards, start_corners, end_corners)
    high = np.where(forwards, end_corners, start_corners)
    keys = np.minimum(starts, ends) * (places.max(initial=0) + 1) + np.maximum(starts, ends)

    order = np.argsort(keys, kind="stable")
    pairs = np.flatnonzero((keys[order][1:] == keys[order][:-1]) & (starts != ends)[order][1:])
    one, other = order[pairs], order[pairs + 1]
    smooth = _is_smooth(areas, groups, one // 3, other // 3)
    one, other = one[smooth], other[smooth]
    return np.concatenate([low[one], high[one]]), np.concatenate([low[other], high[other]])


def _is_smooth(areas: Float64, groups: Int, one: Int, other: Int) -> NDArray[np.bool_]:
    """Return whether the edges between triangles `one` and triangles `other` are smooth."""
    lengths = np.linalg.norm(areas, axis=1, keepdims=True)
    units = np.divide(areas, lengths, out=np.zeros_like(areas), where=lengths > 0.0)
    cosines = (units[one] * units[other]).sum(axis=1)
    near = cosines >= np.cos(np.radians(CREASE_DEGREES)) - 1e-9
    same = (groups[one] == groups[other]) & (groups[one] != FLAT)
    return np.asarray(same & (near | (groups[one] != BY_ANGLE)))
