"""Which of two things is nearer where they overlap on the screen.

The difference of two things' q is linear on the screen, so its extremes over the overlap of two convex shapes
lie at the overlap's corners, or, within a circle, at the points of the circle farthest up and down the slope.
Nearly always the corners of one of the two decide: if none of a polygon's corners is behind the other's
plane, none of its points is.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.blending.candidates import Boxes, Pairs
from firefly_sample.plan.blending.polygons import Discs, Indices, Polygons
from firefly_sample.scene.arrays import Float64

TOUCH = 1e-7
"""Overlaps that are narrower on the screen than this count as touching, as neighbours in a mesh do."""
SAME = 3e-7
"""Two things lie in one plane where their q differ by less than this share of the sum of q's terms. That is a
few roundings of the corners in files, which are float32; where a plane is seen nearly edge-on, they change q
by more."""
INSIDE = 1e-12
"""Points this far outside an edge count as on it."""
TOGETHER = 1 << 13
"""Pairs whose arrays fit a processor's cache."""


class Order(NamedTuple):
    """The order of m pairs that overlap."""

    first: Indices  # (m,) of the pair
    second: Indices
    nearer: NDArray[np.int8]  # 1 if the first is nearer, -1 if the second is, 0 if they lie in one plane
    cross: NDArray[np.bool_]  # they intersect; `nearer` is then about the deeper side


class Shapes:
    """Polygons as the functions below need them: an axis for things last, since NumPy is fast along it."""

    def __init__(self, polygons: Polygons) -> None:
        self.points = np.ascontiguousarray(polygons.corners.transpose(2, 1, 0))  # (2, k, n)
        self.counts = polygons.counts
        self.planes = np.ascontiguousarray(polygons.planes.T)  # (3, n)
        edges = np.roll(self.points, -1, axis=1) - self.points
        self.lengths = np.hypot(*edges)  # (k, n), 0 where a corner is not used
        self.along = edges / np.where(self.lengths > 0.0, self.lengths, 1.0)
        # distance outside the line of an edge is normals.p - offsets; an edge of no length excludes nothing
        self.normals = np.stack((self.along[1], -self.along[0]))
        self.offsets = np.where(self.lengths > 0.0, (self.normals * self.points).sum(axis=0), 1e30)
        reach = np.abs(self.points).max(axis=1, initial=0.0)
        self.blur = SAME * (np.abs(self.planes[0]) + (np.abs(self.planes[1:]) * reach).sum(axis=0))

    def boxes(self) -> Boxes:
        """Return the polygons' boxes without a margin: boxes overlap if they do by more than `TOUCH`."""
        low, high = self.points.min(axis=1, initial=np.inf), self.points.max(axis=1, initial=-np.inf)
        return Boxes(low.T + 0.5 * TOUCH, high.T - 0.5 * TOUCH)


def disc_boxes(discs: Discs) -> Boxes:
    """Return the squares around discs."""
    half = discs.radii[:, None] - 0.5 * TOUCH
    return Boxes(discs.centers - half, discs.centers + half)


def polygon_orders(shapes: Shapes, pairs: Pairs) -> Iterator[Order]:
    """Yield the order of those pairs of polygons that overlap."""
    narrow = np.maximum(shapes.counts[pairs[0]], shapes.counts[pairs[1]]) <= 3
    for corners, rows in ((3, np.flatnonzero(narrow)), (shapes.points.shape[1], np.flatnonzero(~narrow))):
        for start in range(0, len(rows), TOGETHER):
            part = rows[start : start + TOGETHER]
            yield _order_of_polygons(shapes, corners, pairs[0][part], pairs[1][part])


def disc_orders(shapes: Shapes, discs: Discs, pairs: Pairs) -> Iterator[Order]:
    """Yield the order of those pairs of a polygon and a disc that overlap."""
    for start in range(0, len(pairs[0]), TOGETHER):
        part = slice(start, start + TOGETHER)
        yield _order_of_discs(shapes, discs, pairs[0][part], pairs[1][part])


def _order_of_polygons(shapes: Shapes, k: int, a: Indices, b: Indices) -> Order:
    # how far the corners of each lie outside the edges of the other: (edge, corner, pair)
    a_points, b_points = shapes.points[:, :k, a], shapes.points[:, :k, b]
    b_outside = _outside(shapes, k, a, b_points)
    kept = np.flatnonzero(_gap(b_outside) < -TOUCH)
    a, b, b_outside = a[kept], b[kept], b_outside[:, :, kept]
    a_points, b_points = a_points[:, :, kept], b_points[:, :, kept]
    a_outside = _outside(shapes, k, b, a_points)
    kept = np.flatnonzero(_gap(a_outside) < -TOUCH)
    a, b = a[kept], b[kept]
    difference = (shapes.planes[:, a] - shapes.planes[:, b])[:, None]
    blur = shapes.blur[a] + shapes.blur[b]
    at_a, at_b = _q(difference, a_points[:, :, kept]), _q(difference, b_points[:, :, kept])
    low = np.maximum(at_a.min(axis=0), at_b.min(axis=0))
    high = np.minimum(at_a.max(axis=0), at_b.max(axis=0))
    open_ = np.flatnonzero((low < -blur) & (high > blur))
    if len(open_):
        some = kept[open_]
        low[open_], high[open_] = _extremes(
            at_a[:, open_], at_b[:, open_], a_outside[:, :, some], b_outside[:, :, some]
        )
    return Order(a, b, *_decided(low, high, blur))


def _gap(outside: Float64) -> Float64:
    """Return how far apart polygons are along the normals of one's edges; below 0 they overlap."""
    return np.asarray(outside.min(axis=1).max(axis=0))


def _extremes(
    at_a: Float64, at_b: Float64, a_outside: Float64, b_outside: Float64
) -> tuple[Float64, Float64]:
    """Return the least and largest difference over the corners of overlaps.

    Given are the differences at both polygons' corners, shape (k, m), and how far the corners of each lie
    outside the other's edges, shape (edge, corner, m).
    """
    within_b, within_a = a_outside.max(axis=0) <= INSIDE, b_outside.max(axis=0) <= INSIDE
    # edge i of A, from corner i to the next one, crosses edge j of B where each has an end on either side
    a_next, b_next = np.roll(a_outside, -1, axis=1), np.roll(b_outside, -1, axis=1)
    crosses = (a_outside * a_next < 0.0) & (b_outside * b_next < 0.0).transpose(1, 0, 2)
    share = np.where(crosses, a_outside, 0.0) / np.where(crosses, a_outside - a_next, 1.0)
    at_crossing = (at_a + share * (np.roll(at_a, -1, axis=0) - at_a)).reshape(-1, at_a.shape[-1])
    values = np.concatenate((at_a, at_b, at_crossing))
    valid = np.concatenate((within_b, within_a, crosses.reshape(at_crossing.shape)))
    return np.where(valid, values, np.inf).min(axis=0), np.where(valid, values, -np.inf).max(axis=0)


def _order_of_discs(shapes: Shapes, discs: Discs, a: Indices, b: Indices) -> Order:
    """Return the order of polygons `a` and discs `b`."""
    radius, center = discs.radii[b], discs.centers[b].T[:, None]
    outside = _distances(shapes.normals[:, :, a], shapes.offsets[:, a], center)
    farthest_out = outside.max(axis=0)
    beside = np.flatnonzero((farthest_out > 0.0) & (farthest_out < radius - TOUCH))
    meets = farthest_out <= 0.0
    meets[beside] = (
        _to_edges(shapes, a[beside], center[:, :, beside], outside[:, beside]) < radius[beside] - TOUCH
    )
    kept = np.flatnonzero(meets)
    a, b = a[kept], b[kept]
    difference = shapes.planes[:, a].copy()
    difference[0] -= discs.nearness[b]
    blur = shapes.blur[a] + SAME * np.abs(discs.nearness[b])
    at_corners = _q(difference[:, None], shapes.points[:, :, a])
    at_center = _q(difference, center[:, 0, kept])
    slope = np.hypot(difference[1], difference[2])
    rise = slope * radius[kept]
    low = np.maximum(at_corners.min(axis=0), at_center - rise)
    high = np.minimum(at_corners.max(axis=0), at_center + rise)
    open_ = np.flatnonzero((low < -blur) & (high > blur))
    if len(open_):
        some = kept[open_]
        low[open_], high[open_] = _extremes_in_discs(
            shapes, a[open_], difference[:, open_], center[:, :, some], radius[some], outside[:, some]
        )
    return Order(a, b, *_decided(low, high, blur))


def _to_edges(shapes: Shapes, a: Indices, center: Float64, outside: Float64) -> Float64:
    """Return the distances from polygons of centres that lie outside of them."""
    lengths, foot = shapes.lengths[:, a], _foot(shapes, a, center)
    to_edge = np.hypot(foot - np.clip(foot, 0.0, lengths), outside)
    return np.asarray(np.where((outside > 0.0) & (lengths > 0.0), to_edge, np.inf).min(axis=0))


def _foot(shapes: Shapes, a: Indices, center: Float64) -> Float64:
    """Return where the feet of centres are along each edge's line, from the edge's begin."""
    return np.asarray(((center - shapes.points[:, :, a]) * shapes.along[:, :, a]).sum(axis=0))


def _extremes_in_discs(
    shapes: Shapes, a: Indices, difference: Float64, center: Float64, radius: Float64, outside: Float64
) -> tuple[Float64, Float64]:
    """Return the least and largest difference over the overlaps of polygons `a` and discs."""
    points, along, lengths = shapes.points[:, :, a], shapes.along[:, :, a], shapes.lengths[:, a]
    foot = _foot(shapes, a, center)
    lows, highs = [], []

    def look_at(where: Float64, counts: NDArray[np.bool_]) -> None:
        values = _q(difference[:, None], where)
        lows.append(np.where(counts, values, np.inf).min(axis=0))
        highs.append(np.where(counts, values, -np.inf).max(axis=0))

    look_at(points, np.hypot(*(points - center)) <= radius)
    half_chord = np.sqrt(np.maximum(radius**2 - outside**2, 0.0))
    for sign in (-1.0, 1.0):
        place = foot + sign * half_chord
        look_at(points + place * along, (np.abs(outside) <= radius) & (place >= 0.0) & (place <= lengths))
        slope = np.hypot(difference[1], difference[2])
        step = sign * difference[1:] * radius / np.where(slope > 0.0, slope, 1.0)
        farther = outside + (shapes.normals[:, :, a] * step[:, None]).sum(axis=0)
        look_at(center + step[:, None], (farther.max(axis=0) <= 0.0)[None])
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _decided(low: Float64, high: Float64, blur: Float64) -> tuple[NDArray[np.int8], NDArray[np.bool_]]:
    """Return who is nearer and whether they intersect, from the extremes of the difference of q."""
    behind, before = low < -blur, high > blur
    cross = behind & before & np.isfinite(low) & np.isfinite(high)
    nearer = np.where(cross, np.where(high + low >= 0.0, 1, -1), before.astype(int) - behind.astype(int))
    return nearer.astype(np.int8), cross


def _q(planes: Float64, points: Float64) -> Float64:
    return np.asarray(planes[0] + planes[1] * points[0] + planes[2] * points[1])


def _outside(shapes: Shapes, k: int, owners: Indices, points: Float64) -> Float64:
    """Return how far points (2, k, m) lie outside the edges of polygons, shape (edge, corner, m)."""
    normals, offsets = shapes.normals[:, :k, owners], shapes.offsets[:k, owners]
    return _distances(normals[:, :, None], offsets[:, None], points[:, None])


def _distances(normals: Float64, offsets: Float64, points: Float64) -> Float64:
    return np.asarray(normals[0] * points[0] + normals[1] * points[1] - offsets)
