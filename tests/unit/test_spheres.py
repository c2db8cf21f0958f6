"""The scene spheres: what stands where, what moves when, and how bright many lights are together."""

from itertools import pairwise

import numpy as np
import pytest

from firefly_sample.errors import ParameterError
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.report import plan_as_dict
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lights import PointLights
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.scenes.spheres import CIRCLE, EYE, HEIGHTS, RADIUS, REACH, SIDE, light_power
from firefly_sample.settings import Settings

SPHERES = find_scene("firefly_sample.scenes.spheres:scene")


def spheres(**parameters):
    return build_scene(SPHERES, **parameters)


@pytest.fixture(scope="module")
def scene():
    return spheres()


def lights_of(scene, time=0.0):
    node = scene.root.find("lights").node()
    assert isinstance(node, PointLights)
    return node.evaluate(time)


def test_balls_of_320_triangles_stand_on_the_ground_in_sixteen_rows(scene):
    balls = scene.root.find("balls").get_children()
    places = np.array([path.get_pos() for path in balls])
    assert len(np.unique(places[:, :2], axis=0)) == len(balls) == 16 * 16
    for axis in (0, 1):
        assert np.unique(places[:, axis]) == pytest.approx(np.arange(-15.0, 16.0, 2.0))
    assert set(places[:, 2]) == {RADIUS}
    shared = {id(geom) for path in balls for geom, _ in path.node().geoms}
    assert len(shared) == 1
    (geom, _), *_ = balls[0].node().geoms
    assert (len(geom.vertices), len(geom.triangles)) == (162, 320)
    assert np.linalg.norm(geom.vertices, axis=1) == pytest.approx(RADIUS)
    assert geom.normals == pytest.approx(geom.vertices / RADIUS)
    # from outside, corners go counter-clockwise
    a, b, c = geom.vertices[geom.triangles].transpose(1, 0, 2)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a) > 0).all()


def test_the_ground_is_level_whole_and_of_small_triangles(scene):
    node = scene.root.find("ground").node()
    assert isinstance(node, GeomNode)
    ((geom, _),) = node.geoms
    assert set(geom.vertices[:, 2]) == {0.0}
    assert np.abs(geom.vertices[:, :2]).max() == SIDE / 2
    a, b, c = geom.vertices[geom.triangles].transpose(1, 0, 2)
    up = np.cross(b - a, c - a)[:, 2]
    assert (up > 0).all()
    assert 0.5 * up.sum() == SIDE**2
    assert max(np.linalg.norm(b - a, axis=1).max(), np.linalg.norm(c - a, axis=1).max()) < 2.0


def test_the_camera_looks_at_the_origin_45_degrees_up_and_down(scene):
    assert tuple(scene.camera.get_pos()) == EYE
    forward = np.asarray(scene.camera.get_net_transform().get_mat())[1, :3]
    assert forward == pytest.approx(-np.array(EYE) / np.linalg.norm(EYE))
    for size in ((640, 360), (600, 800)):
        plan = build_plan(scene, size=size)
        # z_clip over w_clip is C at the upper edge, where z = y tan(fov / 2)
        assert 1.0 / plan.view.lens.c == pytest.approx(np.tan(np.radians(22.5)))


@pytest.mark.parametrize("count", [0, 1, 100, 3000])
def test_lights_have_their_number_reach_and_heights(count):
    lights = lights_of(spheres(lights=count), 3.0)
    assert len(lights) == count
    assert (lights.radii == REACH).all()
    if count:
        low, high = HEIGHTS
        assert low <= lights.positions[:, 2].min() <= lights.positions[:, 2].max() <= high
        assert np.abs(lights.positions[:, :2]).max() <= SIDE / 2 + CIRCLE


def test_more_lights_leave_the_first_ones_on_their_circles_and_only_dim_them():
    few, many = lights_of(spheres(lights=100), 77.7), lights_of(spheres(lights=5000), 77.7)
    away = few.positions - many.positions[:100]
    assert np.linalg.norm(away[:, :2], axis=1).max() <= 2 * CIRCLE
    assert (away[:, 2] == 0.0).all()
    for time in (0.0, 0.0416):  # before the second step, whose light depends on how many take turns
        few, many = lights_of(spheres(lights=100), time), lights_of(spheres(lights=5000), time)
        assert np.array_equal(few.positions, many.positions[:100])
        scale = light_power(100) / light_power(5000)
        assert few.colors == pytest.approx(scale * many.colors[:100], rel=1e-12)
    other = lights_of(spheres(lights=100, seed=8))
    assert not (other.positions == few.positions).any()


@pytest.mark.parametrize("seed", [7, 8, 2**40])
def test_lights_that_are_added_reach_as_much_as_those_before(seed):
    """Or what one light more costs would be luck: random places are up to 6 % out at such steps."""
    homes = lights_of(spheres(lights=10_000, seed=seed)).positions
    side = np.linspace(-SIDE / 2, SIDE / 2, 65)
    x, y = ((homes[:, axis, None] - side) ** 2 for axis in (0, 1))
    reached = [
        (across[:, None] + along + height**2 < REACH**2).sum()
        for across, along, height in zip(x, y, homes[:, 2], strict=True)
    ]
    for first, end in pairwise((0, 256, 500, 1000, 4000, 10_000)):
        assert np.mean(reached[first:end]) == pytest.approx(np.mean(reached), rel=0.01)


def test_one_light_moves_from_each_frame_to_the_next():
    made = spheres(lights=50)
    frames = [lights_of(made, k / 24).positions for k in range(-60, 140)]
    for k, (one, following) in enumerate(pairwise(frames), -59):
        moved = np.flatnonzero((one != following).any(axis=1))
        assert moved.tolist() == [k % 50]
        assert np.linalg.norm(following[moved] - one[moved]) < 0.14
    assert np.array_equal(lights_of(made, 3 / 24).positions, lights_of(made, 3.9 / 24).positions)
    # a lap is 24 steps of one's own
    assert lights_of(made, 50.0).positions == pytest.approx(frames[60], abs=1e-12)


def test_a_frame_is_a_function_of_time_alone():
    made = spheres(lights=20)
    first = lights_of(made, 2.5).positions.copy()
    lights_of(made, 9.0)
    assert np.array_equal(lights_of(made, 2.5).positions, first)
    assert np.isfinite(lights_of(made, 1e9).positions).all()
    assert np.isfinite(lights_of(made, -1e9).positions).all()


def test_both_parameters_are_live():
    made = spheres(lights=10)
    made.set("lights", 30)
    made.set("seed", 9)
    anew = spheres(lights=30, seed=9)
    assert np.array_equal(lights_of(made, 1.0).positions, lights_of(anew, 1.0).positions)
    with pytest.raises(ParameterError, match="lights must be between 0 and 100000, got 100001"):
        made.set("lights", 100_001)
    with pytest.raises(ParameterError, match="scene 'spheres' has no parameter 'bulbs': it has seed, lights"):
        made.set("bulbs", True)


def test_its_plan_is_the_least_that_lights_need(scene):
    plan = build_plan(scene, Settings(light_method="volumes"))
    assert [step["name"] for step in plan_as_dict(plan)["passes"]] == [
        *("geometry", "ambient", "point_lights", "resolve")
    ]
    assert len(plan.batches) == 2
    dark = build_plan(spheres(lights=0))
    assert "point_lights" not in [step["name"] for step in plan_as_dict(dark)["passes"]]


def test_the_picture_stays_as_bright_however_many_lights_there_are(render):
    """Above 256 lights, and none of it is burnt out."""
    frames = {
        count: render(spheres(lights=count), size=(96, 72), outputs=("color", "radiance"))
        for count in (256, 2000, 10_000)
    }
    means = {count: frame.radiance.mean(axis=(0, 1)) for count, frame in frames.items()}
    assert means[2000] == pytest.approx(means[10_000], rel=0.1)
    assert means[256] == pytest.approx(means[10_000], rel=0.25)
    white = (frames[10_000].color > 245).all(axis=-1)
    assert not white.any()
    # of many colours: neither channel is the least, or the most, everywhere
    lit = frames[10_000].color[40:].reshape(-1, 3)
    assert len(np.unique(lit.argmax(axis=1))) == len(np.unique(lit.argmin(axis=1))) == 3
