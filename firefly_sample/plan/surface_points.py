"""Points on all surfaces of a scene, spread evenly by area and always the same ones.

The area of every triangle of every instance is too much work for a large scene. A mesh is therefore measured
once, in model space, and an instance counts as that area times its mean square scale. An instance that is
stretched has its points weighted by how much its matrix really stretches the surface there, which is what an
importance sampling does: sums over weighted points are right, whatever the matrices.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.instances import Group, Instances
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import Geom

MOST_TRIANGLES = 2**18
"""Triangles of a mesh that are measured: of a larger one every second, every third, and so on."""

_ROOT = 1.2207440846057596
_STEPS = (1.0 / _ROOT, 1.0 / _ROOT**2, 1.0 / _ROOT**3)
"""Steps of the R3 sequence, whose points fill a unit cube evenly (M. Roberts, "The Unreasonable Effectiveness
of Quasirandom Sequences", 2018): `_ROOT` is the real root of x^4 = x + 1."""


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """n points on surfaces, in world space."""

    positions: Float64  # (n, 3)
    normals: Float64  # (n, 3), of the side that is lit: unit vectors, zeros where a mesh has none
    areas: Float64  # (n,), the area that each point stands for
    instances: NDArray[np.intp]  # (n,), indices into `Instances`

    def __len__(self) -> int:
        return len(self.areas)

    def take(self, chosen: NDArray[np.intp] | slice) -> SurfacePoints:
        """Return the chosen points."""
        return SurfacePoints(*(getattr(self, column.name)[chosen] for column in fields(self)))


@dataclass(frozen=True, eq=False)
class _Mesh:
    """The m measured triangles of a Geom: where each ends along the sum of their areas, in model space."""

    triangles: NDArray[np.int32]  # (m, 3)
    ends: Float64  # (m,)
    area: float  # of the whole mesh


def sample_surfaces(instances: Instances, count: int) -> SurfacePoints:
    """Return about `count` points on the surfaces of all instances; none if they have no area.

    A two-sided surface has each of its points twice, once for each side.
    """
    meshes = {id(group.geom): group.geom for group in instances.groups}
    measured = {name: _measured(geom) for name, geom in meshes.items()}
    areas = np.array([measured[id(group.geom)].area for group in instances.groups])[instances.which]
    with np.errstate(over="ignore", invalid="ignore"):
        sizes = areas * _mean_square_scales(instances.model_to_world[:, :3, :3])
    sizes = np.where(np.isfinite(sizes), sizes, 0.0)
    ends = np.cumsum(sizes)
    if not (len(ends) and 0.0 < ends[-1] < np.inf):
        return _joined([])
    jitter, across, up = np.modf(0.5 + np.outer(_STEPS, np.arange(count)))[0]
    places = (np.arange(count) + jitter) / count * ends[-1]
    chosen = np.minimum(np.searchsorted(ends, places, side="right"), np.searchsorted(ends, ends[-1]))
    within = np.clip((places - ends[chosen] + sizes[chosen]) / sizes[chosen], 0.0, 1.0)
    parts = []
    which = instances.which[chosen]
    for index in np.unique(which).tolist():
        mine, group = np.flatnonzero(which == index), instances.groups[index]
        rows = chosen[mine] - instances.starts[index]
        corners = across[mine], up[mine]
        mesh = measured[id(group.geom)]
        parts += _on_group(group, mesh, rows, within[mine], corners, ends[-1] / count, chosen[mine])
    return _joined(parts)


def _measured(geom: Geom) -> _Mesh:
    if not len(geom.triangles):  # lines and points have no area
        return _Mesh(geom.triangles, np.zeros(0), 0.0)
    step = -(-len(geom.triangles) // MOST_TRIANGLES)
    triangles = geom.triangles[::step]
    with np.errstate(over="ignore", invalid="ignore"):
        areas = 0.5 * np.linalg.norm(_edge_products(geom, triangles), axis=1)
    ends = np.cumsum(np.where(np.isfinite(areas), areas, 0.0))
    return _Mesh(triangles, ends, float(ends[-1]) * len(geom.triangles) / len(triangles))


def _edge_products(geom: Geom, triangles: NDArray[np.int32]) -> Float64:
    """Return the cross product of two edges of each triangle, twice its area long, shape (n, 3)."""
    a, b, c = (geom.vertices[corner] for corner in triangles.T)
    return np.asarray(np.cross(b - a, c - a))


def _cofactors(matrices: Float64) -> Float64:
    """Return the cofactors of matrices, shape (n, 3, 3), which take normals and areas to world space."""
    x, y, z = matrices[:, 0], matrices[:, 1], matrices[:, 2]
    return np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=1)


def _mean_square_scales(matrices: Float64) -> Float64:
    """Return the factor by which each matrix, shape (n, 3, 3), enlarges areas: the mean of all directions."""
    return np.asarray(np.sqrt((_cofactors(matrices) ** 2).sum(axis=(1, 2)) / 3.0))


def _on_group(
    group: Group,
    mesh: _Mesh,
    rows: NDArray[np.intp],
    within: Float64,
    corners: tuple[Float64, Float64],
    each: float,
    indices: NDArray[np.intp],
) -> list[SurfacePoints]:
    """Return the points on a group's instances `rows`, n of them, and those on their back if they have one.

    `within` is how far along its mesh's area each point lies, `corners` are coordinates within its triangle,
    0 to 1, and `each` is the area per point.
    """
    found = np.searchsorted(mesh.ends, within * mesh.ends[-1], side="right")
    triangles = mesh.triangles[np.minimum(found, int(np.searchsorted(mesh.ends, mesh.ends[-1])))]
    across, up = corners
    outside = across + up > 1.0  # in the other half of the square, which is turned over onto the triangle
    across, up = np.where(outside, 1.0 - across, across), np.where(outside, 1.0 - up, up)
    shares = np.stack([1.0 - across - up, across, up], axis=1)[:, :, None]
    geom, matrices = group.geom, group.model_to_world[rows]
    positions = np.einsum("ni,nij->nj", (geom.vertices[triangles] * shares).sum(axis=1), matrices[:, :3, :3])
    cofactors = _cofactors(matrices[:, :3, :3])
    faces = _units(_edge_products(geom, triangles))
    stretch = np.linalg.norm(np.einsum("ni,nij->nj", faces, cofactors), axis=1)
    normals = _units(np.einsum("ni,nij->nj", (geom.normals[triangles] * shares).sum(axis=1), cofactors))
    points = SurfacePoints(
        positions + matrices[:, 3, :3],
        -normals if group.mirrored else normals,
        each * stretch / _mean_square_scales(matrices[:, :3, :3]),
        indices,
    )
    if not group.double_sided:
        return [points]
    return [points, SurfacePoints(points.positions, -points.normals, points.areas, indices)]


def _units(vectors: Float64) -> Float64:
    """Return vectors of length 1, shape (n, 3); zeros stay zeros."""
    largest = np.abs(vectors).max(axis=1, initial=0.0, keepdims=True)  # divided out, so that squares fit
    scaled = vectors / np.where(largest > 0.0, largest, 1.0)
    lengths = np.linalg.norm(scaled, axis=1, keepdims=True)
    return np.asarray(scaled / np.where(lengths > 0.0, lengths, 1.0))


def _joined(parts: list[SurfacePoints]) -> SurfacePoints:
    none = SurfacePoints(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.intp))
    columns = (
        np.concatenate([getattr(part, column.name) for part in (none, *parts)])
        for column in fields(SurfacePoints)
    )
    return SurfacePoints(*columns)
