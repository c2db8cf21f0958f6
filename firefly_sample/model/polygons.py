"""Polygons cut into triangles, by ears where they are concave."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64

Int = NDArray[np.int64]


MOST_CORNERS = 1000
"""Polygons with more corners are cut as if convex: cutting ears takes time with their number squared."""


def cut_faces(faces: Int | Sequence[Sequence[int]], vertices: Float64) -> tuple[Int, Int]:
    """Return the triangles (m, 3) of faces with three corners or more, and the face (m,) of each.

    `faces` are indices of `vertices` (n, 3), an array or lists of different lengths. They stay in order.

    Raises
    ------
    ValueError
        If a face has fewer corners, or one that is not there.
    """
    lengths = np.array([len(face) for face in faces], dtype=np.int64)
    if len(lengths) and lengths.min() < 3:
        raise ValueError(f"a face has {lengths.min()} corners, and not three or more")
    pieces, owners = [], []
    for length in np.unique(lengths).tolist():
        rows = np.flatnonzero(lengths == length)
        alike = np.array(faces if len(rows) == len(faces) else [faces[row] for row in rows.tolist()])
        alike = alike.astype(np.int64)
        if alike.min() < 0 or alike.max() >= len(vertices):
            wrong = alike.min() if alike.min() < 0 else alike.max()
            raise ValueError(f"a face uses vertex {wrong} of {len(vertices)}, counted from 0")
        cuts = _cuts(vertices[alike])
        pieces.append(np.take_along_axis(alike, cuts.reshape(len(alike), -1), axis=1).reshape(-1, 3))
        owners.append(np.repeat(rows, length - 2))
    owner = np.concatenate([np.zeros(0, dtype=np.int64), *owners])
    order = np.argsort(owner, kind="stable")
    return np.concatenate([np.zeros((0, 3), dtype=np.int64), *pieces])[order], owner[order]


def _cuts(points: Float64) -> Int:
    """Return the triangles (n, k - 2, 3) of each of many polygons (n, k, 3)."""
    count = points.shape[1]
    if count == 3:
        return np.broadcast_to([0, 1, 2], (len(points), 1, 3))
    if count == 4:
        return split_quads(points)
    return np.array([triangulate(polygon) for polygon in points])


def split_quads(points: Float64) -> Int:
    """Return the two triangles (n, 2, 3), as indices 0 to 3, of each of many quads (n, 4, 3).

    They share the diagonal from the first corner, unless the quad is concave and that lies outside.
    """
    normals = np.cross(points[:, 2] - points[:, 0], points[:, 3] - points[:, 1])
    one = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    other = np.cross(points[:, 2] - points[:, 0], points[:, 3] - points[:, 0])
    inside = ((one * normals).sum(axis=1) >= 0.0) & ((other * normals).sum(axis=1) >= 0.0)
    return np.where(inside[:, None, None], [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]])


def triangulate(points: Float64) -> list[tuple[int, int, int]]:
    """Return triangles, as indices, that fill a polygon (n, 3) without holes, in its sense of rotation.

    Convex polygons become a fan from their first corner. Others lose one ear after another, a corner whose
    triangle lies inside (Meisters, "Polygons have ears", 1975), in the plane of the polygon's mean normal.
    """
    count = len(points)
    fan = [(0, k, k + 1) for k in range(1, count - 1)]
    if count == 3:
        return fan
    flat = _in_own_plane(points)
    turns = _turns(flat[np.arange(count) - 1], flat, flat[(np.arange(count) + 1) % count])
    if (turns >= 0.0).all() or count > MOST_CORNERS:
        return fan
    return _cut_ears([(float(x), float(y)) for x, y in flat]) or fan


def _in_own_plane(points: Float64) -> Float64:
    """Return a polygon's corners (n, 2) in its plane, counter-clockwise (normal by Newell's method)."""
    following = np.roll(points, -1, axis=0)
    normal = np.cross(points, following).sum(axis=0)
    axis = int(np.abs(normal).argmax())
    others = [(axis + 1) % 3, (axis + 2) % 3]
    return points[:, others if normal[axis] >= 0.0 else others[::-1]]


def _turns(before: Float64, corner: Float64, after: Float64) -> Float64:
    """Return twice the signed areas of triangles in the plane: positive where the path turns left."""
    first, second = corner - before, after - corner
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])


Point = tuple[float, float]


def _cut_ears(flat: list[Point]) -> list[tuple[int, int, int]]:
    """Return the triangles of a polygon that turns left; none if it crosses itself and has no ear."""
    left = list(range(len(flat)))
    triangles = []
    while len(left) > 3:
        for place in range(len(left)):
            a, b, c = left[place - 1], left[place], left[(place + 1) % len(left)]
            if _is_ear(flat, left, (a, b, c)):
                triangles.append((a, b, c))
                del left[place]
                break
        else:
            return []
    return [*triangles, (left[0], left[1], left[2])]


def _is_ear(flat: list[Point], left: list[int], ear: tuple[int, int, int]) -> bool:
    corners = [flat[index] for index in ear]
    if _turn(*corners) <= 0.0:
        return False
    edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    return not any(
        all(_turn(start, end, flat[other]) >= 0.0 for start, end in edges)
        for other in left
        if other not in ear and flat[other] not in corners
    )


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
