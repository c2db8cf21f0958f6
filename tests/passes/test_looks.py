"""The looks "pyrender", "flat" and "panda3d": what they show of surfaces, in closed form and against float64.

All mix blended surfaces, average samples and filter textures as values of the display. The look "pyrender"
encodes radiance by the power 1/2.2; the others show base colours as they are stored.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from firefly_sample.errors import OutputError
from firefly_sample.frame import OUTPUTS
from firefly_sample.lab.reference.frame import reference_settings, render_reference
from firefly_sample.lab.reference.shading import power_decoded, power_encoded
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lights import AmbientLight, PointLights
from firefly_sample.scene.material import Material, Texture
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear
from tests.blended import add_lights, add_panes, backdrop, empty_scene, even_texture, held
from tests.conftest import make_renderer
from tests.lit_scenes import lit_scene
from tests.scenes import geom_node, wall, wall_scene
from tests.unit.test_plan import cost

LOOKS = "pyrender", "flat", "panda3d"
each_look = pytest.mark.parametrize("look", LOOKS)
BACKGROUND = (0.1, 0.35, 0.6)


def unlit(color, name="card", **more):
    """A material that shows its base colour in the look "pyrender", too."""
    return Material(name, color, unlit=True, **more)


def card_scene(material, size=2.0, geom=None, background=BACKGROUND):
    """A card as wide as the picture before an orthographic camera."""
    scene = empty_scene(background)
    scene.root.attach_new_node(geom_node("card", geom or wall(size), material)).set_pos(0, 10, 0)
    return scene


def encoded(value, look):
    """Values of the display that a look shows of radiance, or of base colours."""
    return power_encoded(value) if look == "pyrender" else np.clip(value, 0.0, 1.0)


def assert_codes(color, display):
    """Codes are values of the display rounded, but for float32's error."""
    assert np.abs(color - 255.0 * np.asarray(display)).max() <= 0.501


# --- Without layers ---


@pytest.mark.parametrize("exposure", [1.0, 0.3, 4.0])
def test_radiance_is_shown_by_the_power_of_its_inverse_gamma(render, exposure):
    """The background has values from 0 to beyond white; the setting's exposure is times the scene's."""
    scene = Scene(background=VerticalGradient((0.0, 0.0, 0.3), (4.0, 0.4, 0.9)))
    scene.exposure = (1.0, 0.5, 1.0)
    frame = render(scene, Settings(look="pyrender", exposure=exposure), (8, 400), ("color", "radiance"))
    assert_codes(frame.color, power_encoded(frame.radiance * np.array([exposure, 0.5 * exposure, exposure])))
    assert len(np.unique(frame.color)) > 40
    assert frame.radiance.max() > 1.0


@each_look
def test_every_code_of_a_texture_is_shown(render, look):
    """Others show the code itself; pyrender decodes it by sRGB and encodes it by another power."""
    codes = np.arange(256, dtype=np.uint8)
    pixels = np.stack([codes, codes[::-1], codes, np.full(256, 255, np.uint8)], axis=1)[None]
    material = unlit((1, 1, 1, 1), texture=Texture(pixels, magfilter="nearest"))
    color = render(card_scene(material), Settings(look=look), (256, 4)).color
    if look == "pyrender":
        assert_codes(color, power_encoded(srgb_to_linear(pixels[..., :3] / 255.0)))
    else:
        assert (color == pixels[..., :3]).all()


@each_look
def test_textures_are_filtered_as_codes_and_then_decoded(render, look):
    """Between a black texel and a white one; and a chessboard so far away that it is one grey."""
    ramp = np.zeros((1, 2, 4), dtype=np.uint8)
    ramp[0, 1] = 255
    settings = {"look": look} | ({"albedo_format": "rgba32f"} if look == "pyrender" else {})
    for emits in (False, True)[: 2 if look == "pyrender" else 1]:
        texture = Texture(ramp, wrap_u="clamp")
        kind = {"emission": (1, 1, 1), "emission_texture": texture} if emits else {"texture": texture}
        output = "emission" if emits else "albedo"
        frame = render(card_scene(Material("card", **kind)), Settings(**settings), (64, 4), (output,))
        values = linear_to_srgb(frame[output]) if look == "pyrender" else frame[output]
        exact = np.interp((np.arange(64) + 0.5) / 32, [0.5, 1.5], [0, 1])
        # a texel has eight bits, and so has a weight
        assert np.abs(values - exact[:, None]).max() <= 1.5 / 255
    board = np.full((64, 64, 4), 255, dtype=np.uint8)
    board[np.add.outer(np.arange(64), np.arange(64)) % 2 == 0, :3] = 0
    color = render(card_scene(unlit((1, 1, 1, 1), texture=Texture(board))), Settings(look=look), (8, 8)).color
    grey = power_encoded(srgb_to_linear(127.5 / 255)) if look == "pyrender" else 127.5 / 255
    assert np.abs(color - 255 * grey).max() <= 1.1


KINDS = {}, {"unlit": True}, {"metallic": 1.0}, {"emission": (3, 0, 0)}


@pytest.mark.parametrize("material", KINDS, ids=str)
def test_flat_shows_base_colour_times_texture_times_vertex_colour(render, material):
    """Without light and exposure, whatever the material is; alpha does not cut an opaque one."""
    plain = wall(2.0)
    colors = [(1, 0.5, 0.25, 0.3)] * 4
    geom = Geom(plain.vertices, plain.triangles, plain.normals, plain.texcoords, colors)
    made = Material("card", (0.8, 0.6, 0.4, 0.2), texture=even_texture(255), **material)
    scene = card_scene(made, geom=geom)
    scene.exposure = 5.0
    expected = np.array([0.8 * 188 / 255, 0.6 * 0.5, 0.4 * 0.25 * 220 / 255])
    frame = render(scene, Settings(look="flat"), (8, 8), ("color", "color_alpha"))
    assert_codes(frame.color, expected)
    assert (frame.color_alpha[..., :3] == frame.color).all()
    assert (frame.color_alpha[..., 3] == 255).all()
    assert frame.warnings == ()


@pytest.mark.parametrize(("look", "half"), [("pyrender", power_decoded), ("correct", srgb_to_linear)])
def test_the_cut_off_of_lights_costs_half_a_code_in_the_dark(render, look, half):
    """A hundred lights under a sky of a few codes; the power 1/2.2 is steep in the dark."""
    settings = Settings(look=look, tone="none")
    assert settings.budget == pytest.approx(half(0.5 / 255), rel=0.02)
    assert settings.with_changes(cutoff_budget=1e-3).budget == 1e-3
    scene = wall_scene(10.0, (1.0, 1.0, 1.0, 1.0), size=400.0)
    places = np.random.default_rng(2).uniform((-60, 5, -60), (60, 9, 60), (100, 3))
    color = settings.budget * np.array([4.0, 2.0, 12.0])
    lights = PointLights("lights", places, color, attenuation=(0, 0, 1))
    scene.root.attach_new_node(lights)
    scene.root.attach_new_node(AmbientLight("sky", settings.budget * np.array([2.0, 9.0, 30.0])))
    cut = render(scene, settings, (40, 30), ("color", "radiance"))
    whole = render(scene, settings.with_changes(cutoff_budget=0.0), (40, 30), ("color", "radiance"))
    assert cut.color.any()
    assert 0.01 * settings.budget < np.abs(cut.radiance - whole.radiance).max() <= settings.budget
    assert np.abs(cut.color.astype(int) - whole.color).max() <= 1


@each_look
def test_samples_are_averaged_as_codes(render, look):
    """The card covers half of the pixel in the middle, and the background the other half."""
    card = np.array([0.8, 0.05, 0.4])
    scene = card_scene(unlit((*card, 1.0)))
    scene.root.find("card").set_x(-1.0)
    color = render(scene, Settings(look=look, supersample=2), (9, 3)).color
    one, other = encoded(card, look), encoded(BACKGROUND, look)
    assert_codes(color[:, :4], one)
    assert_codes(color[:, 5:], other)
    assert_codes(color[:, 4], (one + other) / 2)
    frame = render(scene, Settings(look=look, supersample=2), (9, 3), ("color_alpha",))
    assert (frame.color_alpha[:, 4, 3] == 128).all()
    assert_codes(frame.color_alpha[:, 4, :3], one * 127.5 / 128)


# --- Panes ---


PANES = [((0.9, 0.2, 0.1), 0.4), ((0.05, 0.8, 0.5), 0.7), ((0.6, 0.6, 1.0), 0.25)]
"""Colours and alphas, from back to front."""


def panes_scene(count, background=BACKGROUND):
    scene = empty_scene(background)
    for index, (color, alpha) in enumerate(PANES[:count]):
        made = unlit((*color, alpha), f"glass {index}", alpha_mode="blend")
        scene.root.attach_new_node(geom_node(f"pane {index}", wall(2.0), made)).set_pos(0, 12 - index, 0)
    return scene


@pytest.mark.parametrize("method", ["sorted", "exact", "weighted"])
@pytest.mark.parametrize("exposure", [1.0, 1.5])
@each_look
def test_panes_are_mixed_as_codes(render, look, exposure, method):
    exposure = exposure if look == "pyrender" else 1.0
    for count in (1, 2, 3) if method != "weighted" else (1,):
        shown, left = encoded(np.array(BACKGROUND) * exposure, look), 1.0
        own = np.zeros(3)
        for color, alpha in PANES[:count]:
            value = encoded(np.array(color) * exposure, look)
            shown, own = (alpha * value + (1.0 - alpha) * under for under in (shown, own))
            left *= 1.0 - alpha
        outputs = ("color", "color_alpha", "radiance")[: 3 if look == "pyrender" else 2]
        settings = Settings(look=look, exposure=exposure, transparency=method)
        frame = render(panes_scene(count), settings, (8, 6), outputs)
        assert_codes(frame.color, shown)
        alpha = np.rint(255.0 * (1.0 - left))
        assert (frame.color_alpha[..., 3] == alpha).all()
        assert_codes(frame.color_alpha[..., :3], own * 255.0 / alpha)
        if look == "pyrender":
            np.testing.assert_allclose(
                frame.radiance, np.broadcast_to(power_decoded(shown) / exposure, (6, 8, 3)), rtol=1e-5
            )


def test_radiance_beside_panes_keeps_what_is_brighter_than_white(render):
    scene = panes_scene(1, background=(4.0, 0.5, 0.1))
    scene.root.find("pane 0").set_x(-1.0)
    radiance = render(scene, Settings(look="pyrender"), (8, 6), ("radiance",)).radiance
    np.testing.assert_allclose(radiance[:, 4:], np.broadcast_to((4.0, 0.5, 0.1), (6, 4, 3)), rtol=1e-6)
    assert (radiance[:, :4] <= 1.0).all()


@each_look
def test_color_alpha_over_the_background_is_the_picture(render, look):
    """Over any colour: both mix codes."""
    for background in ((0.0, 0.0, 0.0), BACKGROUND, (1.0, 1.0, 1.0)):
        scene = add_panes(add_lights(Scene(background=background), ("sun",)), 6)
        scene.root.attach_new_node(geom_node("wall", wall(3.0), Material("grey"))).set_pos(0, 12, 0)
        frame = render(scene, Settings(look=look), (48, 36), ("color", "color_alpha"))
        codes = np.rint(255.0 * encoded(background, look)) / 255.0
        over = frame.color_alpha / 255.0
        picture = over[..., :3] * over[..., 3:] + codes * (1.0 - over[..., 3:])
        # the colour, alpha and the background are rounded
        assert np.abs(255.0 * picture - frame.color).max() <= 2.01
        assert 0 < (over[..., 3] == 0).mean() < 1
        assert (over[..., 3] == 1).any()


# --- Against float64 ---


@pytest.fixture(scope="module")
def renderer():
    with make_renderer((48, 36)) as made:
        yield made


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("method", ["sorted", "exact"])
@each_look
def test_panes_are_what_rays_see(renderer, look, method, orthographic):
    kinds = {"unlit": True}, {"unlit": True, "texture": even_texture(153)}
    scene = add_panes(add_lights(backdrop(orthographic)), 7, crossing=method == "exact", kinds=kinds)
    scene.background = (0.2, 0.4, 0.9)
    formats = {"exposure": 1.3} if look == "pyrender" else {"albedo_format": "sqrt10"}
    assert held(renderer, scene, look=look, transparency=method, **formats).codes() <= 1


@each_look
def test_lit_scenes_and_textures_are_those_of_float64(renderer, look):
    """With a texture of an even number of texels at each level, whose mipmaps are the same on all drivers."""
    scene = lit_scene()
    rng = np.random.default_rng(3)
    noise = rng.integers(0, 256, (8, 8, 4), dtype=np.uint8).repeat(4, 0).repeat(4, 1)
    board = Material("board", (0.9, 0.8, 0.7, 1.0), texture=Texture(noise), double_sided=True)
    path = scene.root.attach_new_node(geom_node("board", wall(4.0), board))
    path.set_pos(0, 8, 0)
    path.set_hpr(35, 20, 10)
    settings = reference_settings(Settings(look=look))
    if look != "flat":
        settings = settings.with_changes(albedo_format="rgba32f", normal_format="rgba32f")
    renderer.settings = settings
    plan = renderer.plan(scene, 0.0, ("color", "visibility", "albedo"))
    frame = renderer.draw(plan)
    tint = renderer.surface(plan).tint() if look == "panda3d" else None
    given = render_reference(plan, frame.visibility, albedo=frame.albedo, tint=tint)
    assert np.abs(frame.color.astype(int) - given.color).max() <= 1
    exact = render_reference(plan, frame.visibility)
    apart = np.abs(frame.color.astype(int) - exact.color).max(axis=-1)
    assert (apart <= 3).mean() >= 0.99  # a level between two pixels, and eight bits of texels and weights
    assert (frame.id_names, (frame.visibility[..., 0] >= 0).mean() > 0.5) == (frame.id_names, True)


# --- Plans ---


def everything_but_light():
    """A surface with all that light could show, under light and ambient light."""
    made = {"emission": (1, 1, 1), "specular": (1, 1, 1), "ambient": (1, 0, 0)}
    scene = wall_scene(material=Material("wall", **made))
    scene.root.attach_new_node(geom_node("metal", wall(2.0), Material("metal", metallic=0.5))).set_pos(
        0, 8, 0
    )
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.1, 0.1)))
    return add_lights(scene)


def test_flat_frames_have_no_light():
    scene = everything_but_light()
    settings = Settings(look="flat")
    assert cost(scene, settings) == (["geometry", "resolve"], {"depth": 4, "albedo": 4, "color": 4})
    assert build_plan(scene, settings).lights == ()
    add_panes(scene, 3)
    assert cost(scene, settings)[0] == ["geometry", "transparency", "resolve"]
    plan = build_plan(scene, settings)
    (step,) = (step for step in plan.passes if step.name == "transparency")
    assert step.variant.light_sets == ()
    assert not plan.ambient.any()


def test_pyrender_frames_without_its_features_have_the_targets_of_others():
    scene = wall_scene()
    add_lights(scene)
    assert cost(scene, Settings(look="pyrender")) == cost(scene, Settings(tone="none"))


@each_look
def test_dots_and_particles_are_left_out_by_name(render, look):
    scene = card_scene(unlit((0.5, 0.5, 0.5, 1.0)))
    plain = render(scene, Settings(look=look), (16, 12)).color
    scene.root.attach_new_node(Sprites("sparks", [(0, 5, 0)], (1, 1, 1), 1.0))
    scene.root.attach_new_node(ParticleNode("mist", [(0, 5, 0)], 1.0, 0.6))
    frame = render(scene, Settings(look=look), (16, 12))
    assert (frame.color == plain).all()
    assert f"look {look!r} leaves out dots and particles: sparks, mist" in frame.warnings


def test_flat_needs_no_light():
    assert build_plan(wall_scene(), Settings(look="flat")).warnings == ()


@pytest.mark.parametrize("output", OUTPUTS)
def test_flat_has_no_outputs_of_light_and_of_materials(render, output):
    scene = card_scene(unlit((0.5, 0.5, 0.5, 1.0)))
    there = {
        "color",
        "color_alpha",
        "albedo",
        "normal",
        "normal_world",
        "depth",
        "position",
        "position_world",
    }
    if output in there | {"id", "visibility"}:
        assert render(scene, Settings(look="flat"), (8, 6), (output,))[output].any() == (output != "id")
    else:
        with pytest.raises(OutputError, match=f"look 'flat' has no output '{output}'"):
            build_plan(scene, Settings(look="flat"), outputs=(output,))


def test_a_look_takes_along_what_it_allows():
    settings = Settings(exposure=2.0, tone="exponential", albedo_format="rgba32f", supersample=2)
    flat = settings.with_look("flat")
    assert (flat.exposure, flat.tone, flat.albedo_format, flat.supersample) == (1.0, None, "sqrt10", 2)
    encoding = settings.with_look("pyrender")
    assert (encoding.exposure, encoding.tone, encoding.albedo_format) == (2.0, None, "rgba32f")
    for look, tone in product(LOOKS, (None, "none")):
        assert Settings(look=look, tone=tone).tone_curve == "none"
