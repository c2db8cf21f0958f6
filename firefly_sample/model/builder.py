"""Collects what a reader finds in a file, turned to Z up, as a `ModelData`."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.conventions import turn, turn_matrix
from firefly_sample.model.creases import split_at_creases
from firefly_sample.model.data import GeomData, ImageData, MaterialData, ModelData, NodeData, TextureData
from firefly_sample.model.folder import Folder
from firefly_sample.model.formats import Up
from firefly_sample.scene.arrays import LARGEST, Float64
from firefly_sample.scene.groups import Int
from firefly_sample.scene.material import AlphaMode
from firefly_sample.scene.tangents import TangentGroups, split_at_tangents
from firefly_sample.scene.texture import Wrap

GREY = (0.8, 0.8, 0.8, 1.0)
"""The base colour where a file gives none."""


class Builder:
    """Makes nodes, geoms, materials and textures of the content of one file.

    Parameters
    ----------
    path : Path
        The file, after which the model is named.
    up : {"x", "y", "z"}
        The axis that points up in it.
    folder : Folder
        The files beside it.
    losses : Losses
        Notes what is not drawn.
    """

    def __init__(self, path: Path, up: Up, folder: Folder, losses: Losses) -> None:
        self.path = path
        self.up = up
        self.folder = folder
        self.losses = losses
        self.model = ModelData(path.stem)
        self._materials: dict[Hashable, int] = {}
        self._images: dict[int, int] = {}
        self._textures: dict[tuple[int, Wrap], int] = {}

    def add_node(self, name: str, parent: int, matrix: Float64 | None = None) -> int:
        """Return the index of a new node; `matrix` (4, 4) is for row vectors in the file's axes.

        Raises
        ------
        ModelError
            If a number of the matrix is not finite.
        """
        if matrix is not None and (matrix.shape != (4, 4) or not np.isfinite(matrix).all()):
            raise ModelError(f"model {self.path}: node {name!r} has a transform that is not finite")
        if matrix is not None:
            matrix = None if np.array_equal(matrix, np.eye(4)) else turn_matrix(self.up, matrix)
        self.model.nodes.append(NodeData(name, parent, matrix))
        return len(self.model.nodes) - 1

    def add_geom(
        self,
        name: str,
        material: int,
        triangles: NDArray[Any],
        arrays: dict[str, Float64],
        groups: Int | None = None,
    ) -> tuple[int, ...]:
        """Return the index of a new geom with normals, of the vertices that are used; () without triangles.

        Parameters
        ----------
        name : str
        material : int
        triangles : ndarray of int, shape (m, 3)
        arrays : dict
            "vertices", and what there is of "normals", "texcoords" and "colors" (linear), a row for each
            vertex. Missing normals are made by `split_at_creases`, as are all if one is no direction. A
            normal map's tangents are always made.
        groups : ndarray of int64, shape (m,), optional
            Smoothing groups, for that.

        Raises
        ------
        ModelError
            If an index is out of range, or a number is not finite or too large.
        """
        damaged = f"model {self.path}: mesh {name!r} is damaged"
        triangles = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
        if not len(triangles):
            return ()
        if triangles.min() < 0 or triangles.max() >= len(arrays["vertices"]):
            raise ModelError(f"{damaged}: a triangle uses a vertex that is not there")
        used, compact = np.unique(triangles, return_inverse=True)
        triangles = compact.reshape(-1, 3)
        arrays = {what: np.ascontiguousarray(array[used], dtype=np.float64) for what, array in arrays.items()}
        for what in arrays.keys() - {"normals"}:
            if not (np.abs(arrays[what]) <= LARGEST).all():
                raise ModelError(
                    f"{damaged}: its {what} have a number that is not finite or above {LARGEST:g}"
                )
        normals = _units(arrays.pop("normals", None))
        if normals is None:
            merge = arrays.keys() == {"vertices"}
            source, triangles, normals = split_at_creases(arrays["vertices"], triangles, groups, merge)
            arrays = {what: array[source] for what, array in arrays.items()}
        arrays["vertices"] = arrays["vertices"] @ turn(self.up) + 0.0  # no negative zeros
        arrays["normals"] = normals @ turn(self.up) + 0.0
        if "colors" in arrays and (arrays["colors"] == 1.0).all():
            del arrays["colors"]
        if self.model.materials[material].normal_texture is not None and "texcoords" in arrays:
            arrays, triangles = _with_tangents(arrays, triangles)
        self.model.geoms.append(GeomData(name, material, {**arrays, "triangles": triangles.astype(np.int32)}))
        return (len(self.model.geoms) - 1,)

    def material(self, key: Hashable, make: Callable[[], MaterialData]) -> int:
        """Return the index of the material with this key, which is made once."""
        if key not in self._materials:
            made = make()
            self._materials[key] = len(self.model.materials)
            self.model.materials.append(made)
        return self._materials[key]

    def plain_material(self, colors: Float64 | None) -> int:
        """Return the index of the material of geoms without one, which have these colours (n, 4) or none."""
        base_color = GREY if colors is None else (1.0, 1.0, 1.0, 1.0)
        mode: AlphaMode = "opaque" if colors is None or (colors[:, 3] == 1.0).all() else "blend"
        made = MaterialData("plain", base_color, alpha_mode=mode, double_sided=True)
        return self.material(("plain", base_color, mode), lambda: made)

    def texture(self, image: ImageData | None, wrap: Wrap = "repeat") -> int | None:
        """Return the index of the texture of an image, which is made once; None of none."""
        if image is None:
            return None
        index = self._images.setdefault(id(image), len(self.model.images))
        if index == len(self.model.images):
            self.model.images.append(image)
        if (index, wrap) not in self._textures:
            self._textures[index, wrap] = len(self.model.textures)
            self.model.textures.append(TextureData(index, wrap_u=wrap, wrap_v=wrap))
        return self._textures[index, wrap]


def _with_tangents(arrays: dict[str, Float64], triangles: Int) -> tuple[dict[str, Float64], Int]:
    """Return arrays with "tangents", where vertices are copied for triangles with different ones."""
    vertices, normals = arrays["vertices"], arrays["normals"]
    corners = TangentGroups(vertices, triangles, normals, arrays["texcoords"]).corners(vertices, normals)
    chosen, split = split_at_tangents(triangles, corners)
    made = {what: array[triangles.ravel()[chosen]] for what, array in arrays.items()}
    return {**made, "tangents": corners.reshape(-1, 4)[chosen]}, split


def _units(normals: Float64 | None) -> Float64 | None:
    """Return normals as unit vectors; None if one of them is no direction."""
    if normals is None:
        return None
    with np.errstate(all="ignore"):
        scaled = normals / np.abs(normals).max(axis=1, keepdims=True)
        units = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return units if np.isfinite(units).all() else None
