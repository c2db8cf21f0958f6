"""Points with a size in the scene's units: squares that face the camera, compared with Panda3D's picture."""

from __future__ import annotations

import numpy as np
import pytest
from panda3d import core

from firefly_sample.interop.panda3d import GraphMirror
from tests.panda.compare import agreement, draw_ours
from tests.panda.test_graph import add_camera

COLUMNS = {"size": 0.7, "aspect_ratio": 1.5, "rotate": 25.0}


def four_colors() -> core.Texture:
    """A texture with another colour in each quarter."""
    made = core.Texture("quarters")
    made.setup_2d_texture(2, 2, core.Texture.T_unsigned_byte, core.Texture.F_rgb)
    made.set_ram_image_as(bytes((250, 0, 0, 0, 250, 0, 0, 0, 250, 200, 200, 200)), "RGB")
    made.set_magfilter(core.SamplerState.FT_nearest)
    return made


def sprites(names: tuple[str, ...] = (), textured: bool = True, thickness: float = 0.9, scale: float = 1.0):
    """Two points below a turned node, and a turned camera."""
    array = core.GeomVertexArrayFormat()
    array.add_column("vertex", 3, core.Geom.NT_float32, core.Geom.C_point)
    for name in names:
        array.add_column(name, 1, core.Geom.NT_float32, core.Geom.C_other)
    layout = core.GeomVertexFormat.register_format(core.GeomVertexFormat(array))
    data = core.GeomVertexData("points", layout, core.Geom.UH_static)
    position = core.GeomVertexWriter(data, "vertex")
    numbers = [(core.GeomVertexWriter(data, name), COLUMNS[name]) for name in names]
    for x in (-1.5, 1.5):
        position.add_data3(x / scale, 0, 0.2)
        for writer, number in numbers:
            writer.add_data1(number)
    points = core.GeomPoints(core.Geom.UH_static)
    points.add_next_vertices(2)
    geom = core.Geom(data)
    geom.add_primitive(points)
    node = core.GeomNode("sprites")
    node.add_geom(geom)
    root = core.NodePath("render")
    path = root.attach_new_node(node)
    path.set_hpr(20, 30, 0)
    path.set_scale(scale)
    path.set_render_mode_thickness(thickness)
    path.set_render_mode_perspective(True)
    if textured:
        path.set_texture(four_colors())
        path.set_tex_gen(core.TextureStage.get_default(), core.TexGenAttrib.M_point_sprite)
    camera = add_camera(root, -9)
    camera.set_r(10)
    return root, camera


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        (("size",),),
        (("size", "aspect_ratio"),),
        (("size", "aspect_ratio", "rotate"),),
        ((), False),
        ((), True, 0.5, 2.0),
    ],
)
def test_sprites_are_where_panda3ds_are(by_panda, arguments):
    ours, warned = draw_ours(sprites, *arguments)
    assert [line for line in warned if "llvmpipe" not in line] == []
    found = agreement(by_panda(sprites, *arguments), ours)
    assert found.covered > 0.03
    assert found.strays == 0
    assert found.mean <= 1


def test_sprites_follow_the_camera_in_place():
    root, camera = sprites(("size",))
    copy = root.find("sprites").copy_to(root)
    copy.set_h(70)
    mirror = GraphMirror(root, camera)
    nodes = [path.node() for path in mirror.update().root.find_all_matches("sprites")]
    geoms = [node.geoms[0][0] for node in nodes]
    before = [geom.vertices.copy() for geom in geoms]
    mirror.update()
    assert all(np.array_equal(geom.vertices, old) for geom, old in zip(geoms, before, strict=True))
    camera.set_h(30)
    mirror.update()
    assert [node.geoms[0][0] for node in nodes] == geoms
    assert not any(np.array_equal(geom.vertices, old) for geom, old in zip(geoms, before, strict=True))
