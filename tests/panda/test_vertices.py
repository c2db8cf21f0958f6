"""Vertices of any format, beside Panda3D's own reading of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from panda3d import core

from firefly_sample.model.panda3d.vertices import VertexUse, animated_data
from tests.panda.geoms import (
    NORMAL,
    POSITION,
    E,
    geom_of,
    panda_corners,
    panda_rows,
    read,
    triangle,
    vertex_data,
    vertex_format,
)
from tests.panda.scenes import MODELS, load

FLOATS = E.NT_float32, E.NT_float64, E.NT_stdfloat
SIGNED = {E.NT_int8: 2**7, E.NT_int16: 2**15, E.NT_int32: 2**31}
UNSIGNED = {E.NT_uint8: 2**8, E.NT_uint16: 2**16, E.NT_uint32: 2**32}
PACKED = E.NT_packed_dcba, E.NT_packed_dabc
NUMBERS = *FLOATS, *SIGNED, *UNSIGNED, E.NT_packed_ufloat


@st.composite
def columns(draw, name, contents, sizes, types=NUMBERS):
    kind = draw(st.sampled_from(types))
    packed = kind in (*PACKED, E.NT_packed_ufloat)
    return name, 1 if packed else draw(st.sampled_from(sizes)), kind, contents


@st.composite
def datas(draw):
    """Vertex data with columns of any type, in any order, in one array or several."""
    chosen = [
        draw(columns("vertex", E.C_point, (2, 3, 4))),
        draw(columns("normal", E.C_normal, (3, 4))),
        draw(columns("color", E.C_color, (3, 4), (*FLOATS, *UNSIGNED, *PACKED))),
        draw(columns("texcoord.tiles", E.C_texcoord, (1, 2, 3, 4))),
        draw(columns("weight", E.C_other, (1, 2, 3, 4), (*NUMBERS, *PACKED))),
    ]
    order = draw(st.permutations(chosen))
    cut = draw(st.integers(0, len(order) - 1))
    arrays = [part for part in (order[:cut], order[cut:]) if part]
    data = core.GeomVertexData("", vertex_format(arrays, draw(st.sampled_from([0, 4]))), E.UH_static)
    count = draw(st.integers(3, 9))
    data.set_num_rows(count)
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    for name, _, kind, contents in chosen:
        if contents == E.C_color:
            rows = random.random((count, 4))
        elif kind in FLOATS:
            rows = random.normal(0.0, 10.0, (count, 4))
        elif kind in (*PACKED, E.NT_packed_ufloat):
            rows = random.integers(1, 200, (count, 4))
        else:
            top = SIGNED.get(kind) or UNSIGNED[kind]
            rows = random.integers(-top if kind in SIGNED else 1, top, (count, 4))
            rows[:, 3] = np.maximum(np.abs(rows[:, 3]) - 1, 1)  # a point's divisor
        writer = core.GeomVertexWriter(data, name)
        for row in rows:
            writer.set_data4d(*map(float, row))
    return data


@settings(max_examples=40)
@given(datas(), st.data())
def test_every_format_is_read_as_panda3d_reads_it(data, draw):
    count = data.get_num_rows()
    corners = draw.draw(st.lists(st.integers(0, count - 1), min_size=3, max_size=3, unique=True))
    use = VertexUse("texcoord.tiles", None, None, None, True)
    (geom,), lost = read(geom_of(data, triangle(*corners)), use)
    assert lost == []
    assert len(geom.vertices) == 3  # those of no primitive are left out
    ours = geom.triangles[0]
    assert np.array_equal(geom.vertices[ours], panda_rows(data, "vertex", 3)[corners])
    normals = panda_rows(data, "normal", 3)[corners]
    length = np.abs(normals).max(axis=1, keepdims=True)
    assert np.array_equal(geom.normals[ours], np.where(length > 1e6, normals / length, normals))
    raw = panda_rows(data, "texcoord.tiles", 4)[corners]  # the fourth number does not divide without a matrix
    assert np.array_equal(geom.texcoords[ours], raw[:, :2])
    colors = panda_rows(data, "color", 4)[corners]
    assert np.allclose(geom.colors[ours], colors[:, :3], rtol=0.0, atol=1e-7)
    alphas = np.ones(3) if geom.alphas is None else geom.alphas[ours]
    assert np.allclose(alphas, colors[:, 3], rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("name", MODELS)
def test_the_models_of_the_wheel_are_read_as_panda3d_reads_them(name):
    for path in load(name).find_all_matches("**/+GeomNode"):
        for source in path.node().get_geoms():
            data, corners = animated_data(source), panda_corners(source).ravel()
            colored = data.has_column("color")
            made, lost = read(source, VertexUse("texcoord", None, None, None, colored))
            assert sum("without normals" in line for line in lost) == len(lost)
            if not len(corners):
                assert made == []
                continue
            (geom,) = made
            ours = geom.indices.ravel()
            assert np.array_equal(geom.vertices[ours], panda_rows(data, "vertex", 3)[corners])
            if data.has_column("normal"):
                assert np.array_equal(geom.normals[ours], panda_rows(data, "normal", 3)[corners])
            if data.has_column("texcoord"):
                assert np.array_equal(geom.texcoords[ours], panda_rows(data, "texcoord", 2)[corners])
            else:
                assert not geom.texcoords.any()
            assert (geom.colors is not None) == colored
            if colored:
                colors = panda_rows(data, "color", 4)[corners]
                assert np.allclose(geom.colors[ours], colors[:, :3], rtol=0.0, atol=1e-7)


CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [5, 5, 5]], dtype=float)


def plain(*others, count=4, **columns):
    """Data with positions and other columns."""
    return vertex_data(vertex_format([[POSITION, *others]]), count, **({"vertex": CORNERS[:count]} | columns))


def test_positions_are_divided_by_their_fourth_number():
    layout = vertex_format([[("vertex", 4, E.NT_float32, E.C_point)]])
    data = vertex_data(layout, 3, vertex=[(2, 4, 6, 2), (4, 0, 0, 4), (-1, -2, -3, -1)])
    (geom,), lost = read(geom_of(data, triangle()))
    assert geom.vertices.tolist() == [[1, 2, 3], [1, 0, 0], [1, 2, 3]]
    assert lost == []


@pytest.mark.parametrize("bad", [np.nan, np.inf, 2e30])
def test_primitives_with_an_impossible_position_are_left_out_by_name(bad):
    data = plain(vertex=np.where(CORNERS == 5, bad, CORNERS))
    (geom,), lost = read(geom_of(data, triangle(0, 1, 3, 0, 1, 2)))
    assert geom.vertices.tolist() == CORNERS[:3].tolist()
    assert geom.triangles.tolist() == [[0, 1, 2]]
    assert lost == ["primitives with a position that is not finite, or is beyond 1e30, are not drawn: 'node'"]
    assert read(geom_of(data, triangle(0, 1, 3)))[0] == []


def test_a_point_at_infinity_is_left_out():
    layout = vertex_format([[("vertex", 4, E.NT_float32, E.C_point)]])
    data = vertex_data(layout, 3, vertex=[(0, 0, 0, 1), (1, 0, 0, 0), (0, 0, 0, 0)])
    made, lost = read(geom_of(data, triangle()))
    assert made == []
    assert len(lost) == 1


def test_primitives_of_vertices_that_do_not_exist_are_left_out_by_name():
    source = geom_of(plain(), triangle(0, 1, 2, 0, 1, 3))
    source.modify_vertex_data().set_num_rows(3)
    (geom,), lost = read(source)
    assert geom.triangles.tolist() == [[0, 1, 2]]
    assert lost == ["primitives of vertices that do not exist are not drawn: 'node'"]


@pytest.mark.parametrize("lit", [True, False])
def test_vertices_without_a_normal_are_named_where_light_counts(lit):
    use = VertexUse(lit=lit)
    named = ["surfaces without normals, which Panda3D draws black, are lit: 'node'"] if lit else []
    (geom,), lost = read(geom_of(plain(), triangle()), use)
    assert np.array_equal(geom.normals, [[0, -1, 0]] * 3)  # of the triangle
    assert lost == named
    for length, expected in ((0.0, named), (1e-3, []), (1e5, [])):
        data = plain(NORMAL, normal=[(0, -1, 0), (0, -1, 0), (0, -length, 0), (0, 0, 0)])
        (geom,), lost = read(geom_of(data, triangle()), use)
        assert np.allclose(geom.normals[2], (0, -length, 0))
        assert lost == expected


def test_a_normal_that_is_not_finite_counts_as_none():
    data = plain(NORMAL, normal=[(0, -1, 0), (0, -1, 0), (0, np.nan, 0)])
    (geom,), lost = read(geom_of(data, triangle()), VertexUse())
    assert geom.normals.tolist() == [[0, -1, 0], [0, -1, 0], [0, 0, 0]]
    assert len(lost) == 1


@pytest.mark.parametrize(
    ("layout", "loss"),
    [
        ([[NORMAL]], "vertices without positions are not drawn: 'node'"),
        (
            [[("vertex", 4, E.NT_float32, E.C_clip_point)]],
            "vertices whose positions are those on the screen are not drawn: 'node'",
        ),
    ],
)
def test_what_has_no_place_in_the_model_is_named(layout, loss):
    data = vertex_data(vertex_format(layout), 3)
    assert read(geom_of(data, triangle())) == ([], [loss])


def test_colors_outside_0_to_1_are_clipped_by_name():
    color = ("color", 4, E.NT_float32, E.C_color)
    data = plain(color, color=[(2, -1, 0.5, 0.25), (np.nan, np.inf, 0, 1), (0, 0, 0, 3)])
    (geom,), lost = read(geom_of(data, triangle()), VertexUse(colors=True, lit=False))
    assert geom.colors.tolist() == [[1, 0, 0.5], [0, 1, 0], [0, 0, 0]]
    assert geom.alphas.tolist() == [0.25, 1, 1]
    assert lost == ["vertex colours outside 0 to 1 are clipped: 'node'"]


def test_colors_that_do_not_count_are_not_read():
    color = ("color", 4, E.NT_float32, E.C_color)
    (geom,), lost = read(geom_of(plain(color, color=[(2, 2, 2, 2)] * 4), triangle()))
    assert geom.colors is geom.alphas is None
    assert lost == []


SHEARED = (2, 0.5, 0, 0, -1, 3, 0, 0, 10, 20, 1, 0, 0.25, 0.125, 0, 1)
PROJECTED = (1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)  # divided by 1 + u
PERSPECTIVE = "texture matrices with perspective are applied at vertices, not at pixels: 'node'"


@pytest.mark.parametrize(
    ("rows", "matrix", "expected", "named"),
    [
        ([(0.5,)], SHEARED, (1.25, 0.375), False),
        ([(0.5, 2)], SHEARED, (-0.75, 6.375), False),
        ([(0.5, 2, 0.25)], SHEARED, (1.75, 11.375), False),
        ([(0.5, 2, 0.25, 2)], SHEARED, (1, 5.75), False),
        ([(1, 3)], PROJECTED, (0.5, 1.5), False),
        ([(1, 3), (0, 3)], PROJECTED, (0.5, 1.5), True),
        ([(-1, 3), (0, 3)], PROJECTED, (0, 0), True),
        ([(1, 3, 5, 4)], None, (1, 3), False),
    ],
)
def test_texture_matrices_move_rows(rows, matrix, expected, named):
    column = ("texcoord.b", len(rows[0]), E.NT_float64, E.C_texcoord)
    data = plain(column, texcoord__b=[*rows, *[rows[-1]] * (4 - len(rows))])
    use = VertexUse(None, "texcoord.b", None, matrix, lit=False)
    (geom,), lost = read(geom_of(data, triangle()), use)
    assert geom.texcoords_1[0].tolist() == list(expected)
    assert not geom.texcoords.any()
    assert (PERSPECTIVE in lost) == named
    far = "texture coordinates that are not finite, or are beyond 1e30, are 0: 'node'"
    assert (far in lost) == (rows[0][0] == -1)


def test_texture_coordinates_that_the_vertices_lack_are_0_before_the_matrix():
    (geom,), lost = read(geom_of(plain(), triangle()), VertexUse("absent", "absent", SHEARED, lit=False))
    assert geom.texcoords.tolist() == [[0.25, 0.125]] * 3
    assert geom.texcoords_1.tolist() == [[0, 0]] * 3
    assert lost == []


def test_the_name_is_that_of_the_node():
    assert read(geom_of(plain(), triangle()))[0][0].name == "node"
