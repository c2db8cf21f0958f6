"""All triangles of some instances, and which of them a ray meets first, by Embree.

Embree computes in float32: it finds candidates, and whoever asks decides in float64. What it cannot tell
apart is about 1e-7 of the distances: which of two triangles that share an edge a ray through that edge meets,
or which of two surfaces that lie so close is the nearer one. A rasteriser, whose corners snap to 1/256 of a
pixel, errs by a hundred times as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import MissingPackageError
from firefly_sample.extras import install_command
from firefly_sample.scene.geom import Geom

Float64 = NDArray[np.float64]


class RayScene:
    """Instances of Geoms in one space.

    Parameters
    ----------
    geoms : sequence of Geom
        One for each instance; they may repeat.
    matrices : ndarray of float64, shape (instances, 4, 4)
        From model space to the rays' space, for row vectors.
    stretch : (float, float, float), optional
        Factors of the axes, for Embree only: rays through a very narrow lens keep their digits if its picture
        is made about as wide as it is far away.

    Raises
    ------
    MissingPackageError
        If embreex is not installed.
    """

    def __init__(
        self, geoms: Sequence[Geom], matrices: Float64, stretch: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ) -> None:
        unique = {id(geom): geom for geom in geoms}
        order = {key: index for index, key in enumerate(unique)}
        own = np.array([order[id(geom)] for geom in geoms], dtype=np.intp)
        vertices = np.cumsum([0, *(len(geom.vertices) for geom in unique.values())])
        triangles = np.cumsum([0, *(len(geom.triangles) for geom in unique.values())])
        self._vertices = _joined([geom.vertices for geom in unique.values()], 3)
        self._texcoords = _joined([geom.texcoords for geom in unique.values()], 2)
        self._alphas = _joined([_alphas(geom)[:, None] for geom in unique.values()], 1)[:, 0]
        parts = [geom.triangles + first for geom, first in zip(unique.values(), vertices, strict=False)]
        self._triangles = np.concatenate([np.zeros((0, 3), dtype=np.intp), *parts])
        self._matrices = matrices
        self._first_triangle = triangles[own]
        self._first = np.concatenate([[0], np.cumsum((triangles[1:] - triangles[:-1])[own])])
        self._stretch = np.array(stretch)
        self._scale = 1.0
        self._scene, self._mesh = _embree(*self._float32(vertices, own))

    def _float32(
        self, vertices: NDArray[np.intp], own: NDArray[np.intp]
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Corners and triangles of all instances; scaled, so that no product leaves float32's range."""
        places, indices, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int32)], 0
        for instance, geom in enumerate(own):
            matrix = self._matrices[instance]
            moved = self._vertices[vertices[geom] : vertices[geom + 1]] @ matrix[:3, :3] + matrix[3, :3]
            places.append(moved * self._stretch)
            first = self._first_triangle[instance]
            rows = self._triangles[first : first + self._first[instance + 1] - self._first[instance]]
            indices.append((rows - vertices[geom] + count).astype(np.int32))
            count += len(moved)
        corners = np.concatenate(places)
        self._scale = 1.0 / max(float(np.abs(corners).max(initial=0.0)), 1e-300)
        return (corners * self._scale).astype(np.float32), np.concatenate(indices)

    def __len__(self) -> int:
        return int(self._first[-1])

    def nearest(self, origin: Float64, direction: Float64, end: Float64) -> NDArray[np.intp]:
        """The number of the first triangle that each ray meets, from either side; -1 where there is none.

        Parameters
        ----------
        origin, direction : ndarray of float64, shape (n, 3)
        end : ndarray of float64, shape (n,)
            How far to look, in units of the direction.
        """
        if not len(self) or not len(origin):
            return np.full(len(origin), -1)
        rays = [
            np.ascontiguousarray(values * (self._stretch * self._scale), dtype=np.float32)
            for values in (origin, direction)
        ]
        limits = np.minimum(end, 1e30).astype(np.float32)
        found = self._scene.run(*rays, dists=limits, query="INTERSECT")
        return np.asarray(found, dtype=np.intp)

    def owner(self, number: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The instances of triangles, and their numbers in their Geoms."""
        instance = np.searchsorted(self._first, number, side="right") - 1
        return instance, number - self._first[instance]

    def corners(self, number: NDArray[np.intp]) -> Float64:
        """Where the corners of triangles are, in float64, shape (n, 3, 3)."""
        instance, _ = self.owner(number)
        matrix = self._matrices[instance]
        places = self._vertices[self._corner_rows(number)]
        return np.asarray(places @ matrix[:, :3, :3] + matrix[:, None, 3, :3])

    def texcoords(self, number: NDArray[np.intp]) -> Float64:
        """Texture coordinates of the corners of triangles, shape (n, 3, 2)."""
        return np.asarray(self._texcoords[self._corner_rows(number)])

    def alphas(self, number: NDArray[np.intp]) -> Float64:
        """Alpha of the vertex colours of the corners of triangles, shape (n, 3)."""
        return np.asarray(self._alphas[self._corner_rows(number)])

    def _corner_rows(self, number: NDArray[np.intp]) -> NDArray[np.intp]:
        instance, triangle = self.owner(number)
        return np.asarray(self._triangles[self._first_triangle[instance] + triangle])


def _alphas(geom: Geom) -> Float64:
    return np.ones(len(geom.vertices)) if geom.alphas is None else geom.alphas


def _joined(arrays: list[Float64], columns: int) -> Float64:
    return np.concatenate([np.zeros((0, columns)), *arrays])


def _embree(corners: NDArray[np.float32], triangles: NDArray[np.int32]) -> tuple[Any, Any]:
    """Embree's scene, built, and its mesh, which must live as long."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError as error:
        raise MissingPackageError(
            f"rays need embreex, which is not installed: run {install_command('measure')}"
        ) from error
    scene = EmbreeScene(robust=True)
    if not len(triangles):
        return scene, None
    mesh = TriangleMesh(scene, corners, triangles)
    nowhere = np.zeros((1, 3), dtype=np.float32)
    # what is built by the first ray must not be built by several threads
    scene.run(nowhere, np.array([[0, 1, 0]], dtype=np.float32), query="INTERSECT")
    return scene, mesh
