"""Primitives of any kind, beside Panda3D's own decomposition of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from panda3d import core

from tests.panda.geoms import (
    POSITION,
    E,
    geom_of,
    panda_corners,
    read,
    triangle,
    turned,
    vertex_data,
    vertex_format,
)

ROWS = 40
SHORTEST = {
    core.GeomTriangles: 3,
    core.GeomTristrips: 3,
    core.GeomTrifans: 3,
    core.GeomLines: 2,
    core.GeomLinestrips: 2,
    core.GeomPoints: 1,
}
"""The kinds that Panda3D decomposes, and the fewest vertices of each."""
LISTS = core.GeomTriangles, core.GeomLines, core.GeomPoints
INDEX_TYPES = E.NT_uint8, E.NT_uint16, E.NT_uint32


def numbered(count=ROWS):
    """Vertices at (row, 0, 0): where a vertex of ours is shows which one it was."""
    return vertex_data(vertex_format([[POSITION]]), count, vertex=[(row, 0, 0) for row in range(count)])


def primitive_of(kind, *parts, index_type=E.NT_uint16):
    """A primitive of one strip or list for each part."""
    made = kind(E.UH_static)
    made.set_index_type(index_type)
    for part in parts:
        for vertex in part:
            made.add_vertex(vertex)
        made.close_primitive()
    return made


def corners_of(geom):
    """The numbers of the vertices at the corners of a Geom of ours."""
    return geom.vertices[geom.indices, 0].astype(int)


@st.composite
def primitives(draw, kind):
    """One primitive: a range of vertices, or with indices that may occur more than once."""
    shortest = SHORTEST[kind]
    lengths = st.integers(shortest, 7) if kind not in LISTS else st.integers(0, 3).map(lambda n: n * shortest)
    parts = draw(st.lists(lengths, max_size=4))
    if draw(st.booleans()):
        first = draw(st.integers(0, ROWS - 28))
        starts = np.cumsum([first, *parts])
        given = [range(start, start + length) for start, length in zip(starts, parts, strict=False)]
    else:
        given = [
            draw(st.lists(st.integers(0, ROWS - 1), min_size=length, max_size=length)) for length in parts
        ]
    made = primitive_of(kind, *given, index_type=draw(st.sampled_from(INDEX_TYPES)))
    if draw(st.booleans()):
        made.make_indexed()
    return made


@settings(max_examples=80)
@given(st.sampled_from(sorted(SHORTEST, key=str)), st.data())
def test_primitives_are_those_of_panda3ds_decomposition(kind, data):
    source = geom_of(numbered(), *data.draw(st.lists(primitives(kind), max_size=3)))
    expected = panda_corners(source)
    made, lost = read(source)
    assert lost == []
    if not len(expected):
        assert made == []
        return
    (geom,) = made
    assert geom.mode == {3: "triangles", 2: "lines", 1: "points"}[expected.shape[1]]
    assert sorted(turned(corners_of(geom))) == sorted(turned(expected))
    assert set(geom.vertices[:, 0].astype(int)) == set(expected.ravel())


@pytest.mark.parametrize(
    ("kind", "parts", "mode", "expected"),
    [
        (core.GeomTrianglesAdjacency, [range(12)], "triangles", [(0, 2, 4), (6, 8, 10)]),
        (core.GeomTristripsAdjacency, [range(10)], "triangles", [(0, 2, 4), (2, 6, 4), (4, 6, 8)]),
        (
            core.GeomTristripsAdjacency,
            [range(6), range(6, 14)],
            "triangles",
            [(0, 2, 4), (6, 8, 10), (8, 12, 10)],
        ),
        (core.GeomLinesAdjacency, [range(8)], "lines", [(1, 2), (5, 6)]),
        (core.GeomLinestripsAdjacency, [range(5), range(5, 9)], "lines", [(1, 2), (2, 3), (6, 7)]),
    ],
)
@pytest.mark.parametrize("index_type", INDEX_TYPES)
def test_neighbours_of_primitives_are_left_out(kind, parts, mode, expected, index_type):
    (geom,), lost = read(geom_of(numbered(), primitive_of(kind, *parts, index_type=index_type)))
    assert geom.mode == mode
    assert sorted(turned(corners_of(geom))) == expected
    assert lost == []


def test_corners_twice_are_left_out():
    (geom,), _ = read(geom_of(numbered(), triangle(0, 1, 1, 2, 2, 3, 4, 5, 4, 6, 7, 8)))
    assert corners_of(geom).tolist() == [[6, 7, 8]]
    (geom,), _ = read(geom_of(numbered(), primitive_of(core.GeomLines, [1, 1, 2, 3])))
    assert corners_of(geom).tolist() == [[2, 3]]


def test_patches_are_named():
    patches = core.GeomPatches(3, E.UH_static)
    patches.add_vertices(0, 1, 2)
    made, lost = read(geom_of(numbered(), patches))
    assert made == []
    assert lost == ["primitives of the type GeomPatches are not drawn: 'node'"]


def test_points_with_sizes_of_their_own_are_named():
    data = vertex_data(vertex_format([[POSITION, ("size", 1, E.NT_float32, E.C_other)]]), 3)
    named = ["points with sizes of their own are drawn at the size of their render mode: 'node'"]
    assert read(geom_of(data, primitive_of(core.GeomPoints, [0, 1])))[1] == named
    assert read(geom_of(data, triangle()))[1] == []


def test_what_is_empty_is_nothing():
    assert read(core.Geom(numbered(0))) == ([], [])
    assert read(geom_of(numbered(0), core.GeomTriangles(E.UH_static))) == ([], [])
    assert read(geom_of(numbered(), core.GeomTristrips(E.UH_static))) == ([], [])
