"""`frame_camera`: every vertex is in the picture, which is full, at any shape, scale and place."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from firefly_sample import Camera, Geom, GeomNode, NodePath, Scene, frame_camera
from firefly_sample.errors import SceneError
from firefly_sample.model.framing import CLOSEST, FILL, SHADOW_ROOM

SHAPES = st.floats(-2.0, 2.0).map(lambda power: 10.0**power)
SCALES = st.floats(-6.0, 6.0).map(lambda power: 10.0**power)
POINT = st.tuples(*[st.floats(-1.0, 1.0, width=32)] * 3)
CLOUDS = st.lists(POINT, min_size=3, max_size=12).map(np.array)
DIRECTIONS = st.tuples(st.floats(-360.0, 360.0), st.floats(-90.0, 90.0))


def node_of(points, name="model"):
    """A node whose triangles use all points."""
    count = len(points)
    node = GeomNode(name)
    node.add_geom(Geom(points, [(k, (k + 1) % count, (k + 2) % count) for k in range(count)]))
    return node


def scene_of(points):
    scene = Scene()
    scene.root.attach_new_node(node_of(points))
    return scene


def in_view(scene, points, shape):
    """World-space points as the camera sees them: NDC (n, 2) in a picture of this shape, and depths (n,)."""
    height = 1000
    lens = scene.lens.for_picture(max(1, round(shape * height)), height)
    net = scene.camera.get_net_mat()
    seen = (points - net[3, :3]) @ net[:3, :3].T  # a rotation: its inverse is its transpose
    return lens.constants().ndc_from_view(seen)[:, :2], seen[:, 1]


def size_of(points):
    return np.linalg.norm(points - 0.5 * (points.min(axis=0) + points.max(axis=0)), axis=1).max()


def check_in_view(scene, points, shape):
    ndc, depth = in_view(scene, points, shape)
    assert np.abs(ndc).max() <= FILL + 1e-3
    assert scene.lens.get_near() < depth.min()
    assert depth.max() < scene.lens.get_far()
    return ndc, depth


@given(points=CLOUDS, direction=DIRECTIONS, shape=SHAPES, scale=SCALES)
def test_every_vertex_is_in_view_and_the_picture_is_full(points, direction, shape, scale):
    assume(size_of(points) > 1e-3)
    points = points * scale
    scene = scene_of(points)
    frame_camera(scene, azimuth=direction[0], elevation=direction[1])
    ndc, depth = check_in_view(scene, points, shape)
    low, high = ndc.min(axis=0), ndc.max(axis=0)
    np.testing.assert_allclose(-low, high, atol=2e-3)  # it stands in the middle, also on the other axis
    if depth.min() > 1.001 * CLOSEST * size_of(points):
        full = max((high - low) / 2.0)
        across = min((high - low) / np.array([shape, 1.0]))
        # a line that is seen along one side has no width of its own
        assert full >= FILL - 2e-3 or across < 1e-2


@given(points=CLOUDS, shape=SHAPES, offset=POINT)
def test_a_model_far_from_the_origin(points, shape, offset):
    assume(size_of(points) > 0.1)
    points = points + 1e6 * np.array(offset)
    scene = scene_of(points)
    frame_camera(scene)
    check_in_view(scene, points, shape)


@given(points=CLOUDS, shape=SHAPES, direction=DIRECTIONS, turn=st.floats(0.0, 360.0))
def test_a_model_that_turns_stays_in_view(points, shape, direction, turn):
    assume(size_of(points) > 1e-3)
    scene = scene_of(points)
    frame_camera(scene, azimuth=direction[0], elevation=direction[1], turns=True)
    center = np.array(scene.focus)
    cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    turned = (points - center) @ np.array([(cos, sin, 0.0), (-sin, cos, 0.0), (0.0, 0.0, 1.0)]) + center
    check_in_view(scene, turned, shape)


def test_a_cube_by_hand():
    """Seen from the front, the near face fills the picture: its half is 1 at a distance of 1 / (fill tan)."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    scene = scene_of(corners)
    frame_camera(scene, azimuth=0.0, elevation=0.0, fov=60.0, fill=0.8)
    distance = 1.0 / (0.8 * math.tan(math.radians(30.0)))
    np.testing.assert_allclose(scene.camera.get_pos(), (0.0, -1.0 - distance, 0.0), atol=1e-12)
    assert scene.focus == (0.0, 0.0, 0.0)
    assert math.isclose(scene.lens.for_picture(100, 100).get_vfov(), 60.0)
    assert math.isclose(scene.lens.get_far() - 1.0 - distance, SHADOW_ROOM * math.sqrt(3.0))


def test_the_three_quarter_view_is_from_the_front_right_and_above():
    scene = scene_of(np.eye(3))
    frame_camera(scene)
    x, y, z = scene.camera.get_pos() - np.array(scene.focus)
    assert x > 0.0 > y
    assert z > 0.0
    right = scene.camera.get_net_mat()[0, :3]
    assert abs(right[2]) < 1e-12  # upright


@pytest.mark.parametrize("flat", [(1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
def test_flat_models_and_lines(flat):
    points = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(flat)
    for azimuth, elevation in ((35.0, 20.0), (0.0, 0.0), (0.0, 90.0)):
        scene = scene_of(points.astype(float))
        frame_camera(scene, azimuth=azimuth, elevation=elevation)
        check_in_view(scene, points.astype(float), 4 / 3)


def test_a_point_is_ahead():
    points = np.full((3, 3), 7.0)
    scene = scene_of(points)
    frame_camera(scene)
    check_in_view(scene, points, 1.0)


def test_a_rod_that_points_at_the_eye_keeps_its_distance():
    rod = np.array([(x, y, z) for x in (-1e-3, 1e-3) for y in (-1, 1) for z in (-1e-3, 1e-3)])
    scene = scene_of(rod)
    frame_camera(scene, azimuth=0.0, elevation=0.0)
    _, depth = check_in_view(scene, rod, 1.0)
    assert math.isclose(depth.min(), CLOSEST, rel_tol=1e-4)


def test_hidden_nodes_and_unused_vertices_do_not_count():
    cloud = np.eye(3)
    scene = scene_of(np.concatenate([cloud, [(50.0, 0.0, 0.0)]])[:3])
    stray = GeomNode("stray")
    stray.add_geom(Geom(np.concatenate([cloud, [(0.0, 90.0, 0.0)]]), [(0, 1, 2)]))
    scene.root.attach_new_node(stray)
    hidden = scene.root.attach_new_node(node_of(100.0 * cloud, "hidden"))
    hidden.hide()
    masked = scene.root.attach_new_node(node_of(100.0 * cloud, "masked"))
    masked.hide(scene.camera_node.camera_mask)
    frame_camera(scene)
    only = scene_of(cloud)
    frame_camera(only)
    np.testing.assert_allclose(scene.camera.get_mat(), only.camera.get_mat())


def test_a_part_of_a_scene_below_nodes_that_move_it():
    scene = scene_of(1000.0 * np.eye(3))
    moved = scene.root.attach_new_node("moved")
    moved.set_pos_hpr_scale((5, 6, 7), (10, 20, 30), (2, 2, 2))
    part = moved.attach_new_node(node_of(np.eye(3)))
    camera = moved.attach_new_node("rig").attach_new_node(Camera())
    scene.camera = camera
    frame_camera(scene, part)
    check_in_view(scene, np.eye(3) @ part.get_net_mat()[:3, :3] + part.get_net_mat()[3, :3], 1.5)
    np.testing.assert_allclose(np.linalg.norm(camera.get_net_mat()[:3, :3], axis=1), 1.0)


class Jumping(Scene):
    def update(self, time):
        self.root.find("model").set_pos(time, 0.0, 0.0)


def test_all_times_are_framed():
    points = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
    scene = Jumping()
    scene.root.attach_new_node(node_of(points))
    frame_camera(scene, times=(0.0, 3.0, 9.0))
    check_in_view(scene, np.concatenate([points, points + np.array([9.0, 0.0, 0.0])]), 1.0)


@pytest.mark.parametrize("made", [Scene, lambda: Scene(NodePath(GeomNode("root")))])
def test_nothing_to_frame(made):
    with pytest.raises(SceneError, match="nothing to frame: no visible triangles at or below root"):
        frame_camera(made())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"azimuth": math.inf}, "azimuth must be a number, got inf"),
        ({"elevation": 91}, "elevation must be a number of -90 to 90, got 91"),
        ({"fov": 0}, "fov must be a number of 1 to 120, got 0"),
        ({"fill": 1.1}, r"fill must be a number of 0\.01 to 1, got 1\.1"),
    ],
)
def test_numbers_out_of_range(options, message):
    with pytest.raises(SceneError, match=message):
        frame_camera(scene_of(np.eye(3)), **options)


def test_a_path_outside_the_scene_may_be_framed():
    scene, path = Scene(), NodePath(node_of(np.eye(3)))
    frame_camera(scene, path)
    check_in_view(scene, np.eye(3), 1.0)


@pytest.mark.parametrize("kind", ["points", "lines"])
def test_points_and_lines_are_framed_as_triangles_are(kind):
    corners = np.array([(-1.0, 0.0, 0.0), (2.0, 1.0, 0.0), (0.0, 0.0, 3.0)])
    geom = Geom.points(corners) if kind == "points" else Geom.lines(corners, [(0, 1), (1, 2)])
    scene, node = Scene(), GeomNode("marks")
    node.add_geom(geom)
    scene.root.attach_new_node(node)
    frame_camera(scene)
    check_in_view(scene, corners, 1.0)
