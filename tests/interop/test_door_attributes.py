"""Meshes with numbers that are not finite, and with colours that are none."""

from __future__ import annotations

import math

import numpy as np
import pyrender
import pytest
import trimesh
from pyrender import RenderFlags
from trimesh.transformations import translation_matrix

import firefly_sample.interop.pyrender as door
from firefly_sample.interop.pyrender.normals import LENGTH, normal_lines
from firefly_sample.losses import ConversionWarning, Losses
from firefly_sample.scene.transforms import vectors_to_gltf
from tests.interop.door_parts import ASKEW, add_lights, look, picture, scene
from tests.interop.oracle import LIT, SIZE

BALL = trimesh.creation.icosphere(2, radius=1.5)
CARD = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
CORNERS = [(0, 1, 2), (0, 2, 3)]


@pytest.fixture(scope="module")
def renderer():
    with door.OffscreenRenderer(*SIZE) as made:
        yield made


def lit(primitive, pose=None):
    made = add_lights(scene(), suns=2)
    made.add(pyrender.Mesh([primitive]), name="thing", pose=pose)
    return made


@pytest.fixture
def drawn(renderer):
    """The picture of a primitive that loses something, which the message names."""

    def draw(primitive, message):
        with pytest.warns(ConversionWarning, match=f"{message}.*'thing'"):
            return renderer.render(lit(primitive))

    yield draw
    renderer._told.clear()  # each test hears of its own


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
@pytest.mark.parametrize("mode", [0, 4], ids=["points", "triangles"])
def test_vertices_that_are_not_finite_are_left_out_as_in_pyrender(drawn, draw_with_pyrender, mode, wrong):
    places = BALL.vertices.copy()
    places[::9, 1] = wrong
    indices = None if mode == 0 else BALL.faces
    primitive = pyrender.Primitive(
        places, BALL.vertex_normals, indices=indices, mode=mode, material=look(roughness=0.9)
    )
    color, depth = drawn(primitive, "vertices that are not finite are left out")
    their_color, their_depth = draw_with_pyrender(lit(primitive), SIZE, LIT)
    assert ((depth > 0) == (their_depth > 0)).all()
    assert (depth > 0).any()
    assert np.abs(color.astype(int) - their_color).max() <= 1


def test_a_mesh_of_nothing_finite_draws_nothing(drawn):
    primitive = pyrender.Primitive(np.full((4, 3), np.nan), indices=CORNERS, material=look())
    assert not drawn(primitive, "vertices that are not finite")[1].any()


def test_normals_that_are_not_finite_face_the_camera(drawn, renderer):
    normals = np.full((4, 3), np.nan)
    color = drawn(pyrender.Primitive(CARD, normals, indices=CORNERS, material=look()), "normals that are not")
    without = renderer.render(lit(pyrender.Primitive(CARD, indices=CORNERS, material=look())))
    assert (color[0] == without[0]).all()


def test_colors_are_clipped(drawn, renderer):
    given = [(2.0, 0.5, -1.0, 1.0), (np.nan, 0.5, 0.0, 1.0), (1.0000001, 1, 1, 1), (np.inf, 0, 0, 1)]
    meant = [(1.0, 0.5, 0.0, 1.0), (0.0, 0.5, 0.0, 1.0), (1.0, 1, 1, 1), (1.0, 0, 0, 1)]
    wrong, right = (
        pyrender.Primitive(CARD, color_0=np.array(colors), indices=CORNERS, material=look())
        for colors in (given, meant)
    )
    assert (drawn(wrong, "colours are clipped")[0] == renderer.render(lit(right))[0]).all()


def test_texture_coordinates_that_are_not_finite_become_0(drawn, renderer):
    material = look(baseColorTexture=pyrender.Texture(source=picture(), source_channels="RGB"))
    wrong, right = (
        pyrender.Primitive(
            CARD,
            texcoord_0=np.array([first, (1, 0), (1, 1), (0, 1)], dtype=np.float32),
            indices=CORNERS,
            material=material,
        )
        for first in ((np.nan, 1), (0, 0))
    )
    assert (drawn(wrong, "texture coordinates")[0] == renderer.render(lit(right))[0]).all()


@pytest.mark.parametrize("faces", [False, True], ids=["vertices", "faces"])
@pytest.mark.parametrize("array", ["positions", "normals"])
def test_lines_of_normals_are_those_of_what_is_finite(renderer, array, faces):
    """Two triangles, and a third beside them whose last vertex has a number that is none."""
    flag = RenderFlags.FACE_NORMALS if faces else RenderFlags.VERTEX_NORMALS
    places = np.array([*CARD, (1, 1.5, 0)], dtype=np.float32)
    arrays = {"positions": places.copy(), "normals": np.tile((0, 0, 1), (5, 1)).astype(np.float32)}
    arrays[array][4] = np.nan
    corners = np.array([*CORNERS, (2, 4, 3)])
    whole = corners[:2] if array == "positions" else corners
    feet = places[whole].mean(axis=1) if faces else places[:4]
    box = places[:4] if array == "positions" else places
    primitive = pyrender.Primitive(**arrays, indices=corners, mode=4, material=look())
    lines = normal_lines(primitive, not faces, faces, "thing", Losses())
    ends = feet + np.array([0.0, 0.0, LENGTH * np.linalg.norm(np.ptp(box, axis=0))])
    wanted = np.stack([feet, ends], axis=1).reshape(-1, 3)
    np.testing.assert_allclose(vectors_to_gltf(lines.vertices), wanted, atol=1e-6)
    with pytest.warns(ConversionWarning, match="not finite.*'thing'"):
        drawn = renderer.render(lit(primitive, ASKEW), flag)
    plain = renderer.render(lit(primitive, ASKEW))
    renderer._told.clear()
    assert (drawn[0] != plain[0]).any()
    assert (drawn[1] == plain[1]).all()


def test_lines_of_normals_grow_with_the_spread_of_instances_as_pyrenders_scale_does():
    poses = np.array([translation_matrix((x, 0, 0)) for x in (0, 3)])
    primitive = pyrender.Primitive(CARD, np.tile((0, 0, 2), (4, 1)), indices=CORNERS, mode=4, poses=poses)
    start, end = normal_lines(primitive, False, True, "thing", Losses()).vertices[:2]
    assert np.isclose(np.linalg.norm(end - start), 0.05 * primitive.scale)
    assert np.isclose(primitive.scale, np.hypot(5.0, 2.0))


@pytest.mark.parametrize("flag", [RenderFlags.VERTEX_NORMALS, RenderFlags.FACE_NORMALS])
def test_points_have_lines_of_normals_by_either_flag(renderer, flag):
    """Each goes up from its point, across 0.05 of the diagonal of the four."""
    made = lit(pyrender.Primitive(CARD, np.tile((0, 1, 0), (4, 1)), mode=0, material=look()))
    lined, plain = (renderer.render(made, flags)[0] for flags in (flag, LIT))
    rows, columns = np.nonzero((lined != plain).any(axis=-1))
    pixel = 2.0 * math.tan(0.35) * 6.0 / SIZE[1]
    assert len(set(columns)) == 2
    assert abs(len(rows) - 4 * 0.05 * math.hypot(2, 2) / pixel) <= 4


@pytest.mark.parametrize("flag", [RenderFlags.VERTEX_NORMALS, RenderFlags.FACE_NORMALS])
@pytest.mark.parametrize(("mode", "normals"), [(4, None), (0, None), (1, np.tile((0, 0, 1), (4, 1)))])
def test_what_has_no_lines_of_normals_is_named_once(renderer, flag, mode, normals):
    made = lit(pyrender.Primitive(CARD, normals, indices=CORNERS, mode=mode, material=look()))
    with pytest.warns(ConversionWarning, match="NORMALS draw nothing of .* without normals: 'thing'") as told:
        pictures = [renderer.render(made, flags)[0] for flags in (flag, flag, LIT)]
    renderer._told.clear()
    assert len(told) == 1
    assert all((picture == pictures[-1]).all() for picture in pictures)
