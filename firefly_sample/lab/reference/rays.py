"""Rays through the centres of pixels, and where they meet triangles; view space and float64.

A triangle is seen along the ray: space is sheared until the ray is an axis, so that a corner's two other
coordinates are its distance beside the ray. The share of a corner is the area between the ray and the
opposite edge, a determinant of two such small numbers. No plane equation is formed, whose constant would lose
the digits that are small beside the distance from the origin. Two triangles that share an edge compute the
same number for it, so that no ray passes between them (Woop, Benthin, Wald, "Watertight Ray/Triangle
Intersection", JCGT 2(1), 2013).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]

FARTHEST_OUT = 1.0 / 16.0
"""Limit of a share below 0 up to which the plane is followed beyond the triangle. A rasteriser moves corners
to a grid of 1/256 pixel, so it may draw a pixel whose centre is that far outside. A triangle less than 1/16
pixel wide is edge-on: its plane leads anywhere."""


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays through n pixels: a point on one is origin + y * direction, y the distance along the view axis.

    Attributes
    ----------
    origin, direction : ndarray of float64, shape (n, 3)
        View space: the direction's Y is 1, the origin's 0.
    pixel : (float, float)
        The step from a pixel to its neighbour, to the right and down, at distance 1.
    """

    origin: Float64
    direction: Float64
    perspective: bool
    pixel: tuple[float, float]

    def take(self, chosen: NDArray[Any]) -> Rays:
        """Return the rays of the chosen pixels."""
        return Rays(self.origin[chosen], self.direction[chosen], self.perspective, self.pixel)

    def to_eye(self) -> Float64:
        """Return unit vectors back to the eye, shape (n, 3)."""
        return np.asarray(-self.direction / np.linalg.norm(self.direction, axis=1, keepdims=True))

    def __len__(self) -> int:
        return len(self.direction)


def pixel_rays(view: View) -> Rays:
    """Return the rays of all pixels of a view, row by row, the first row on top."""
    width, height = view.size
    ndc_x = (np.arange(width) + 0.5) / (width / 2) - 1.0
    ndc_y = 1.0 - (np.arange(height) + 0.5) / (height / 2)
    lens = view.lens
    distance = 1.0 if lens.perspective else 0.0
    position = lens.view_from_distance(ndc_x[None], ndc_y[:, None], distance).reshape(-1, 3)
    pixel = 2.0 / (width * lens.a), -2.0 / (height * lens.c)
    if lens.perspective:
        return Rays(np.zeros_like(position), position, True, pixel)
    return Rays(position, np.tile([0.0, 1.0, 0.0], (len(position), 1)), False, pixel)


@dataclass(frozen=True, eq=False)
class RayCorners:
    """The corners of n triangles as seen along n rays, shapes (n, 3).

    `across` and `up` are each corner's offset from the ray, at the corner's own distance; `along` is its
    distance along the axis, in units of the ray's direction.
    """

    across: Float64
    up: Float64
    along: Float64

    @classmethod
    def of(cls, corners: Float64, origin: Float64, direction: Float64) -> RayCorners:
        """Return corners (n, 3, 3) as seen along rays (n, 3) or (3,), whose direction's Y must not be 0."""
        away = corners - origin[..., None, :]
        along = away[..., 1] / direction[..., None, 1]
        return cls(
            away[..., 0] - direction[..., None, 0] * along,
            away[..., 2] - direction[..., None, 2] * along,
            along,
        )

    def areas(self) -> Float64:
        """Return twice the areas between the ray and each corner's opposite edge, shape (n, 3).

        Their sum is above 0 for triangles whose corners run counter-clockwise, seen with X right and Z up.
        """
        x, z = self.across, self.up
        after, before = [1, 2, 0], [2, 0, 1]
        return np.asarray(x[:, after] * z[:, before] - z[:, after] * x[:, before])


@dataclass(frozen=True, eq=False)
class Intersections:
    """The intersections of n rays with n triangles.

    Attributes
    ----------
    shares : ndarray of float64, shape (n, 3)
        Barycentric coordinates; their sum is 1.
    along : ndarray of float64, shape (n,)
        Distance in units of the ray's direction.
    on_ray : ndarray of bool, shape (n,)
        False where the ray meets the plane too far from the triangle, or nowhere: shares and distance are
        then those of a point of the triangle near the ray.
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


def intersect(corners: RayCorners) -> Intersections:
    """Return where rays meet the planes of triangles; if edge-on, the triangle's point nearest to the ray."""
    areas = corners.areas()
    whole = areas.sum(axis=1)
    flat = whole == 0.0
    shares = areas / np.where(flat, 1.0, whole)[:, None]
    inside = ~flat & (shares >= 0.0).all(axis=1)
    on_ray = ~flat & (shares >= -FARTHEST_OUT).all(axis=1)
    lost = np.flatnonzero(~on_ray)
    if len(lost):
        shares[lost] = _nearest_on_edges(corners.across[lost], corners.up[lost])
    along = np.einsum("ni,ni->n", shares, corners.along)
    return Intersections(shares, along, on_ray, whole > 0.0, inside)


def _nearest_on_edges(x: Float64, z: Float64) -> Float64:
    """Return the shares of the point on an edge that is nearest to the ray, shape (n, 3)."""
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
