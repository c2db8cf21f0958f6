"""Triangles, and the node that holds them."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import SceneError
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode

__all__ = ["Geom", "GeomNode"]

Float64 = NDArray[np.float64]

_SERIALS = itertools.count()


class Geom:
    """Indexed triangles in model space. Geoms are shared: instancing is one Geom under many nodes.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Positions in model space (Z up), in scene units.
    triangles : array_like of int, shape (m, 3)
        Indices into `vertices`, counter-clockwise seen from the front.
    normals : array_like, shape (n, 3), optional
        Unit normals; area-weighted vertex normals are computed when absent.
    texcoords : array_like, shape (n, 2), optional
        Texture coordinates with v up (the first row of an image is v = 1); zeros when absent.
    colors : array_like, shape (n, 3) or (n, 4), optional
        Linear vertex colours that multiply the material's base colour; white when absent.
    name : str
        Used in messages.

    The arrays are copies and read-only: `set_vertices`, `set_normals` and `set_colors` replace them.

    Attributes
    ----------
    serial : int
        Its own, never another's, not even after its end.
    revision : int
        Grows with each change, so that whoever keeps a copy (the GPU) knows when it is stale.

    Raises
    ------
    SceneError
        If a shape is wrong, an index is out of range or a number is not finite.
    """

    def __init__(
        self,
        vertices: ArrayLike,
        triangles: ArrayLike,
        normals: ArrayLike | None = None,
        texcoords: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        name: str = "geom",
    ) -> None:
        self.name = name
        self.serial = next(_SERIALS)
        self.revision = 0
        self.vertices = self._floats("vertices", vertices, None, 3)
        n = len(self.vertices)
        self.triangles: NDArray[np.int32] = np.array(triangles, dtype=np.int32)
        self.triangles.setflags(write=False)
        if self.triangles.ndim != 2 or self.triangles.shape[1] != 3:
            raise SceneError(f"geom {name!r}: triangles must have shape (m, 3), got {self.triangles.shape}")
        if self.triangles.size and (self.triangles.min() < 0 or self.triangles.max() >= n):
            raise SceneError(f"geom {name!r}: a triangle index lies outside 0..{n - 1}")
        self.normals = self._vertex_normals() if normals is None else self._floats("normals", normals, n, 3)
        self.texcoords = np.zeros((n, 2)) if texcoords is None else self._floats("texcoords", texcoords, n, 2)
        self.colors: Float64 | None = None if colors is None else self._colors(colors)
        self._bounds: tuple[Float64, Float64] | None = None

    def _floats(self, what: str, values: ArrayLike, rows: int | None, columns: int) -> Float64:
        array = np.array(values, dtype=np.float64)
        if array.ndim != 2 or array.shape[1] != columns or (rows is not None and len(array) != rows):
            expected = f"({'n' if rows is None else rows}, {columns})"
            raise SceneError(f"geom {self.name!r}: {what} must have shape {expected}, got {array.shape}")
        if not np.isfinite(array).all():
            raise SceneError(f"geom {self.name!r}: {what} has a number that is not finite")
        array.setflags(write=False)
        return array

    def _vertex_normals(self) -> Float64:
        corners = self.vertices[self.triangles]
        face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = np.zeros_like(self.vertices)
        for corner in range(3):
            np.add.at(normals, self.triangles[:, corner], face)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        up = np.broadcast_to([0.0, 0.0, 1.0], normals.shape)
        return np.where(length > 0, normals / np.where(length > 0, length, 1.0), up)

    @property
    def bounds(self) -> tuple[Float64, Float64]:
        """The axis-aligned box (minimum, maximum) in model space; NaN without vertices."""
        if self._bounds is None:
            if len(self.vertices):
                self._bounds = (self.vertices.min(axis=0), self.vertices.max(axis=0))
            else:
                self._bounds = (np.full(3, np.nan), np.full(3, np.nan))
        return self._bounds

    def set_vertices(self, vertices: ArrayLike) -> None:
        """Move the vertices; the count must stay. Normals are left as they are."""
        self.vertices = self._floats("vertices", vertices, len(self.vertices), 3)
        self._bounds = None
        self.revision += 1

    def set_normals(self, normals: ArrayLike) -> None:
        """Replace the normals, shape (n, 3)."""
        self.normals = self._floats("normals", normals, len(self.vertices), 3)
        self.revision += 1

    def set_colors(self, colors: ArrayLike | None) -> None:
        """Replace the linear vertex colours, shape (n, 3) or (n, 4); None takes them away."""
        self.colors = None if colors is None else self._colors(colors)
        self.revision += 1

    def _colors(self, colors: ArrayLike) -> Float64:
        rgb = np.asarray(colors, dtype=np.float64)
        return self._floats("colors", rgb[:, :3] if rgb.ndim == 2 else rgb, len(self.vertices), 3)

    def __repr__(self) -> str:
        return f"Geom({self.name!r}, {len(self.vertices)} vertices, {len(self.triangles)} triangles)"


class GeomNode(PandaNode):
    """A node with Geoms, each with its own material."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.geoms: list[tuple[Geom, Material]] = []

    def add_geom(self, geom: Geom, material: Material | None = None) -> None:
        """Add `geom`, drawn with `material` (a plain white one when absent) unless a node overrides it."""
        self.geoms.append((geom, material if material is not None else Material("default")))
        self.mark_changed()

    def make_copy(self) -> GeomNode:
        """A new node with the same (shared) Geoms, transform and attributes, without children."""
        copy = GeomNode(self.name)
        self._copy_state_to(copy)
        copy.geoms = list(self.geoms)
        return copy

    def get_local_bounds(self) -> tuple[Float64, Float64] | None:
        """The box around this node's own Geoms in its own space, None when it has none."""
        boxes = [geom.bounds for geom, _ in self.geoms if len(geom.vertices)]
        if not boxes:
            return None
        return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)

    def iter_local_points(self) -> list[Float64]:
        """The vertex arrays of this node's Geoms, for tight bounds."""
        return [geom.vertices for geom, _ in self.geoms if len(geom.vertices)]
