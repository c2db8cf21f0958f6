"""Test spheres, sectors and triangles against frustums: vectorised, float64.

The triangles of a large Geom are put into chunks of neighbours, each with a box, so that a test against a
small region looks at few of them. Chunks are made when they are first asked for, and kept with their Geom.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lens_constants import LensConstants

FULLSCREEN_RADIUS = 1e15
"""Above it, float32 misplaces a sphere's vertices; a full-screen triangle is drawn instead."""
WIDEST = 5e4
"""Half widths of the view: triangles that reach as far to a side keep all of their pixels, and of triangles
that reach four times as far one in forty loses some. A rasterizer clips triangles to the view in float32,
which moves an edge by up to 6e-8 of its length."""
WIDEST_CASTER = 1e6
"""Half widths of a shadow map's view: casters that reach 1e7 to a side still fill every texel of it; from 3e7
on some let light through."""
CHUNK = 1 << 8
"""Triangles in a chunk."""
TOGETHER = 16
"""Chunks that are looked at together, before more are."""
CELLS = 32
"""Cells along each side of a Geom's box; triangles of a cell are neighbours."""


def spheres_in_frustum(planes: Float64, centers: Float64, radii: Float64) -> NDArray[np.bool_]:
    """Return which spheres meet the frustum (some that just miss a corner count too), shape (n,).

    The planes, shape (p, 4), are rows (nx, ny, nz, d) with unit normals inwards, as `Lens.frustum_planes`
    gives them; centers (n, 3) and radii (n,) are in view space.
    """
    # one row per plane: along axes of a few, NumPy is several times as slow
    inside = planes[:, :3] @ centers.T + planes[:, 3:]
    return np.asarray(inside.min(axis=0) >= -radii)


def sectors_in_frustum(
    planes: Float64, centers: Float64, axes: Float64, radii: Float64, openings: Float64
) -> NDArray[np.bool_]:
    """Return which spherical sectors, the cones of spotlights, meet the frustum; as `spheres_in_frustum`.

    A sector lies outside a plane if its farthest point along the plane's normal does: a point of the cap
    where the normal lies within the cone, else a point of the cap's rim or the tip. The centers are the tips,
    axes unit vectors, radii may be infinite, and openings are 1 - cos of the half-angles.
    """
    half = 2.0 * np.arcsin(np.sqrt(np.clip(openings / 2.0, 0.0, 1.0)))
    away = np.arccos(np.clip(axes @ planes[:, :3].T, -1.0, 1.0)) - half[:, None]
    share = np.where(away <= 0.0, 1.0, np.maximum(np.cos(np.minimum(away, np.pi)), 0.0))
    distances = centers @ planes[:, :3].T + planes[:, 3]
    # a margin for rounded angles
    farthest = np.minimum(radii, 1e300)[:, None] * (share + 1e-9)
    return np.asarray((distances >= -farthest).all(axis=1))


def farthest_corner(corners: Float64, centers: Float64) -> Float64:
    """Return the distance from each center (n, 3) to the farthest of `corners` (8, 3), infinite if one is."""
    with np.errstate(over="ignore", invalid="ignore"):
        farthest = np.linalg.norm(corners[None] - centers[:, None], axis=2).max(axis=1)
    return np.where(np.isfinite(farthest), farthest, np.inf)


def frustum_corners(lens: LensConstants, near: float, far: float) -> Float64:
    """Return the eight corners in view space, shape (8, 3); those of an infinite far plane are infinite."""
    signs = np.array([(x, y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    sides = [
        lens.view_from_distance(signs[:, 0], signs[:, 1], np.full(4, distance))
        if np.isfinite(distance)
        else np.full((4, 3), np.inf)
        for distance in (near, far)
    ]
    return np.concatenate(sides)


def has_wide_caster(geom: Geom, model_to_light: Float64, planes: Float64, lens: Lens) -> bool:
    """Return whether an instance of a Geom is too wide to cast a shadow into all of a shadow map.

    Matrices, shape (n, 4, 4), lead to the light's view space, for row vectors; planes and lens are the map's.
    """
    constants, near = lens.constants(), lens.get_near()
    low, high = geom.bounds
    middles = 0.5 * (low + high) @ model_to_light[:, :3, :3] + model_to_light[:, 3, :3]
    halves = 0.5 * (high - low) @ np.abs(model_to_light[:, :3, :3])
    reach = (np.abs(middles) + halves)[:, [0, 2]].max(axis=1)
    ahead = np.maximum(near, middles[:, 1] - halves[:, 1]) if constants.perspective else 1.0
    suspects = reach * max(constants.a, constants.c) > WIDEST_CASTER * ahead
    if not suspects.any():  # nearly always: the rest looks at every vertex
        return False
    return has_wide(geom, model_to_light[suspects], planes, constants, near, WIDEST_CASTER)


def has_wide(
    geom: Geom, model_to_view: Float64, planes: Float64, lens: LensConstants, near: float, widest: float
) -> bool:
    """Return whether a triangle in view has a corner more than `widest` half widths of the view to a side."""
    for matrix in model_to_view:
        corners = geom.vertices @ matrix[:3, :3] + matrix[3, :3]
        ahead = corners[:, 1] if lens.perspective else np.ones(len(corners))
        aside = np.abs(corners[:, [0, 2]] * (lens.a, lens.c)).max(axis=1)
        wide = (aside > widest * ahead) & (ahead >= (near if lens.perspective else 0.0))
        triangles = geom.triangles[wide[geom.triangles].any(axis=1)]
        outside = corners @ planes[:, :3].T + planes[:, 3] < 0.0
        if len(triangles) and not outside[triangles].all(axis=1).any(axis=1).all():
            return True
    return False


class _Chunks(NamedTuple):
    """A Geom's elements in chunks at a revision: indices cell by cell, boxes' middles and half sizes."""

    revision: int
    order: NDArray[np.intp]
    middles: Float64  # (k, 3)
    halves: Float64


_kept: WeakKeyDictionary[Geom, _Chunks] = WeakKeyDictionary()


def corners_near(geom: Geom, planes: Float64, touch: float) -> Iterator[Float64]:
    """Yield corners of triangles, lines or points that may reach into a convex region.

    Their shape is (n, 3, 3), (n, 2, 3) or (n, 1, 3). Left out are those that lie outside one of the planes,
    shape (p, 4): rows (nx, ny, nz, d) in the Geom's own space, with nx*x + ny*y + nz*z + d > `touch` inside.
    """
    elements, vertices = geom.indices, geom.vertices
    parts: Any = (slice(None),)
    if len(elements) > CHUNK:
        _, order, middles, halves = _chunks_of(geom)
        nearest = middles @ planes[:, :3].T + halves @ np.abs(planes[:, :3]).T + planes[:, 3]
        chosen = np.flatnonzero((nearest > touch).all(axis=1))
        parts = (
            np.concatenate([order[CHUNK * k : CHUNK * (k + 1)] for k in chosen[start : start + TOGETHER]])
            for start in range(0, len(chosen), TOGETHER)
        )
    for part in parts:
        corners = vertices[elements[part]]
        outside = corners.reshape(-1, 3) @ planes[:, :3].T + planes[:, 3] <= touch
        yield corners[~outside.reshape(*corners.shape[:2], -1).all(axis=1).any(axis=1)]


def _chunks_of(geom: Geom) -> _Chunks:
    kept = _kept.get(geom)
    if kept is None or kept.revision != geom.revision:
        # the order stays when vertices move, since boxes may overlap
        order = _order_of(geom) if kept is None else kept.order
        indices = geom.indices[order].ravel()
        starts = np.arange(0, len(indices), geom.indices.shape[1] * CHUNK)
        lows, highs = np.empty((2, len(starts), 3))
        for axis in range(3):  # one by one takes a third of the time
            coordinates = np.ascontiguousarray(geom.vertices[:, axis])[indices]
            lows[:, axis] = np.minimum.reduceat(coordinates, starts)
            highs[:, axis] = np.maximum.reduceat(coordinates, starts)
        kept = _Chunks(geom.revision, order, 0.5 * (lows + highs), 0.5 * (highs - lows))
        _kept[geom] = kept
    return kept


def _order_of(geom: Geom) -> NDArray[np.intp]:
    """Return indices of triangles, lines or points, cell by cell."""
    first = geom.vertices[geom.indices[:, 0]]
    low, high = geom.bounds
    size = np.where(high > low, high - low, 1.0)
    cells = np.minimum((first - low) / size * CELLS, CELLS - 1).astype(np.uint16)
    return np.argsort(cells @ np.array([CELLS * CELLS, CELLS, 1], dtype=np.uint16), kind="stable")
