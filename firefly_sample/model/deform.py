"""Morph targets and skins: the vertices, normals and tangents of a geom in a pose, in float64.

A geom is morphed first and then skinned (glTF 2.0, 3.7.2.2 and 3.7.3). A skin moves each vertex by the
blended matrix of its joints, which is linear-blend skinning.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.model.data import GeomData
from firefly_sample.scene.arrays import Float64, ReadOnlyArrays, read_only
from firefly_sample.scene.tangents import perpendicular

DEFORMING = frozenset({"morph_vertices", "morph_normals", "morph_tangents", "joints", "joint_weights"})
"""The arrays of a `GeomData` that deform it, and are no arguments of a `Geom`."""

_BLOCK = 2048
"""Vertices that are skinned at once, so that all steps of it stay in the processor's cache."""


class Posed(NamedTuple):
    """Vertices and unit normals (n, 3) of a geom in a pose, and its tangents (n, 4) if it has some."""

    vertices: Float64
    normals: Float64
    tangents: Float64 | None


class Shape(ReadOnlyArrays):
    """A geom at rest, with its targets, joints and weights; it never changes, so copies of models share it.

    Parameters
    ----------
    made : GeomData
    normals : ndarray, shape (n, 3)
        Its unit normals at rest.
    is_skinned : bool
        Whether its joints are used, if it has any.
    is_turned : bool
        Whether its triangles are turned over.
    """

    def __init__(
        self, made: GeomData, normals: Float64, is_skinned: bool = False, is_turned: bool = False
    ) -> None:
        arrays = made.arrays
        self.vertices = _own(arrays["vertices"])
        self.normals = _own(normals)
        triangles = arrays["triangles"][:, ::-1] if is_turned else arrays["triangles"]
        self.triangles = _own(triangles, np.int32) if made.flat else None
        none = np.zeros((0, *self.vertices.shape))
        self.targets = _own(arrays.get("morph_vertices", none))
        self.normal_targets = _own(arrays.get("morph_normals", none))
        self.tangents = _own(arrays["tangents"]) if "tangents" in arrays else None
        self.tangent_targets = _own(arrays.get("morph_tangents", none))
        self.flat_tangents: Float64 | None = None
        if self.triangles is not None and self.tangents is not None:
            self.flat_tangents = _own(edge_shares(self.vertices, self.triangles, self.tangents[:, :3]))
            self.tangents = _own(self.tangents * (1.0, 1.0, 1.0, -1.0 if is_turned else 1.0))
        self.joints: NDArray[np.intp] | None = None
        self.joint_weights: Float64 | None = None
        if is_skinned and "joints" in arrays:
            self.joints = _own(arrays["joints"].T, np.intp)
            self.joint_weights = _own(normalized_weights(arrays["joint_weights"]).T)

    def __copy__(self) -> Shape:
        return self

    def __deepcopy__(self, _: dict[int, Any]) -> Shape:
        return self

    def posed(self, weights: Sequence[float], matrices: Float64 | None = None) -> Posed:
        """Return the geom with these weights of targets and matrices of joints.

        `matrices`, shape (j, 4, 4), map row vectors from the geom's space at rest to the model's.
        """
        vertices = morphed(self.vertices, self.targets, weights)
        normals, tangents = self.normals, self.tangents
        if self.triangles is None:
            moved = morphed(normals, self.normal_targets, weights)
            normals = normals if moved is normals else unit_or(moved, normals)
            tangents = self._morphed_tangents(weights)
        if self.joints is not None and matrices is not None:
            vertices, normals, tangents = self._skinned(vertices, normals, tangents, matrices)
        if self.triangles is not None:
            normals = flat_normals(vertices, self.triangles, normals)
            if tangents is not None and self.flat_tangents is not None:
                laid = from_edge_shares(vertices, self.triangles, self.flat_tangents)
                directions = unit_or(laid, perpendicular(normals))
                tangents = np.column_stack([directions, tangents[:, 3]])
        return Posed(vertices, normals, tangents)

    def _morphed_tangents(self, weights: Sequence[float]) -> Float64 | None:
        if self.tangents is None:
            return None
        rest = self.tangents[:, :3]
        moved = morphed(rest, self.tangent_targets, weights)
        if moved is rest:
            return self.tangents
        return np.column_stack([unit_or(moved, rest), self.tangents[:, 3]])

    def _skinned(
        self, points: Float64, normals: Float64, tangents: Float64 | None, matrices: Float64
    ) -> tuple[Float64, Float64, Float64 | None]:
        """Return all three moved by the skin; of a flat geom, normals and tangents as they are."""
        assert self.joints is not None
        assert self.joint_weights is not None
        is_flat = self.triangles is not None
        moved, turned = np.empty_like(points), normals if is_flat else np.empty_like(normals)
        along = tangents if tangents is None or is_flat else np.empty_like(tangents)
        for start in range(0, len(points), _BLOCK):
            part = slice(start, start + _BLOCK)
            blended = blend_matrices(self.joints[:, part], self.joint_weights[:, part], matrices)
            moved[part] = skinned_points(points[part], blended)
            if not is_flat:
                turned[part] = skinned_normals(normals[part], blended)
                if along is not None and tangents is not None:
                    along[part] = skinned_tangents(tangents[part], blended)
        return moved, turned, along


def _own(array: Any, dtype: type = np.float64) -> NDArray[Any]:
    return read_only(np.array(array, dtype=dtype, order="C"))


def normalized_weights(weights: NDArray[Any]) -> Float64:
    """Return the weights of joints (n, j), divided by their sum; without any, the first joint has all."""
    own = np.array(weights, dtype=np.float64)
    total = own.sum(axis=1)
    own[~(total > 0.0), 0] = 1.0
    return np.asarray(own / np.where(total > 0.0, total, 1.0)[:, None])


def morphed(rest: Float64, targets: Float64, weights: Sequence[float]) -> Float64:
    """Return `rest` plus each target times its weight; `rest` itself if all weights are 0 or missing."""
    result = rest
    for target, weight in zip(targets, weights, strict=False):
        if weight != 0.0:
            result = result + weight * target
    return result


def blend_matrices(joints: NDArray[np.intp], weights: Float64, matrices: Float64) -> Float64:
    """Return the weighted sum of each vertex's joint matrices.

    Arrays have a row for each influence, or for each element of a matrix: then every step is one operation on
    a long array that stays in the processor's cache.

    Parameters
    ----------
    joints, weights : ndarray, shape (k, n)
        Indices into `matrices`, and their weights.
    matrices : ndarray, shape (j, 4, 4)
        Affine, for row vectors.

    Returns
    -------
    ndarray, shape (12, n)
        The first three columns of the matrices, row by row.
    """
    elements = np.ascontiguousarray(matrices[:, :, :3].reshape(len(matrices), 12).T)
    blended = np.zeros((12, joints.shape[1]))
    part = np.empty(joints.shape[1])
    for element, total in zip(elements, blended, strict=True):
        for joint, weight in zip(joints, weights, strict=True):
            np.take(element, joint, out=part, mode="clip")  # "raise" would copy; the indices are checked
            np.multiply(part, weight, out=part)
            total += part
    return blended


def skinned_points(points: Float64, blended: Float64) -> Float64:
    """Return points (n, 3), each moved by its matrix, see `blend_matrices`."""
    x, y, z = points.T
    m = blended
    moved = np.empty_like(points)
    for column in range(3):
        moved[:, column] = x * m[column] + y * m[3 + column] + z * m[6 + column] + m[9 + column]
    return moved


def skinned_normals(normals: Float64, blended: Float64) -> Float64:
    """Return unit normals (n, 3), each turned by the inverse transpose of its matrix's upper 3x3.

    The inverse transpose is the matrix of cofactors over the determinant, of which a unit normal needs only
    the sign. So a matrix that flattens space onto a plane gives the plane's normal. A normal whose length
    would be 0 stays.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = blended[:9].reshape(3, 3, -1)
    rows = (
        (yy * zz - yz * zy, yz * zx - yx * zz, yx * zy - yy * zx),
        (zy * xz - zz * xy, zz * xx - zx * xz, zx * xy - zy * xx),
        (xy * yz - xz * yy, xz * yx - xx * yz, xx * yy - xy * yx),
    )
    determinant = xx * rows[0][0] + xy * rows[0][1] + xz * rows[0][2]
    sign = np.where(determinant < 0.0, -1.0, 1.0)
    x, y, z = normals.T
    turned = np.empty_like(normals)
    for column in range(3):
        turned[:, column] = sign * (x * rows[0][column] + y * rows[1][column] + z * rows[2][column])
    return unit_or(turned, normals)


def skinned_tangents(tangents: Float64, blended: Float64) -> Float64:
    """Return tangents (n, 4), each moved by its matrix's upper 3x3; a matrix that mirrors turns the sign.

    One whose length would be 0 stays. A tangent in the plane of its normal stays in that of
    `skinned_normals`.
    """
    x, y, z = tangents[:, :3].T
    m = blended
    moved = np.empty_like(tangents[:, :3])
    for column in range(3):
        moved[:, column] = x * m[column] + y * m[3 + column] + z * m[6 + column]
    determinant = np.linalg.det(blended[:9].T.reshape(-1, 3, 3))
    signs = tangents[:, 3] * np.where(determinant < 0.0, -1.0, 1.0)
    return np.column_stack([unit_or(moved, tangents[:, :3]), signs])


def edge_shares(vertices: Float64, triangles: NDArray[np.int32], tangents: Float64) -> Float64:
    """Return tangents as multiples (n, 2) of the two edges from the first vertex of their triangle.

    No vertex belongs to two triangles. With these numbers, `from_edge_shares` lays the tangents into the
    plane of the triangle in another pose, along the same direction of the texture. They are 0 for triangles
    without area.
    """
    one, other = _edges(vertices, triangles)
    with np.errstate(all="ignore"):
        a, b, c = (np.einsum("ij,ij->i", *pair) for pair in ((one, one), (one, other), (other, other)))
        shares = np.zeros((len(vertices), 2))
        for corner in triangles.T:
            along = (np.einsum("ij,ij->i", tangents[corner], edge) for edge in (one, other))
            first, second = along
            shares[corner] = np.stack([first * c - second * b, second * a - first * b], axis=1)
            shares[corner] /= (a * c - b * b)[:, None]
    shares[~np.isfinite(shares).all(axis=1)] = 0.0
    return shares


def from_edge_shares(vertices: Float64, triangles: NDArray[np.int32], shares: Float64) -> Float64:
    """Return the vectors (n, 3) whose `edge_shares` these are."""
    one, other = _edges(vertices, triangles)
    vectors = np.zeros_like(vertices)
    for corner in triangles.T:
        vectors[corner] = shares[corner, :1] * one + shares[corner, 1:] * other
    return vectors


def _edges(vertices: Float64, triangles: NDArray[np.int32]) -> tuple[Float64, Float64]:
    a, b, c = (vertices[corner] for corner in triangles.T)
    return b - a, c - a


def flat_normals(vertices: Float64, triangles: NDArray[np.int32], otherwise: Float64) -> Float64:
    """Return the normal of its triangle for each vertex (n, 3); `otherwise` where it has no area."""
    a, b, c = (vertices[corner] for corner in triangles.T)
    faces = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for corner in triangles.T:
        normals[corner] = faces
    return unit_or(normals, otherwise)


def unit_or(vectors: Float64, otherwise: Float64) -> Float64:
    """Return vectors (n, 3) of length 1; of those without a length, the rows of `otherwise`."""
    x, y, z = vectors.T
    largest = np.maximum(np.maximum(np.abs(x), np.abs(y)), np.abs(z))
    safe = np.where(largest > 0.0, largest, 1.0)  # so that squares neither over- nor underflow
    scaled = vectors / safe[:, None]
    x, y, z = scaled.T
    length = np.sqrt(x * x + y * y + z * z)
    unit = scaled / np.where(length > 0.0, length, 1.0)[:, None]
    return np.where((length > 0.0)[:, None], unit, otherwise)
