"""Geoms of Panda3D of any vertex format, and Panda3D's own reading of them, one number at a time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from panda3d import core

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.vertices import VertexUse, animated_data, read_geom

Column = tuple[str, int, int, int]
"""The name, the number of components, the numeric type and the contents of a column."""

E = core.GeomEnums
POSITION: Column = ("vertex", 3, E.NT_float32, E.C_point)
NORMAL: Column = ("normal", 3, E.NT_float32, E.C_normal)


def vertex_format(arrays: Iterable[Sequence[Column]], gap: int = 0, animation=None) -> core.GeomVertexFormat:
    """A format of these arrays of columns, each with `gap` unused bytes at the end of its rows."""
    made = core.GeomVertexFormat()
    for columns in arrays:
        array = core.GeomVertexArrayFormat()
        for column in columns:
            array.add_column(*column)
        if gap:
            array.set_stride(array.get_stride() + gap)
        made.add_array(array)
    if animation is not None:
        made.set_animation(animation)
    return core.GeomVertexFormat.register_format(made)


def vertex_data(layout: core.GeomVertexFormat, count: int, **columns: np.ndarray) -> core.GeomVertexData:
    """`count` vertices with these columns, whose names have `__` for a dot."""
    data = core.GeomVertexData("vertices", layout, E.UH_static)
    data.set_num_rows(count)
    for name, rows in columns.items():
        writer = core.GeomVertexWriter(data, name.replace("__", "."))
        for row in rows:
            writer.set_data4d(*map(float, row), *(0.0, 0.0, 0.0, 1.0)[len(row) :])
    return data


def geom_of(data: core.GeomVertexData, *primitives: core.GeomPrimitive) -> core.Geom:
    geom = core.Geom(data)
    for primitive in primitives:
        geom.add_primitive(primitive)
    return geom


def triangle(*vertices: int) -> core.GeomTriangles:
    primitive = core.GeomTriangles(E.UH_static)
    for vertex in vertices or (0, 1, 2):
        primitive.add_vertex(vertex)
    return primitive


def read(geom: core.Geom, use: VertexUse | None = None):
    """Our Geoms of one of Panda3D's, named "node", and the lines of what is lost."""
    losses = Losses()
    made = read_geom(geom, animated_data(geom), use or VertexUse(lit=False), "node", losses)
    return made, losses.lines()


def panda_rows(data: core.GeomVertexData, column: str, size: int) -> np.ndarray:
    """A column read by GeomVertexReader, shape (rows, size)."""
    reader = core.GeomVertexReader(data, column)
    get = {2: reader.get_data2d, 3: reader.get_data3d, 4: reader.get_data4d}[size]
    return np.array([tuple(get()) for _ in range(data.get_num_rows())], dtype=np.float64).reshape(-1, size)


def panda_corners(geom: core.Geom) -> np.ndarray:
    """The rows of the corners of a Geom's primitives by Panda3D's own decomposition, shape (m, corners).

    That of a strip without vertices would end the process.
    """
    found: list[list[int]] = []
    for primitive in [each.decompose() for each in geom.get_primitives() if each.get_num_vertices()]:
        size = primitive.get_num_vertices_per_primitive()
        vertices = [primitive.get_vertex(index) for index in range(primitive.get_num_vertices())]
        found += [vertices[first : first + size] for first in range(0, len(vertices), size)]
    return np.array([corners for corners in found if len(set(corners)) == len(corners)], dtype=int)


def turned(corners: np.ndarray) -> list[tuple[int, ...]]:
    """The corners of each primitive, begun at the smallest, in the same sense."""
    turned = []
    for row in corners.tolist():
        first = row.index(min(row))
        turned.append(tuple(row[first:] + row[:first]))
    return turned
