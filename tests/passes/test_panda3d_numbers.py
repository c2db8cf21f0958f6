"""The look "panda3d" by hand: what its pictures show where the formula has few terms."""

import numpy as np
import pytest

from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.settings import Settings
from tests.passes.test_metallic import centre_of, image
from tests.passes.test_panda3d_look import EXACT, METHODS, lit_wall
from tests.scenes import geom_node, wall, wall_scene

EVERY_WAY = [{"light_method": method} for method in (*METHODS, "forward")]


@pytest.mark.parametrize("way", EVERY_WAY, ids=lambda way: way["light_method"])
def test_the_limit_is_before_the_texture_and_highlights_are_after_it(render, way):
    """The sum of emission, ambient and diffuse light ends at 1, then come texture and scale."""
    material = Material(
        "m",
        (0.5, 0.8, 0.1, 1.0),
        image(51, 204, 102, 255),
        ambient=(1.0, 0.5, 1.0),
        emission=(0.05, 0.1, 0.2),
        specular=(0.3, 0.2, 0.1),
        shininess=7.0,
    )
    scene = lit_wall(material, (2.0, 1.5, 0.5), scale=(1.5, 0.5, 2.0, 1.0))
    matt = np.array([0.05 + 0.1 + 2.0 * 0.5, 0.1 + 0.5 * 0.2 + 1.5 * 0.8, 0.2 + 0.3 + 0.5 * 0.1])
    assert (matt > 1.0).tolist() == [True, True, False]
    gloss = np.array([0.3, 0.2, 0.1]) * (2.0, 1.5, 0.5)  # the light comes from the eye
    expected = np.minimum(matt, 1.0) * (0.2 * 1.5, 0.8 * 0.5, 0.4 * 2.0) + gloss
    assert expected.max() < 1.0
    frame = render(scene, EXACT.with_changes(**way), (9, 9), ("radiance", "color"))
    assert centre_of(frame) == pytest.approx(expected, abs=5e-4)  # half floats hold the tint
    assert np.abs(frame.color[4, 4] - 255.0 * expected).max() <= 0.7


@pytest.mark.parametrize("transparency", ["sorted", "exact", "weighted"])
def test_what_is_blended_is_limited_before_it_is_mixed(render, transparency):
    """The opacities of colour, texture and scale are multiplied, and codes are mixed."""
    pane = Material(
        "pane",
        (0.9, 0.9, 0.9, 0.8),
        image(255, 51, 255, 204),
        "blend",
        specular=(0.5, 0.5, 0.5),
        shininess=3.0,
    )
    scene = lit_wall(Material("m", (0.4, 0.4, 0.4, 1.0)), (2.0, 2.0, 0.5))
    front = scene.root.attach_new_node(geom_node("pane", wall(4.0), pane))
    front.set_pos(0, 8, 0)
    front.set_color_scale(0.5, 1.0, 1.0, 0.5)
    behind = np.array([0.4 * 2.1, 0.4 * 2.2, 0.4 * 0.8])
    own = np.minimum([0.9 * 2.1, 0.9 * 2.2, 0.9 * 0.8], 1.0) * (0.5, 0.2, 1.0) + 0.5 * np.array(
        [2.0, 2.0, 0.5]
    )
    alpha = 0.8 * 0.8 * 0.5
    expected = np.minimum(own, 1.0) * alpha + behind * (1.0 - alpha)
    frame = render(scene, EXACT.with_changes(transparency=transparency), (9, 9), ("radiance",))
    assert centre_of(frame) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("way", EVERY_WAY, ids=lambda way: way["light_method"])
@pytest.mark.parametrize("textured", [False, True])
def test_a_surface_that_faces_away_has_highlights_alone(render, way, textured):
    """And no diffuse light: (N.H)^shininess, with H half-way between the light and the view axis."""
    texture = image(128, 128, 128, 255) if textured else None
    material = Material("m", (0.5, 0.5, 0.5, 1.0), texture, specular=(0.5, 0.6, 0.7), shininess=4.0)
    scene = wall_scene(material=material)
    lamp = PointLight("lamp", (1.0, 0.9, 0.8))
    lamp.set_attenuation((0.5, 0.0, 0.1))
    scene.root.attach_new_node(lamp).set_pos(2.0, 11.0, 0.0)  # behind the wall
    to_light = np.array([2.0, 1.0, 0.0]) / 5.0**0.5
    half = to_light + np.array([0.0, -1.0, 0.0])
    cosine = -half[1] / np.linalg.norm(half)
    fading = 1.0 / (0.5 + 0.1 * 5.0)
    expected = np.array([0.5, 0.6, 0.7]) * (1.0, 0.9, 0.8) * fading * cosine**4.0
    frame = render(scene, EXACT.with_changes(**way), (9, 9), ("radiance",))
    assert centre_of(frame) == pytest.approx(expected, abs=2e-5)  # sixteen bits hold colours and exponents


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("local", [False, True])
@pytest.mark.parametrize("method", ["volumes", "forward"])
def test_a_local_viewer_sees_the_eye_where_it_is(render, local, orthographic, method):
    """Others see it along the view axis; beside the picture's middle, these are different ways."""
    looks = {"specular": (1.0, 1.0, 1.0), "shininess": 5.0}
    scene = wall_scene(material=Material("m", (0.0, 0.0, 0.0, 1.0), local_viewer=local, **looks))
    near = Material("near", (0.0, 0.0, 0.0, 1.0), local_viewer=not local, **looks)  # a frame with both
    scene.root.attach_new_node(geom_node("near", wall(0.1), near)).set_pos(0, 5, 2)
    scene.root.attach_new_node(DirectionalLight("sun", (0.9, 0.9, 0.9))).set_h(-40.0)
    scene.camera.node().lens = (
        OrthographicLens(film_size=(9.0, 9.0), near=1.0, far=50.0)
        if orthographic
        else PerspectiveLens(fov=90.0, near=1.0, far=50.0)
    )
    frame = render(scene, EXACT.with_changes(light_method=method), (9, 9), ("radiance",))
    x = -4.0 if orthographic else -10.0 * 8.0 / 9.0  # of the first pixel of the middle row
    to_light = -np.array([np.sin(np.deg2rad(40.0)), np.cos(np.deg2rad(40.0)), 0.0])
    to_eye = -np.array([x, 10.0, 0.0]) / np.hypot(x, 10.0) if local else np.array([0.0, -1.0, 0.0])
    half = to_light + to_eye
    expected = 0.9 * (-half[1] / np.linalg.norm(half)) ** 5.0
    assert frame.radiance[4, 0] == pytest.approx([expected] * 3, abs=2e-4)


def test_a_spotlight_ends_hard_at_half_of_its_lens(render):
    """The strength is cos(angle)^exponent up to there."""
    scene = wall_scene(material=Material("m", (0.5, 0.5, 0.5, 1.0)))
    spot = Spotlight("spot", (1.0, 1.0, 1.0))
    spot.set_attenuation((1, 0, 0))
    spot.set_exponent(12.0)
    spot.get_lens().set_fov(30.0)
    scene.root.attach_new_node(spot)
    scene.camera.node().lens = PerspectiveLens(fov=60.0, near=1.0, far=50.0)
    row = render(scene, EXACT, (65, 65), ("radiance",)).radiance[32, :, 0]
    angle = np.arctan(np.tan(np.deg2rad(30.0)) * (2.0 * np.arange(65) + 1.0 - 65.0) / 65.0)
    inside = np.abs(angle) < np.deg2rad(15.0)
    assert row == pytest.approx(np.where(inside, 0.5 * np.cos(angle) ** 13.0, 0.0), abs=1e-5)


@pytest.mark.parametrize("blended", [False, True])
def test_an_unlit_surface_shows_its_codes_times_the_scale(render, blended):
    """What the scale makes brighter than white is white."""
    material = Material("m", (0.5, 1.0, 0.8, 1.0), image(102, 153, 204, 255), unlit=True)
    if blended:
        material.alpha_mode = "blend"
    scene = lit_wall(material, scale=(1.5, 0.5, 2.0, 1.0 if not blended else 0.5))
    shown = np.minimum([0.5 * 0.4 * 1.5, 0.6 * 0.5, 0.8 * 0.8 * 2.0], 1.0)
    frame = render(scene, EXACT, (9, 9), ("radiance",))
    assert centre_of(frame) == pytest.approx(shown * (0.5 if blended else 1.0), abs=5e-4)


def test_a_modulating_texture_alone_is_a_texture(render):
    material = Material("m", (0.5, 0.5, 0.5, 1.0), modulate_texture=image(51, 102, 204, 255))
    expected = np.minimum([0.5 * 2.1, 0.5 * 2.2, 0.5 * 0.8], 1.0) * (0.2, 0.4, 0.8)
    frame = render(lit_wall(material, (2.0, 2.0, 0.5)), EXACT, (9, 9), ("radiance", "albedo"))
    assert centre_of(frame) == pytest.approx(expected, abs=5e-4)
    assert frame.albedo[4, 4] == pytest.approx([0.1, 0.2, 0.4], abs=5e-4)


def test_the_back_keeps_the_normal_of_the_front(render):
    scene = lit_wall(Material("m", (0.5, 0.5, 0.5, 1.0), double_sided=True))
    scene.root.find("wall").set_h(180.0)
    assert centre_of(render(scene, EXACT, (9, 9), ("radiance",))) == pytest.approx(
        [0.05, 0.1, 0.15], abs=1e-6
    )
    scene.root.find("sun").set_h(180.0)
    lit = [0.3, 0.35, 0.4]
    assert centre_of(render(scene, EXACT, (9, 9), ("radiance",))) == pytest.approx(lit, abs=1e-6)


def test_the_background_is_codes_and_samples_are_averaged_as_codes(render):
    scene = wall_scene(material=Material("m", (1.0, 1.0, 1.0, 1.0), unlit=True))
    scene.background = (0.2, 0.6, 1.5)
    scene.root.find("wall").set_pos(10.0, 10.0, 0.0)  # its edge in the middle
    frame = render(scene, Settings(look="panda3d", supersample=2), (9, 8), ("color", "radiance"))
    assert frame.color[:, 0].tolist() == [[51, 153, 255]] * 8
    assert frame.radiance[:, 4] == pytest.approx(np.full((8, 3), [0.6, 0.8, 1.0]), abs=1e-6)
    assert frame.color[:, 8].min() == 255


def test_a_metallic_surface_is_that_of_the_look_correct_without_encoding(render):
    """Its numbers are those that are stored, and its light ends at 1."""
    numbers = (0.5, 0.25, 0.125, 1.0)
    plain = Material("m", numbers, metallic=0.3, roughness=0.5)
    scene = lit_wall(plain)
    scene.root.attach_new_node(PointLights("lamps", [(1, 8, 0)], (0.4, 0.4, 0.4), 9.0))
    correct = render(
        scene, Settings(cutoff_budget=0.0, albedo_format="rgba32f", normal_format="rgba32f"), (9, 9)
    )
    expected = render(scene, EXACT.with_look("correct"), (9, 9), ("radiance",)).radiance
    assert expected.max() < 1.0
    found = render(scene, EXACT, (9, 9), ("radiance", "color"))
    assert found.radiance == pytest.approx(expected, abs=1e-6)
    assert (found.color == np.rint(found.radiance * 255.0)).mean() > 0.99
    assert (found.color != correct.color).any()
