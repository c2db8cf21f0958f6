"""The door's differences on purpose: pyrender and the door both do what docs/pyrender.md says of them."""

from __future__ import annotations

import math

import numpy as np
import pyrender
import pytest
import trimesh
from pyrender import RenderFlags
from trimesh.transformations import translation_matrix

import firefly_sample.interop.pyrender as door
from firefly_sample.errors import SceneError
from firefly_sample.losses import ConversionWarning
from tests.interop.door_parts import EYE, add_lights, add_shapes, card, look, scene, shell, textured
from tests.interop.door_scenes import smooth_and_flat, wireframes
from tests.interop.oracle import LIT, SIZE

MIDDLE = SIZE[1] // 2, SIZE[0] // 2


@pytest.fixture(scope="module")
def renderer():
    with door.OffscreenRenderer(*SIZE) as made:
        yield made


@pytest.fixture(scope="module")
def both(draw_with_pyrender, renderer):
    """``both(scene, flags)``: what pyrender's ``render`` returns and what the door's returns."""

    def draw(made, flags=LIT):
        return draw_with_pyrender(made, SIZE, flags), renderer.render(made, flags)

    return draw


def board(color, alpha_mode="OPAQUE", size=4.0, depth=0.0, **others):
    """A square that faces the camera, of a mesh that is `depth` before its node's origin."""
    mesh = card(size=size)
    mesh.vertices[:, 2] += depth
    return pyrender.Mesh.from_trimesh(mesh, look(color, alphaMode=alpha_mode, **others), smooth=False)


def test_orthographic_depth(both):
    made = pyrender.Scene()
    near, far = 1.0, 11.0
    made.add(pyrender.OrthographicCamera(1.0, 1.0, near, far), pose=EYE)
    made.add(board((1.0, 1.0, 1.0, 1.0)))
    (_, theirs), (_, ours) = both(made)
    share = (6.0 - near) / (far - near)
    assert math.isclose(theirs[MIDDLE], near * far / (far - share * (far - near)), rel_tol=1e-5)
    assert math.isclose(ours[MIDDLE], 6.0, rel_tol=1e-6)


def test_four_lights_of_a_kind(both):
    """Six lamps above a floor, each above a place of its own; the floor's node is below the first of them."""
    made = scene(ambient_light=(0.0, 0.0, 0.0))
    made.add(board((0.8, 0.8, 0.8, 1.0), size=9.0), pose=translation_matrix((-2.0, 0.0, 0.0)))
    for index in range(6):
        made.add(pyrender.PointLight(intensity=0.05), pose=translation_matrix((0.8 * index - 2.0, 0.0, 0.1)))
    pixel = 2.0 * math.tan(0.35) * 6.0 / SIZE[1]
    columns = np.rint((0.8 * np.arange(6) - 2.0) / pixel + 0.5 * SIZE[0] - 0.5).astype(int)
    theirs, ours = (picture[0][MIDDLE[0], columns, 0] > 150 for picture in both(made))
    assert theirs.tolist() == [True, True, True, True, False, False]
    assert ours.all()


def test_back_faces_in_depth_and_segmentation(draw_with_pyrender, renderer, both):
    made = scene()
    node = made.add(shell(1.0, 0.3, look(doubleSided=True)), name="shell")
    picture = both(made)
    theirs, ours = both(made, RenderFlags.DEPTH_ONLY)
    assert (picture[0][1] > 0).sum() - (theirs > 0).sum() > 1000
    assert (ours == picture[1][1]).all()
    theirs, _ = draw_with_pyrender(made, SIZE, RenderFlags.SEG, segments={"shell": 9})
    ours, _ = renderer.render(made, RenderFlags.SEG, {node: 9})
    assert (picture[0][1] > 0).sum() - theirs.any(axis=-1).sum() > 1000
    assert (ours.any(axis=-1) == (picture[1][1] > 0)).all()


def test_all_solid(both, draw_with_pyrender):
    theirs, ours = both(wireframes(), RenderFlags.ALL_SOLID)
    plain = draw_with_pyrender(wireframes(), SIZE, LIT)
    solid = draw_with_pyrender(
        wireframes(), SIZE, RenderFlags.FLIP_WIREFRAME
    )  # the scene has wireframes alone
    assert (theirs[0] == plain[0]).all()
    assert np.abs(ours[0].astype(int) - solid[0]).max() <= 1


@pytest.mark.parametrize("flag", [RenderFlags.VERTEX_NORMALS, RenderFlags.FACE_NORMALS])
def test_normals_as_lines(both, flag):
    plain, lined = both(smooth_and_flat()), both(smooth_and_flat(), flag)
    assert (lined[0][0] == plain[0][0]).all()
    changed = (lined[1][0] != plain[1][0]).any(axis=-1)
    assert changed.sum() > 300
    outside = changed & (plain[1][1] == 0)
    assert outside.any()
    assert (lined[1][1] == plain[1][1]).all()


def test_shadows_of_point_lights(draw_with_pyrender, renderer):
    made = add_lights(add_shapes(scene()), lamps=1)
    made.add(board((0.5, 0.5, 0.5, 1.0), size=9.0), pose=translation_matrix((0, 0, -1.5)))
    with pytest.raises(NotImplementedError, match="not implemented for point lights"):
        draw_with_pyrender(made, SIZE, RenderFlags.SHADOWS_POINT)
    plain, shadowed = (renderer.render(made, flags)[0] for flags in (LIT, RenderFlags.SHADOWS_POINT))
    assert (shadowed.astype(int) <= plain).all()
    assert ((plain.astype(int) - shadowed).sum(axis=-1) > 60).mean() > 0.02


def test_cut_outs(both):
    made = scene()
    pixels = np.full((4, 4, 4), 255, np.uint8)
    pixels[:, :2, 3] = 0
    sampler = pyrender.Sampler(magFilter=pyrender.GLTF.NEAREST, minFilter=pyrender.GLTF.NEAREST)
    image = pyrender.Texture(source=pixels, source_channels="RGBA", sampler=sampler)
    made.add(textured({"baseColorTexture": image}, alphaMode="MASK", alphaCutoff=0.5))
    (_, theirs), (_, ours) = both(made)
    left = np.arange(SIZE[0]) < SIZE[0] // 2
    assert (theirs > 0)[:, left].any()
    assert not (ours > 0)[:, left].any()
    assert (ours == np.where(left, 0.0, ours)).all()
    assert ((ours > 0) == (theirs > 0))[:, ~left].all()


@pytest.mark.parametrize(("mode", "theirs", "ours"), [("BLEND", 0.4**2, 0.4), ("OPAQUE", 0.4, 1.0)])
def test_alpha_of_a_picture(both, mode, theirs, ours):
    made = scene(bg_color=(0.0, 0.0, 0.0, 0.0))
    made.add(board((1.0, 1.0, 1.0, 0.4), mode))
    for (color, _), alpha in zip(both(made, RenderFlags.RGBA), (theirs, ours), strict=True):
        assert abs(color[MIDDLE][3] - 255 * alpha) <= 0.6


def test_the_order_of_blended_meshes(both):
    """The pane in front belongs to a node far behind: pyrender draws it first, and it hides the other one."""
    made = pyrender.Scene(bg_color=(0.0, 0.0, 0.0))
    made.add(pyrender.PerspectiveCamera(0.7), pose=EYE)
    made.add(
        board((1.0, 0.0, 0.0, 0.5), "BLEND", depth=3.0), name="front", pose=translation_matrix((0, 0, -2))
    )
    made.add(board((0.0, 1.0, 0.0, 0.6), "BLEND"), name="behind")
    (theirs, _), (ours, _) = both(made, RenderFlags.FLAT)
    np.testing.assert_allclose(theirs[MIDDLE], (127.5, 0, 0), atol=0.6)
    np.testing.assert_allclose(ours[MIDDLE], (127.5, 0.5 * 0.6 * 255, 0), atol=0.6)


def test_specular_glossiness(renderer):
    """pyrender's shader has no code for it, so that its colours are undefined; the door's are those of
    the same surface with metalness and roughness.
    """
    pictures = []
    for material in (
        pyrender.material.SpecularGlossinessMaterial(
            diffuseFactor=(0.8, 0.4, 0.2, 1.0), specularFactor=(0.04, 0.04, 0.04), glossinessFactor=0.3
        ),
        look((0.96 * 0.8, 0.96 * 0.4, 0.96 * 0.2, 1.0), metallic=0.0, roughness=0.7),
    ):
        made = add_lights(scene(ambient_light=(0.0, 0.0, 0.0)), suns=1)
        made.add(pyrender.Mesh.from_trimesh(trimesh.creation.icosphere(3), material))
        pictures.append(renderer.render(made)[0].astype(int))
    assert np.abs(pictures[0] - pictures[1]).max() <= 1
    assert (pictures[0] != pictures[0][0, 0]).any(axis=-1).sum() > 1000


def test_rows_of_textures(both):
    """Three texels of three bytes are nine bytes, which OpenGL takes for twelve."""
    made = scene()
    pixels = np.random.default_rng(2).integers(0, 256, (3, 3, 3), np.uint8)
    sampler = pyrender.Sampler(magFilter=pyrender.GLTF.NEAREST, minFilter=pyrender.GLTF.NEAREST)
    image = pyrender.Texture(source=pixels, source_channels="RGB", sampler=sampler)
    made.add(textured({"baseColorTexture": image}, color=(1.0, 1.0, 1.0, 1.0)))
    pixel = 2.0 * math.tan(0.35) * 6.0 / SIZE[1]
    rows = np.rint(MIDDLE[0] + np.array([-0.5, 0.0, 0.5]) / pixel).astype(int)
    columns = rows - MIDDLE[0] + MIDDLE[1]
    theirs, ours = (picture[0][np.ix_(rows, columns)] for picture in both(made, RenderFlags.FLAT))
    assert (ours == pixels).all()
    assert (theirs != pixels).any()


def test_no_camera(both, draw_with_pyrender):
    with pytest.raises(ValueError, match="without a camera"):
        draw_with_pyrender(pyrender.Scene(), SIZE, LIT)
    with pytest.raises(SceneError, match="no camera"), door.OffscreenRenderer(*SIZE) as made:
        made.render(pyrender.Scene())
    assert issubclass(SceneError, ValueError)


def test_a_scaled_camera(both):
    made = smooth_and_flat()
    plain = both(made)
    made.set_pose(made.main_camera_node, EYE @ np.diag((2.0, 2.0, 2.0, 1.0)))
    with pytest.warns(ConversionWarning, match="scale and shear of cameras are left out"):
        scaled = both(made)
    np.testing.assert_allclose(scaled[0][1], 0.5 * plain[0][1], rtol=1e-4)
    assert (scaled[1][1] == plain[1][1]).all()
