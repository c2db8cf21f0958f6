"""Lights as nodes: Panda3D's names and defaults, what they refuse, and copies that lead their own life."""

import math

import numpy as np
import pytest
from panda3d import core as panda

from firefly_sample.errors import LightError
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.light import Attenuation, Falloff
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.nodepath import NodePath
from tests.scenes import new_planner, wall_scene

PAIRS = [
    (PointLight, panda.PointLight),
    (Spotlight, panda.Spotlight),
    (DirectionalLight, panda.DirectionalLight),
]


@pytest.mark.parametrize(("ours", "theirs"), PAIRS, ids=lambda kind: kind.__name__)
def test_defaults_are_panda3ds(ours, theirs):
    a, b = ours("light"), theirs("light")
    assert tuple(a.get_color()) == tuple(b.color)[:3]
    assert tuple(a.get_specular_color()) == tuple(b.specular_color)[:3]
    assert a.is_shadow_caster() == b.is_shadow_caster() is False
    if hasattr(b, "attenuation"):
        assert a.get_attenuation() == tuple(b.attenuation)
        assert a.get_max_distance() == b.max_distance == math.inf
    if hasattr(b, "exponent"):
        assert a.get_exponent() == b.exponent
        assert a.get_lens().get_hfov() == pytest.approx(b.get_lens().get_hfov())
    if hasattr(b, "direction"):
        assert tuple(a.get_direction()) == tuple(b.direction)


@pytest.mark.parametrize(("ours", "theirs"), PAIRS, ids=lambda kind: kind.__name__)
def test_a_specular_color_is_the_lights_own_until_it_is_set(ours, theirs):
    """The same steps on both."""

    def steps(light, color):
        seen = []
        light.set_color(color(0.5, 0.25, 1.0))
        seen.append((light.has_specular_color(), tuple(light.get_specular_color())[:3]))
        light.set_specular_color(color(0.125, 2.0, 0.0))
        light.set_color(color(1.0, 1.0, 1.0))
        seen.append((light.has_specular_color(), tuple(light.get_specular_color())[:3]))
        light.clear_specular_color()
        seen.append((light.has_specular_color(), tuple(light.get_specular_color())[:3]))
        return seen

    class Theirs:
        """Panda3D's light with our getter's name."""

        def __init__(self, light):
            self._light = light

        def __getattr__(self, name):
            return getattr(self._light, name)

        def get_specular_color(self):
            return self._light.specular_color

        def has_specular_color(self):
            return self._light.has_specular_color()

    assert steps(ours("l"), lambda *rgb: rgb) == steps(Theirs(theirs("l")), lambda *rgb: (*rgb, 1.0))


def test_a_light_has_one_way_to_fade():
    light = PointLight("lamp", radius=4.0)
    assert (light.falloff, light.get_attenuation(), light.get_max_distance()) == (
        Falloff.RAMP_SQUARED,
        None,
        4.0,
    )
    with pytest.raises(LightError, match="'lamp' fades over its radius and ends there: use set_radius"):
        light.set_max_distance(3.0)
    light.set_attenuation((1, 2, 3))
    assert light.falloff is Falloff.ATTENUATION
    assert (light.get_attenuation(), light.get_max_distance()) == ((1, 2, 3), math.inf)
    light.set_max_distance(8.0)
    light.set_attenuation(Attenuation.INVERSE_SQUARE)
    assert light.get_max_distance() == 8.0  # only a radius is forgotten
    light.set_radius(5.0)
    assert (light.falloff, light.get_max_distance()) == (Falloff.RAMP_SQUARED, 5.0)


def test_colors_may_have_panda3ds_alpha_which_means_nothing():
    for make in (PointLight, Spotlight, DirectionalLight, AmbientLight):
        light = make("lamp", (1, 2, 3, 0.5))
        assert light.get_color().tolist() == [1, 2, 3]
        light.set_color((3, 2, 1, 0))
        assert light.get_color().tolist() == [3, 2, 1]


def test_named_attenuations_are_those_of_their_sources():
    assert Attenuation.ENDLESS == (1.0, 0.0, 0.0)
    assert Attenuation.FIFTY_UNITS == (1.0, 0.09, 0.032)
    assert Attenuation.INVERSE_SQUARE == (1.0, 0.0, 1.0)


@pytest.mark.parametrize(
    "attenuation",
    [
        *[(0, 0, 0), (-1, 0, 1), (1, math.nan, 0), (1, math.inf, 0), (1, 0), "far", (1, 0, "x"), 1.0],
        *[(1e-31, 0, 0), (0, 1e-40, 1e-31), (0, 0, 1e31)],  # beyond what float32 can divide by
    ],
)
@pytest.mark.parametrize("make", [PointLight, Spotlight])
def test_an_impossible_attenuation_names_the_light(make, attenuation):
    light = make("lamp")
    with pytest.raises(LightError, match="'lamp': attenuation must be three numbers of 0 or more"):
        light.set_attenuation(attenuation)
    assert light.get_attenuation() == Attenuation.ENDLESS
    with pytest.raises(LightError, match="'swarm': attenuation"):
        PointLights("swarm", [(0, 0, 0)], attenuation=attenuation)


@pytest.mark.parametrize(
    ("setter", "values", "says"),
    [
        (
            "set_color",
            [(1, 1), (1, -1, 1), (1, math.inf, 1), "red", (1, 1, 2e30)],
            "color must be three",
        ),
        ("set_specular_color", [(1, 1), (-1, 0, 0)], "color must be three"),
        ("set_radius", [-1.0, math.nan, math.inf, "far"], "radius must be"),
        ("set_max_distance", [-1.0, math.nan, None], "max distance must be a number of 0 or more"),
        ("set_exponent", [-1.0, math.nan, 2e6, "x"], "exponent must be a number of 0 to 1e"),
        ("set_lens", [None, OrthographicLens()], "a spotlight's lens is a PerspectiveLens"),
    ],
)
def test_wrong_values_name_the_light_and_change_nothing(setter, values, says):
    light = Spotlight("lamp", (0.5, 0.5, 0.5))
    before = light.revision
    for value in values:
        with pytest.raises(LightError, match=f"'lamp': {says}"):
            getattr(light, setter)(value)
    assert light.revision == before
    assert light.get_color().tolist() == [0.5, 0.5, 0.5]


@pytest.mark.parametrize(
    "angles", [(30, 20), (-1, 20), (10, 181), (0, 0), (0, 0.009), (math.nan, 20), ("a", 20), (10, None)]
)
def test_impossible_cones_name_the_light(angles):
    light = Spotlight("lamp")
    with pytest.raises(LightError, match="'lamp': a cone's half-angles must be 0 <= inner <= outer <= 180"):
        light.set_cone(*angles)


def test_a_cone_is_the_lenss_or_its_own():
    light = Spotlight("lamp")
    assert light.get_cone() == pytest.approx((15.0, 15.0, 50.0))
    light.get_lens().set_fov(40)
    light.set_exponent(2.0)
    assert light.get_cone() == pytest.approx((20.0, 20.0, 2.0))
    light.set_cone(20, 30)
    assert light.get_cone() == (20.0, 30.0, 0.0)
    light.set_lens(PerspectiveLens(fov=1e-3))
    with pytest.raises(LightError, match=r"'lamp': its lens sees 0\.001 degrees"):
        light.get_cone()


def test_a_lens_that_changes_is_heard_of():
    """A lens is no node: the plan watches its revision."""
    from firefly_sample.plan.frame_plan import Capabilities
    from firefly_sample.settings import Settings

    scene = wall_scene()
    light = Spotlight("lamp")
    scene.root.attach_new_node(light)
    planner = new_planner()

    def opening():
        plan = planner.plan(scene, Settings(), (16, 12), ("color",), 0.0, Capabilities())
        return plan.lights[0].cones[0, 1]

    assert opening() == pytest.approx(1 - np.cos(np.radians(15)))
    light.get_lens().set_fov(80)
    assert opening() == pytest.approx(1 - np.cos(np.radians(40)))


@pytest.mark.parametrize("direction", [(0, 0, 0), (1, 0), (1, math.nan, 0), "down"])
def test_a_direction_needs_a_length(direction):
    with pytest.raises(LightError, match="'sun': direction must be three finite numbers"):
        DirectionalLight("sun").set_direction(direction)


def test_a_direction_of_any_length_is_made_a_unit_vector():
    sun = DirectionalLight("sun")
    for direction in ((0, 0, -1e-300), (3e300, 4e300, 0)):
        sun.set_direction(direction)
        assert np.linalg.norm(sun.get_direction()) == pytest.approx(1.0, abs=1e-15)
    for distance in (0.0, -1.0, math.nan, "far"):
        with pytest.raises(LightError, match="'sun': shadow distance must be a number above 0"):
            sun.set_shadow_distance(distance)


@pytest.mark.parametrize("make", [PointLight, Spotlight, DirectionalLight])
def test_every_change_is_heard_of(make):
    light = make("lamp")
    changes = [
        lambda: light.set_color((1, 0, 0)),
        lambda: light.set_specular_color((0, 1, 0)),
        light.clear_specular_color,
        lambda: light.set_shadow_caster(True, 64),
    ]
    if make is DirectionalLight:
        changes += [lambda: light.set_direction((1, 0, 0)), lambda: light.set_shadow_distance(9)]
    else:
        changes += [
            lambda: light.set_attenuation((1, 0, 1)),
            lambda: light.set_max_distance(9),
            lambda: light.set_radius(3),
        ]
    if make is Spotlight:
        changes += [
            lambda: light.set_cone(1, 2),
            lambda: light.set_lens(PerspectiveLens()),
            lambda: light.set_exponent(3),
        ]
    for change in changes:
        before = light.subtree_revision
        change()
        assert light.subtree_revision > before


def lamps():
    spot = Spotlight("spot", (1, 2, 3))
    spot.set_cone(5, 6)
    spot.set_attenuation((1, 2, 3))
    spot.set_max_distance(7)
    point = PointLight("point", (1, 2, 3), 4.0)
    point.set_specular_color((3, 2, 1))
    sun = DirectionalLight("sun", (1, 2, 3))
    sun.set_direction((1, 1, -1))
    sun.set_shadow_distance(12)
    many = PointLights("many", [(1, 2, 3)], (1, 2, 3), 5.0, attenuation=(1, 0, 1), specular_colors=(1, 0, 0))
    for light in (spot, point, sun, many):
        light.set_shadow_caster(True, 99)
        light.camera_mask = 0b101
    return [spot, point, sun, many, AmbientLight("ambient", (1, 2, 3))]


@pytest.mark.parametrize("light", lamps(), ids=lambda light: light.name)
def test_copies_shine_alike(light):
    """What a plan makes of a copy is what it makes of the original."""

    def columns(node):
        scene = wall_scene()
        scene.root.attach_new_node(node).set_pos(0, 5, 1)
        plan = build_plan(scene)
        sets = [
            (
                s.kind,
                s.falloff,
                s.proxy,
                [
                    np.array(getattr(s, name)).tolist()
                    for name in (
                        "colors",
                        "specular_colors",
                        "positions",
                        "directions",
                        "reaches",
                        "ends",
                        "attenuations",
                        "cones",
                    )
                ],
            )
            for s in plan.lights
        ]
        return sets, plan.ambient.tolist(), plan.shadows.size

    copy = NodePath("root").attach_new_node(light).copy_to(NodePath("other")).node()
    assert type(copy) is type(light)
    assert copy is not light
    assert columns(copy) == columns(light)
    if not isinstance(light, AmbientLight):
        assert (copy.is_shadow_caster(), copy.get_shadow_resolution(), copy.camera_mask) == (True, 99, 0b101)


def test_many_lights_may_be_endless_only_with_an_attenuation():
    with pytest.raises(LightError, match="'l': entry 0: its radius is negative or not finite"):
        PointLights("l", [(0, 0, 0)], radii=math.inf)
    PointLights("l", [(0, 0, 0)], radii=math.inf, attenuation=(1, 0, 1))
    assert PointLights("l", [(0, 0, 0)], attenuation=(1, 0, 1)).arrays.radii.tolist() == [math.inf]
    with pytest.raises(LightError, match="'l': entry 1: its radius is negative or no number"):
        PointLights("l", [(0, 0, 0)] * 2, radii=[1, math.nan], attenuation=(1, 0, 1))


def test_specular_colors_must_fit_the_lights_that_there_are():
    with pytest.raises(LightError, match="'l': specular colors must have shape"):
        PointLights("l", [(0, 0, 0)], specular_colors=[1, 2])
    swarm = PointLights("swarm", function=lambda t: (np.zeros((int(t), 3)), (1, 1, 1), 1.0))
    swarm.set_specular_colors(np.ones((2, 3)))
    scene = wall_scene()
    scene.root.attach_new_node(swarm)
    build_plan(scene, time=2.0)
    with pytest.raises(LightError, match="'swarm': 2 specular colors for 3 lights"):
        build_plan(scene, time=3.0)


def test_a_light_whose_parents_leave_it_no_direction_is_named():
    scene = wall_scene()
    flat = scene.root.attach_new_node("flat")
    flat.set_mat(np.diag([1.0, 0.0, 1.0, 1.0]))
    flat.attach_new_node(Spotlight("lamp"))
    with pytest.raises(LightError, match="'lamp': its net transform leaves it no direction"):
        build_plan(scene)


@pytest.mark.parametrize("make", [PointLight, Spotlight])
def test_a_light_beyond_all_numbers_is_named(make):
    scene = wall_scene()
    far = scene.root.attach_new_node("far")
    far.set_scale(1e20)
    far.attach_new_node(make("lamp")).set_pos(1e15, 0, 0)
    with pytest.raises(LightError, match="'lamp': its position in the world must be finite and at most"):
        build_plan(scene)


def test_what_follows_from_other_values_cannot_be_set():
    lamps, lens = PointLights("lamps", [(0, 0, 0)]), PerspectiveLens()
    card = Geom([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [(0, 1, 2)])
    for thing, name in ((lamps, "endless"), (lens, "shape"), (card, "bounds")):
        with pytest.raises(AttributeError):
            setattr(thing, name, True)
