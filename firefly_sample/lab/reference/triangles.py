"""Rays and triangles in float64: where a ray meets a triangle's plane, and how much each corner counts there.

Everything is seen along the ray: space is sheared until the ray is an axis, so that what is left of a corner
is how far it lies beside the ray. The share of a corner is the area between the ray and the opposite edge, a
determinant of two such small numbers. No plane equation is formed, whose constant would lose what is small
beside the distance from the origin; and of two triangles that share an edge, both compute the same number for
it, so that no ray slips through between them (Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection",
JCGT 2(1), 2013).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]

FARTHEST_OUT = 1.0 / 16.0
"""How far below 0 a share may be for the plane to be followed beyond the triangle. A rasteriser moves corners
to a grid of 1/256 pixel, so that it may draw a pixel whose centre is that far outside. Followed so far, a
plane stays by its triangle unless that is less than 1/16 pixel wide: edge-on, and it leads anywhere."""


@dataclass(frozen=True, eq=False)
class Beside:
    """The corners of n triangles as seen along n rays.

    Attributes
    ----------
    across, up : ndarray of float64, shape (n, 3)
        How far each corner lies beside the ray, at its own distance.
    along : ndarray of float64, shape (n, 3)
        Its distance along the axis, in units of the ray's direction.
    """

    across: Float64
    up: Float64
    along: Float64

    @classmethod
    def of(cls, corners: Float64, origin: Float64, direction: Float64) -> Beside:
        """For corners (n, 3, 3), and rays (n, 3) or (3,) whose direction's Y, the axis, is not 0."""
        away = corners - origin[..., None, :]
        along = away[..., 1] / direction[..., None, 1]
        return cls(
            away[..., 0] - direction[..., None, 0] * along,
            away[..., 2] - direction[..., None, 2] * along,
            along,
        )

    def areas(self) -> Float64:
        """Twice the areas between the ray and each corner's opposite edge, shape (n, 3).

        Their sum is above 0 for triangles whose corners run counter-clockwise, seen with X right and Z up.
        """
        x, z = self.across, self.up
        after, before = [1, 2, 0], [2, 0, 1]
        return np.asarray(x[:, after] * z[:, before] - z[:, after] * x[:, before])


@dataclass(frozen=True, eq=False)
class Meeting:
    """Where n rays meet n triangles.

    Attributes
    ----------
    shares : ndarray of float64, shape (n, 3)
        Of the corners; their sum is 1.
    along : ndarray of float64, shape (n,)
        Distance in units of the ray's direction.
    on_ray : ndarray of bool, shape (n,)
        False where the plane is met too far from the triangle, or nowhere: shares and distance are then those
        of a point of the triangle that is near the ray.
    front : ndarray of bool, shape (n,)
        True where the corners run counter-clockwise, seen with X right and Z up.
    inside : ndarray of bool, shape (n,)
        Whether the ray goes through the triangle, edges included.
    """

    shares: Float64
    along: Float64
    on_ray: NDArray[np.bool_]
    front: NDArray[np.bool_]
    inside: NDArray[np.bool_]


def meet(beside: Beside) -> Meeting:
    """Where rays meet the planes of triangles, and what stands in for that where a triangle is edge-on."""
    areas = beside.areas()
    whole = areas.sum(axis=1)
    flat = whole == 0.0
    shares = areas / np.where(flat, 1.0, whole)[:, None]
    inside = ~flat & (shares >= 0.0).all(axis=1)
    on_ray = ~flat & (shares >= -FARTHEST_OUT).all(axis=1)
    lost = np.flatnonzero(~on_ray)
    if len(lost):
        shares[lost] = _near(beside.across[lost], beside.up[lost])
    along = np.einsum("ni,ni->n", shares, beside.along)
    return Meeting(shares, along, on_ray, whole > 0.0, inside)


def _near(x: Float64, z: Float64) -> Float64:
    """Shares of the point, on an edge, that is nearest to the ray in the plane across it, shape (n, 3)."""
    best = np.full(len(x), np.inf)
    shares = np.zeros_like(x)
    for first, second in ((0, 1), (1, 2), (2, 0)):
        edge_x, edge_z = x[:, second] - x[:, first], z[:, second] - z[:, first]
        square = edge_x**2 + edge_z**2
        toward = -(x[:, first] * edge_x + z[:, first] * edge_z)
        t = np.clip(toward / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
        away = (x[:, first] + t * edge_x) ** 2 + (z[:, first] + t * edge_z) ** 2
        nearer = np.flatnonzero(away < best)
        best[nearer] = away[nearer]
        shares[nearer] = 0.0
        shares[nearer, first] = 1.0 - t[nearer]
        shares[nearer, second] = t[nearer]
    return shares
