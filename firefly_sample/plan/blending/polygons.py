"""Blended triangles and camera-facing discs as they lie on the screen: the input of `paint_order`.

Screen coordinates are x/y and z/y in perspective and x and z of view space otherwise, times the larger scale
of the lens, so that the view reaches from -1 to 1 along its shorter side. In them a triangle's `q`, which is
larger where it is nearer (1/y in perspective, -y otherwise), is linear: with the plane n.p = d,

    perspective   q = (nx*s + ny + nz*t) / d          from n.(x, y, z)/y = d/y
    orthographic  q = (nx*s + nz*t - d) / ny          from y = (d - nx*x - nz*z) / ny
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.lens_constants import LensConstants

Indices = NDArray[np.intp]

EDGE_ON = 1e-9
"""Polygons that are thinner than this on the screen are left out: no pixel of any picture sees them."""


@dataclass(frozen=True, eq=False)
class Polygons:
    """The visible parts of n triangles, convex, each with up to k corners."""

    corners: Float64  # (n, k, 2) on the screen, counter-clockwise; unused ones repeat the first one
    counts: Indices  # (n,) how many corners are used
    planes: Float64  # (n, 3): q = p0 + p1*s + p2*t
    farthest: Float64  # (n,) the largest distance y of the visible part
    groups: Indices  # (n,) polygons of a group that follow each other share a draw
    sources: Indices  # (n,) row of the triangle among those given

    def __len__(self) -> int:
        return len(self.corners)


@dataclass(frozen=True, eq=False)
class Discs:
    """The n discs that face the camera and are in view, each at one distance."""

    centers: Float64  # (n, 2) on the screen
    radii: Float64  # (n,) on the screen
    nearness: Float64  # (n,) the q of the whole disc
    distances: Float64  # (n,) y
    adds: NDArray[np.bool_]  # (n,) it only adds light, so that its order among its like is free
    groups: Indices  # (n,) as those of polygons, with numbers of their own or shared with them
    sources: Indices  # (n,) row of the disc among those given

    def __len__(self) -> int:
        return len(self.centers)


def triangles_on_screen(
    corners: ArrayLike, groups: ArrayLike, lens: LensConstants, near: float, far: float = math.inf
) -> Polygons:
    """Return the visible parts of triangles, shape (n, 3, 3), in view space (X right, Y forward, Z up).

    They are clipped to the view, so that what happens outside of it has no influence. Left out are triangles
    outside the view, seen edge-on, or without an area. Groups, shape (n,) or (), are whole numbers.
    """
    triangles = np.asarray(corners, dtype=np.float64).reshape(-1, 3, 3)
    distances = [_sides(triangles, plane) for plane in _view_planes(lens, near, far)]
    outside = np.any([(side < 0.0).all(axis=1) for side in distances], axis=0)
    crossing = np.any([(side < 0.0).any(axis=1) for side in distances], axis=0)[~outside]
    sources = np.flatnonzero(~outside)
    parts, counts = triangles[sources], np.full(len(sources), 3)
    if crossing.any():
        cut, cut_counts = _clipped(parts[crossing], _view_planes(lens, near, far))
        wide = np.repeat(parts[:, :1], cut.shape[1], axis=1)
        wide[:, :3] = parts
        wide[crossing], counts[crossing] = cut, cut_counts
        left = counts >= 3
        parts, counts, sources = wide[left], counts[left], sources[left]
    on_screen = _screen(parts, lens)
    areas = _areas(on_screen)
    seen = np.abs(areas) > EDGE_ON * _longest(on_screen)
    backwards = areas < 0.0
    on_screen[backwards] = _reversed(on_screen[backwards], counts[backwards])
    sources = sources[seen]
    return Polygons(
        on_screen[seen],
        counts[seen],
        _planes(triangles[sources], lens),
        parts[seen, :, 1].max(axis=1),
        np.broadcast_to(np.asarray(groups, dtype=np.intp), len(triangles))[sources],
        sources,
    )


def discs_on_screen(
    positions: ArrayLike,
    radii: ArrayLike,
    adds: ArrayLike,
    groups: ArrayLike,
    lens: LensConstants,
    near: float,
    far: float = math.inf,
) -> Discs:
    """Return the discs in view of those at positions (n, 3) in view space, whose planes face the camera.

    Radii, flags `adds` and groups have the shape (n,) or (). A disc is in view if its centre lies between
    the near and the far plane and the disc reaches into the sides of the view.
    """
    places = np.asarray(positions, dtype=np.float64).reshape(-1, 3)
    n, zoom = len(places), _zoom(lens)
    sizes = np.broadcast_to(np.asarray(radii, dtype=np.float64), n)
    distances = places[:, 1]
    kept = (distances >= near) & (distances <= far) & (sizes > 0.0)
    for plane in lens.side_planes():
        # the largest of n.p over a disc in the plane y = constant
        kept &= places @ plane[:3] + plane[3] + sizes * math.hypot(plane[0], plane[2]) > 0.0
    sources = np.flatnonzero(kept)
    distances = distances[sources]
    w = distances if lens.perspective else np.ones(len(sources))
    return Discs(
        places[sources][:, [0, 2]] * (zoom / w)[:, None],
        sizes[sources] * zoom / w,
        1.0 / distances if lens.perspective else -distances,
        distances,
        np.broadcast_to(np.asarray(adds, dtype=np.bool_), n)[sources],
        np.broadcast_to(np.asarray(groups, dtype=np.intp), n)[sources],
        sources,
    )


def _zoom(lens: LensConstants) -> float:
    return max(lens.a, lens.c)


def _view_planes(lens: LensConstants, near: float, far: float) -> list[Float64]:
    planes = [np.array([0.0, 1.0, 0.0, -near]), *lens.side_planes()]
    return planes if math.isinf(far) else [*planes, np.array([0.0, -1.0, 0.0, far])]


def _sides(points: Float64, plane: Float64) -> Float64:
    """Return signed distances, shape (n, k), of points (n, k, 3) from a plane."""
    flat = points.reshape(-1, 3) @ plane[:3] + plane[3]
    return np.asarray(flat.reshape(points.shape[:2]))


def _clipped(polygons: Float64, planes: list[Float64]) -> tuple[Float64, Indices]:
    """Return convex polygons (n, k, 3) clipped by planes, and their numbers of corners.

    The method is that of Sutherland and Hodgman.
    """
    n, width = polygons.shape[:2]
    counts = np.full(n, width)
    rows = np.arange(n)[:, None]
    for plane in planes:
        width = polygons.shape[1]
        places = np.arange(width)
        following = np.where(places + 1 < counts[:, None], places + 1, 0)
        here = _sides(polygons, plane)
        there = here[rows, following]
        used = places < counts[:, None]
        leaves = used & ((here >= 0.0) != (there >= 0.0))
        share = here / np.where(leaves, here - there, 1.0)
        crossings = polygons + share[:, :, None] * (polygons[rows, following] - polygons)
        # each corner that is kept, then the crossing on the way to the next one
        points = np.stack((polygons, crossings), axis=2).reshape(n, 2 * width, 3)
        kept = np.stack((used & (here >= 0.0), leaves), axis=2).reshape(n, 2 * width)
        counts = np.minimum(kept.sum(axis=1), width + 1)
        polygons = points[rows, np.argsort(~kept, axis=1, kind="stable")[:, : width + 1]]
        places = np.arange(width + 1)
        polygons = polygons[rows, np.where(places < counts[:, None], places, 0)]
    width = max(int(counts.max(initial=3)), 3)
    return polygons[:, :width], counts


def _screen(points: Float64, lens: LensConstants) -> Float64:
    """Return screen coordinates, shape (n, k, 2), of points in view space."""
    w = points[:, :, 1] if lens.perspective else 1.0
    return np.stack((points[:, :, 0] / w, points[:, :, 2] / w), axis=2) * _zoom(lens)


def _areas(corners: Float64) -> Float64:
    """Return twice the signed areas of polygons."""
    edges = corners[:, 1:] - corners[:, :1]
    x, y = edges[:, :, 0], edges[:, :, 1]
    return np.asarray((x[:, :-1] * y[:, 1:] - x[:, 1:] * y[:, :-1]).sum(axis=1))


def _longest(corners: Float64) -> Float64:
    """Return the longer sides of polygons' boxes."""
    return np.asarray((corners.max(axis=1) - corners.min(axis=1)).max(axis=1))


def _reversed(corners: Float64, counts: Indices) -> Float64:
    """Return polygons with the opposite winding."""
    places = np.arange(corners.shape[1])
    backwards = np.where((places > 0) & (places < counts[:, None]), counts[:, None] - places, 0)
    return np.asarray(corners[np.arange(len(corners))[:, None], backwards])


def _planes(triangles: Float64, lens: LensConstants) -> Float64:
    """Return the coefficients (n, 3) of q; triangles have an area, and are not seen edge-on."""
    first = triangles[:, 0]
    normals = np.cross(triangles[:, 1] - first, triangles[:, 2] - first)
    normals /= np.abs(normals).max(axis=1, keepdims=True)
    d = (normals * triangles.mean(axis=1)).sum(axis=1)
    x, y, z = normals.T
    zoom = _zoom(lens)
    if lens.perspective:
        return np.asarray(np.stack((y, x / zoom, z / zoom), axis=1) / d[:, None])
    return np.asarray(np.stack((-d, x / zoom, z / zoom), axis=1) / y[:, None])
