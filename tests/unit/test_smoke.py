"""The scene smoke: where the light and the puffs are, and what each parameter does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.errors import ParameterError
from firefly_sample.lab.reference.particles import particle_light
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.parameter import resolve_parameters
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.scenes.smoke import AMBIENT
from firefly_sample.scenes.smoke_cloud import EMBER, GOLD, LARGEST_PUFF, PERIOD, REACH, Cloud

SMOKE = find_scene("smoke")
SOME = Cloud(7, 500, 1.0, 0.1)


def smoke(**parameters):
    return build_scene(SMOKE, **({"particles": 200} | parameters))


def light_of(scene, time=0.0):
    """Where the light is and where it shines."""
    scene.update(time)
    path = scene.root.find("light")
    return np.array(path.get_pos()), path.node().get_direction()


@given(st.floats(0.0, 85.0), st.floats(-180.0, 180.0), st.floats(0.0, 180.0), st.floats(0.0, 1e4))
def test_the_light_is_aimed_at_the_middle_from_its_angle(angle, heading, swing, time):
    scene = smoke(particles=0, light_angle=angle, light_heading=heading, swing=swing)
    place, way = light_of(scene, time)
    np.testing.assert_allclose(way, -place / np.linalg.norm(place), atol=1e-12)
    np.testing.assert_allclose(np.degrees(np.arccos(np.clip(-way[2], -1, 1))), angle, atol=1e-5)


def test_the_light_swings_to_both_sides():
    scene = smoke(particles=0, light_angle=45.0, light_heading=0.0, swing=60.0)
    headings = []
    for time in np.linspace(0, 16, 33):
        place, _ = light_of(scene, float(time))
        headings.append(np.degrees(np.arctan2(place[0], place[1])))
    assert max(headings) == pytest.approx(60.0)
    assert min(headings) == pytest.approx(-60.0)
    assert headings[0] == pytest.approx(headings[-1], abs=1e-9)


def test_a_drag_turns_the_light_and_tells_which_parameters_it_changed():
    scene = smoke(light_angle=30.0, light_heading=170.0, swing=0.0)
    assert scene.drag(0.1, 0.1) == {
        "light_angle": pytest.approx(39.0),
        "light_heading": pytest.approx(-172.0),
    }
    place, _ = light_of(scene)
    assert np.degrees(np.arctan2(place[0], place[1])) == pytest.approx(-172.0)
    assert scene.drag(0.0, 9.0)["light_angle"] == 85.0


@given(st.integers(0, 2**63 - 1), st.floats(0.0, 1e5), st.floats(0.0, 1.0), st.booleans())
def test_the_cloud_stays_within_its_reach(seed, time, morph, morphing):
    positions, radii, _, colors = Cloud(seed, 3000, 1.0, 0.1).at(time, morph, morphing)
    assert np.linalg.norm(positions, axis=1).max() <= REACH
    assert radii.max() <= LARGEST_PUFF
    assert colors.min() >= 0.0
    assert colors.max() <= 1.0


def test_the_cloud_goes_from_one_shape_and_colour_to_the_other_and_back():
    cloud = Cloud(7, 500, 1.0, 0.1)
    heap, knot, again = (cloud.at(time) for time in (0.0, PERIOD / 2, PERIOD))
    np.testing.assert_allclose(heap[3], np.tile(EMBER, (500, 1)))
    np.testing.assert_allclose(knot[3], np.tile(GOLD, (500, 1)))
    np.testing.assert_allclose(again[3], heap[3])
    assert np.linalg.norm(heap[0] - knot[0], axis=1).mean() > 0.5


def progress(*arguments):
    """How far each of 500 puffs is on its way from heap to knot, from 0 to 1, as its colour tells."""
    colors = SOME.at(*arguments)[3]
    return (colors[:, 1] - EMBER[1]) / (GOLD[1] - EMBER[1])


@given(st.floats(0.0, 1e4))
def test_a_cloud_that_is_not_morphing_stays_what_morph_says(time):
    np.testing.assert_allclose(progress(time, 0.0, False), 0.0, atol=1e-12)
    np.testing.assert_allclose(progress(time, 1.0, False), 1.0, atol=1e-12)
    half = progress(time, 0.5, False)
    np.testing.assert_array_equal(half, progress(0.0, 0.5, False))
    assert half.mean() == pytest.approx(0.5, abs=0.02)  # as many puffs set out early as late


@given(st.floats(0.0, 2.0 * PERIOD), st.floats(0.0, 1.0))
def test_a_cloud_that_is_morphing_goes_on_from_morph_to_the_knot_and_back_to_it(time, morph):
    least, alone, both = progress(time, morph, False), progress(time), progress(time, morph, True)
    np.testing.assert_array_equal(both, np.maximum(least, alone))
    np.testing.assert_array_equal(progress(time, 0.0, True), alone)
    np.testing.assert_allclose(progress(PERIOD / 2, morph), 1.0)


def test_each_step_of_morph_moves_puffs_towards_the_knot():
    steps = np.array([progress(0.0, morph, False) for morph in np.linspace(0.0, 1.0, 11)])
    gone = np.diff(steps, axis=0)
    assert gone.min() >= 0.0
    assert (gone.max(axis=1) > 0.04).all()  # smoothly: the first ones go 1/20 of their way in the first step


@pytest.mark.parametrize("ambient", [0.25, 1.0, 100.0])
def test_ambient_light_adds_its_share_of_each_puffs_colour_whatever_shadows_it(ambient):
    dark, lit = (build_plan(smoke(particles=20, ambient=share)) for share in (0.0, ambient))
    added = particle_light(lit) - particle_light(dark)
    expected = ambient * np.array(AMBIENT) * lit.particles.colors
    np.testing.assert_allclose(added, expected, rtol=1e-12, atol=1e-12)


def test_without_ambient_light_nothing_is_drawn_for_it():
    lit, dark = (build_plan(smoke(ambient=share)) for share in (1.0, 0.0))
    assert {step.name for step in lit.passes} - {step.name for step in dark.passes} == {"ambient"}


def test_more_puffs_never_move_the_first_ones():
    few, many = Cloud(7, 100, 1.0, 0.1).at(3.0), Cloud(7, 1000, 1.0, 0.1).at(3.0)
    np.testing.assert_array_equal(few[0], many[0][:100])
    np.testing.assert_array_equal(few[1], many[1][:100])


def test_a_frame_does_not_depend_on_the_frames_before():
    scene = smoke()
    first = build_plan(scene, time=5.0)
    build_plan(scene, time=11.0)
    again = build_plan(scene, time=5.0)
    np.testing.assert_array_equal(first.particles.positions, again.particles.positions)
    np.testing.assert_array_equal(first.particle_shadow.positions, again.particle_shadow.positions)


@pytest.mark.parametrize(
    ("name", "value", "see"),
    [
        ("shadow_blur", 3.0, lambda plan: plan.particle_shadow.blur == 3.0),
        ("shadow_darkness", 2.0, lambda plan: plan.particle_shadow.strengths.max() > 0.15),
        ("shadow_tint", 1.0, lambda plan: plan.particle_shadow.tinted),
        ("use_attenuation", True, lambda plan: plan.particles.attenuations.min() < 0.5),
        ("use_interpolation", False, lambda plan: not plan.particle_shadow.interpolate),
        (
            "bounding_radius",
            2.0,
            lambda plan: plan.particle_shadow.view.per_unit == 32.0 / (2.0 + LARGEST_PUFF),
        ),
        (
            "bounding_radius",
            0.0,
            lambda plan: plan.particle_shadow.view.per_unit > 32 / (REACH + LARGEST_PUFF),
        ),
        ("show_texture", True, lambda plan: plan.passes[-1].name == "particle_shadow_texture"),
        ("shadows", False, lambda plan: plan.particle_shadow is None),
        ("particles", 50, lambda plan: len(plan.particles) == 50),
        ("morph", 1.0, lambda plan: np.allclose(plan.particles.colors, GOLD)),
        ("ambient", 3.0, lambda plan: np.allclose(plan.ambient, 3.0 * np.array(AMBIENT))),
        ("particle_size", 2.0, lambda plan: plan.particles.radii.min() > 0.07),
        ("particle_alpha", 0.5, lambda plan: plan.particles.optical_depths.min() > 0.6),
        (
            "light_angle",
            0.0,
            lambda plan: plan.lights[0].directions[0] @ plan.view.world_to_view[2, :3] < -0.999,
        ),
        ("camera_ratio", 2.0, lambda plan: plan.particles.positions[:, 1].mean() > 14.0),
        ("shadow_kernel", "gaussian", lambda plan: plan.particle_shadow.kernel == "gaussian"),
    ],
)
def test_each_parameter_acts_in_a_running_scene_as_in_a_new_one(name, value, see):
    running = smoke()
    before = build_plan(running)
    assert not see(before)
    running.set(name, value)
    after, new = build_plan(running), build_plan(smoke(**{name: value}))
    assert see(after)
    np.testing.assert_array_equal(after.particles.positions, new.particles.positions)
    np.testing.assert_array_equal(after.ambient, new.ambient)
    assert (after.particle_shadow is None) == (new.particle_shadow is None)
    if after.particle_shadow is not None:
        np.testing.assert_array_equal(after.particle_shadow.positions, new.particle_shadow.positions)
        np.testing.assert_array_equal(after.particle_shadow.strengths, new.particle_shadow.strengths)


def test_morphing_acts_in_a_running_scene():
    running = smoke(morph=0.25)
    moving = build_plan(running, time=PERIOD / 2)
    running.set("morphing", False)
    after = build_plan(running, time=PERIOD / 2)
    assert np.abs(after.particles.positions - moving.particles.positions).max() > 0.5
    new = build_plan(smoke(morph=0.25, morphing=False), time=PERIOD / 2)
    np.testing.assert_array_equal(after.particles.positions, new.particles.positions)


def test_the_seed_decides_which_puffs():
    scene = smoke()
    before = build_plan(scene).particles.positions
    scene.set("seed", 8)
    after = build_plan(scene).particles.positions
    assert len(before) == len(after)
    assert not (before == after).any()
    np.testing.assert_array_equal(after, build_plan(smoke(seed=8)).particles.positions)


def test_attenuation_is_by_any_power_from_the_plane_or_the_point():
    plane, point, cubed = (
        build_plan(smoke(use_attenuation=True, **more)).particles.attenuations
        for more in ({}, {"attenuation": "point"}, {"attenuation_power": 3.0})
    )
    assert (point <= plane).all()
    assert (point < plane).any()
    np.testing.assert_allclose(cubed, plane**1.5)


def test_what_is_refused_changes_nothing():
    scene = smoke()
    for name, value in (("attenuation", "line"), ("shadow_kernel", "tent")):
        with pytest.raises(ParameterError, match=f"{name} must be .*, got '{value}'"):
            scene.set(name, value)
    scene.set("use_attenuation", True)
    assert build_plan(scene).particle_shadow.kernel == "box"


def test_puffs_of_any_size_stay_in_their_sphere():
    for size in (0.1, 1.0, 10.0):
        assert build_plan(smoke(particle_size=size)).warnings == ()


def test_wrong_parameters_are_refused():
    with pytest.raises(ParameterError, match="scene 'smoke' has no parameter 'fog'"):
        smoke().set("fog", 1)
    with pytest.raises(ParameterError, match="light_angle"):
        smoke().set("light_angle", 90.0)
    assert resolve_parameters("smoke", SMOKE.parameters, {})["light_angle"] == 32.0


def test_a_forest_has_mist_where_it_is_asked_for():
    forest = build_scene(find_scene("forest"), fireflies=3)
    clear = build_plan(forest)
    assert len(clear.particles) == 0
    assert not [step for step in clear.passes if step.name.startswith(("particle_shadow", "particle"))]
    forest.set("mist", True)
    misty = build_plan(forest, time=1.0)
    assert len(misty.particles) > 300
    assert misty.particle_shadow is None  # no light is named: nothing but fireflies light it
    assert {"particle_light", "particles"} <= {step.name for step in misty.passes}
    node = forest.root.find("mist").node()
    moved = np.abs(node.evaluate(9.0).positions - node.evaluate(1.0).positions).max()
    assert 0.5 < moved < 20.0
