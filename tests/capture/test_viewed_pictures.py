"""Pictures of views: what is left from here is right from behind, in any order, and where a NeRF says."""

from __future__ import annotations

import random

import numpy as np
import pytest

from firefly_sample import model_scene
from firefly_sample.capture.viewed_scene import ViewedScene
from firefly_sample.capture.views import OrbitViews, parse_views
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from tests.conftest import borrow_renderer
from tests.model.scene_files import add_camera, box_file
from tests.scenes import ball, ball_scene, geom_node

SIZE = (64, 48)


class Swaying(Scene):
    """A ball and a camera that move with time; the camera hangs below a node."""

    def __init__(self):
        scene = ball_scene(lights=4, ambient=(0.2, 0.2, 0.2))
        carrier = scene.root.attach_new_node("carrier")
        scene.camera.reparent_to(carrier)
        super().__init__(scene.root, scene.camera, focus=(0.0, 10.0, 0.0))
        self.carrier, self.ball = carrier, scene.root.find("place 1")

    def update(self, time):
        super().update(time)
        self.carrier.set_pos(time, -0.5 * time, 0)
        self.ball.set_z(time)


def place_of(ids, number):
    """The mean column and row of an object's pixels."""
    rows, columns = np.nonzero(ids == number)
    return columns.mean(), rows.mean()


def test_what_is_left_from_here_is_right_from_behind():
    scene = Scene(focus=(0.0, 10.0, 0.0))
    scene.camera.node().lens = PerspectiveLens(vfov=50.0, near=0.5, far=100.0)
    red, green = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    for name, x, color in (("red", -2.5, red), ("green", 2.5, green)):
        node = geom_node(name, ball(), Material(name, (*color, 1.0)))
        scene.root.attach_new_node(node).set_pos(x, 10, 0.5)
    scene.root.attach_new_node(AmbientLight("sky", (1, 1, 1)))
    viewed = ViewedScene(scene, OrbitViews(4), SIZE)
    places, colors = [], []
    with borrow_renderer(SIZE) as renderer:
        for viewed.view in range(4):
            frame = renderer.render(viewed, 0.0, ("color", "id"))
            left, right = frame.color[:, :32].astype(int), frame.color[:, 32:].astype(int)
            colors.append([int((side[..., 0] - side[..., 1]).sum()) for side in (left, right)])
            places.append([place_of(frame.id, number) for number in range(2) if (frame.id == number).any()])
    (red_here, green_here), aside, (red_behind, green_behind), _ = places
    assert red_here[0] < 20 < 44 < green_here[0]
    assert green_behind[0] < 20 < 44 < red_behind[0]
    # behind is the mirror image: the balls are level with the focus, and the camera is as far and as high
    np.testing.assert_allclose((red_behind[0], red_behind[1]), (63 - red_here[0], red_here[1]), atol=0.1)
    assert colors[0][0] > 0 > colors[0][1]
    assert colors[2][0] < 0 < colors[2][1]
    assert (
        len(aside) == 1
    )  # from the right the green one hides the red one, whose rim is too thin for a pixel
    np.testing.assert_allclose(aside[0][0], 31.5, atol=0.1)


@pytest.mark.parametrize("reuse", [False, True])
def test_the_order_of_views_and_moments_changes_no_bit(reuse):
    outputs = ("color", "depth", "id")
    frames = [(moment, view) for moment in range(3) for view in range(4)]
    expected = {}
    for time, view in frames:
        viewed = ViewedScene(Swaying(), OrbitViews(4), SIZE)
        viewed.view = view
        with borrow_renderer(SIZE) as renderer:
            expected[time, view] = renderer.render(viewed, time, outputs)
    different = {frame.color.tobytes() for frame in expected.values()}
    assert len(different) == len(frames)
    viewed = ViewedScene(Swaying(), OrbitViews(4), SIZE)
    mixed = random.Random(5).sample(frames, len(frames))

    def times():
        for time, viewed.view in mixed:
            yield time

    with borrow_renderer(SIZE, reuse=reuse) as renderer:
        for place, found in zip(mixed, renderer.render_many(viewed, times(), outputs), strict=True):
            for output in outputs:
                assert found[output].tobytes() == expected[place][output].tobytes(), (place, output)


def test_view_0_of_an_orbit_is_the_scenes_own_picture(tmp_path):
    file = box_file()
    add_camera(file, "Front", translation=[1.0, 2.0, 10.0], rotation=[0.0, 0.6, 0.0, 0.8], scale=[3, 3, 3])
    path = file.write(tmp_path / "box.glb")
    with borrow_renderer((64, 32)) as renderer:
        for make in (Swaying, lambda: model_scene(path)):
            own = renderer.render(make(), 1.0, ("color", "depth"))
            first = renderer.render(ViewedScene(make(), OrbitViews(3), (64, 32)), 1.0, ("color", "depth"))
            assert own.color.tobytes() == first.color.tobytes()
            assert own.depth.tobytes() == first.depth.tobytes()
            assert own.camera.as_dict() == first.camera.as_dict()
            assert own.warnings == first.warnings


def test_between_views_only_the_camera_changes():
    viewed = ViewedScene(Swaying(), OrbitViews(4), SIZE)
    with borrow_renderer(SIZE) as renderer:
        plans = []
        for viewed.view in (0, 1, 1, 2):
            plans.append(renderer.plan(viewed, 1.0))
    assert (
        len({id(batch.geom) for plan in plans for batch in plan.batches}) == 2
    )  # the ball's and the floor's
    # a walk of the graph gives a new tuple of names
    assert len({id(plan.id_names) for plan in plans}) == 1
    assert plans[1].batches is plans[2].batches
    assert plans[0].view.view_to_world.tobytes() != plans[3].view.view_to_world.tobytes()


def test_a_nerfs_camera_sees_points_where_its_own_formula_has_them():
    """``u = cx + fl_x x / -z``, ``v = cy - fl_y y / -z`` from the picture's corner, in OpenGL's axes."""
    points = np.array([(0.2, 0.5, 1.4), (-0.6, -0.8, 0.7)])
    pose = np.array([[0, 0, 1, 4], [1, 0, 0, 0], [0, 1, 0, 1], [0, 0, 0, 1]], dtype=float)
    content = {
        "fl_x": 80.0,
        "fl_y": 82.0,
        "cx": 30.0,
        "cy": 26.0,
        "w": 64,
        "h": 48,
        "frames": [{"transform_matrix": pose.tolist()}],
    }
    scene = Scene()
    scene.camera.node().lens = PerspectiveLens(near=0.5, far=100.0)
    for number, point in enumerate(points):
        path = scene.root.attach_new_node(geom_node(f"ball {number}", ball(0.15)))
        path.set_pos(*point)
    viewed = ViewedScene(scene, parse_views(content), SIZE)
    with borrow_renderer(SIZE) as renderer:
        frame = renderer.render(viewed, 0.0, ("id",))
    for number in range(2):
        x, y, z = pose[:3, :3].T @ (points[number] - pose[:3, 3])
        u, v = 30.0 + 80.0 * x / -z, 26.0 - 82.0 * y / -z
        column, row = place_of(frame.id, number)
        assert abs(column + 0.5 - u) < 0.25
        assert abs(row + 0.5 - v) < 0.25
    again = parse_views([frame.camera])
    assert np.allclose(frame.camera.pose("opengl"), pose, rtol=0, atol=0)
    viewed = ViewedScene(scene, again, SIZE)
    with borrow_renderer(SIZE) as renderer:
        assert renderer.render(viewed, 0.0, ("id",)).id.tobytes() == frame.id.tobytes()
