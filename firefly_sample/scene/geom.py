"""Triangles, lines and points, and the node that holds them."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import SceneError
from firefly_sample.scene.arrays import (
    LARGEST,
    Float64,
    ReadOnlyArrays,
    as_colors,
    as_numbers,
    as_whole,
    hint_above_one,
    new_serial,
    outside,
    read_only,
)
from firefly_sample.scene.camel_case import CamelCase
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.tangents import TangentGroups

GeomMode = Literal["triangles", "lines", "points"]
_CORNERS: dict[GeomMode, int] = {"triangles": 3, "lines": 2, "points": 1}


class Geom(CamelCase, ReadOnlyArrays):
    """Indexed triangles in model space, or lines or points. For instancing, one Geom is used by many nodes.

    `Geom.lines` and `Geom.points` make those of the other modes. They are lit as surfaces are, cast no
    shadows, and are not blended. Lines are one pixel wide; `NodePath.set_render_mode_thickness` sets the size
    of points.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Positions in model space (Z up), in scene units.
    triangles : array_like of int, shape (m, 3)
        Indices into `vertices`, counter-clockwise seen from the front.
    normals : array_like, shape (n, 3), optional
        Unit normals; area-weighted vertex normals are computed when absent. One of length 0 is lit as if it
        faced the camera, as are lines and points without normals.
    texcoords : array_like, shape (n, 2), optional
        Texture coordinates with v up (the first row of an image is v = 1); zeros when absent.
    colors : array_like, shape (n, 3) or (n, 4), optional
        Linear vertex colours and alpha in 0..1, which multiply the material's base colour and alpha; white
        when absent. In uint8, 255 is 1, and in uint16, 65535.
    name : str
    texcoords_1 : array_like, shape (n, 2), optional
        A second set of texture coordinates, for materials whose `emission_texcoord` or other such number is
        1; None when absent.
    tangents : array_like, shape (n, 4), optional
        For normal maps: unit vectors along which u grows, and 1 or -1, by which cross(normal, tangent) is
        multiplied to give the bitangent, along which v grows. When absent, they are computed if a material
        needs them, by the rule of `firefly_sample.scene.tangents`; a vertex whose triangles disagree gets
        their mean, weighted by angle.

    `firefly_sample.scene.arrays` lists the accepted types. The arrays are copied and read-only: replace them
    with `set_vertices`, `set_normals`, `set_tangents` and `set_colors`.

    Attributes
    ----------
    mode : {"triangles", "lines", "points"}
    indices : ndarray of int32, shape (m, 3), (m, 2) or (m, 1)
        Of the mode's corners; `triangles` is the same for triangles, and else has no rows.
    alphas : ndarray of float64, shape (n,), or None
        Alpha of the vertex colours, None if it is 1 everywhere; `colors`, shape (n, 3), has the rest.
    serial : int
        A number that no other object of this process ever has, not even a copy.
    revision : int
        Grows with each change, so that copies, such as the GPU's, can be updated.

    Raises
    ------
    SceneError
        If a shape is wrong, an index is out of range, a number is not finite or above 1e30, or a colour is
        outside 0 to 1.
    """

    alphas: Float64 | None
    texcoords_1: Float64 | None
    tangents: Float64 | None
    _bounds: tuple[Float64, Float64] | None
    _sphere: tuple[Float64, float] | None
    _made_tangents: tuple[int, int, Float64] | None

    def __init__(
        self,
        vertices: ArrayLike,
        triangles: ArrayLike,
        normals: ArrayLike | None = None,
        texcoords: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        name: str = "geom",
        *,
        texcoords_1: ArrayLike | None = None,
        tangents: ArrayLike | None = None,
        mode: GeomMode = "triangles",
    ) -> None:
        self.name = name
        if mode not in _CORNERS:
            raise SceneError(f"geom {name!r}: mode must be one of {', '.join(_CORNERS)}, got {mode!r}")
        self.mode: GeomMode = mode
        self.serial = new_serial()
        self.revision = 0
        self.vertices = self._floats("vertices", vertices, None, 3)
        n = len(self.vertices)
        self.indices = self._indices(triangles)
        solid = mode == "triangles"
        self.triangles = self.indices if solid else read_only(np.zeros((0, 3), dtype=np.int32))
        if normals is None:
            self.normals = self._vertex_normals() if solid else read_only(np.zeros((n, 3)))
        else:
            self.normals = self._normals(normals)
        self.texcoords = self._floats("texcoords", np.zeros((n, 2)) if texcoords is None else texcoords, n, 2)
        self.texcoords_1 = None if texcoords_1 is None else self._floats("texcoords_1", texcoords_1, n, 2)
        self.tangents = None if tangents is None else self._tangents(tangents)
        self.colors, self.alphas = self._colors(colors)
        self._bounds = self._sphere = None
        self._made_tangents = None

    @classmethod
    def lines(cls, vertices: ArrayLike, segments: ArrayLike, **others: Any) -> Geom:
        """Return lines between pairs of vertices.

        `segments` has shape (m, 2); `others` are normals, texcoords, colors and name, as of triangles.
        """
        return cls(vertices, segments, **({"name": "lines"} | others), mode="lines")

    @classmethod
    def points(cls, vertices: ArrayLike, **others: Any) -> Geom:
        """Return a point at each vertex; `others` as of `lines`."""
        count = len(as_numbers("points", vertices))
        return cls(vertices, np.arange(count)[:, None], **({"name": "points"} | others), mode="points")

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self._bounds = self._sphere = self._made_tangents = None  # a copy's arrays could be written to

    def _indices(self, triangles: ArrayLike) -> NDArray[np.int32]:
        what, corners = f"geom {self.name!r}: {self.mode}", _CORNERS[self.mode]
        given = as_whole(what, triangles)
        if given.ndim != 2 or given.shape[1] != corners:
            raise SceneError(f"{what} must have shape (m, {corners}), got {given.shape}")
        # checked in the type that was given: a narrower one would wrap around
        wrong = (given < 0) | (given >= len(self.vertices))
        if wrong.any():
            row, column = np.argwhere(wrong)[0]
            raise SceneError(
                f"geom {self.name!r}: a {self.mode[:-1]} index lies outside 0..{len(self.vertices) - 1}: "
                f"{self.mode[:-1]} {row} has {int(given[row, column])}"
            )
        return read_only(given.astype(np.int32, order="C"))

    def _floats(self, what: str, values: ArrayLike, rows: int | None, columns: int) -> Float64:
        what = f"geom {self.name!r}: {what}"
        array = as_numbers(what, values)
        if array.ndim != 2 or array.shape[1] != columns or (rows is not None and len(array) != rows):
            expected = f"({'n' if rows is None else rows}, {columns})"
            raise SceneError(f"{what} must have shape {expected}, got {array.shape}")
        if not np.isfinite(array).all():
            raise SceneError(f"{what} has a number that is not finite")
        if np.abs(array).max(initial=0.0) > LARGEST:
            raise SceneError(f"{what} has a number above {LARGEST:g}, which float32 may not hold")
        return read_only(array)

    def _normals(self, normals: ArrayLike) -> Float64:
        given = self._floats("normals", normals, len(self.vertices), 3)
        length = np.abs(given).max(axis=1, initial=0.0, keepdims=True)
        extreme = (length > 0.0) & ((length < 1e-6) | (length > 1e6))  # shaders square lengths to normalise
        return read_only(np.where(extreme, given / np.where(extreme, length, 1.0), given))

    def _vertex_normals(self) -> Float64:
        # scaled by a power of two, which is exact, so that products of edges do not overflow
        _, exponent = np.frexp(np.abs(self.vertices).max(initial=0.0))
        corners = np.ldexp(self.vertices, -exponent)[self.triangles]
        face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = np.zeros_like(self.vertices)
        for corner in range(3):
            np.add.at(normals, self.triangles[:, corner], face)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        up = np.broadcast_to([0.0, 0.0, 1.0], normals.shape)
        return read_only(np.where(length > 0, normals / np.where(length > 0, length, 1.0), up))

    @property
    def bounds(self) -> tuple[Float64, Float64]:
        """The axis-aligned box (minimum, maximum) in model space; NaN without vertices."""
        if self._bounds is None:
            points = self.vertices if len(self.vertices) else np.full((1, 3), np.nan)
            self._bounds = read_only(points.min(axis=0)), read_only(points.max(axis=0))
        return self._bounds

    @property
    def sphere(self) -> tuple[Float64, float]:
        """The centre of `bounds`, and the distance of the farthest vertex from it; 0 without vertices."""
        if self._sphere is None:
            low, high = self.bounds
            center = 0.5 * (low + high)
            distances = np.linalg.norm(self.vertices - center, axis=1)
            self._sphere = read_only(center), float(distances.max(initial=0.0))
        return self._sphere

    def set_vertices(self, vertices: ArrayLike) -> None:
        """Move the vertices, whose number must stay. Normals are not changed."""
        self.vertices = self._floats("vertices", vertices, len(self.vertices), 3)
        self._bounds = self._sphere = None
        self.revision += 1

    def set_normals(self, normals: ArrayLike) -> None:
        """Replace the normals, shape (n, 3)."""
        self.normals = self._normals(normals)
        self.revision += 1

    def set_tangents(self, tangents: ArrayLike | None) -> None:
        """Replace the tangents, shape (n, 4), see the class; None has them computed."""
        self.tangents = None if tangents is None else self._tangents(tangents)
        self.revision += 1

    def tangents_or_made(self, texcoord: int = 0) -> Float64:
        """Return `tangents`, shape (n, 4); if absent, those computed once for the present revision.

        `texcoord` is a material's `normal_texcoord`, the number of the texture coordinates that count.
        """
        if self.tangents is not None:
            return self.tangents
        made = self._made_tangents
        if made is None or made[:2] != (self.revision, texcoord):
            second = texcoord == 1 and self.texcoords_1 is not None
            texcoords = self.texcoords_1 if second else self.texcoords
            assert texcoords is not None
            groups = TangentGroups(self.vertices, self.triangles, self.normals, texcoords)
            tangents = read_only(groups.vertices(self.vertices, self.normals))
            made = self._made_tangents = self.revision, texcoord, tangents
        return made[2]

    def _tangents(self, tangents: ArrayLike) -> Float64:
        given = self._floats("tangents", tangents, len(self.vertices), 4)
        if not (np.abs(given[:, 3]) == 1.0).all():
            raise SceneError(f"geom {self.name!r}: the fourth number of each tangent must be 1 or -1")
        return given

    def set_colors(self, colors: ArrayLike | None) -> None:
        """Replace the vertex colours, shape (n, 3) or (n, 4), see the class; None removes them."""
        self.colors, self.alphas = self._colors(colors)
        self.revision += 1

    def _colors(self, colors: ArrayLike | None) -> tuple[Float64 | None, Float64 | None]:
        """Return colours without alpha, and alpha if it is not 1 everywhere."""
        if colors is None:
            return None, None
        what, n = f"geom {self.name!r}: colors", len(self.vertices)
        given = as_colors(what, colors)
        if given.ndim != 2 or len(given) != n or given.shape[1] not in (3, 4):
            raise SceneError(f"{what} must have shape ({n}, 3) or ({n}, 4), got {given.shape}")
        if outside(given).any():
            hint = hint_above_one(given)
            raise SceneError(f"{what} must be 0 to 1, got {given.min():g} to {given.max():g}{hint}")
        given = np.clip(given, 0.0, 1.0)
        alphas = None if given.shape[1] == 3 or (given[:, 3] == 1.0).all() else read_only(given[:, 3].copy())
        return read_only(np.ascontiguousarray(given[:, :3])), alphas

    def __repr__(self) -> str:
        return f"Geom({self.name!r}, {len(self.vertices)} vertices, {len(self.indices)} {self.mode})"


class GeomNode(PandaNode):
    """A node with Geoms, each with its own material."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.geoms: list[tuple[Geom, Material]] = []

    def add_geom(self, geom: Geom, material: Material | None = None) -> None:
        """Add `geom` with `material`, a plain white one when absent; nodes may override it."""
        self.geoms.append((geom, material if material is not None else Material("default")))
        self.mark_changed()

    def get_num_geoms(self) -> int:
        """Return the number of Geoms."""
        return len(self.geoms)

    def get_geom(self, index: int) -> Geom:
        """Return the Geom number `index`, from 0. IndexError if there is none."""
        return self.geoms[index][0]

    def get_geoms(self) -> list[Geom]:
        """Return the Geoms, without their materials."""
        return [geom for geom, _ in self.geoms]

    def remove_all_geoms(self) -> None:
        """Remove all Geoms."""
        self.geoms.clear()
        self.mark_changed()

    def iter_local_points(self) -> list[Float64]:
        """Return the vertex arrays of this node's Geoms."""
        return [geom.vertices for geom, _ in self.geoms if len(geom.vertices)]
