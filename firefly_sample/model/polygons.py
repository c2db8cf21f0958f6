"""Polygons cut into triangles, by ears where they are concave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64

Int = NDArray[np.int64]
Point = tuple[float, float]

MOST_CORNERS = 1000
"""Polygons with more corners are cut as if convex: cutting ears takes time with their number squared."""


def cut_faces(faces: Sequence[Sequence[int]], vertices: Float64) -> tuple[Int, Int]:
    """Return the triangles (m, 3) of faces with three corners or more, and the face (m,) of each.

    `faces` are indices of `vertices` (n, 3). They stay in order, and triangles turn as their face does.

    Raises
    ------
    ValueError
        If a face has fewer corners, or one that is not there.
    """
    lengths = np.array([len(face) for face in faces], dtype=np.int64)
    if lengths.min(initial=3) < 3:
        raise ValueError(f"a face has {lengths.min()} corners, and not three or more")
    pieces, owners = [np.zeros((0, 3), dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for length in np.unique(lengths).tolist():
        rows = np.flatnonzero(lengths == length)
        alike = np.array([faces[row] for row in rows.tolist()], dtype=np.int64)
        if alike.min() < 0 or alike.max() >= len(vertices):
            wrong = alike.min() if alike.min() < 0 else alike.max()
            raise ValueError(f"a face uses vertex {wrong} of {len(vertices)}, counted from 0")
        cuts = triangulate(vertices[alike]).reshape(len(alike), -1)
        pieces.append(np.take_along_axis(alike, cuts, axis=1).reshape(-1, 3))
        owners.append(np.repeat(rows, length - 2))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(pieces)[order], owner[order]


def triangulate(points: Float64) -> Int:
    """Return the triangles (n, k - 2, 3), as indices, of n polygons (n, k, 3) without holes.

    Convex polygons become a fan from their first corner. Others lose one ear after another, a corner whose
    triangle lies inside (Meisters, "Polygons have ears", 1975), in the plane of the polygon's mean normal.
    """
    count = points.shape[1]
    cuts = np.tile([(0, k, k + 1) for k in range(1, count - 1)], (len(points), 1, 1))
    if 3 < count <= MOST_CORNERS:
        flat = _in_own_plane(points)
        for row in np.flatnonzero(_are_concave(flat)).tolist():
            cuts[row] = _cut_ears([(x, y) for x, y in flat[row].tolist()]) or cuts[row]
    return cuts


def has_concave(faces: Sequence[Sequence[int]], vertices: Float64) -> bool:
    """Return whether some faces (indices of vertices) are concave."""
    for length in {len(face) for face in faces} - {0, 1, 2, 3}:
        alike = np.array([face for face in faces if len(face) == length], dtype=np.int64)
        if _are_concave(_in_own_plane(vertices[alike])).any():
            return True
    return False


def _are_concave(flat: Float64) -> NDArray[np.bool_]:
    """Return which polygons (n, k, 2) turn right somewhere."""
    before, after = flat - np.roll(flat, 1, axis=1), np.roll(flat, -1, axis=1) - flat
    turns = before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]
    return np.asarray((turns < 0.0).any(axis=1))


def _in_own_plane(points: Float64) -> Float64:
    """Return the corners (n, k, 2) of polygons in their planes, counter-clockwise (Newell's normals)."""
    normals = np.cross(points, np.roll(points, -1, axis=1)).sum(axis=1)
    axis = np.abs(normals).argmax(axis=1)
    up = np.take_along_axis(normals, axis[:, None], axis=1) >= 0.0
    others = np.where(up, (axis[:, None] + [1, 2]) % 3, (axis[:, None] + [2, 1]) % 3)
    return np.take_along_axis(points, others[:, None], axis=2)


def _cut_ears(flat: list[Point]) -> list[tuple[int, int, int]]:
    """Return the triangles of a polygon that turns left; none if it crosses itself and has no ear."""
    left = list(range(len(flat)))
    triangles = []
    while len(left) > 3:
        for place in range(len(left)):
            ear = left[place - 1], left[place], left[(place + 1) % len(left)]
            if _is_ear(flat, left, ear):
                triangles.append(ear)
                del left[place]
                break
        else:
            return []
    return [*triangles, (left[0], left[1], left[2])]


def _is_ear(flat: list[Point], left: list[int], ear: tuple[int, int, int]) -> bool:
    a, b, c = (flat[index] for index in ear)
    return _turn(a, b, c) > 0.0 and not any(
        min(_turn(a, b, point), _turn(b, c, point), _turn(c, a, point)) >= 0.0
        for point in (flat[other] for other in left)
        if point not in (a, b, c)
    )


def _turn(a: Point, b: Point, c: Point) -> float:
    """Return twice the area of a triangle: positive where the path turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
