"""Every kind of light on every kind of material, alone and together, against float64 on the same G-buffer."""

import numpy as np
import pytest

from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.scene.light import Attenuation
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer
from tests.lit_scenes import KINDS, MATERIALS, lit_scene
from tests.reference import BOUNDS, compare
from tests.scenes import orthographic_wall, wall_scene

MODELS = ("phong", "blinn_phong")
SHININESS = (0.0, 0.5, 1.0, 8.0, 50.0, 200.0, 1e3, 1e4)


# --- Against the reference ---


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("kind", KINDS)
def test_each_light_on_each_material_is_what_float64_says(kind, material):
    compared = compare(lit_scene((kind,), material), Settings())
    assert compared.error() <= BOUNDS["linear32f"]
    assert compared.error("light") <= BOUNDS["linear32f"]
    assert compared.chosen.sum() >= 0.95 * compared.covered.sum()


@pytest.mark.parametrize("shininess", SHININESS)
@pytest.mark.parametrize("model", MODELS)
def test_all_lights_together_at_every_shininess(model, shininess):
    for seed in range(2):
        scene = lit_scene(material="everything", shininess=shininess, seed=seed)
        compared = compare(scene, Settings(specular_model=model))
        assert compared.error() <= BOUNDS["linear32f"]


@pytest.mark.parametrize("position", BOUNDS)
@pytest.mark.parametrize("model", MODELS)
def test_all_lights_from_every_position_method(model, position):
    settings = Settings(specular_model=model, position_method=position)
    compared = compare(lit_scene(material="everything"), settings)
    assert compared.error() <= BOUNDS[position]


@pytest.mark.parametrize("color", [(0.0, 0.0, 0.0), (0.02, 0.02, 0.02), (1.0, 0.5, 0.2)])
def test_a_threshold_drops_neither_light_nor_highlights_above_it(render, color):
    scene = lit_scene((), "shiny")
    lamp = PointLight("lamp", color)
    lamp.set_specular_color((3, 1, 2))
    lamp.set_attenuation((1, 0, 0.1))
    scene.root.attach_new_node(lamp).set_pos(0, 5, 4)
    whole = render(scene, Settings(cutoff_budget=0.0), (80, 60), ("radiance",)).radiance
    cut = render(scene, Settings(cutoff_threshold=0.01), (80, 60), ("radiance",)).radiance
    assert whole.max() > 0.1
    assert np.abs(whole - cut).max() <= 2 * 0.01  # the light's, and its highlight's


@pytest.mark.parametrize("model", MODELS)
def test_all_lights_through_an_orthographic_lens(model):
    compared = compare(lit_scene(material="everything", orthographic=True), Settings(specular_model=model))
    assert compared.error() <= BOUNDS["linear32f"]


@pytest.mark.parametrize(
    "changes", [{"range_falloff": "gltf"}, {"clamp_light": True}, {"specular_model": "blinn_phong"}]
)
def test_each_setting_of_the_light_is_its_twins(changes):
    """And it does change the picture."""
    scene = lit_scene(material="everything", shininess=8.0)
    scene.root.attach_new_node(PointLight("bright", (4, 5, 6), 20.0)).set_pos(0, 5, 4)
    compared = compare(scene, Settings(**changes))
    assert compared.error() <= BOUNDS["linear32f"]
    ordinary = compare(scene, Settings())
    assert np.abs(compared.expected - ordinary.expected).max() > 1e-3


@pytest.mark.parametrize("lights", ["fullscreen", "loop"])
def test_every_way_to_draw_lights_gives_the_same_picture(render, lights):
    scene = lit_scene(material="everything")
    volumes = render(scene, Settings(), (160, 120), ("radiance",)).radiance
    other = render(scene, Settings(light_method=lights), (160, 120), ("radiance",)).radiance
    assert np.abs(volumes - other).max() <= 5e-6 * np.percentile(volumes, 99.9)


def test_a_driver_without_clip_control_and_snorm_draws_the_same():
    old = Capabilities(clip_control=False, snorm_targets=False)
    compared = compare(lit_scene(material="everything"), Settings(), capabilities=old)
    assert compared.error() <= BOUNDS["linear32f"]


# --- Values that are known ---


def centre_of(frame, output="radiance"):
    height, width = frame[output].shape[:2]
    return frame[output][height // 2, width // 2]


def test_a_surface_is_the_sum_of_four_parts(render):
    """Ambient + diffuse + specular + emission, each as the materials and lights say."""
    material = Material(
        "all",
        (0.25, 0.5, 1.0, 1.0),
        ambient=(1.0, 0.25, 0.25),
        emission=(0.01, 0.02, 0.03),
        specular=(0.36, 0.49, 0.64),
        shininess=20.0,
    )
    scene = wall_scene(material=material)
    scene.root.attach_new_node(AmbientLight("a", (0.1, 0.2, 0.3)))
    sun = DirectionalLight("sun", (0.5, 0.6, 0.7))
    sun.set_specular_color((0.9, 0.8, 0.7))
    scene.root.attach_new_node(sun)  # along the view: straight onto the wall, and straight back
    frame = render(scene, None, (9, 9), ("radiance", "albedo", "specular", "emission", "light"))
    ambient = np.round(np.sqrt([1.0, 0.25, 0.25]) * 1023) / 1023  # as its ten bits hold it
    expected = (
        ambient**2 * (0.1, 0.2, 0.3)
        + centre_of(frame, "albedo") * (0.5, 0.6, 0.7)
        + centre_of(frame, "specular") * (0.9, 0.8, 0.7)
        + (0.01, 0.02, 0.03)
    )
    assert centre_of(frame) == pytest.approx(expected, rel=1e-5)
    assert centre_of(frame, "albedo") == pytest.approx([0.25, 0.5, 1.0], rel=0.01)
    assert centre_of(frame, "specular") == pytest.approx([0.36, 0.49, 0.64], rel=1e-4)
    assert centre_of(frame, "light") == pytest.approx([0.6, 0.8, 1.0], rel=1e-5)
    assert centre_of(frame, "emission") == pytest.approx([0.01, 0.02, 0.03], rel=1e-6)


def test_a_surface_turned_away_gets_neither_light_nor_highlight(render):
    """From behind the wall: a highlight by the mirrored angle alone would be there."""
    for model in MODELS:
        scene = wall_scene(material=Material("shiny", specular=(1, 1, 1), shininess=0.0))
        sun = DirectionalLight("sun")
        sun.set_direction((0, -1, -0.1))
        scene.root.attach_new_node(sun)
        point = PointLight("behind")
        scene.root.attach_new_node(point).set_pos(0, 12, 1)
        spot = Spotlight("spot")
        scene.root.attach_new_node(spot).set_pos_hpr(0, 12, 0, 180, 0, 0)
        frame = render(scene, Settings(specular_model=model), (16, 12), ("radiance",))
        assert frame.radiance.max() == 0.0


def test_lights_above_one_are_not_limited_unless_asked(render):
    scene = wall_scene(color=(0.25, 0.25, 0.25, 1.0))
    scene.root.attach_new_node(DirectionalLight("sun", (8, 8, 8)))
    free = centre_of(render(scene, None, (9, 9), ("radiance",)))
    clamped = centre_of(render(scene, Settings(clamp_light=True), (9, 9), ("radiance", "albedo")))
    assert free == pytest.approx([2.0] * 3, rel=0.01)
    assert clamped == pytest.approx([0.25] * 3, rel=0.01)


def test_the_clamp_comes_before_the_fading(render):
    """A light of 8 that has faded to a quarter shows a quarter of the surface's colour, not all of it."""
    scene = wall_scene(distance=10.0, color=(0.25, 0.25, 0.25, 1.0))
    light = PointLight("lamp", (8, 8, 8))
    light.set_attenuation((1, 1, 0))
    scene.root.attach_new_node(light).set_pos(0, 7, 0)
    frame = render(scene, Settings(clamp_light=True), (9, 9), ("radiance", "albedo"))
    assert centre_of(frame) == pytest.approx(centre_of(frame, "albedo") / 4, rel=1e-5)


@pytest.mark.parametrize(
    ("attenuation", "distance", "factor"),
    [
        (Attenuation.ENDLESS, 3.0, 1.0),
        (Attenuation.FIFTY_UNITS, 5.0, 1 / (1 + 0.45 + 0.8)),
        (Attenuation.INVERSE_SQUARE, 2.0, 0.2),
        ((0, 0, 1), 4.0, 1 / 16),
    ],
)
def test_attenuations(render, attenuation, distance, factor):
    scene = wall_scene(distance=10.0, color=(1, 1, 1, 1))
    light = PointLight("lamp")
    light.set_attenuation(attenuation)
    path = scene.root.attach_new_node(light)
    path.set_pos(0, 10 - distance, 0)
    frame = render(scene, None, (9, 9), ("radiance",))
    assert centre_of(frame) == pytest.approx([factor] * 3, rel=1e-5)
    light.set_max_distance(2 * distance)
    for window, share in (("karis", (1 - 1 / 16) ** 2), ("gltf", 1 - 1 / 16)):
        frame = render(scene, Settings(range_falloff=window), (9, 9), ("radiance",))
        assert centre_of(frame) == pytest.approx([factor * share] * 3, rel=1e-5)
    light.set_max_distance(0.99 * distance)
    assert render(scene, None, (9, 9), ("radiance",)).radiance.max() == 0.0


@pytest.mark.parametrize(("angle", "strength"), [(0, 1), (19.9, 1), (30.1, 0), (40, 0)])
def test_a_smooth_cone(render, angle, strength):
    """The slides' 20 and 30 degrees: even inside the one, nothing outside the other."""
    scene = wall_scene(distance=10.0, color=(1, 1, 1, 1))
    light = Spotlight("spot")
    light.set_cone(20, 30)
    path = scene.root.attach_new_node(light)
    path.set_h(angle)  # turned away from the wall's middle
    frame = render(scene, None, (9, 9), ("radiance",))
    assert centre_of(frame) == pytest.approx([strength] * 3, rel=1e-5, abs=1e-9)


def test_pandas_cone_ends_hard_at_half_of_the_lens_and_fades_by_the_exponent(render):
    scene = wall_scene(distance=10.0, color=(1, 1, 1, 1), material=Material("m", specular=(1, 1, 1)))
    light = Spotlight("spot", (0.5, 0.5, 0.5))
    light.get_lens().set_fov(60)
    light.set_exponent(8.0)
    path = scene.root.attach_new_node(light)
    for angle in (0.0, 10.0, 25.0, 29.9, 30.1, 60.0):
        path.set_h(angle)
        factor = np.cos(np.radians(angle)) ** 8 if angle < 30 else 0.0
        # diffuse light and highlight fade alike: half of white, and half of a highlight of exponent 0
        frame = render(scene, None, (9, 9), ("radiance",))
        assert centre_of(frame) == pytest.approx([factor] * 3, rel=1e-5, abs=1e-9)


def test_a_spotlight_of_180_degrees_is_a_point_light(render):
    scene = wall_scene(cells=4)
    spot = Spotlight("lamp", radius=9.0)
    spot.set_cone(180, 180)
    path = scene.root.attach_new_node(spot)
    path.set_pos_hpr(1, 8, 0.5, 77, 13, 0)
    as_spot = render(scene, None, (64, 48), ("radiance",)).radiance
    path.detach_node()
    scene.root.attach_new_node(PointLight("lamp", radius=9.0)).set_pos(1, 8, 0.5)
    as_point = render(scene, None, (64, 48), ("radiance",)).radiance
    assert as_point.max() > 0.1
    assert np.array_equal(as_spot, as_point)


def test_a_scale_moves_lights_and_never_stretches_their_reach(render):
    """As in Panda3D; a spotlight keeps its cone, too."""

    def pictures(scaled):
        scene = wall_scene(cells=4)
        parent = scene.root.attach_new_node("parent")
        factor = 2.0 if scaled else 1.0
        parent.set_scale(factor)
        spot = Spotlight("spot", radius=5.0)
        spot.set_cone(20, 30)
        parent.attach_new_node(spot).set_pos(1 / factor, 7 / factor, 0)
        lamp = PointLight("lamp", (0, 1, 0), 4.0)
        parent.attach_new_node(lamp).set_pos(-2 / factor, 8 / factor, 0)
        return render(scene, None, (64, 48), ("radiance",)).radiance

    assert np.abs(pictures(True) - pictures(False)).max() <= 1e-6


def test_highlights_have_their_lights_own_color_unless_told(render):
    scene = wall_scene(color=(0, 0, 0, 1), material=Material("m", (0, 0, 0, 1), specular=(1, 1, 1)))
    lamps = PointLights("lamps", [(0, 5, 0)], (0.2, 0.4, 0.6), 20.0)
    scene.root.attach_new_node(lamps)
    fade = (1 - 5 / 20) ** 2
    assert centre_of(render(scene, None, (9, 9), ("radiance",))) == pytest.approx(
        fade * np.array([0.2, 0.4, 0.6]), rel=1e-5
    )
    lamps.set_specular_colors((0.6, 0.4, 0.2))
    assert centre_of(render(scene, None, (9, 9), ("radiance",))) == pytest.approx(
        fade * np.array([0.6, 0.4, 0.2]), rel=1e-5
    )


# --- What is cut off ---


def test_a_threshold_cuts_where_the_formula_says(render):
    scene = wall_scene(distance=10.0, color=(1, 1, 1, 1))
    light = PointLight("lamp")
    light.set_attenuation(Attenuation.FIFTY_UNITS)
    path = scene.root.attach_new_node(light)
    with borrow_renderer((9, 9), Settings(cutoff_threshold=5 / 256)) as renderer:
        (lights,) = renderer.plan(scene).lights
        reach = lights.reaches[0]
        path.set_pos(0, 10 - 0.999 * reach, 0)
        assert centre_of(renderer.render(scene, 0.0, ("radiance",)))[0] == pytest.approx(5 / 256, rel=0.01)
        path.set_pos(0, 10 - 1.001 * reach, 0)
        assert renderer.render(scene, 0.0, ("radiance",)).radiance.max() == 0.0


@pytest.mark.parametrize("budget", [1e-2, 1e-3, 1.5e-4])
@pytest.mark.parametrize("count", [1, 10, 100])
def test_a_budget_holds_at_every_pixel_for_any_number_of_lights(render, count, budget):
    """Numbers as in the docs: |picture - picture without any cut-off| <= e + 1e-6 of the largest."""
    scene = lit_scene((), "shiny", shininess=2.0)
    rng = np.random.default_rng(count)
    places = rng.uniform((-30, -20, -1), (30, 60, 20), (count, 3))
    colors = rng.uniform(0, 1, (count, 3)) * 10.0 ** rng.uniform(-2, 1, (count, 1))
    scene.root.attach_new_node(PointLights("l", places, colors, attenuation=(1, 0.7, 1.8)))
    whole = render(scene, Settings(cutoff_budget=0.0), (96, 72), ("radiance",)).radiance
    cut = render(scene, Settings(cutoff_budget=budget), (96, 72), ("radiance",)).radiance
    error = np.abs(whole - cut).max()
    assert error <= budget + 1e-6 * whole.max()
    assert error > 0 or budget < 1e-2 or count == 1  # something is cut off


def test_the_default_budget_cannot_be_seen(render):
    """Half a code: no code of the picture differs by more than one, and hardly any by one."""
    scene = lit_scene(("attenuated", "endless"), "everything")
    whole = render(scene, Settings(cutoff_budget=0.0), (160, 120)).color.astype(int)
    cut = render(scene, Settings(), (160, 120)).color.astype(int)
    assert np.abs(whole - cut).max() <= 1


def test_an_exposure_makes_the_budget_stricter():
    scene = lit_scene(("attenuated",))
    with borrow_renderer((32, 24)) as renderer:
        before = renderer.plan(scene).lights[-1].reaches.max()
        scene.exposure = (1.0, 9.0, 1.0)
        after = renderer.plan(scene).lights[-1].reaches.max()
        renderer.settings = Settings(cutoff_threshold=0.01)
        scene.exposure = 1.0
        plain = renderer.plan(scene).lights[-1].reaches.copy()
        scene.exposure = 9.0
        assert np.array_equal(renderer.plan(scene).lights[-1].reaches, plain)
    assert after >= before


# --- Piles ---


@pytest.mark.parametrize("count", [1, 64, 500, 2000])
@pytest.mark.parametrize("kind", ["point", "spot", "directional"])
def test_a_pile_of_lights_is_one_light(render, kind, count):
    """Many renderers drop lights here without a word."""

    def pile(n):
        scene = orthographic_wall() if kind == "directional" else wall_scene()
        for k in range(n if kind != "point" else 0):
            light = (Spotlight if kind == "spot" else DirectionalLight)(f"l{k}", (1 / n, 1 / n, 1 / n))
            path = scene.root.attach_new_node(light)
            path.set_pos_hpr(1, 6, 0.5, 5, -3, 0)
            if kind == "spot":
                light.set_cone(20, 30)
                light.set_radius(9.0)
        if kind == "point":
            scene.root.attach_new_node(PointLights("l", np.tile([1, 6, 0.5], (n, 1)), (1 / n,) * 3, 9.0))
        return scene

    scenes = pile(1), pile(count)
    for lights in ("volumes", "fullscreen", "loop"):
        one, many = (
            render(scene, Settings(light_method=lights), (24, 18), ("radiance",)).radiance for scene in scenes
        )
        assert one.max() > 0.1, lights
        assert np.abs(one - many).max() <= (2e-8 * count + 1e-6) * one.max(), lights


@pytest.mark.parametrize("lights", ["loop", "forward"])
def test_more_lights_than_a_shaders_loop_has_turns(render, lights):
    """llvmpipe leaves a loop after 65,535 turns, without a word."""

    def picture(n):
        scene = wall_scene()
        scene.root.attach_new_node(PointLights("l", np.tile([1, 6, 0.5], (n, 1)), (1 / n,) * 3, 9.0))
        return render(scene, Settings(light_method=lights), (8, 6), ("radiance",)).radiance

    one, many = picture(1), picture(100_000)
    assert one.max() > 0.1
    assert np.abs(one - many).max() <= (2e-8 * 100_000 + 1e-6) * one.max()


def test_emission_without_ambient_light_stays_beside_an_output_of_light(render):
    """The lights then begin the light, and add to the radiance that emission began."""
    scene = wall_scene(material=Material("m", (0.5, 0.5, 0.5, 1.0), emission=(0.3, 0.2, 0.1)))
    scene.root.attach_new_node(DirectionalLight("sun", (0.4, 0.4, 0.4)))
    frame = render(scene, Settings(albedo_format="rgba32f"), (8, 6), ("radiance", "light"))
    assert frame.radiance[3, 4] == pytest.approx([0.5, 0.4, 0.3], abs=1e-6)
    assert frame.light[3, 4] == pytest.approx([0.4] * 3, abs=1e-6)
