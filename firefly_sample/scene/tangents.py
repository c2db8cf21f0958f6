"""Tangents for normal maps, by the rule of MikkTSpace.

M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited" (2008), appendix and the program of that name: glTF
2.0 asks for its default settings (section 3.7.2.1). Vertices with one position, normal and pair of texture
coordinates count as one. Two corners there share a tangent if a chain of triangles connects them, each with
an edge in common with the next, and if none of these triangles shows its texture mirrored while another does
not. The tangent is the mean of the directions in which u grows on their triangles, each laid into the plane
of the vertex's normal and weighted by the angle of its corner.

A triangle whose texture coordinates have no area has no such direction: it takes part in chains, and counts
as mirrored if the first triangle beside it is (in MikkTSpace's program, if that which reaches it first is). A
triangle with two corners at one position takes the tangents of others there. Where nothing gives a tangent,
it is any vector at a right angle to the normal (in MikkTSpace's program, the x axis).

The textures' v points up here, as in `Geom`; the sign of a tangent is that with which
cross(normal, tangent) * sign points along v. glTF's normal maps and its own tangents have y and the bitangent
up in the picture (section 3.9.3), so that these signs are also glTF's, though its v points down.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.groups import Int, connected, row_ids

_FLATTEST = 1e-12
"""The area of texture coordinates that counts as none, of the products whose difference it is."""

_SHORTEST = 1e-12
"""The length of a unit vector's part in a plane that counts as none."""


class TangentGroups:
    """The corners of triangles that share a tangent.

    Parameters
    ----------
    vertices, normals : ndarray of float64, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    texcoords : ndarray of float64, shape (n, 2)
        With v up.
    """

    def __init__(
        self, vertices: Float64, triangles: NDArray[np.integer], normals: Float64, texcoords: Float64
    ) -> None:
        self._triangles = np.asarray(triangles, dtype=np.int64)
        a, b, c = np.moveaxis(texcoords[self._triangles], 1, 0)
        self._one, self._other = b - a, c - a
        with np.errstate(all="ignore"):  # transformed texture coordinates may be huge
            products = self._one[:, 0] * self._other[:, 1], self._one[:, 1] * self._other[:, 0]
            area = products[0] - products[1]
            has_area = np.abs(area) > _FLATTEST * (np.abs(products[0]) + np.abs(products[1]))
        places = row_ids(np.hstack([vertices, normals, texcoords]))[self._triangles]
        points = row_ids(vertices)[self._triangles]
        whole = (points != np.roll(points, 1, axis=1)).all(axis=1)
        self._counts = has_area & whole
        edges = _shared_edges(places, whole)
        self._signs = _signs(area, self._counts, edges // 3)
        self._groups = self._linked(edges)
        self._join_degenerate(places, whole)

    def _linked(self, edges: Int) -> Int:
        """Return the group of each corner (3 m,), the number of a corner."""
        one, other = edges[:, self._signs[edges[0] // 3] == self._signs[edges[1] // 3]]
        ends = _next(one), _next(other)
        links = np.concatenate([one, ends[0]]), np.concatenate([ends[1], other])
        return connected(self._triangles.size, *links)

    def _join_degenerate(self, places: Int, whole: NDArray[np.bool_]) -> None:
        """Put the corners of degenerate triangles into the first group at their vertex."""
        good = np.repeat(whole, 3)
        if good.all():
            return
        none = places.size
        first = np.full(places.max() + 1, none)
        np.minimum.at(first, places.ravel()[good], np.flatnonzero(good))
        found = first[places.ravel()]
        joined = ~good & (found < none)
        self._groups[joined] = self._groups[found[joined]]

    def corners(self, vertices: Float64, normals: Float64) -> Float64:
        """Return the tangent of each corner, shape (m, 3, 4): a unit vector, and 1 or -1.

        `vertices` and `normals` may be those of another pose of the same triangles.
        """
        with np.errstate(all="ignore"):
            directions, angles = self._directions(vertices, normals)
            return self._summed(directions, angles, normals)

    def vertices(self, vertices: Float64, normals: Float64) -> Float64:
        """Return a tangent for each vertex, shape (n, 4): the mean of its corners', weighted by angle."""
        count = len(vertices)
        with np.errstate(all="ignore"):
            directions, angles = self._directions(vertices, normals)
            corners = self._summed(directions, angles, normals).reshape(-1, 4)
            owners = self._triangles.ravel()
            sums = _sums(corners * angles.reshape(-1, 1), owners, count)
            first = np.full(count, -1)
            first[owners[::-1]] = np.arange(len(owners))[::-1]
            otherwise = perpendicular(normals)
            otherwise[owners] = corners[first[owners], :3]
            signs = np.where(sums[:, 3] < 0.0, -1.0, 1.0)
            return np.column_stack([_units(sums[:, :3], otherwise), signs])

    def _directions(self, vertices: Float64, normals: Float64) -> tuple[Float64, Float64]:
        """Return the direction of u in each corner's plane (m, 3, 3), and each corner's angle there."""
        points, up = vertices[self._triangles], _units(normals)[self._triangles]
        edges = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
        along = self._other[:, 1:] * edges[0] - self._one[:, 1:] * edges[1]
        along = _units(along) * self._signs[:, None]
        along = np.where(self._counts[:, None], along, 0.0)
        directions = _units(_laid(along[:, None], up))
        to_next = _units(_laid(_units(np.roll(points, -1, axis=1) - points), up))
        to_last = _units(_laid(_units(np.roll(points, 1, axis=1) - points), up))
        angles = np.arccos(np.clip(_dots(to_next, to_last)[..., 0], -1.0, 1.0))
        return directions, np.where(self._counts[:, None], angles, 0.0)

    def _summed(self, directions: Float64, angles: Float64, normals: Float64) -> Float64:
        weighted = (directions * angles[..., None]).reshape(-1, 3)
        sums = _sums(weighted, self._groups, len(self._groups))[self._groups]
        otherwise = perpendicular(normals)[self._triangles.ravel()]
        signs = np.repeat(self._signs, 3)[self._groups]
        return np.column_stack([_units(sums, otherwise), signs]).reshape(-1, 3, 4)


def split_at_tangents(triangles: NDArray[np.integer], corners: Float64) -> tuple[Int, Int]:
    """Return a corner for each of k vertices with one tangent each, shape (k,), and the triangles (m, 3).

    A corner is three times the number of its triangle, plus 0 to 2. The first vertices are the old ones, in
    their order; then come copies for corners with other tangents.

    Parameters
    ----------
    triangles : ndarray of int, shape (m, 3)
        They use every vertex.
    corners : ndarray of float64, shape (m, 3, 4)
        See `TangentGroups.corners`.
    """
    old, tangents = np.asarray(triangles, dtype=np.int64).ravel(), corners.reshape(-1, 4)
    first = np.zeros(old.max(initial=-1) + 1, dtype=np.int64)
    first[old[::-1]] = np.arange(len(old))[::-1]
    apart = np.flatnonzero((tangents != tangents[first[old]]).any(axis=1))
    ids = row_ids(np.column_stack([old[apart], tangents[apart]]))
    _, chosen, copies = np.unique(ids, return_index=True, return_inverse=True)
    new = old.copy()
    new[apart] = len(first) + copies
    return np.concatenate([first, apart[chosen]]), new.reshape(-1, 3)


def perpendicular(normals: Float64) -> Float64:
    """Return a unit vector at a right angle to each normal (n, 3)."""
    units = _units(normals)
    axes = np.eye(3)[np.abs(units).argmin(axis=1)]
    return _units(_laid(axes, units))


def _shared_edges(places: Int, whole: NDArray[np.bool_]) -> Int:
    """Return pairs of corners (2, k) whose edges to their next corners are one, in opposite directions.

    Where more than two triangles share an edge, the first in one direction meets the first in the other, and
    so on.
    """
    starts = np.flatnonzero(np.repeat(whole, 3))
    ends = _next(starts)
    low, high = places.ravel()[starts], places.ravel()[ends]
    forwards = low < high
    low, high = np.minimum(low, high), np.maximum(low, high)
    keys = low * (places.max(initial=0) + 1) + high
    order = np.lexsort((forwards, keys))
    begins = np.ones(len(order), bool)
    begins[1:] = (keys[order][1:] != keys[order][:-1]) | (forwards[order][1:] != forwards[order][:-1])
    counted = np.arange(len(order))
    ranks = np.empty(len(order), dtype=np.int64)
    ranks[order] = counted - np.maximum.accumulate(np.where(begins, counted, 0))
    order = np.lexsort((forwards, ranks, keys))
    pairs = np.flatnonzero(
        (keys[order][1:] == keys[order][:-1])
        & (ranks[order][1:] == ranks[order][:-1])
        & (forwards[order][1:] != forwards[order][:-1])
    )
    return starts[np.stack([order[pairs], order[pairs + 1]])]


def _signs(area: Float64, counts: NDArray[np.bool_], sharing: Int) -> Float64:
    """Return 1 for each triangle, -1 for those that show their texture mirrored.

    Neighbouring triangles without a direction of their own follow the first triangle beside one of them.
    """
    signs = np.where(counts & (area < 0.0), -1.0, 1.0)
    if counts.all():
        return signs
    one, other = sharing
    alike = ~counts[one] & ~counts[other]
    regions = connected(len(signs), one[alike], other[alike])
    first = np.full(len(signs), len(signs))
    for inside, beside in ((one, other), (other, one)):
        border = ~counts[inside] & counts[beside]
        np.minimum.at(first, regions[inside[border]], beside[border])
    leader = first[regions]
    follows = ~counts & (leader < len(signs))
    signs[follows] = signs[leader[follows]]
    return signs


def _next(corners: Int) -> Int:
    """Return the corners that follow these in their triangles."""
    return np.where(corners % 3 == 2, corners - 2, corners + 1)


def _laid(vectors: Float64, normals: Float64) -> Float64:
    """Return unit vectors without their part along unit normals; 0 where only rounding is left."""
    laid = vectors - normals * _dots(vectors, normals)
    return np.where(_dots(laid, laid) > _SHORTEST**2, laid, 0.0)


def _dots(one: Float64, other: Float64) -> Float64:
    """Return scalar products, shape (..., 1); much faster than a sum along the short axis."""
    return np.asarray(np.einsum("...i,...i->...", one, other)[..., None])


def _sums(rows: Float64, owners: Int, count: int) -> Float64:
    return np.stack([np.bincount(owners, column, count) for column in rows.T], axis=1)


def _units(vectors: Float64, otherwise: Float64 | float = 0.0) -> Float64:
    """Return vectors of length 1; `otherwise` for those without a direction."""
    x, y, z = np.abs(np.moveaxis(vectors, -1, 0))
    largest = np.maximum(np.maximum(x, y), z)[..., None]  # so that squares neither over- nor underflow
    scaled = vectors / np.where(largest > 0.0, largest, 1.0)
    squares = _dots(scaled, scaled)
    known = squares > 0.0  # false for NaN
    return np.where(known, scaled / np.sqrt(np.where(known, squares, 1.0)), otherwise)
