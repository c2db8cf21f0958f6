"""Automatic exposure: white paper in bright light comes out just below white, however bright the light is."""

from __future__ import annotations

import copy
import math
from time import process_time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.pipeline import build_plan
from firefly_sample.plan.exposure import DARK, MOST_POINTS, PERCENTILE, TARGET, with_exposure_at
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.cli.command import run_python
from tests.lit_scenes import lit_scene
from tests.scenes import ball, ball_scene, geom_node, new_planner, wall, wall_scene

AUTO = Settings(exposure="auto")
SIX_DIGITS = 1e-5
LEVEL = {"exponential": -math.log(1.0 - TARGET), "none": TARGET}
"""The exposed radiance that each tone curve shows as `TARGET`."""
GREY = Material("grey", (0.2, 0.1, 0.05, 1.0))


def measured(scene, time=0.0, **settings):
    """The exposure of a plan."""
    return build_plan(scene, AUTO.with_changes(**settings), (64, 48), time=time).settings.exposure


def floor_scene(size=20.0, cells=1, material=GREY, double_sided=False):
    """A wall at the origin that faces -Y, and no light yet."""
    scene = Scene()
    if double_sided:
        material = Material("sheet", double_sided=True)
    scene.root.attach_new_node(geom_node("wall", wall(size, cells), material))
    return scene


def add(scene, light, position=(0, -5, 0), attenuation=None):
    if attenuation is not None:
        light.set_attenuation(attenuation)
    path = scene.root.attach_new_node(light)
    path.set_pos(*position)
    return path


# --- Known answers ---


@given(
    color=st.floats(-6.0, 6.0).map(lambda exponent: 10.0**exponent),
    tilt=st.floats(0.0, 80.0),
    tone=st.sampled_from(sorted(LEVEL)),
)
def test_white_paper_in_the_sun_is_at_the_target(color, tilt, tone):
    scene = floor_scene()
    add(scene, DirectionalLight("sun", (0.5 * color, color, 0.1 * color))).set_hpr(tilt, 0, 0)
    exposed = color * math.cos(math.radians(tilt)) * measured(scene, tone=tone)
    assert exposed == pytest.approx(LEVEL[tone], rel=SIX_DIGITS)


def test_the_target_is_near_white_and_below():
    assert 0.75 <= TARGET <= 0.9


def test_ambient_lights_add_up():
    scene = floor_scene(material=Material("black", (0, 0, 0, 1), ambient=(0.1, 0.1, 0.1)))
    add(scene, AmbientLight("one", (1.0, 30.0, 1.0)))
    add(scene, AmbientLight("other", (0.0, 10.0, 5.0)))
    assert 40.0 * measured(scene) == pytest.approx(LEVEL["exponential"], rel=SIX_DIGITS)
    add(scene, DirectionalLight("sun", (20.0, 20.0, 20.0)))
    assert 60.0 * measured(scene) == pytest.approx(LEVEL["exponential"], rel=SIX_DIGITS)


def test_emission_counts_where_nothing_is_lit():
    scene = floor_scene(material=Material("glow", emission=(3.0, 50.0, 7.0)))
    assert 50.0 * measured(scene) == pytest.approx(LEVEL["exponential"], rel=SIX_DIGITS)
    scene.root.attach_new_node(geom_node("dark", wall(90.0)))
    assert 50.0 * measured(scene) == pytest.approx(LEVEL["exponential"], rel=SIX_DIGITS)
    add(scene, AmbientLight("sky", (0.01, 0.01, 0.01)))
    assert 0.01 * measured(scene) == pytest.approx(LEVEL["exponential"], rel=SIX_DIGITS)


@pytest.mark.parametrize(
    ("height", "half"), [(0.5, 3.0), (0.5, 12.0), (4.0, 20.0), (4.0, 60.0), (4.0, 120.0)]
)
def test_a_lamp_over_a_plane_is_its_integral(height, half):
    """At r beside it the light is h / (r² + h²)^1.5; the lit disc ends where that is dark.

    With rho = (r / h)², the lit disc up to rho has a share x of its area up to x rho.
    """

    def light(rho):
        return (1.0 + rho) ** -1.5

    low, end = 0.0, 1e3
    while end - low > 1e-9:
        middle = 0.5 * (low + end)
        lit = light(middle) > DARK * light((1.0 - PERCENTILE) * middle)
        low, end = (middle, end) if lit else (low, middle)
    expected = light((1.0 - PERCENTILE) * end) / height**2
    scene = floor_scene(2.0 * half)
    add(scene, PointLight("lamp", (7.0, 7.0, 7.0)), (0, -height, 0), (0, 0, 1))
    assert math.sqrt(end) * height < half
    seen = math.pi * end * height**2 / (4.0 * half**2) * MOST_POINTS  # points in the light
    assert 7.0 * expected * measured(scene) == pytest.approx(LEVEL["exponential"], rel=1.5 / math.sqrt(seen))


def test_a_spotlight_counts_where_it_shines():
    scene = floor_scene()
    spot = Spotlight("spot", (2.0, 2.0, 2.0))
    spot.set_cone(20, 20)
    add(scene, spot, (0, -10, 0), (1, 0, 0))
    end = math.tan(math.radians(20)) ** 2
    expected = 2.0 / math.sqrt(1.0 + (1.0 - PERCENTILE) * end)
    assert expected * measured(scene) == pytest.approx(LEVEL["exponential"], rel=1e-3)


@pytest.mark.parametrize(
    "build",
    [Scene, floor_scene, lambda: add_lamp_to(Scene()), lambda: add_lamp_to(floor_scene(), behind=True)],
    ids=["nothing", "no light", "no surface", "a light behind"],
)
def test_the_exposure_is_1_where_nothing_is_lit(build):
    assert measured(build()) == 1.0


def add_lamp_to(scene, behind=False):
    add(scene, PointLight("lamp", (9.0, 9.0, 9.0)), (0, 5.0 if behind else -5.0, 0))
    return scene


def test_a_two_sided_surface_is_lit_from_either_side():
    behind = add_lamp_to(floor_scene(double_sided=True), behind=True)
    before = add_lamp_to(floor_scene(double_sided=True))
    one_sided = add_lamp_to(floor_scene())
    assert measured(behind) == pytest.approx(measured(before), rel=1e-3)
    assert measured(before) == pytest.approx(measured(one_sided), rel=SIX_DIGITS)


# --- What it depends on ---


def test_instances_are_as_one_mesh():
    whole, tiled = floor_scene(20.0, 10), Scene()
    tile = geom_node("tile", wall(2.0), GREY)
    for x in range(10):
        for z in range(10):
            place = tiled.root.attach_new_node("place")
            place.set_pos(2 * x - 9, 0, 2 * z - 9)
            place.attach_new_node(tile)
    stretched = Scene()
    path = stretched.root.attach_new_node(geom_node("wall", wall(2.0, 10), GREY))
    path.set_scale(10, 1, 10)
    exposures = []
    for scene in (whole, tiled, stretched):
        add(scene, PointLight("lamp"), (2, -3, 1), (0, 0, 1))
        exposures.append(measured(scene))
    assert exposures == pytest.approx([exposures[0]] * 3, rel=0.06)


@given(seed=st.integers(0, 2**32 - 1))
def test_the_order_of_triangles_hardly_matters(seed):
    geom = ball()
    order = np.random.default_rng(seed).permutation(len(geom.triangles))
    exposures = []
    for triangles in (geom.triangles, geom.triangles[order]):
        scene = Scene()
        scene.root.attach_new_node(geom_node("ball", Geom(geom.vertices, triangles, geom.normals)))
        add(scene, PointLight("lamp"), (1, -3, 1), (0, 0, 1))
        exposures.append(measured(scene))
    assert exposures[1] == pytest.approx(exposures[0], rel=0.05)


@given(size=st.floats(-3, 3).map(lambda n: 10.0**n), brightness=st.floats(-6, 6).map(lambda n: 10.0**n))
def test_sizes_do_not_matter_and_brightness_cancels(size, brightness):
    exposures = []
    for unit, color in ((1.0, 1.0), (size, brightness)):
        scene = floor_scene(20.0 * unit)
        light = PointLight("lamp", (color, color, color))
        add(scene, light, (2.0 * unit, -4.0 * unit, 0), (0, 0, 1.0 / unit**2))
        add(scene, DirectionalLight("sun", (0.01 * color,) * 3))
        exposures.append(measured(scene))
    assert exposures[1] * brightness == pytest.approx(exposures[0], rel=SIX_DIGITS)


def test_what_is_hidden_does_not_count():
    scene = floor_scene()
    add(scene, DirectionalLight("sun"))
    expected = measured(scene)
    add(scene, DirectionalLight("hidden", (1e5, 1e5, 1e5))).hide()
    bright = scene.root.attach_new_node(geom_node("turned", wall(40.0)))
    bright.set_hpr(180, 0, 0)
    add(scene, PointLight("lamp", (1e4, 1e4, 1e4), radius=4.0), (0, 3, 0))
    assert measured(scene) < 0.1 * expected
    bright.hide()
    assert measured(scene) == expected


def test_neither_camera_nor_picture_nor_material_matters():
    scene = lit_scene()
    expected = measured(scene)
    for step in range(8):
        scene.camera.set_hpr(45.0 * step, 10.0 * step, 0)
        scene.camera.set_pos(step, -step, step)
        assert measured(scene) == expected
    black = Material("black", (0, 0, 0, 1))
    scene.root.set_material(black)
    assert measured(scene) == expected
    assert build_plan(scene, AUTO, (7, 300), ("depth",)).settings.exposure == expected


def test_the_scenes_exposure_multiplies_it():
    scene = floor_scene()
    add(scene, DirectionalLight("sun"))
    plain = measured(scene)
    scene.exposure = (2.0, 1.0, 0.5)
    plan = build_plan(scene, AUTO)
    assert plan.settings.exposure == plain
    assert plan.exposure == (2.0 * plain, plain, 0.5 * plain)


def test_lights_are_as_the_settings_shade_them():
    scene = floor_scene()
    add(scene, DirectionalLight("sun", (100.0, 100.0, 100.0)))
    assert measured(scene, clamp_light=True) == pytest.approx(LEVEL["exponential"], rel=SIX_DIGITS)


def circling(time):
    """Two lights near the wall, or only one."""
    count = 2 if time < 5.0 else 1
    return [(3 * math.cos(time), -1.0 - time, 0), (0, -3, 1)][:count], (1.0 + time, 1.0, 1.0), 8.0


def test_it_is_a_function_of_time_also_in_a_planner_that_keeps_its_points():
    scene = floor_scene()
    scene.root.attach_new_node(PointLights("lamps", function=circling))
    times = [0.0, 2.5, 7.0]
    exposures = [measured(scene, time) for time in times]
    assert len(set(exposures)) == 3
    planner = new_planner()
    for time, exposure in [*zip(times, exposures, strict=True)][::-1] * 2:
        plan = planner.plan(scene, AUTO, (64, 48), ("color",), time, Capabilities())
        assert plan.settings.exposure == exposure
        assert with_exposure_at(scene, AUTO, time).exposure == exposure


def test_a_planner_measures_again_when_something_has_changed():
    scene = floor_scene(material=Material("glow", emission=(2.0, 2.0, 2.0)))
    planner = new_planner()

    def planned():
        plan = planner.plan(scene, AUTO, (64, 48), ("color",), 0.0, Capabilities())
        assert plan.settings.exposure == measured(copy.deepcopy(scene))
        return plan.settings

    node = scene.root.find("wall").node()
    first = planned()
    assert planned() is first  # a still scene is measured once
    lamp = add(scene, PointLight("lamp", (9.0, 9.0, 9.0)), attenuation=(0, 0, 1))
    changes = {
        "emission": lambda: node.geoms[0][1].set_emission((5.0, 5.0, 5.0)),
        "move": lambda: lamp.set_pos(0, -2, 0),
        "colour": lambda: lamp.node().set_color((1.0, 2.0, 3.0)),
        "vertices": lambda: node.geoms[0][0].set_vertices(2.0 * node.geoms[0][0].vertices + [0, 1, 0]),
        "ambient": lambda: add(scene, AmbientLight("sky")),
        "hide": lamp.hide,
    }
    seen = [first, planned()]
    for name, change in changes.items():
        change()
        seen.append(planned())
        if name != "emission":  # which does not count beside light
            assert seen[-1].exposure != seen[-2].exposure, name
    lamp.show()
    assert planned().exposure == seen[-2].exposure


def test_a_number_is_left_alone_and_costs_nothing():
    scene, settings = lit_scene(), Settings(exposure=3.0)
    assert build_plan(scene, settings).settings is settings
    assert with_exposure_at(scene, settings, 0.0) is settings


SCRIPT = """
from firefly_sample.pipeline import build_plan
from firefly_sample.settings import Settings
from tests.lit_scenes import lit_scene
print(repr(build_plan(lit_scene(), Settings(exposure="auto")).settings.exposure))
"""


def test_copies_and_other_processes_find_the_same_number(tmp_path):
    scene = lit_scene()
    expected = measured(scene)
    assert measured(copy.deepcopy(scene)) == expected
    assert measured(lit_scene()) == expected
    done = run_python("-c", SCRIPT, cwd=tmp_path)
    assert done.stdout == f"{expected!r}\n", done.stderr


# --- Many lights, and extreme ones ---


@pytest.mark.parametrize("kind", ["endless", "small"])
def test_ten_thousand_lights_are_measured_in_a_moment(kind):
    lights = 10_000
    rng = np.random.default_rng(1)
    positions = rng.uniform((-10, -2, -10), (10, 0, 10), (lights, 3))
    scene = floor_scene(cells=10)
    options = {"radii": 0.5} if kind == "small" else {"attenuation": (0, 0, 1)}
    scene.root.attach_new_node(PointLights("lamps", positions, rng.uniform(0.1, 1, (lights, 3)), **options))
    plans = []
    for settings in (Settings(), AUTO):
        build_plan(scene, settings, (64, 48))
        began = process_time()
        build_plan(scene, settings, (64, 48))
        plans.append(process_time() - began)
    assert plans[1] - plans[0] < 0.5, plans


def test_many_lights_in_one_place_are_one_light():
    exposures = []
    for count in (1, 10_000):
        scene = floor_scene()
        light = (1.0 / count,) * 3
        places = np.tile([(1.0, -3.0, 0.0)], (count, 1))
        scene.root.attach_new_node(PointLights("lamps", places, light, attenuation=(0, 0, 1)))
        exposures.append(measured(scene))
    assert exposures[1] == pytest.approx(exposures[0], rel=0.1)


@pytest.mark.parametrize(
    ("color", "position", "attenuation"),
    [
        (1e30, (0, -1e-200, 0), (0, 0, 1)),
        (1e30, (0, -1, 0), (0, 0, 1e-30)),
        (1e-30, (0, -1e15, 0), (0, 0, 1)),
        (1.0, (0, 0, 0), (1, 0, 0)),
        (1.0, (0, -1e30, 0), (0, 0, 1e-30)),
    ],
)
def test_extreme_lights_give_a_plan(color, position, attenuation):
    scene = floor_scene()
    add(scene, PointLight("lamp", (color, 0.0, 0.0)), position, attenuation)
    assert 1e-30 <= measured(scene) <= 1e30


def test_a_hot_spot_does_not_decide():
    """A lamp within its shade: a small surface, a thousand times as bright as the room."""
    scene = ball_scene(lights=0, ambient=(1.0, 1.0, 1.0))
    expected = measured(scene)
    shade = scene.root.attach_new_node(geom_node("shade", ball(0.2), Material("shade", double_sided=True)))
    shade.set_pos(0, 10, 5)
    add(scene, PointLight("lamp", (20.0, 20.0, 20.0), radius=0.3), (0, 10, 5))
    assert measured(scene) == pytest.approx(expected, rel=0.01)


def test_a_wall_that_the_camera_does_not_see_counts_as_well():
    seen, turned = wall_scene(), wall_scene()
    turned.camera.set_hpr(180, 0, 0)
    for scene in (seen, turned):
        add(scene, DirectionalLight("sun"))
    assert measured(seen) == measured(turned) != 1.0
