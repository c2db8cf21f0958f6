"""When a plan says that positions will be off, and what it says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.pipeline import build_plan
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.plan.position_error import CODE, codes_shown, depth_error, position_error, position_errors
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights
from firefly_sample.settings import CHOICES, Settings
from firefly_sample.srgb import linear_to_srgb
from tests.scenes import wall_scene

SIZE = (64, 48)
ODD = (65, 49)
"""Has a sample in the middle, where a light that is less than a sample wide is."""


def lit_wall(distance=10.0, reach=2.0, **lens):
    """A wall that fills the view, and a light just before it."""
    scene = wall_scene(distance, size=4 * distance, **lens)
    scene.root.attach_new_node(PointLight("light", radius=reach)).set_pos(0, distance - 0.25 * reach, 0)
    return scene


def warnings_of(scene, outputs=("color",), capabilities=None, size=SIZE, **settings):
    return build_plan(scene, Settings(**settings), size, outputs, capabilities=capabilities).warnings


# --- The law ---


@pytest.mark.parametrize("far", [100.0, 1e6, math.inf])
def test_an_error_of_depth_grows_as_the_square_of_the_distance(far):
    lens = wall_scene(far=far).camera_node.lens.constants()
    for y in (2.0, 10.0, 90.0):
        step = 1e-9
        moved = lens.distance_from_depth(lens.depth_from_distance(y) + step) - y
        assert depth_error(step, 1.0, far, True, y) == pytest.approx(float(moved), rel=1e-4)


def test_an_error_of_orthographic_depth_is_the_same_everywhere():
    assert depth_error(1e-3, 2.0, 12.0, False, 3.0) == depth_error(1e-3, 2.0, 12.0, False, 11.0)
    assert depth_error(1e-3, 2.0, 12.0, False, 3.0) == pytest.approx(1e-2)


def test_methods_differ_as_they_were_measured():
    def relative(method, **more):
        return position_error(method, 1.0, math.inf, True, 1000.0, **more) / 1000.0

    assert relative("linear32f") == relative("stored32f") == pytest.approx(4.5e-7)
    assert relative("depth32f") < relative("linear32f")
    assert relative("depth32f", clip_control=False) == relative("depth24")
    assert 6e-5 <= relative("depth24") <= 4 * 6e-5
    assert relative("depth16") == pytest.approx(7.6e-3, rel=0.05)
    assert relative("stored16f") == pytest.approx(2.0**-10)
    assert relative("inverse_matrix", from_origin=1e6) > 100 * relative("inverse_matrix")


def test_half_floats_end_on_both_sides():
    assert position_error("stored16f", 1.0, 1e6, True, 1e5) == pytest.approx(1e5 - 65504)
    assert position_error("stored16f", 1e-9, 1.0, True, 1e-6) == 2.0**-24


@given(st.lists(st.floats(1e-9, 1e9), min_size=2, max_size=9), st.sampled_from(CHOICES["position_method"]))
def test_what_is_farther_is_never_less_far_off(distances, method):
    errors = position_errors(method, 1e-3, math.inf, True, np.sort(distances), 10.0)
    assert (np.diff(errors) >= 0.0).all()


def test_a_code_is_the_step_of_srgb_at_white():
    slope = (linear_to_srgb(1.0) - linear_to_srgb(1.0 - 1e-6)) / 1e-6
    assert float(slope) * CODE * 255.0 == pytest.approx(1.0, rel=1e-5)
    assert codes_shown(0.5 * CODE, 1.0) == pytest.approx(1.0)
    assert codes_shown(1.0, 0.0) == math.inf


@given(st.floats(1e-4, 1.0))
def test_a_change_of_what_is_darker_is_fewer_codes(level):
    change = 1e-6
    codes = 255.0 * float(linear_to_srgb(level) - linear_to_srgb(level * (1.0 - change)))
    assert float(codes_shown(0.5 * change, 1.0, level)) == pytest.approx(codes, rel=2e-2)


# --- The line ---


def test_the_line_names_method_place_error_and_way_out():
    (line,) = warnings_of(lit_wall(near=1e-3), position_method="depth24")
    assert line == (
        "position_method=depth24: at 10 units, near plane 0.001, positions are off by about 0.015 units, "
        "which is about 5.3 display codes on a surface 0.5 from a light; "
        "use position_method=linear32f, which is off by 4.5e-06, or move the near plane out"
    )


@pytest.mark.parametrize("position", ["linear32f", "depth32f", "stored32f"])
@pytest.mark.parametrize("near", [1.0, 1e-6])
def test_accurate_methods_have_nothing_to_say(position, near):
    assert warnings_of(lit_wall(near=near), position_method=position) == ()


def test_a_near_plane_that_is_far_enough_needs_no_warning():
    assert warnings_of(lit_wall(near=1.0), position_method="depth24") == ()


def test_depth32f_without_clip_control_is_as_depth24():
    found = warnings_of(
        lit_wall(near=1e-3), position_method="depth32f", capabilities=Capabilities(clip_control=False)
    )
    assert [line.split(":")[0] for line in found] == ["position_method=depth32f"] * 2
    assert "ARB_clip_control" in found[0]
    assert "use position_method=linear32f, " in found[1]


def test_the_inverse_matrix_minds_the_worlds_origin():
    scene = lit_wall(near=1.0)
    assert warnings_of(scene, position_method="inverse_matrix") == ()
    for child in scene.root.get_children():
        child.set_x(1e6)
    (line,) = warnings_of(scene, position_method="inverse_matrix")
    assert "1e+06 from the world's origin" in line
    assert line.endswith(
        "use position_method=linear32f, which is off by 4.5e-06, or bring the camera near the world's origin"
    )
    assert warnings_of(scene, position_method="depth24") == ()


@pytest.mark.parametrize("aside", [False, True])
def test_half_floats_say_where_they_end(aside):
    scene = lit_wall(1e5, 1e4, near=10.0, far=1e6)
    if aside:  # near, but wide
        scene = lit_wall(2e4, 1e4, near=10.0, far=1e6)
        scene.camera_node.lens.set_fov(150.0)
        scene.root.find("wall").set_scale(10)
    (line,) = warnings_of(scene, position_method="stored16f")
    assert line.startswith("position_method=stored16f: half floats end at 65504 units and ")
    assert line.endswith("use position_method=stored32f, which has no such limit")


def test_parallel_rays_err_by_what_lies_between_the_planes():
    scene = lit_wall(reach=0.1)
    scene.camera_node.lens = OrthographicLens(film_size=(16, 12), near=1, far=1e6)
    (line,) = warnings_of(scene, position_method="depth24", size=ODD)
    assert "planes 1e+06 apart" in line
    assert "move the near plane" not in line
    scene.camera_node.lens = OrthographicLens(film_size=(16, 12), near=1, far=100)
    assert warnings_of(scene, position_method="depth24") == ()


def test_lights_too_small_for_any_method_say_so():
    (line,) = warnings_of(lit_wall(1e6, 240.0, near=1.0, far=1e7), size=ODD)
    assert line.startswith("position_method=linear32f: at 1e+06 units, positions are off by about 0.45 units")
    assert line.endswith(
        "use position_method=depth32f, which is off by 0.18"
    )  # a reversed depth buffer has a digit more
    assert warnings_of(lit_wall(1e6, 240.0, near=1.0, far=1e7)) == ()  # no sample meets it: it lights nothing
    (line,) = warnings_of(lit_wall(1e6, 0.5, near=1.0, far=1e7), size=ODD)
    assert line.endswith("no method is more accurate: the lights are too small for their distance")


# --- What it depends on ---


def test_no_light_with_a_place_no_warning():
    scene = wall_scene(near=1e-5)
    (dark,) = warnings_of(scene, position_method="depth24")
    assert dark.startswith("the scene has no light")
    scene.root.attach_new_node(AmbientLight("sky"))
    sun = DirectionalLight("sun")
    scene.root.attach_new_node(sun)
    assert warnings_of(scene, position_method="depth24") == ()
    sun.set_shadow_caster(True, 64)
    assert warnings_of(scene, position_method="depth24")


def test_no_picture_and_no_gbuffer_no_warning():
    assert warnings_of(lit_wall(near=1e-5), ("depth", "normal"), position_method="depth24") == ()
    assert warnings_of(lit_wall(near=1e-5), light_method="forward", position_method="depth24") == ()


def test_what_no_light_reaches_does_not_count():
    """A wall far behind the one that is lit."""
    scene = lit_wall(near=0.05, far=1e5)
    assert warnings_of(scene, position_method="depth24") == ()
    far = scene.root.find("wall").copy_to(scene.root)
    far.set_pos(0, 9e4, 0)
    assert warnings_of(scene, position_method="depth24") == ()


@pytest.mark.parametrize("others", [1, 2, 50])
def test_a_small_light_among_large_ones_counts(others):
    """Whatever most lights are like."""
    scene = lit_wall(50.0, 1.0, near=50.0 / 2e4)
    (alone,) = warnings_of(scene, position_method="depth24")
    colors = np.full((others, 3), 1e-3)
    scene.root.attach_new_node(PointLights("large", np.tile([0.0, 40.0, 0.0], (others, 1)), colors, 400.0))
    assert warnings_of(scene, position_method="depth24") == (alone,)


def test_a_light_that_is_too_dim_to_see_does_not_count():
    scene = lit_wall(50.0, 1.0, near=50.0 / 2e4)
    light = scene.root.find("light").node()
    light.set_color((1e-4, 1e-4, 1e-4))
    assert warnings_of(scene, position_method="depth24") == ()
    scene.exposure = 1e4
    assert warnings_of(scene, position_method="depth24")


def test_an_attenuated_light_counts_where_it_has_halved():
    """Its reach is a hundred times as far: there it hardly changes."""
    scene = wall_scene(near=2e-3)
    light = PointLight("light")
    light.set_attenuation((1.0, 0.0, 4.0))
    scene.root.attach_new_node(light).set_pos(0, 9, 0)
    (line,) = warnings_of(scene, position_method="depth24")
    assert "0.5 from a light" in line


def test_an_endless_light_counts_as_far_away_as_what_it_lights():
    scene = wall_scene(near=1e-3)
    scene.root.attach_new_node(PointLight("endless"))
    assert warnings_of(scene, position_method="depth24") == ()
    scene.camera_node.lens.set_near(1e-5)
    (line,) = warnings_of(scene, position_method="depth24")
    assert "10 from a light" in line


# --- What light is added up in ---


@pytest.mark.parametrize(
    ("accumulation", "largest"), [("rgba16f", 65504.0), ("r11g11b10f", 64512.0), ("rgba8", 1.0)]
)
def test_light_that_is_more_than_its_target_holds(accumulation, largest):
    def found(strength):
        scene = wall_scene()
        scene.root.attach_new_node(PointLights("lights", [(0, 9, 0)], [(0.1, strength, 0.1)], 5.0))
        return warnings_of(scene, accumulation_format=accumulation)

    assert found(largest) == ()
    (line,) = found(2 * largest)
    assert line == (
        f"accumulation_format={accumulation}: it holds radiance up to {largest:g} and a light has "
        f"{2 * largest:g}, so surfaces are clipped to that; "
        "use accumulation_format=rgba32f, which has no such limit"
    )


def test_float32_holds_any_light():
    scene = wall_scene()
    scene.root.attach_new_node(PointLights("lights", [(0, 9, 0)], [(1e30, 1, 1)], 5.0))
    assert warnings_of(scene) == ()
