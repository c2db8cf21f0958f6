"""The original's look against the original's own formula: in float64, and drawn by Panda3D itself."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.errors import SettingsError
from firefly_sample.lab.reference.frame import render_classic
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import VerticalGradient
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer
from tests.lit_scenes import lit_scene
from tests.passes.classic_scene import classic_scene, write_parts
from tests.scenes import ball_scene, wall_scene

CLASSIC = Settings(look="classic")


def draw(scene, size=(160, 120), outputs=("color", "albedo", "visibility")):
    with borrow_renderer(size, CLASSIC) as renderer:
        plan = renderer.plan(scene, 0.0, outputs)
        return plan, renderer.draw(plan)


def apart(one, other):
    """Codes between two pictures, the largest of each pixel's channels."""
    return np.abs(one.astype(int) - other.astype(int)).max(axis=-1)


# --- By hand ---


@pytest.mark.parametrize(
    ("offset", "cosine"),
    [((0, 0, 2), 1.0), ((0, 0, -2), 0.0), ((0, -2, 0), 0.0), ((0, 2, 0), 128 / 255), ((2, 0, 0), 128 / 255)],
    ids=["above", "below", "before", "behind", "beside"],
)
def test_a_wall_that_faces_the_eye_is_lit_from_above_and_not_from_the_front(offset, cosine):
    """Its normal (0, -1, 0) is stored as (1/2, 1/2, 1), and used as if it were in axes with z up."""
    scene = wall_scene(10.0, (0.6, 0.6, 0.6, 1.0))
    place = np.array([0, 10, 0]) + offset
    scene.root.attach_new_node(PointLights("light", [place], (1.0, 0.5, 2.0), 4.0))
    _, frame = draw(scene, (65, 49), ("color", "albedo", "normal"))
    assert (np.rint(frame.normal[24, 32] * 255) == (128, 128, 255)).all()
    assert (np.rint(frame.albedo[24, 32] * 255) == 153).all()
    expected = 153 * np.array((1.0, 0.5, 2.0)) * cosine * (1 - 2 / 4) ** 2
    np.testing.assert_allclose(frame.color[24, 32], expected, atol=0.51)


def test_each_light_is_cut_at_white_before_it_is_added():
    """Sixteen lights: shares of 0.49 codes add up to 0, of 0.51 codes to 16, and of 6,375 codes to white."""
    scene = wall_scene(10.0, (1.0, 1.0, 1.0, 1.0))
    color = np.array((0.49, 6375.0, 0.51)) / 255 / (1 - 2 / 4) ** 2
    scene.root.attach_new_node(PointLights("lights", [(0, 10, 2)] * 16, color, 4.0))
    _, frame = draw(scene, (65, 49))
    assert frame.color[24, 32].tolist() == [0, 255, 16]


def test_textures_and_vertex_colors_are_multiplied_as_stored(render):
    """128 of 255 times a half is 64, as in Panda3D: no sRGB is decoded on the way in."""
    texture = Texture(np.full((2, 2, 4), 128, dtype=np.uint8))
    scene = wall_scene(material=Material("grey", texture=texture))
    albedo = render(scene, CLASSIC, (8, 6), ("albedo",)).albedo
    assert np.abs(albedo - 128 / 255).max() <= 1e-6
    (geom, _), *_ = scene.root.find("wall").node().geoms
    geom.set_colors(np.full((4, 3), 0.5))
    albedo = render(scene, CLASSIC, (8, 6), ("albedo",)).albedo
    assert (np.rint(albedo * 255) == 64).all()


def test_the_back_of_a_two_sided_surface_keeps_its_normal():
    scene = wall_scene(material=Material("leaf", double_sided=True))
    scene.root.find("wall").set_h(180)
    _, frame = draw(scene, (9, 7), ("normal", "normal_world"))
    assert (np.rint(frame.normal[3, 4] * 255) == (128, 128, 0)).all()
    np.testing.assert_allclose(frame.normal_world[3, 4], (0, 1, 0), atol=1 / 127)


def test_world_normals_are_decoded(render):
    scene = ball_scene(5)
    classic, correct = (render(scene, s, (160, 120), ("normal_world",)).normal_world for s in (CLASSIC, None))
    # half a code of 255 in each axis, on a vector of length 1/2
    assert np.abs(classic - correct).max() <= 2 * np.sqrt(3) * 0.51 / 255
    assert correct.any()


# --- In float64 ---


def everything():
    """Beside what the original has, every kind of light, a sky, and dots."""
    scene = lit_scene()
    scene.background = VerticalGradient((0.1, 0.2, 0.3), (0.0, 0.05, 0.4))
    rng = np.random.default_rng(4)
    places = rng.uniform((-4, 3, -3), (4, 14, 3), (40, 3))
    scene.root.attach_new_node(Sprites("dots", places, rng.uniform(0, 1, (40, 3)), 0.3))
    return scene


def orthographic():
    scene = classic_scene()[0]
    scene.camera.node().lens = OrthographicLens(film_size=(12, 9), near=1, far=60)
    return scene


SCENES = {
    "original": lambda: classic_scene()[0],
    "orthographic": orthographic,
    "everything": everything,
}


@pytest.mark.parametrize("name", SCENES)
def test_every_pixel_is_within_a_code_of_float64(name):
    plan, frame = draw(SCENES[name]())
    expected = render_classic(plan, frame.visibility, albedo=frame.albedo)
    lit = expected.any(axis=-1)
    assert lit.mean() > 0.2
    difference = apart(frame.color, expected)
    assert difference.max() <= 1
    assert (difference[lit] == 0).mean() >= 0.999


def test_with_textures_sampled_in_float64_nearly_every_pixel_is_within_two_codes():
    plan, frame = draw(classic_scene()[0])
    expected = render_classic(plan, frame.visibility)
    lit = expected.any(axis=-1)
    assert (apart(frame.color, expected)[lit] <= 2).mean() >= 0.999


def test_there_is_a_reference_of_the_classic_look_alone():
    seen = np.full((48, 64, 2), -1, dtype=np.int32)
    for settings in (Settings(), Settings(look="classic", supersample=2)):
        with pytest.raises(SettingsError, match="needs a plan with look 'classic' and 'supersample' 1"):
            render_classic(build_plan(ball_scene(2), settings, (64, 48)), seen)


# --- By Panda3D ---


def test_the_picture_is_the_one_that_panda3d_draws(tmp_path):
    """Its normals for shaders, its view axes, its targets of 8 bits and its blending."""
    scene, parts, places, colors = classic_scene()
    plan, frame = draw(scene, (320, 240), ("color", "albedo", "normal", "visibility"))
    write_parts(tmp_path / "scene.npz", parts, plan, places, colors)
    files = tmp_path / "scene.npz", tmp_path / "frame.npz"
    command = [sys.executable, Path(__file__).with_name("panda_original.py"), *files]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert ended.returncode == 0, ended.stderr
    theirs = np.load(files[1])
    lit = theirs["color"].any(axis=-1) & (frame.visibility[..., 0] >= 0)
    assert lit.mean() > 0.2
    # at the edges of leaves the two may see different surfaces
    for name in ("albedo", "normal"):
        assert (apart(np.rint(frame[name] * 255), theirs[name])[lit] <= 1).mean() >= 0.995
    assert (apart(frame.color, theirs["color"])[lit] <= 2).mean() >= 0.995
    assert (apart(render_classic(plan, frame.visibility), theirs["color"])[lit] <= 2).mean() >= 0.995


def test_classic_differs_from_correct(render):
    scene = ball_scene(60)
    correct = render(scene, Settings(tone="none"), (160, 120)).color
    assert apart(correct, render(scene, CLASSIC, (160, 120)).color).max() > 40
