"""What Panda3D's shaders make of unusual vertices, beside our picture of them."""

from __future__ import annotations

import numpy as np
import pytest
from panda3d import core

from tests.panda.agreement import agreement
from tests.panda.compare import draw_ours
from tests.panda.geoms import NORMAL, POSITION, E, geom_of, vertex_data, vertex_format

SQUARE = np.array([(0, 0), (1, 0), (0, 1), (1, 1)], dtype=float)
COLORS = [(1, 0.25, 0.5, 1), (0.25, 1, 0.5, 1), (0.5, 0.25, 1, 1), (1, 1, 0.25, 1)]
COLUMNS = {
    "position of 4": ("vertex", 4, E.NT_float32, E.C_point),
    "position of float64": ("vertex", 3, E.NT_float64, E.C_point),
    "position of int16": ("vertex", 3, E.NT_int16, E.C_point),
    "color of float32": ("color", 4, E.NT_float32, E.C_color),
    "color of 3": ("color", 3, E.NT_float32, E.C_color),
    "color of uint8": ("color", 4, E.NT_uint8, E.C_color),
    "color of uint16": ("color", 4, E.NT_uint16, E.C_color),
    "color packed, dabc": ("color", 1, E.NT_packed_dabc, E.C_color),
    "color packed, dcba": ("color", 1, E.NT_packed_dcba, E.C_color),
    "texcoord of 1": ("texcoord", 1, E.NT_float32, E.C_texcoord),
    "texcoord of 3": ("texcoord", 3, E.NT_float32, E.C_texcoord),
    "texcoord of 4": ("texcoord", 4, E.NT_float32, E.C_texcoord),
    "texcoord of 4, matrix": ("texcoord", 4, E.NT_float32, E.C_texcoord),
    "normal of int8": ("normal", 3, E.NT_int8, E.C_normal),
    "normal of 4": ("normal", 4, E.NT_float32, E.C_normal),
}


def squares(*named):
    """One square for each of these columns, seen from the front by a camera without perspective."""
    root = core.NodePath("root")
    columns_of_squares = 5
    for number, name in enumerate(named):
        column = COLUMNS[name]
        others = [other for other in (POSITION, NORMAL) if other[0] != column[0]]
        layout = vertex_format([others, [column]])
        positions = np.column_stack([SQUARE[:, 0], np.zeros(4), SQUARE[:, 1]])
        if name == "position of 4":
            positions = np.column_stack([2.0 * positions, [2.0] * 4])
        given = {"vertex": positions, "normal": [(0, -1, 0)] * 4}
        if column[0] == "normal":
            given["normal"] = [(60, -100, 0)] * 4
        elif column[0] == "color":
            given["color"] = COLORS
        elif column[0] == "texcoord":
            # the middle of texels: 64 of them, one for each step of a square
            given["texcoord"] = np.column_stack([SQUARE * [1.0, 0.5], [0.25] * 4, [2.0] * 4])[:, : column[1]]
        strip = core.GeomTristrips(E.UH_static)
        strip.add_vertices(0, 1, 2, 3)
        strip.close_primitive()
        node = core.GeomNode(name)
        node.add_geom(geom_of(vertex_data(layout, 4, **given), strip))
        path = root.attach_new_node(node)
        path.set_pos(1.2 * (number % columns_of_squares), 0, 1.2 * (number // columns_of_squares))
        if column[0] == "texcoord":
            path.set_texture(gradient())
        if name.endswith("matrix"):
            moved = core.TransformState.make_pos2d((0.125, 0.25))
            path.set_tex_transform(core.TextureStage.get_default(), moved)
        if column[0] != "normal":
            path.set_light_off()
    sun = core.DirectionalLight("sun")
    sun.set_color((0.75, 0.75, 0.75, 1))
    root.set_light(root.attach_new_node(sun), 0)
    camera = core.Camera("camera")
    lens = core.OrthographicLens()
    lens.set_film_size(8, 6)
    camera.set_lens(lens)
    path = root.attach_new_node(camera)
    path.set_pos(2.9, -5, 1.7)
    return root, path


def gradient():
    """A texture whose red grows with u, and green with v."""
    codes = np.zeros((64, 64, 3), dtype=np.uint8)
    codes[..., 2], codes[..., 1], codes[..., 0] = np.arange(64) * 4, np.arange(64)[:, None] * 4, 128
    texture = core.Texture("gradient")
    texture.setup_2d_texture(64, 64, core.Texture.T_unsigned_byte, core.Texture.F_rgb)
    texture.set_ram_image(codes.tobytes())
    texture.set_wrap_u(core.SamplerState.WM_repeat)
    return texture


def test_unusual_columns_look_as_in_panda3d(by_panda):
    theirs = by_panda(squares, *COLUMNS)
    ours, warned = draw_ours(squares, *COLUMNS)
    assert not any(name in line for line in warned for name in COLUMNS)
    found = agreement(theirs, ours)
    assert found.covered > 0.2
    assert found.strays == found.edges == 0
    assert found.mean <= 0.5
    assert found.largest <= 1.0


def bare():
    """A square without normals, in the light of a sun that shines on it."""
    root, camera = squares("color of uint8")
    path = root.find("color of uint8")
    path.clear_light()
    data = path.node().modify_geom(0).modify_vertex_data()
    data.set_format(vertex_format([[POSITION]]))
    return root, camera


def test_lit_vertices_without_a_normal_are_black_in_panda3d(by_panda):
    theirs = by_panda(bare)
    assert theirs.covered.any()
    assert not theirs.color[theirs.covered].any()
    ours, warned = draw_ours(bare)
    assert "surfaces without normals, which Panda3D draws black, are lit: 'color of uint8'" in warned
    assert ours.color[theirs.covered].min() == pytest.approx(191, abs=1)
