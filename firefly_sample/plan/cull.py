"""Leave out what cannot be seen, and sort what can: vectorised, float64, view space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.lens_constants import LensConstants

__all__ = ["FULLSCREEN_RADIUS", "frustum_corners", "holds_frustum", "spheres_in_frustum"]

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
    distances = centers @ planes[:, :3].T + planes[:, 3]
    return np.asarray((distances >= -radii[:, None]).all(axis=1))


def holds_frustum(corners: Float64, centers: Float64, radii: Float64) -> NDArray[np.bool_]:
    """Which spheres hold all `corners` of the frustum (none does if one is at infinity) or are huge.

    Parameters
    ----------
    corners : ndarray, shape (8, 3)
        View space.
    centers : ndarray, shape (n, 3)
    radii : ndarray, shape (n,)
    """
    with np.errstate(over="ignore", invalid="ignore"):
        farthest = np.linalg.norm(corners[None] - centers[:, None], axis=2).max(axis=1)
    return np.asarray((radii >= FULLSCREEN_RADIUS) | (np.isfinite(farthest) & (farthest <= radii)))


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
