"""Lights: units, fading, directions and cones by values, and there and back."""

from __future__ import annotations

import math

import numpy as np
import pyrender
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from firefly_sample.errors import LightError
from firefly_sample.interop.pyrender.bridge import from_pyrender, to_pyrender
from firefly_sample.losses import ConversionWarning
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import (
    SMALLEST_CONE,
    AmbientLight,
    DirectionalLight,
    PointLight,
    PointLights,
    Spotlight,
)
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Scene
from tests.interop.blocks import (
    ANGLES,
    NUMBER,
    SCALES,
    SINGLE,
    VECTOR,
    U,
    fading,
    log_floats,
    only,
    scene_with,
    single,
    there_and_back,
)


def converted_light(light, **place):
    """The light's pyrender node and light, and that nothing was lost."""
    converted = to_pyrender(scene_with(light), **place)
    node = only(converted.light_nodes)
    return converted.get_pose(node), node.light


def test_a_light_of_inverse_square_is_pi_times_as_strong():
    pose, light = converted_light(fading(PointLight("lamp", (3, 6, 1.5))))
    np.testing.assert_array_equal(light.color, [0.5, 1.0, 0.25])
    assert light.intensity == pytest.approx(6 * math.pi, rel=1e-15)
    assert light.range is None
    np.testing.assert_array_equal(pose, np.eye(4))


def test_a_quadratic_attenuation_divides():
    _, light = converted_light(fading(PointLight("lamp", (3, 6, 1.5)), (0, 0, 4)))
    assert light.intensity == pytest.approx(1.5 * math.pi, rel=1e-15)


def test_a_black_light_stays_black():
    _, light = converted_light(fading(PointLight("lamp", (0, 0, 0))))
    assert light.intensity == 0.0
    assert np.isfinite(light.color).all()


@pytest.mark.parametrize(
    ("light", "distance", "fade"),
    [
        (PointLight("lamp", (2, 2, 2), radius=6.0), 3.0, 0.25),
        (fading(PointLight("lamp", (2, 2, 2)), (0.5, 0, 0)), 1.0, 2.0),
        (fading(PointLight("lamp", (2, 2, 2)), (0.5, 1.5, 0)), 1.0, 0.5),
        (fading(PointLight("lamp", (2, 2, 2)), (1, 0, 2)), 1e9, 1 / (1 + 2e18)),
    ],
    ids=["radius", "endless", "linear", "from afar"],
)
def test_other_fading_is_equal_at_one_distance(light, distance, fade):
    with pytest.warns(ConversionWarning, match="'lamp'"):
        _, made = converted_light(light)
    assert made.intensity / (math.pi * distance**2) == pytest.approx(2 * fade, rel=1e-12)


def test_light_over_a_radius_is_nowhere_dimmer():
    with pytest.warns(ConversionWarning, match="over a radius"):
        _, made = converted_light(PointLight("lamp", radius=6.0))
    distance = np.linspace(0.01, 6, 1000)
    assert (made.intensity / (math.pi * distance**2) >= (1 - distance / 6) ** 2 - 1e-15).all()
    assert made.range == 6.0


def test_a_max_distance_is_a_range():
    with pytest.warns(ConversionWarning, match="how far lights reach .*'lamp'"):
        _, light = converted_light(fading(PointLight("lamp"), end=9.0))
    assert light.range == 9.0


def test_a_light_without_reach_is_dark():
    _, light = converted_light(fading(PointLight("lamp"), end=0.0))
    assert (light.intensity, light.range) == (0.0, None)


def test_lights_shine_along_their_axis():
    pose, light = converted_light(DirectionalLight("sun", (1, 0.5, 0.5)))
    np.testing.assert_array_equal(pose, np.eye(4))  # pyrender's shine along -Z, where ours shine along +Y
    assert light.intensity == pytest.approx(math.pi)
    sun = DirectionalLight("sun")
    sun.set_direction((0, 0, -1))
    pose, _ = converted_light(sun)
    np.testing.assert_allclose(-pose[:3, 2], [0, -1, 0], atol=1e-15)


def test_a_spotlights_angles_and_direction():
    spot = fading(Spotlight("spot"))
    spot.set_cone(20, 30)
    scene = Scene()
    path = scene.root.attach_new_node(spot)
    path.set_scale(3.0)
    path.look_at(1, 0, 0)
    with pytest.warns(ConversionWarning, match="fade between their two angles"):
        converted = to_pyrender(scene)
    node = only(converted.spot_light_nodes)
    assert math.degrees(node.light.innerConeAngle) == pytest.approx(20)
    assert math.degrees(node.light.outerConeAngle) == pytest.approx(30)
    # not three times as long: pyrender takes that for the cone's strength
    np.testing.assert_allclose(-converted.get_pose(node)[:3, 2], [1, 0, 0], atol=1e-15)


def test_a_lenss_cone_is_as_wide_as_the_lens_sees():
    spot = fading(Spotlight("spot"))
    spot.set_lens(PerspectiveLens(fov=44))
    with pytest.warns(ConversionWarning, match="no exponent .*'spot'"):
        _, light = converted_light(spot)
    assert math.degrees(light.outerConeAngle) == pytest.approx(22)
    assert light.innerConeAngle == light.outerConeAngle


def test_lights_are_where_they_are_at_that_time():
    lights = PointLights(
        "moving", function=lambda time: ([(time, 0, 0)], (1, 1, 1), math.inf), attenuation=(0, 0, 1)
    )
    pose, _ = converted_light(lights, time=2.5)
    np.testing.assert_array_equal(pose[:3, 3], [2.5, 0, 0])


def test_ambient_lights_add_up():
    scene = scene_with(AmbientLight("sky", (0.25, 0.5, 0.75)))
    scene.root.attach_new_node(AmbientLight("glow", (0.5, 0, 0)))
    np.testing.assert_array_equal(to_pyrender(scene).ambient_light, [0.75, 0.5, 0.75])


def test_a_range_is_a_max_distance_and_is_named():
    """pyrender's shader has no use for it; glTF's window for it is ours."""
    source = pyrender.Scene()
    source.add(pyrender.PointLight(range=3.0), name="lamp")
    source.add(pyrender.SpotLight(range=4.0, innerConeAngle=0.5, outerConeAngle=0.5), name="spot")
    with pytest.warns(ConversionWarning, match=r"ends at its range here, .* in pyrender: 'lamp', 'spot'$"):
        scene = from_pyrender(source)
    found = {path.get_name(): path.node().get_max_distance() for path in scene.root.get_children()[:2]}
    assert found == {"lamp": 3.0, "spot": 4.0}


def test_a_cone_too_narrow_is_refused():
    source = pyrender.Scene()
    source.add(pyrender.SpotLight(outerConeAngle=1e-6), name="needle")
    with pytest.raises(LightError, match="light 'needle'"):
        from_pyrender(source)


COLOR = st.tuples(*[st.floats(0, 1e6)] * 3)
REACH = st.one_of(st.just(math.inf), log_floats(1e-6, 1e6))


def assert_same_color(given, got) -> None:
    """The brightest channel, which the intensity holds, to float64's rounding; the others to float32's."""
    given, got = np.asarray(given), np.asarray(got)
    brightest = int(given.argmax())
    np.testing.assert_allclose(got[brightest], given[brightest], rtol=4 * U)
    np.testing.assert_allclose(got, given, rtol=2 * SINGLE, atol=1e-37 * max(given.max(), 1.0))


@st.composite
def places(draw) -> tuple[Scene, NodePath]:
    """A scene, and a node below a transform in it that turns, moves and scales."""
    scene = Scene()
    path = scene.root.attach_new_node("arm")
    path.set_pos_hpr_scale(draw(VECTOR), draw(ANGLES), draw(SCALES))
    return scene, path


def direction_of(path: NodePath, own=(0.0, 1.0, 0.0)) -> Float64:
    direction = np.asarray(own) @ path.get_net_mat()[:3, :3]
    return direction / np.linalg.norm(direction)


@pytest.mark.filterwarnings("ignore:pyrender keeps how far lights reach")
@pytest.mark.filterwarnings("ignore:light ends at its range")
@given(places(), COLOR, REACH, VECTOR)
def test_point_lights_come_back(place, color, reach, pos):
    scene, arm = place
    light = PointLight("lamp", color)
    light.set_attenuation((0, 0, 1))
    light.set_max_distance(reach)
    path = arm.attach_new_node(light)
    path.set_pos(pos)
    back = there_and_back(scene).root.find("**/lamp")
    assert type(back.node()) is PointLight
    np.testing.assert_array_equal(back.get_net_mat(), path.get_net_mat())
    assert_same_color(color, back.node().get_color())
    assert back.node().get_attenuation() == (0, 0, 1)
    assert back.node().get_max_distance() == reach


@pytest.mark.filterwarnings("ignore:pyrender ")
@pytest.mark.filterwarnings("ignore:light ends at its range")
@given(places(), arrays(np.float64, (6, 3), elements=NUMBER), st.lists(COLOR, min_size=6, max_size=6))
def test_many_lights_of_a_node_come_back_as_nodes(place, positions, colors):
    scene, arm = place
    arm.attach_new_node(PointLights("lamps", positions, colors, 7.0, attenuation=(0, 0, 1)))
    back = there_and_back(scene).root.find("**/lamps")
    assert [path.get_name() for path in back.get_children()] == [f"lamps[{index}]" for index in range(6)]
    for path, position, color in zip(back.get_children(), positions, colors, strict=True):
        np.testing.assert_array_equal(path.get_pos(), position)
        np.testing.assert_array_equal(back.get_net_mat(), arm.get_net_mat())
        assert_same_color(color, path.node().get_color())
        assert path.node().get_max_distance() == 7.0


@pytest.mark.filterwarnings("ignore:spotlights fade between")
@given(
    places(), COLOR, st.sampled_from([SMALLEST_CONE, 90.0]) | st.floats(SMALLEST_CONE, 90), st.floats(0, 1)
)
def test_spotlights_come_back(place, color, outer, share):
    scene, arm = place
    light = Spotlight("spot", color)
    light.set_attenuation((0, 0, 1))
    light.set_cone(share * outer, outer)
    path = arm.attach_new_node(light)
    back = there_and_back(scene).root.find_all_matches("**/spot")[-1]
    assert type(back.node()) is Spotlight
    np.testing.assert_allclose(back.get_net_mat()[3], path.get_net_mat()[3], rtol=1e-14)
    np.testing.assert_allclose(direction_of(back), direction_of(path), atol=1e-14)
    np.testing.assert_allclose(back.node().get_cone(), light.get_cone(), rtol=4 * U, atol=1e-300)
    assert_same_color(color, back.node().get_color())


@given(places(), COLOR, VECTOR.filter(any))
def test_directional_lights_come_back(place, color, direction):
    scene, arm = place
    light = DirectionalLight("sun", color)
    light.set_direction(direction)
    path = arm.attach_new_node(light)
    back = there_and_back(scene).root.find_all_matches("**/sun")[-1]
    assert type(back.node()) is DirectionalLight
    got = direction_of(back, back.node().get_direction())
    np.testing.assert_allclose(got, direction_of(path, light.get_direction()), atol=1e-12)
    assert_same_color(color, back.node().get_color())


@given(COLOR, COLOR)
def test_ambient_lights_come_back_as_their_sum(first, second):
    scene = Scene()
    scene.root.attach_new_node(AmbientLight("sky", first))
    scene.root.attach_new_node(AmbientLight("glow", second))
    back = there_and_back(scene)
    found = [
        path.node() for path in back.root.find_all_matches("**") if isinstance(path.node(), AmbientLight)
    ]
    total = np.add(first, second)
    assert len(found) == int(single(total).any())
    for light in found:
        np.testing.assert_array_equal(light.get_color(), single(total))
