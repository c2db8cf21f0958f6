"""Panda3D's primitives as lists of triangles, lines or points."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.geom import GeomMode

Indices = NDArray[np.int64]

_LISTS: dict[str, tuple[GeomMode, int, list[int]]] = {
    "GeomTriangles": ("triangles", 3, [0, 1, 2]),
    "GeomTrianglesAdjacency": ("triangles", 6, [0, 2, 4]),
    "GeomLines": ("lines", 2, [0, 1]),
    "GeomLinesAdjacency": ("lines", 4, [1, 2]),
    "GeomPoints": ("points", 1, [0]),
}
"""The mode, the number of vertices of each, and which of them are its corners."""
_STRIPS: dict[str, tuple[GeomMode, int, int]] = {
    "GeomTristrips": ("triangles", 1, 0),
    "GeomTristripsAdjacency": ("triangles", 2, 0),
    "GeomTrifans": ("triangles", 1, 0),
    "GeomLinestrips": ("lines", 1, 0),
    "GeomLinestripsAdjacency": ("lines", 1, 1),
}
"""The mode, the step from corner to corner, and how many vertices at each end are none."""


def mode_of(primitive: Any) -> GeomMode | None:
    """Return the mode of a GeomPrimitive; None if it has none here."""
    kind = primitive.get_type().get_name()
    entry = _LISTS.get(kind) or _STRIPS.get(kind)
    return None if entry is None else entry[0]


def read_primitive(primitive: Any) -> Indices:
    """Return the rows of the corners of a GeomPrimitive, shape (m, 3), (m, 2) or (m, 1).

    Triangles are counter-clockwise as Panda3D's are. Triangles and lines with a corner twice are left out.
    """
    kind = primitive.get_type().get_name()
    vertices = _vertices(primitive)
    if kind in _LISTS:
        _, size, picked = _LISTS[kind]
        whole = len(vertices) // size * size
        corners = vertices[:whole].reshape(-1, size)[:, picked]
    else:
        mode, step, skipped = _STRIPS[kind]
        starts, ends = _strips(primitive)
        size = 3 if mode == "triangles" else 2
        corners = vertices[_places(starts + skipped, ends - skipped, step, size, kind == "GeomTrifans")]
    repeated = np.zeros(len(corners), dtype=bool)
    for first, second in itertools.combinations(corners.T, 2):
        repeated |= first == second
    return np.asarray(corners[~repeated] if repeated.any() else corners)


def _vertices(primitive: Any) -> Indices:
    """Return the row of each vertex of a primitive."""
    if not primitive.is_indexed():
        first = primitive.get_first_vertex()
        return np.arange(first, first + primitive.get_num_vertices(), dtype=np.int64)
    return np.asarray(memoryview(primitive.get_vertices())).reshape(-1).astype(np.int64)


def _strips(primitive: Any) -> tuple[Indices, Indices]:
    """Return where strips start and end among the vertices; what is between them belongs to none."""
    given = primitive.get_ends()
    ends = np.array(given, dtype=np.int64) if given else np.zeros(0, dtype=np.int64)
    starts = np.zeros_like(ends)
    starts[1:] = ends[:-1] + primitive.get_num_unused_vertices_per_primitive()
    return starts, ends


def _places(starts: Indices, ends: Indices, step: int, size: int, fan: bool) -> Indices:
    """Return the places of the corners of strips or fans, shape (m, size)."""
    counts = np.maximum((ends - starts) // step - (size - 1), 0)
    strip = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(strip)) - np.repeat(np.cumsum(counts) - counts, counts)
    first = starts[strip] + number * step
    corners: Indices = first[:, None] + np.arange(size) * step
    if fan:
        corners[:, 0] = starts[strip]
    elif size == 3:
        odd = number % 2 == 1
        corners[odd] = corners[odd][:, [1, 0, 2]]
    return corners
