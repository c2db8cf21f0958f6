"""Shapes of random Panda3D scenes: models, cards and balls with two sets of texture coordinates."""

from __future__ import annotations

from functools import cache

import numpy as np
from panda3d import core

from tests.panda.scenes import load


@cache
def _model(name: str) -> core.NodePath:
    found = load(name)
    low, high = found.get_tight_bounds()
    holder = core.NodePath("model")
    found.reparent_to(holder)
    size = 2 / (high - low).length()
    found.set_scale(size)
    found.set_pos(-(low + high) / 2 * size)
    return holder


def model(name: str) -> core.NodePath:
    """A model of the wheel, about two units large."""
    return _model(name).copy_to(core.NodePath())


def _format(coloured: bool) -> core.GeomVertexFormat:
    array = core.GeomVertexArrayFormat()
    kind = core.Geom
    array.add_column("vertex", 3, kind.NT_float32, kind.C_point)
    array.add_column("normal", 3, kind.NT_float32, kind.C_normal)
    array.add_column("texcoord", 2, kind.NT_float32, kind.C_texcoord)
    array.add_column("texcoord.second", 2, kind.NT_float32, kind.C_texcoord)
    if coloured:
        array.add_column("color", 4, kind.NT_uint8, kind.C_color)
    made = core.GeomVertexFormat()
    made.add_array(array)
    return core.GeomVertexFormat.register_format(made)


def _grid(name: str, points, normals, uvs, colors) -> core.GeomNode:
    """Triangles of a grid of vertices, arrays of shape (rows, columns, n)."""
    data = core.GeomVertexData(name, _format(colors is not None), core.Geom.UH_static)
    rows, columns = points.shape[:2]
    data.set_num_rows(rows * columns)
    seconds = uvs[..., ::-1] * 0.7 + 0.1
    for column, values in (
        ("vertex", points),
        ("normal", normals),
        ("texcoord", uvs),
        ("texcoord.second", seconds),
        ("color", colors),
    ):
        if values is None:
            continue
        writer = core.GeomVertexWriter(data, column)
        for value in values.reshape(rows * columns, -1).tolist():
            getattr(writer, f"set_data{len(value)}")(*value)
    triangles = core.GeomTriangles(core.Geom.UH_static)
    for row in range(rows - 1):
        for column in range(columns - 1):
            first = row * columns + column
            triangles.add_vertices(first, first + 1, first + columns)
            triangles.add_vertices(first + 1, first + columns + 1, first + columns)
    geom = core.Geom(data)
    geom.add_primitive(triangles)
    node = core.GeomNode(name)
    node.add_geom(geom)
    return node


def _colors(points):
    """Smooth colours of vertices."""
    return np.concatenate([0.5 + 0.5 * np.sin(2 * points), np.ones_like(points[..., :1])], axis=-1)


def card(coloured: bool) -> core.GeomNode:
    """A square of two units towards -Y."""
    u, v = np.meshgrid(np.linspace(0, 1, 3), np.linspace(0, 1, 3))
    points = np.stack([2 * u - 1, 0 * u, 2 * v - 1], axis=-1)
    normals = np.broadcast_to([0.0, -1.0, 0.0], points.shape)
    uvs = np.stack([u, v], axis=-1)
    return _grid("card", points, normals, uvs, _colors(points) if coloured else None)


def ball(coloured: bool, parts: int) -> core.GeomNode:
    """A sphere of radius 1."""
    u, v = np.meshgrid(np.linspace(0, 1, 2 * parts + 1), np.linspace(0, 1, parts + 1))
    angle, height = 2 * np.pi * u, np.pi * (v - 0.5)
    points = np.stack(
        [np.cos(angle) * np.cos(height), np.sin(angle) * np.cos(height), np.sin(height)], axis=-1
    )
    return _grid("ball", points, points, np.stack([2 * u, v], axis=-1), _colors(points) if coloured else None)
