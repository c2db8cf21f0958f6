"""Vertices and primitives of Panda3D's Geoms as ours."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.columns import Rows, read_column
from firefly_sample.model.panda3d.primitives import Indices, mode_of, read_primitive
from firefly_sample.model.panda3d.sprites import SPRITE, Facing, square_texcoords, squares
from firefly_sample.scene.arrays import LARGEST, Float64, outside
from firefly_sample.scene.geom import Geom, GeomMode

Matrix = tuple[float, ...]
"""The 16 numbers of a matrix for row vectors, row by row."""


class VertexUse(NamedTuple):
    """The columns of vertices that a surface uses.

    Attributes
    ----------
    texcoords, texcoords_1 : str or None
        Names of columns.
    matrix, matrix_1 : tuple of 16 floats, or None
        Applied to these texture coordinates, as row vectors.
    colors : bool
        True if vertex colours count.
    lit : bool
        True if normals count.
    backs : bool
        True if triangles show their backs alone.
    """

    texcoords: str | None = None
    texcoords_1: str | None = None
    matrix: Matrix | None = None
    matrix_1: Matrix | None = None
    colors: bool = False
    lit: bool = True
    backs: bool = False


_NO_NORMALS = "surfaces without normals, which Panda3D draws black, are lit"


def read_geom(
    geom: Any, data: Any, use: VertexUse, name: str, losses: Losses, facing: Facing | None = None
) -> list[Geom]:
    """Return the triangles, lines and points of one of Panda3D's Geoms, one Geom for each mode that it has.

    Vertices that no primitive uses are left out. So are primitives with a position that is not finite.

    Parameters
    ----------
    geom : panda3d.core.Geom
        Its primitives count.
    data : panda3d.core.GeomVertexData
        The vertices, as `animated_data` returns them.
    use : VertexUse
    name : str
        Of the Geoms, and of what is not drawn.
    losses : Losses
    facing : Facing, optional
        Makes points squares that face the camera.
    """
    found: dict[GeomMode, list[Indices]] = {}
    for primitive in geom.get_primitives():
        mode = mode_of(primitive)
        if mode is not None:
            found.setdefault(mode, []).append(read_primitive(primitive))
        elif primitive.get_num_vertices():
            kind = primitive.get_type().get_name()
            losses.add(f"primitives of the type {kind} are not drawn", name)
    reader = _Reader(data, name, losses)
    made = []
    for mode, parts in found.items():
        indices = np.concatenate(parts)
        turned = use.backs and mode == "triangles"
        made.append(reader.read(mode, indices[:, ::-1] if turned else indices, use, facing))
    return [each for each in made if each is not None]


def animated_data(geom: Any) -> Any:
    """Return a Geom's vertex data as moved by its joints and sliders: panda3d.core.GeomVertexData."""
    from panda3d import core

    return geom.get_vertex_data().animate_vertices(True, core.Thread.get_current_thread())


def vertex_revision(geom: Any) -> tuple[int, ...]:
    """Return numbers that differ as soon as `read_geom` would read other vertices or primitives.

    They are Panda3D's own, by which it sees that it has to send vertices to the GPU again. Neither sees what
    is written through a memoryview that was made before.
    """
    data = geom.get_vertex_data()
    parts = [geom, data, *data.get_arrays(), *geom.get_primitives()]
    tables = data.get_transform_blend_table(), data.get_slider_table()
    parts += [table for table in tables if table is not None]
    return tuple([part.get_modified().get_seq() for part in parts])


class _Reader:
    """Reads those vertices of one of Panda3D's Geoms that its primitives use."""

    def __init__(self, data: Any, name: str, losses: Losses) -> None:
        self._data, self._name, self._losses = data, name, losses
        self._rows = Rows(slice(0, 0), None)
        self._corners: Indices | None = None  # of squares: the row of each corner

    def read(self, mode: GeomMode, indices: Indices, use: VertexUse, facing: Facing | None) -> Geom | None:
        """Return a Geom of one mode; None if nothing is left to draw."""
        if not self._has_positions():
            return None
        there = ((indices >= 0) & (indices < self._data.get_num_rows())).all(axis=1)
        if not there.all():
            self._note("primitives of vertices that do not exist are not drawn")
            indices = indices[there]
        if not len(indices):
            return None
        self._rows, corners = _used(indices)
        positions = self._positions()
        good = _in_range(positions)
        if not good.all():
            self._note("primitives with a position that is not finite, or is beyond 1e30, are not drawn")
            indices = indices[good[corners].all(axis=1)]
            if not len(indices):
                return None
            self._rows, corners = _used(indices)
            positions = self._positions()
        if mode == "points" and facing is not None:
            return self._squares(positions[corners[:, 0]], corners[:, 0], use, facing)
        if mode == "points" and self._data.has_column("size"):
            self._note("points with sizes of their own are drawn at the size of their render mode")
        return Geom(
            positions,
            corners,
            normals=self._normals(use.lit),
            texcoords=self._texcoords(use.texcoords, use.matrix),
            colors=self._colors() if use.colors else None,
            name=self._name,
            texcoords_1=self._texcoords(use.texcoords_1, use.matrix_1),
            mode=mode,
        )

    def _squares(self, positions: Float64, rows: Indices, use: VertexUse, facing: Facing) -> Geom:
        """Return points as squares that face the camera."""
        numbers = [read_column(self._data, name, self._rows) for name in ("size", "aspect_ratio", "rotate")]
        sizes, ratios, turns = (None if each is None else _zero_where_wrong(each)[rows] for each in numbers)
        self._corners = rows.repeat(4)
        vertices, triangles = squares(positions, facing, sizes, ratios, turns)
        colors = self._colors() if use.colors else None
        made = Geom(
            vertices,
            triangles,
            texcoords=self._texcoords(use.texcoords, use.matrix),
            colors=None if colors is None else colors[self._corners],
            name=self._name,
            texcoords_1=self._texcoords(use.texcoords_1, use.matrix_1),
        )
        if use.lit:
            self._note(_NO_NORMALS)
        self._corners = None
        return made

    def _note(self, loss: str) -> None:
        self._losses.add(loss, self._name)

    def _has_positions(self) -> bool:
        """Return whether there are positions in model space; note what is there instead."""
        from panda3d import core

        layout = self._data.get_format()
        column = layout.get_column("vertex")
        if column is None:
            self._note("vertices without positions are not drawn")
            return False
        if column.get_contents() == core.GeomEnums.C_clip_point:
            self._note("vertices whose positions are those on the screen are not drawn")
            return False
        if layout.get_animation().get_animation_type() == core.GeomEnums.AT_hardware:
            self._note("vertices that a shader is to move by joints stay where they are")
        return True

    def _positions(self) -> Float64:
        """Return positions, shape (n, 3); homogeneous ones are divided by their fourth number."""
        given = read_column(self._data, "vertex", self._rows)
        assert given is not None
        divides = self._data.get_format().get_column("vertex").has_homogeneous_coord()
        return _divided(given[:, :3], given[:, 3:]) if divides and given.shape[1] == 4 else _widened(given, 3)

    def _normals(self, lit: bool) -> Float64 | None:
        """Return normals of any length, shape (n, 3); None if there are none."""
        given = read_column(self._data, "normal", self._rows)
        normals = None if given is None else _zero_where_wrong(_widened(given, 3))
        if lit and (normals is None or not normals.any(axis=1).all()):
            self._note(_NO_NORMALS)
        return normals

    def _texcoords(self, column: str | None, matrix: Matrix | None) -> Float64 | None:
        """Return texture coordinates as moved by their matrix, shape (n, 2); None if none are used.

        As in Panda3D, those that the vertices lack are 0, and only a matrix makes their fourth number count.
        """
        if column is None:
            return None
        given = read_column(self._data, column, self._rows)
        if given is None:
            given = np.zeros((self._rows.number, 2))
        if self._corners is not None:
            given = square_texcoords(len(self._corners) // 4) if column == SPRITE else given[self._corners]
        moved = _widened(given, 2)
        if matrix is not None:
            by = np.array(matrix, dtype=np.float64).reshape(4, 4)
            full = _widened(given, 4)
            if given.shape[1] < 4:
                full[:, 3] = 1.0
            moved, divisor = full @ by[:, :2], full @ by[:, 3:]
            if (divisor != divisor[0]).any():
                self._note("texture matrices with perspective are applied at vertices, not at pixels")
            moved = _divided(moved, divisor)
        finite = _zero_where_wrong(moved)
        if finite is not moved:
            self._note("texture coordinates that are not finite, or are beyond 1e30, are 0")
        return finite

    def _colors(self) -> Float64 | None:
        """Return vertex colours with alpha, shape (n, 4); None if there are none."""
        given = read_column(self._data, "color", self._rows)
        if given is None:
            return None
        colors = _widened(given, 4)
        if given.shape[1] < 4:
            colors[:, 3] = 1.0
        if outside(colors).any():
            self._note("vertex colours outside 0 to 1 are clipped")
            colors = np.clip(np.nan_to_num(colors, nan=0.0), 0.0, 1.0)
        return colors


def _used(indices: Indices) -> tuple[Rows, Indices]:
    """Return the rows that indices refer to, and the indices into these."""
    low, high = int(indices.min()), int(indices.max())
    span, local = slice(low, high + 1), indices - low
    used = np.zeros(high - low + 1, dtype=bool)
    used[local] = True
    if used.all():
        return Rows(span, None), local
    return Rows(span, np.flatnonzero(used)), (np.cumsum(used) - 1)[local]


def _widened(values: Float64, count: int) -> Float64:
    """Return the first `count` numbers of each row, as a new array; those that are missing are 0."""
    widened = np.zeros((len(values), count))
    shared = min(count, values.shape[1])
    widened[:, :shared] = values[:, :shared]
    return widened


def _divided(values: Float64, divisor: Float64) -> Float64:
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return values / divisor


def _zero_where_wrong(values: Float64) -> Float64:
    """Return the values with rows of 0 where a number is not finite, or too large for the GPU."""
    good = _in_range(values)
    return values if good.all() else np.where(good[:, None], values, 0.0)


def _in_range(values: Float64) -> NDArray[np.bool_]:
    """Return which rows have only numbers that are finite, and that the GPU can hold."""
    inside = np.abs(values) <= LARGEST
    return np.ones(len(values), dtype=bool) if inside.all() else np.asarray(inside.all(axis=1))
