"""Leave out what cannot be seen, and sort what can: vectorised, float64, view space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.lens_constants import LensConstants

Float64 = NDArray[np.float64]

FULLSCREEN_RADIUS = 1e15
"""Above it a sphere's float32 vertices are no longer where they should be; a full-screen quad always is."""


def spheres_in_frustum(planes: Float64, centers: Float64, radii: Float64) -> NDArray[np.bool_]:
    """Which spheres meet the frustum (some that just miss a corner count as meeting it).

    Parameters
    ----------
    planes : ndarray, shape (p, 4)
        View space, unit normals inwards: inside where n.x + d >= 0.
    centers : ndarray, shape (n, 3)
    radii : ndarray, shape (n,)

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    # a plane a row: along axes of a few, NumPy is several times as slow
    inside = planes[:, :3] @ centers.T + planes[:, 3:]
    return np.asarray(inside.min(axis=0) >= -radii)


def sectors_in_frustum(
    planes: Float64, centers: Float64, axes: Float64, radii: Float64, openings: Float64
) -> NDArray[np.bool_]:
    """Which spherical sectors, the cones of spotlights, meet the frustum; as `spheres_in_frustum`.

    A sector lies outside a plane if its farthest point along the plane's normal does: a point of the cap
    where the normal lies within the cone, else a point of the cap's rim or the tip.

    Parameters
    ----------
    planes : ndarray, shape (p, 4)
    centers, axes : ndarray, shape (n, 3)
        Of the tips, and unit vectors.
    radii : ndarray, shape (n,)
        May be infinite.
    openings : ndarray, shape (n,)
        1 - cos of the half-angles.
    """
    half = 2.0 * np.arcsin(np.sqrt(np.clip(openings / 2.0, 0.0, 1.0)))
    away = np.arccos(np.clip(axes @ planes[:, :3].T, -1.0, 1.0)) - half[:, None]
    share = np.where(away <= 0.0, 1.0, np.maximum(np.cos(np.minimum(away, np.pi)), 0.0))
    distances = centers @ planes[:, :3].T + planes[:, 3]
    # a little more than the sector: the angles are rounded
    farthest = np.minimum(radii, 1e300)[:, None] * (share + 1e-9)
    return np.asarray((distances >= -farthest).all(axis=1))


def farthest_corner(corners: Float64, centers: Float64) -> Float64:
    """The distance from each center (n, 3) to the farthest of the `corners` (8, 3); infinite where one is."""
    with np.errstate(over="ignore", invalid="ignore"):
        farthest = np.linalg.norm(corners[None] - centers[:, None], axis=2).max(axis=1)
    return np.where(np.isfinite(farthest), farthest, np.inf)


def frustum_corners(lens: LensConstants, near: float, far: float) -> Float64:
    """The eight corners in view space, shape (8, 3); those of an infinite far plane are infinite."""
    signs = np.array([(x, y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    sides = [
        lens.view_from_distance(signs[:, 0], signs[:, 1], np.full(4, distance))
        if np.isfinite(distance)
        else np.full((4, 3), np.inf)
        for distance in (near, far)
    ]
    return np.concatenate(sides)
