"""Views of a moment: texts, an orbit as circles have it, and scenes whose own camera moves."""

from __future__ import annotations

import copy
import json
import math
import pickle
import random

import numpy as np
import pytest

from firefly_sample import Scene, model_scene
from firefly_sample.capture.viewed_scene import ViewedScene
from firefly_sample.capture.views import MOST_VIEWS, OrbitViews, Views, parse_views
from firefly_sample.errors import OutputError
from firefly_sample.plan.exposure import with_exposure_at
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import PointLights
from firefly_sample.settings import Settings
from tests.model.scene_files import add_camera, box_file
from tests.scenes import ball, ball_scene, geom_node

SIZE = (64, 48)
FOCUS = np.array([1.0, 2.0, 0.5])


def tilted_scene(focus=FOCUS, lens=None):
    scene = Scene(focus=None if focus is None else tuple(focus))
    scene.camera.set_pos(3, -8, 2)
    scene.camera.set_hpr(20, -12, 5)
    if lens is not None:
        scene.camera.node().lens = lens
    return scene


def net(scene):
    return scene.camera.get_net_mat()


def about_z(degrees, x, y):
    """The matrix for row vectors of a turn about the vertical line through (x, y), by hand."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn = np.array([[cos, sin, 0, 0], [-sin, cos, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    there, back = np.eye(4), np.eye(4)
    there[3, :2], back[3, :2] = (-x, -y), (x, y)
    return there @ turn @ back


def close(found, expected, atol=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=atol)


@pytest.mark.parametrize("lens", [None, OrthographicLens(film_size=8.0)])
@pytest.mark.parametrize("count", [1, 2, 7, 24])
def test_an_orbit_is_a_circle_around_what_the_camera_looks_at(count, lens):
    scene = tilted_scene(lens=lens)
    first = net(scene)
    distance = (FOCUS - first[3, :3]) @ first[1, :3]
    pivot = first[3, :3] + distance * first[1, :3]
    viewed = ViewedScene(scene, parse_views(f"orbit:{count}"), SIZE)
    for view in range(count):
        viewed.view = view
        viewed.update(0.0)
        matrix = net(viewed)
        close(matrix, first @ about_z(360.0 * view / count, *pivot[:2]))
        eye, forward = matrix[3, :3], matrix[1, :3]
        close(np.linalg.norm(pivot - eye), distance)
        assert eye[2] == first[3, 2]
        close(forward, (pivot - eye) / distance)
        close(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3))
        assert viewed.lens is scene.lens
    viewed.view = 0
    viewed.update(0.0)
    assert net(viewed).tobytes() == first.tobytes() == net(scene).tobytes()


def test_quarters_of_a_turn_are_exact():
    scene = Scene(focus=(0.0, 0.0, 0.0))
    scene.camera.set_pos(0, -10, 0)
    viewed = ViewedScene(scene, OrbitViews(4), SIZE)
    places = []
    for viewed.view in range(4):
        viewed.update(0.0)
        places.append((net(viewed)[3, :3].tolist(), net(viewed)[1, :3].tolist()))
    assert places == [
        ([0, -10, 0], [0, 1, 0]),
        ([10, 0, 0], [-1, 0, 0]),  # counter-clockwise seen from above
        ([0, 10, 0], [0, -1, 0]),
        ([-10, 0, 0], [1, 0, 0]),
    ]


def test_without_a_focus_it_goes_around_the_middle_at_the_start():
    class Rolling(Scene):
        def update(self, time):
            super().update(time)
            self.root.find("ball").set_pos(0, 10.0 + time, 0)

    scene = Rolling()
    scene.root.attach_new_node(geom_node("ball", ball()))
    viewed = ViewedScene(scene, OrbitViews(2), SIZE, start=2.0)
    viewed.view = 1
    for time in (7.0, 2.0, 0.0):
        viewed.update(time)
        close(net(viewed)[3, :3], (0, 24, 0), atol=1e-9)  # the ball was at 12
        assert scene.root.find("ball").get_y() == 10.0 + time


def test_a_scale_above_the_camera_is_no_part_of_an_orbit():
    scene = tilted_scene()
    holder = scene.root.attach_new_node("holder")
    holder.set_scale(1, 2, 1)
    scene.camera.reparent_to(holder)
    viewed = ViewedScene(scene, OrbitViews(2), SIZE)
    viewed.update(0.0)
    assert net(viewed).tobytes() == net(scene).tobytes()
    viewed.view = 1
    viewed.update(0.0)
    close(net(viewed)[:3, :3] @ net(viewed)[:3, :3].T, np.eye(3))
    assert net(viewed)[3, 2] == net(scene)[3, 2]


class Flying(Scene):
    """Its camera hangs below a node that flies on a circle, and nods."""

    updates = 0

    def __init__(self):
        super().__init__(focus=(0.0, 0.0, 1.0))
        self.root.attach_new_node(geom_node("ball", ball()))
        self.carrier = self.root.attach_new_node("carrier")
        self.camera.reparent_to(self.carrier)

    def update(self, time):
        super().update(time)
        self.updates += 1
        self.carrier.set_pos(9 * math.cos(time), 9 * math.sin(time), 2 + time)
        self.carrier.set_h(math.degrees(time) + 90.0)
        self.camera.set_p(-10.0 * time)


def animated_model(folder):
    """A file whose camera slides along its x."""
    file = box_file()
    camera = add_camera(file, "Front", translation=[0.0, 2.0, 10.0])
    times, places = np.array([0, 2], np.float32), np.array([(0, 2, 10), (6, 2, 10)], np.float32)
    sampler = {"input": file.accessor(times), "output": file.accessor(places)}
    channel = {"sampler": 0, "target": {"node": camera, "path": "translation"}}
    file.add("animations", name="slide", samplers=[sampler], channels=[channel])
    path = file.write(folder / "slide.glb")
    return lambda: model_scene(path)


@pytest.mark.parametrize("kind", ["below a node", "a model's"])
def test_a_moving_camera_is_right_for_every_view_and_time_in_any_order(kind, tmp_path):
    make = Flying if kind == "below a node" else animated_model(tmp_path)
    expected = {}
    for time in (0.0, 0.5, 1.0, 1.75):
        fresh = make()
        fresh.update(time)
        first = net(fresh)
        ahead = (np.array(fresh.focus) - first[3, :3]) @ first[1, :3]
        if ahead <= fresh.lens.get_near():  # it is behind the eye
            ahead = math.sqrt(fresh.lens.get_near() * min(fresh.lens.get_far(), 1e3 * fresh.lens.get_near()))
        pivot = first[3, :3] + ahead * first[1, :3]
        for view in range(5):
            expected[time, view] = first @ about_z(72.0 * view, *pivot[:2])
    assert not np.allclose(expected[0.0, 0], expected[1.0, 0])
    scene = make()
    viewed = ViewedScene(scene, OrbitViews(5), SIZE)
    for time, view in random.Random(3).sample(list(expected), len(expected)):
        viewed.view = view
        viewed.update(time)
        close(net(viewed), expected[time, view])
        close(net(scene), expected[time, 0], atol=0)
    scene.update(1.0)
    close(net(scene), expected[1.0, 0], atol=0)


def test_the_scene_is_still_between_the_views_of_a_moment():
    scene = Flying()
    viewed = ViewedScene(scene, OrbitViews(3), SIZE)
    viewed.update(1.0)
    revision = scene.root.node().subtree_revision
    for viewed.view in (1, 2, 0):
        viewed.update(1.0)
    assert (scene.root.node().subtree_revision, scene.updates) == (revision, 1)
    scene.update(2.0)  # by somebody else
    viewed.update(1.0)
    close(net(viewed)[3, :3], (9 * math.cos(1.0), 9 * math.sin(1.0), 3.0))


def test_after_an_update_that_failed_the_next_one_is_whole():
    class Failing(Scene):
        def update(self, time):
            self.camera.set_x(time)
            if self.camera.get_y() < 0:
                raise ValueError("not there")
            self.camera.set_z(time)

    scene = Failing(focus=(0.0, 5.0, 0.0))
    viewed = ViewedScene(scene, OrbitViews(2), SIZE)
    viewed.update(1.0)
    scene.camera.set_y(-1)
    with pytest.raises(ValueError, match="not there"):
        viewed.update(1.0)
    scene.camera.set_y(0)
    viewed.update(1.0)
    close(net(viewed)[3, :3], (1, 0, 1))


def test_the_rest_of_the_scene_is_that_of_the_scene():
    scene = ball_scene()
    scene.background, scene.exposure, scene.camera.node().camera_mask = (0.1, 0.2, 0.3), 2.0, 5
    viewed = ViewedScene(scene, OrbitViews(3), SIZE)
    scene.background, scene.exposure, scene.camera.node().camera_mask = (0.3, 0.2, 0.1), 3.0, 6
    scene.camera.node().lens = PerspectiveLens(vfov=20.0)
    viewed.update(0.0)
    assert (viewed.background, viewed.exposure, viewed.camera_node.camera_mask) == ((0.3, 0.2, 0.1), 3.0, 6)
    assert viewed.root == scene.root == viewed.scene.root
    assert viewed.lens is scene.lens
    assert str(viewed.camera) == str(scene.camera)


def test_automatic_exposure_is_that_of_the_scene():
    def make():
        scene = ball_scene(lights=3)
        scene.root.attach_new_node(PointLights("near", [(0, 8, 1)], (0.1, 0.1, 0.1), 4.0))
        return scene

    auto = Settings(exposure="auto")
    expected = with_exposure_at(make(), auto, 1.0)
    for view in range(3):
        viewed = ViewedScene(make(), OrbitViews(3), SIZE)
        viewed.view = view
        assert with_exposure_at(viewed, auto, 1.0) == expected


def test_views_are_values():
    views = parse_views(" orbit:24 ")
    assert (len(views), views.as_json()) == (24, {"orbit": 24})
    for same in (OrbitViews(24), pickle.loads(pickle.dumps(views)), copy.deepcopy(views), parse_views(views)):
        assert (same, hash(same)) == (views, hash(views))
    assert parse_views(json.loads(json.dumps(views.as_json()))) == views
    assert views != OrbitViews(12)
    assert len(parse_views(f"orbit:{MOST_VIEWS}")) == 100_000
    assert isinstance(parse_views("orbit:1"), Views)


def test_a_view_that_is_not_there():
    viewed = ViewedScene(Scene(), OrbitViews(3), SIZE)
    viewed.view = 3
    with pytest.raises(IndexError):
        viewed.update(0.0)


@pytest.mark.parametrize(
    "text",
    ["orbit:0", "orbit:100001", "orbit:9999999999", "orbit:", "orbit", "orbit:2.5", "orbit:-3", "orbit 8"],
)
def test_wrong_orbits(text):
    with pytest.raises(
        OutputError, match=r"^an orbit has 1 to 100,000 cameras, for example 'orbit:24'"
    ) as caught:
        parse_views(text)
    assert str(caught.value).endswith(f"got {text!r}")


@pytest.mark.parametrize("value", [{"orbit": 0}, {"orbit": True}, {"orbit": "24"}])
def test_wrong_orbits_of_a_manifest(value):
    with pytest.raises(OutputError, match="an orbit has"):
        parse_views(value)


@pytest.mark.parametrize("value", ["", " ", "circle:24", "no/such.json", 24, None, 2.5, b"orbit:24"])
def test_what_is_no_views_at_all(value):
    with pytest.raises(
        OutputError, match=r"^views must be 'orbit:24' .* or the path of a JSON file"
    ) as caught:
        parse_views(value)
    assert f"got {value!r}" in str(caught.value)
