"""What the G-buffer and the light are stored in: every combination draws, and errs as its parts do."""

import itertools

import numpy as np
import pytest

from firefly_sample.errors import LightError, OutputError, SettingsError
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.report import plan_as_dict, plan_as_text
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import PRESETS, Settings
from tests.conftest import make_renderer
from tests.lit_scenes import lit_scene
from tests.reference import compare
from tests.scenes import ball, ball_scene, geom_node, orthographic_wall, wall, wall_scene

CHOICES = {
    "position_method": (
        *("linear32f", "depth32f", "depth24", "depth16", "inverse_matrix"),
        *("stored16f", "stored32f"),
    ),
    "normal_format": ("oct16", "rgb10a2", "rgba8", "oct8", "rgba16f", "rgba32f"),
    "albedo_format": ("sqrt10", "sqrt8", "srgb8", "rgba8", "rgba16f", "rgba32f"),
    "accumulation_format": ("rgba32f", "rgba16f", "r11g11b10f", "rgba8"),
}
FINEST = {
    "position_method": "linear32f",
    "normal_format": "rgba32f",
    "albedo_format": "rgba32f",
    "accumulation_format": "rgba32f",
}


def make_sun(color, direction):
    sun = DirectionalLight("sun", color)
    sun.set_direction(direction)
    return sun


def small_scene():
    """A shiny and a dull ball before a wall under a dozen lights: highlights and edges in 32x24 pixels."""
    scene = Scene()
    shiny = Material("tin", (0.2, 0.3, 0.5, 1), specular=(0.5, 0.5, 0.4), shininess=20.0)
    scene.root.attach_new_node(geom_node("tin", ball(1.0, 2), shiny)).set_pos(-1.2, 8, 0)
    clay = Material("clay", (0.7, 0.4, 0.2, 1))
    scene.root.attach_new_node(geom_node("clay", ball(1.0, 2), clay)).set_pos(1.2, 8, 0.3)
    scene.root.attach_new_node(geom_node("wall", wall(12.0, 4))).set_pos(0, 11, 0)
    rng = np.random.default_rng(5)
    positions = rng.uniform((-3, 5, -2), (3, 10, 2), (12, 3))
    scene.root.attach_new_node(PointLights("lights", positions, rng.uniform(0.02, 0.1, (12, 3)), 4.0))
    return scene


def pairs():
    """Combinations of one choice of each setting, among which every two choices of two settings are.

    Each is drawn by shaders of its own, which take a while to compile; another test compiles every three.
    """
    first, second, third, last = CHOICES.values()
    places = itertools.product(range(len(first)), range(len(second)))
    some = [(first[i], second[j], third[(i + j) % len(third)], last[(i + j) % len(last)]) for i, j in places]
    return some + [
        (first[k % len(first)], second[(k + n) % len(second)], third[k], last[n])
        for k, n in itertools.product(range(len(third)), range(len(last)))
    ]


def test_the_combinations_have_every_two_choices():
    names = list(CHOICES)
    for chosen in itertools.combinations(range(len(names)), 2):
        had = {tuple(combination[index] for index in chosen) for combination in pairs()}
        assert had == set(itertools.product(*(CHOICES[names[index]] for index in chosen)))


def test_every_two_formats_together_draw_and_err_no_more_than_their_parts():
    scene = small_scene()

    def drawn(renderer, **formats):
        renderer.settings = Settings(**(FINEST | formats))
        frame = renderer.render(scene, 0.0, ("radiance",))
        assert np.isfinite(frame.radiance).all(), formats
        return frame.radiance.astype(np.float64)

    with make_renderer((32, 24)) as renderer:
        finest = drawn(renderer)
        alone = {
            (name, choice): np.abs(drawn(renderer, **{name: choice}) - finest).max()
            for name, choices in CHOICES.items()
            for choice in choices
        }
        for combination in pairs():
            formats = dict(zip(CHOICES, combination, strict=True))
            error = np.abs(drawn(renderer, **formats) - finest).max()
            assert error <= 1.2 * sum(alone[part] for part in formats.items()) + 1e-6, formats
    scale = np.percentile(finest, 99.9)
    for part, error in alone.items():  # none draws nonsense: a quarter is 8 bits of dim light
        assert error <= 0.25 * scale, part
    assert (
        alone["normal_format", "rgba16f"] < alone["normal_format", "rgba8"] < alone["normal_format", "oct8"]
    )
    assert alone["accumulation_format", "rgba16f"] < alone["accumulation_format", "r11g11b10f"]


ARITHMETIC = {
    "depth16": 1.2e-4,
    "inverse_matrix": 3e-4,
    "stored16f": 3e-6,
    "stored32f": 6e-6,
}
"""Largest difference over the 99.9th percentile to float64 shading of what is stored."""


@pytest.mark.parametrize("position", ARITHMETIC)
def test_every_way_to_a_position_agrees_with_float64_on_what_is_stored(position):
    compared = compare(lit_scene(material="everything"), Settings(position_method=position))
    assert compared.error() <= ARITHMETIC[position]
    assert compared.error("light") <= ARITHMETIC[position]


@pytest.mark.parametrize(
    "formats",
    [{"normal_format": name} for name in CHOICES["normal_format"][1:]]
    + [{"albedo_format": name} for name in ("sqrt8", "rgba8", "rgba16f", "rgba32f")],
    ids=lambda formats: next(iter(formats.values())),
)
def test_every_packing_agrees_with_float64_on_what_is_stored(formats):
    compared = compare(ball_scene(60), Settings(**formats))
    assert compared.error() <= 4e-6


def test_the_drivers_own_srgb_errs_as_was_measured():
    """Its decoding is up to 1.2e-3 off: that of the exact pieces is what is compared with."""
    compared = compare(ball_scene(60), Settings(albedo_format="srgb8"))
    assert 4e-6 < compared.error() <= 3e-3


STEPS = {
    "sqrt10": 1 / 1023,
    "sqrt8": 1 / 255,
    "rgba8": 0.5 / 255 + 1e-7,
    "rgba16f": 2.0**-11,
    "rgba32f": 2.0**-24,
}
"""Largest error of a colour up to 1: half a code (of a root, twice that), or what this driver cuts off."""


@pytest.mark.parametrize("albedo", CHOICES["albedo_format"])
def test_colors_come_back_from_what_they_are_stored_in(render, albedo):
    color = (0.5, 0.25, 0.04)
    frame = render(wall_scene(color=(*color, 1.0)), Settings(albedo_format=albedo), (8, 6), ("albedo",))
    # the driver's encoding misses the nearest code now and then: a code of light grey is worth 0.009
    bound = STEPS.get(albedo, 0.009)
    assert np.abs(frame.albedo - color).max() <= bound


@pytest.mark.parametrize("position", CHOICES["position_method"])
@pytest.mark.parametrize("orthographic", [False, True], ids=["perspective", "orthographic"])
def test_positions_come_back_from_what_they_are_stored_in(render, position, orthographic):
    scene = orthographic_wall(10.0) if orthographic else wall_scene(distance=10.0)
    frame = render(scene, Settings(position_method=position), (32, 24), ("depth", "position"))
    # near 1, far 100: a 16-bit depth is worth 1e-4 of y times y/near, a half float 1e-3
    bound = {"depth16": 7.7e-5 * 10, "stored16f": 1e-3}.get(position, 6e-8 * 4 * 10)
    if orthographic:
        bound = max(bound, 1e-3)
    assert np.abs(frame.depth / 10.0 - 1).max() <= bound
    assert np.abs(frame.position[..., 1] / 10.0 - 1).max() <= bound


def test_a_half_float_position_ends_at_65504_and_stays_a_number(render):
    scene = wall_scene(distance=1e5, size=4e5, near=10.0, far=1e6)
    scene.root.attach_new_node(AmbientLight("sky", (1, 1, 1)))
    scene.root.attach_new_node(PointLights("l", [(0, 5, 0)], [(1, 1, 1)], 1e9))
    frame = render(scene, Settings(position_method="stored16f"), (16, 12), ("radiance", "depth"))
    assert (frame.depth == 65504).all()
    assert np.isfinite(frame.radiance).all()
    assert (frame.radiance > 0.4).all()


@pytest.mark.parametrize("accumulation", CHOICES["accumulation_format"])
def test_light_beyond_a_formats_numbers_is_bright_and_finite(render, accumulation):
    scene = wall_scene()
    scene.root.attach_new_node(AmbientLight("sun", (1e9, 1e9, 1e9)))
    scene.root.attach_new_node(PointLights("l", [(0, 5, 0)], [(1e9, 1e9, 1e9)], 50.0))
    frame = render(scene, Settings(accumulation_format=accumulation), (16, 12), ("radiance", "color"))
    assert np.isfinite(frame.radiance).all()
    assert (frame.color >= 156).all()  # 1 - exp(-1/2), where 8 bits clip at 1 before the albedo
    if accumulation != "rgba8":
        assert (frame.color == 255).all()


# --- Half resolution ---


def test_a_flat_wall_in_even_light_is_the_same_at_half_resolution(render):
    """Where light does not change between pixels, nothing may; edges of the picture, odd sizes too."""
    scene = wall_scene(cells=4)
    scene.root.attach_new_node(make_sun((0.8, 0.7, 0.6), (0, 1, -1)))
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.1, 0.1)))
    for size in ((16, 12), (17, 13), (1, 1), (1, 9)):
        full = render(scene, None, size, ("radiance", "light"))
        half = render(scene, Settings(light_resolution="half"), size, ("radiance", "light"))
        np.testing.assert_allclose(half.radiance, full.radiance, rtol=3e-7)
        np.testing.assert_allclose(half.light, full.light, rtol=3e-7)


@pytest.mark.parametrize("position", CHOICES["position_method"])
@pytest.mark.parametrize("size", [(160, 120), (159, 121)], ids=str)
def test_a_pixel_that_is_lit_itself_keeps_its_light_to_the_bit(render, position, size):
    """Every second pixel across and down: also where volumes end, so these lie where their pixels do."""
    scene = lit_scene(material="everything")
    given = {"position_method": position, "albedo_format": "rgba32f"}
    full = render(scene, Settings(**given), size, ("radiance",)).radiance
    half = render(scene, Settings(**given, light_resolution="half"), size, ("radiance",)).radiance
    lit = np.s_[size[1] - 1 :: -2, ::2]  # rows of a picture run down, the driver's run up
    error = np.abs(half[lit] - full[lit]).max(axis=-1)
    # spread light is multiplied by the weight that it is divided by, and highlights are added apart
    assert (error <= 2e-6 * full[lit].max(axis=-1) + 2e-7 * full.max()).all()
    assert np.abs(half - full).mean() <= 0.03 * full.mean()


def test_light_does_not_spread_over_edges(render):
    """A dark ball before a bright wall: neither lights the other."""
    scene = wall_scene(distance=10.0, cells=4)
    scene.root.attach_new_node(geom_node("ball", ball(1.0), Material("b", (1, 1, 1, 1)))).set_pos(0, 6, 0)
    scene.root.attach_new_node(PointLights("l", [(0, 9, 0)], [(1, 1, 1)], 3.0))  # behind the ball
    half = render(scene, Settings(light_resolution="half"), (120, 90), ("light", "depth"))
    full = render(scene, None, (120, 90), ("light", "depth"))
    ball_pixels = full.depth < 8
    assert full.light[ball_pixels].max() == 0.0
    inner = ball_pixels[1:-1, 1:-1] & ball_pixels[:-2, 1:-1] & ball_pixels[2:, 1:-1]
    assert half.light[1:-1, 1:-1][inner & ball_pixels[1:-1, :-2] & ball_pixels[1:-1, 2:]].max() <= 1e-3
    # each pixel is between the light of its neighbours on its own surface: it has at least one
    low, high = np.full(half.light.shape, np.inf), np.full(half.light.shape, -np.inf)
    for shift in itertools.product((-1, 0, 1), repeat=2):
        same = (ball_pixels == np.roll(ball_pixels, shift, (0, 1)))[..., None]
        moved = np.roll(full.light, shift, (0, 1))
        low, high = np.where(same, np.minimum(low, moved), low), np.where(same, np.maximum(high, moved), high)
    slack = 1e-3 * full.light.max()
    inside = ((half.light >= low - slack) & (half.light <= high + slack)).all(axis=2)
    assert inside.mean() >= 0.9995


def test_half_resolution_shades_a_quarter_of_the_fragments():
    scene = ball_scene(60)
    shaded = {}
    for resolution in ("full", "half"):
        with make_renderer(
            (160, 120), Settings(light_resolution=resolution), count_fragments=True
        ) as renderer:
            shaded[resolution] = renderer.render(scene, 0.0, ("radiance",)).shaded
    assert abs(shaded["half"] / shaded["full"] - 0.25) <= 0.02


# --- Forward shading ---


@pytest.mark.parametrize("material", ["everything"])
def test_forward_shading_gives_the_picture_of_the_finest_buffers(render, material):
    scene = lit_scene(material=material)
    finest = render(scene, Settings(**FINEST), (160, 120), ("radiance",)).radiance
    forward = render(scene, Settings(light_method="forward"), (160, 120), ("radiance",))
    assert forward.lights.dropped == 0
    error = np.abs(forward.radiance - finest) / np.percentile(finest, 99.9)
    # what its plain differences of places lose beside lights
    assert error.max() <= 1e-4
    assert np.percentile(error, 99) <= 3e-6


def test_forward_shading_is_one_pass_and_keeps_nothing_but_the_picture():
    plan = build_plan(ball_scene(60), Settings(light_method="forward"))
    assert [step.name for step in plan.passes] == ["forward", "resolve"]
    assert [target.name for target in plan.targets] == ["depth", "coverage", "radiance", "color"]
    with pytest.raises(OutputError, match=r"^light_method=forward keeps no G-buffer to make 'depth' from"):
        build_plan(ball_scene(60), Settings(light_method="forward"), outputs=("color", "depth"))


def test_forward_without_lights_and_without_geometry(render):
    scene = ball_scene(0, ambient=(0.1, 0.2, 0.3))
    deferred = render(scene, Settings(**FINEST), outputs=("radiance",)).radiance
    forward = render(scene, Settings(light_method="forward"), outputs=("radiance",)).radiance
    np.testing.assert_allclose(forward, deferred, atol=1e-7)
    empty = Scene(background=(0.1, 0.2, 0.3))
    np.testing.assert_allclose(
        render(empty, Settings(light_method="forward"), outputs=("radiance",)).radiance[0, 0], (0.1, 0.2, 0.3)
    )


# --- Settings that go together, and those that do not ---


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_draws(render, name):
    frame = render(small_scene(), Settings.preset(name), (32, 24))
    assert frame.color.max() > 60
    assert Settings.preset(name, exposure=2.0) == Settings(**(PRESETS[name] | {"exposure": 2.0}))


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("given", [{"light_method": "forward"}, {"look": "classic"}], ids=str)
def test_a_preset_leaves_out_what_given_settings_rule_out(name, given):
    made = Settings.preset(name, **given)
    kept = {key for key, value in PRESETS[name].items() if getattr(made, key) == value}
    assert kept >= PRESETS[name].keys() & {"cutoff_budget", "cutoff_threshold", "volume_proxy", "shadow_taps"}
    with pytest.raises(SettingsError):  # what is given itself is not left out
        Settings.preset(name, **given, light_resolution="half")


def test_a_misspelt_preset_is_named():
    with pytest.raises(
        SettingsError, match=r"^there is no preset 'fats' \(did you mean 'fast'\?\): there are"
    ):
        Settings.preset("fats")


@pytest.mark.parametrize(
    "changes",
    [
        {"normal_format": "oct8"},
        {"albedo_format": "rgba8"},
        {"accumulation_format": "rgba16f"},
        {"light_resolution": "half"},
        {"light_method": "forward"},
    ],
    ids=str,
)
def test_the_classic_look_keeps_its_own_formats(changes):
    with pytest.raises(SettingsError, match=f"{next(iter(changes))!r} must be .* with look=classic"):
        Settings(look="classic", **changes)


def test_forward_shading_has_no_half_resolution():
    with pytest.raises(SettingsError, match="'light_resolution' must be full with light_method=forward"):
        Settings(light_method="forward", light_resolution="half")


def test_a_plan_tells_of_half_targets_and_of_forced_shadow_maps():
    half = build_plan(small_scene(), Settings(light_resolution="half"), (101, 51))
    told = {target["name"]: target for target in plan_as_dict(half)["targets"]}
    assert told["half_light"]["size"] == [51, 26]
    assert "size" not in told["radiance"]
    assert "half_light  rgba32f, half" in plan_as_text(half)
    whole = sum(t.bytes_per_pixel for t in half.targets if not t.half)
    share = 51 * 26 / (101 * 51)
    quarter = sum(t.bytes_per_pixel for t in half.targets if t.half)
    assert half.bytes_per_pixel == pytest.approx(whole + quarter * share)

    scene = wall_scene()
    lamp = PointLight("lamp")
    lamp.set_shadow_caster(True, 64)
    scene.root.attach_new_node(lamp).set_pos(0, 5, 0)
    sizes = {tile.size for tile in build_plan(scene, Settings(shadow_resolution=256)).shadows.layout}
    assert sizes == {256}
    with pytest.raises(LightError, match=r"lower the setting shadow_resolution to 512, or raise the setting"):
        build_plan(scene, Settings(shadow_resolution=4096, shadow_atlas=2048))


TURNS = [
    (0, "rgba16f"),
    (1, "rgba32f"),
    (1, "rgba16f"),  # whose texture holds what was drawn before the move
    (1, "sqrt8"),
    (1, "rgba32f"),
    (1, "rgba8"),  # the same texture as that of sqrt8, with another encoding
]


def test_formats_that_are_drawn_in_turn_leave_nothing_behind():
    """Textures of the frame before the last one are kept: what they hold is not this frame's."""
    scene = ball_scene(3)
    ball = scene.root.find("place 1")
    with make_renderer((32, 24)) as turning, make_renderer((32, 24)) as fresh:
        fresh.reuse = False
        for place, albedo_format in TURNS:
            ball.set_x(0.5 * place)
            turning.settings = fresh.settings = Settings(albedo_format=albedo_format)
            np.testing.assert_array_equal(turning.render(scene).color, fresh.render(scene).color)
