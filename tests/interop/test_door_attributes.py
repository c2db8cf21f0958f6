"""Meshes with numbers that are not finite, and with colours that are none."""

from __future__ import annotations

import numpy as np
import pyrender
import pytest
import trimesh

import firefly_sample.interop.pyrender as door
from firefly_sample.losses import ConversionWarning
from tests.interop.door_parts import add_lights, look, picture, scene
from tests.interop.oracle import LIT, SIZE

BALL = trimesh.creation.icosphere(2, radius=1.5)
CARD = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
CORNERS = [(0, 1, 2), (0, 2, 3)]


@pytest.fixture(scope="module")
def renderer():
    with door.OffscreenRenderer(*SIZE) as made:
        yield made


def lit(primitive):
    made = add_lights(scene(), suns=2)
    made.add(pyrender.Mesh([primitive]), name="thing")
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
