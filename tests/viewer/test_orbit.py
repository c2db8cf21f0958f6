"""The mouse's camera: where it starts, and what turning, panning and zooming keep."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.other_camera import SceneWithCamera
from firefly_sample.scene.scene import Scene
from firefly_sample.viewer.orbit import RANGE, TURN, OrbitCamera
from tests.scenes import ball_scene, orthographic_wall

WINDOW = (640, 480)
drags = st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=8)


def eye_of(camera: OrbitCamera) -> np.ndarray:
    return camera.path.get_net_mat()[3, :3]


def axes_of(camera: OrbitCamera) -> np.ndarray:
    return camera.path.get_net_mat()[:3, :3]


def looks_at_pivot(camera: OrbitCamera) -> bool:
    seen = eye_of(camera) + camera.distance * axes_of(camera)[1]
    return np.allclose(
        seen, camera.pivot, rtol=0, atol=1e-12 * (camera.distance + np.abs(camera.pivot).max())
    )


def test_it_starts_where_the_scene_s_camera_is():
    scene = ball_scene()
    holder = scene.root.attach_new_node("holder")
    holder.set_pos(3, -2, 1)
    holder.set_hpr(20, 5, -3)
    scene.camera.reparent_to(holder)
    camera = OrbitCamera(scene)
    np.testing.assert_allclose(camera.path.get_net_mat(), scene.camera.get_net_mat(), rtol=0, atol=1e-14)
    assert looks_at_pivot(camera)


def test_the_pivot_is_as_far_away_as_the_middle_of_the_scene():
    scene = ball_scene()
    low, high = scene.root.get_tight_bounds()
    net = scene.camera.get_net_mat()
    ahead = (0.5 * (low + high) - net[3, :3]) @ net[1, :3]
    assert OrbitCamera(scene).distance == pytest.approx(ahead, rel=1e-12)


@pytest.mark.parametrize("lens", [PerspectiveLens(near=2.0, far=math.inf), OrthographicLens(film_size=8.0)])
def test_without_anything_ahead_the_lens_gives_a_distance(lens):
    scene = Scene()
    scene.camera.node().lens = lens
    camera = OrbitCamera(scene)
    assert math.isfinite(camera.distance)
    assert camera.distance > 0


def test_a_scene_may_say_what_to_turn_around():
    scene = ball_scene()
    eye, forward = np.array(scene.camera.get_net_transform().get_pos()), scene.camera.get_net_mat()[1, :3]
    scene.focus = tuple(eye + 7.0 * forward + 3.0 * np.cross(forward, (0, 0, 1)))
    camera = OrbitCamera(scene)
    assert camera.distance == pytest.approx(7.0, rel=1e-12)
    assert SceneWithCamera(scene, camera.path).focus == scene.focus
    scene.focus = tuple(eye - forward)  # behind: no such thing
    assert camera.distance > 0
    assert OrbitCamera(scene).distance > 0


@given(drags)
def test_turning_keeps_pivot_distance_and_roll_and_never_flips(turns):
    camera = OrbitCamera(ball_scene())
    pivot, distance, roll = camera.pivot, camera.distance, camera.path.get_hpr()[2]
    for right, down in turns:
        camera.turn(right, down)
        assert looks_at_pivot(camera)
        assert np.linalg.norm(eye_of(camera) - pivot) == pytest.approx(distance, rel=1e-12)
        # the camera's up leans at most as far as its roll makes it, whatever the pitch
        assert axes_of(camera)[2, 2] >= -1e-12
    np.testing.assert_array_equal(camera.pivot, pivot)
    upright = OrbitCamera(ball_scene())
    upright.turn(0.1, 0.1)
    assert upright.path.get_hpr()[2] == pytest.approx(roll, abs=1e-9)


def test_a_drag_over_the_window_s_height_is_half_a_turn():
    camera = OrbitCamera(ball_scene())
    before = eye_of(camera)
    camera.turn(1.0, 0.0)
    after = eye_of(camera)
    assert TURN == 180.0
    np.testing.assert_allclose(after[:2] + before[:2], 2 * camera.pivot[:2], atol=1e-9)
    assert after[2] == pytest.approx(before[2], abs=1e-12)


def test_the_scene_turns_with_the_mouse():
    """What is before the pivot moves the way that the mouse does."""
    camera = OrbitCamera(ball_scene())
    front = 0.5 * (camera.pivot + eye_of(camera))
    for drag, axis, sign in (((0.05, 0.0), 0, 1.0), ((0.0, 0.05), 1, -1.0)):
        camera = OrbitCamera(ball_scene())
        before = project(camera, front)
        camera.turn(*drag)
        assert sign * (project(camera, front) - before)[axis] > 0.01


def project(camera: OrbitCamera, point: np.ndarray) -> np.ndarray:
    lens = camera.path.node().lens.for_picture(*WINDOW)
    view = np.append(point, 1.0) @ np.linalg.inv(camera.path.get_net_mat())
    return np.array(lens.project(view[:3]))


@given(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.sampled_from([ball_scene, orthographic_wall]))
def test_panning_moves_what_is_at_the_pivot_with_the_mouse(right, down, make):
    camera = OrbitCamera(make())
    pivot, distance, axes = camera.pivot, camera.distance, axes_of(camera)
    before = project(camera, pivot)
    seen = camera.path.node().lens.for_picture(*WINDOW)
    camera.pan(right, down, seen.constants())
    moved = project(camera, pivot) - before
    aspect = WINDOW[0] / WINDOW[1]
    np.testing.assert_allclose(moved, (2 * right / aspect, -2 * down), atol=1e-12)
    np.testing.assert_array_equal(axes_of(camera), axes)
    assert camera.distance == distance
    assert looks_at_pivot(camera)


@given(st.lists(st.floats(-300, 300), min_size=1, max_size=10))
def test_zooming_never_reaches_the_pivot(steps):
    camera = OrbitCamera(ball_scene())
    pivot, first, forward = camera.pivot, camera.distance, axes_of(camera)[1]
    for step in steps:
        camera.zoom(step)
        ahead = (pivot - eye_of(camera)) @ forward
        assert first / RANGE * 0.999 <= ahead <= first * RANGE * 1.001
        assert looks_at_pivot(camera)
        lens = camera.path.node().lens
        assert 0 < lens.get_near() < camera.distance < lens.get_far()
    np.testing.assert_array_equal(camera.pivot, pivot)


def test_zooming_in_and_out_again_changes_nothing():
    camera = OrbitCamera(ball_scene())
    before = camera.path.get_net_mat()
    near = camera.path.node().lens.get_near()
    camera.zoom(3)
    assert camera.path.node().lens.get_near() < near
    camera.zoom(-3)
    np.testing.assert_allclose(camera.path.get_net_mat(), before, rtol=1e-13)
    assert camera.path.node().lens.get_near() == pytest.approx(near, rel=1e-13)


def test_zooming_an_orthographic_lens_shrinks_the_film():
    camera = OrbitCamera(orthographic_wall(film=(16.0, 12.0)))
    before = camera.path.get_net_mat()
    camera.zoom(2)
    assert camera.path.node().lens.get_film_size() == pytest.approx((16.0 * 0.81, 12.0 * 0.81))
    np.testing.assert_array_equal(camera.path.get_net_mat(), before)


@pytest.mark.parametrize("lens", [OrthographicLens(film_size=8.0), OrthographicLens(film_height=6.0)])
def test_zooming_an_orthographic_lens_leaves_its_shape_to_the_window(lens):
    scene = orthographic_wall()
    scene.camera.node().lens = lens
    camera = OrbitCamera(scene)
    camera.zoom(2)
    camera.zoom(-1)
    seen, first = (each.for_picture(640, 320) for each in (camera.path.node().lens, lens))
    assert seen.get_film_size() == pytest.approx([0.9 * size for size in first.get_film_size()])


def test_the_scene_and_its_camera_stay_as_they_are():
    scene = ball_scene()
    before = scene.root.node().subtree_revision, scene.camera.get_net_mat(), scene.lens.revision
    camera = OrbitCamera(scene)
    camera.turn(0.3, 0.1)
    camera.pan(0.3, 0.1, scene.lens.constants())
    camera.zoom(5)
    assert scene.root.node().subtree_revision == before[0]
    np.testing.assert_array_equal(scene.camera.get_net_mat(), before[1])
    assert scene.lens.revision == before[2]


def test_a_scene_that_moves_its_own_camera_moves_no_other():
    class Moving(Scene):
        def update(self, time):
            self.camera.set_pos(time, 0, 0)
            self.background = (time, 0.0, 0.0)
            self.exposure = 1.0 + time

    scene = Moving(exposure=3.0)
    camera = OrbitCamera(scene)
    seen = SceneWithCamera(scene, camera.path)
    before = camera.path.get_net_mat()
    assert seen.exposure == 3.0
    seen.update(0.5)
    np.testing.assert_array_equal(seen.camera.get_net_mat(), before)
    assert (seen.background, seen.exposure) == ((0.5, 0.0, 0.0), 1.5)
    assert scene.camera.get_x() == 0.5
    assert seen.root == scene.root
