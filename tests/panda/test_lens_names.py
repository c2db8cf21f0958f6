"""Lenses of ours and of Panda3D side by side: points, out-parameters, planes at infinity, names."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from panda3d import core

from firefly_sample import Camera, NodePath, Scene
from firefly_sample.errors import NodeError
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from tests.unit.panda_twins import EPS32, float32s

KINDS = {"perspective": PerspectiveLens, "orthographic": OrthographicLens}
kinds = st.sampled_from(sorted(KINDS))
sizes = float32s(0.5, 8)
shifts = float32s(-2, 2)


def both(kind, calls):
    """A lens of ours and one of Panda3D after the same calls."""
    ours = KINDS[kind]()
    theirs = getattr(core, type(ours).__name__)()
    for lens in (ours, theirs):
        for name, *arguments in calls:
            getattr(lens, name)(*arguments)
    return ours, theirs


@st.composite
def pairs(draw):
    """Both lenses, of any kind, film and planes, also endless ones."""
    kind = draw(kinds)
    near, far = draw(float32s(0.5, 2)), draw(float32s(4, 50))
    planes = [(near, far)]
    if kind == "perspective":
        planes += [(near, math.inf), (math.inf, near)]
    calls = [
        ("set_film_size", draw(sizes), draw(sizes)),
        ("set_film_offset", draw(shifts), draw(shifts)),
        ("set_near_far", *draw(st.sampled_from(planes))),
    ]
    return both(kind, calls)


def near_to(expected, rtol=64 * EPS32, atol=64 * EPS32):
    return pytest.approx(np.array(expected), rel=rtol, abs=atol)


points = st.tuples(float32s(-8, 8), float32s(-4, 40).filter(lambda y: abs(y) > 0.25), float32s(-8, 8))


@given(pairs(), points)
def test_project_writes_what_panda3d_writes(twins, point):
    ours, theirs = twins
    seen, mine = core.LPoint3(7), core.LPoint3(7)
    expected = theirs.project(core.LPoint3(*point), seen)
    found = ours.project(point, mine)
    in_front = ours.is_orthographic() or point[1] > 0.0
    largest = max(1.0, abs(seen[0]), abs(seen[1])) if in_front else 1.0
    if in_front:
        assert np.array(mine) == near_to(seen, atol=64 * EPS32 * largest * 10)
    if np.abs(np.abs(np.array(seen)[:2]) - 1.0).min() > 1e-4:  # rounding decides nearer to the edge
        assert found == expected
    flat = core.LPoint2(7)
    assert ours.project(point, flat) == found
    assert tuple(flat) == tuple(mine)[:2]
    assert (ours.project(point) is not None) == found


@given(pairs(), float32s(-1, 1), float32s(-1, 1))
def test_extrude_writes_what_panda3d_writes(twins, x, y):
    ours, theirs = twins
    expected = core.LPoint3(), core.LPoint3()
    found = core.LPoint3(), core.LPoint3()
    assert theirs.extrude(core.LPoint2(x, y), *expected)
    assert ours.extrude(core.LPoint2(x, y), *found) is True
    for mine, wanted in zip(found, expected, strict=True):
        # z = -1 and 1 go through the inverse of a float32 matrix, which has near/far in one entry
        size = np.abs(np.array(wanted)).max()
        assert np.array(mine) == near_to(wanted, rtol=2e-5, atol=2e-5 * size)
    assert np.array_equal(np.array(ours.extrude((x, y)), dtype=np.float32), np.array(found))


@given(pairs(), float32s(-1, 1), float32s(-1, 1), float32s(-1, 0.5))
def test_extrude_depth_and_vec(twins, x, y, z):
    ours, theirs = twins
    if theirs.get_near() > theirs.get_far():
        z = -z
    expected, found = core.LPoint3(), core.LPoint3()
    assert theirs.extrude_depth(core.LPoint3(x, y, z), expected)
    assert ours.extrude_depth((x, y, z), found) is True
    size = np.abs(np.array(expected)).max()
    assert np.array(found) == near_to(expected, rtol=2e-5, atol=2e-5 * size)
    axis, mine = core.LVector3(), core.LVector3()
    assert theirs.extrude_vec(core.LPoint2(x, y), axis)
    assert ours.extrude_vec((x, y), mine) is True
    assert mine == axis
    assert ours.extrude_vec([(x, y)] * 3).shape == (3, 3)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("side", [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1)])
@pytest.mark.parametrize(("factor", "seen"), [(1.0, True), (1.0000005, True), (1.00001, False)])
def test_points_on_the_films_edge(kind, side, factor, seen):
    ours, theirs = both(kind, [("set_film_size", 3.0, 2.0), ("set_near_far", 1.0, 10.0)])
    (x, y, z) = ours.extrude(side)[0]
    point = (float(x) * factor, float(y), float(z) * factor)
    assert theirs.project(core.LPoint3(*point), core.LPoint2()) is seen
    assert ours.project(point, core.LPoint2()) is seen
    assert (ours.project(point) is not None) is seen
    assert bool(np.isfinite(ours.project([point])).all()) is seen


@pytest.mark.parametrize(
    "out", [[7.0, 7.0], np.full(2, 7.0), core.LPoint2(7), core.LPoint2d(7), core.LVecBase2(7)]
)
def test_out_parameters_of_any_kind(out):
    lens = PerspectiveLens(fov=90.0)
    assert lens.project((1, 4, -2), out) is True
    assert list(out) == pytest.approx([0.25, -0.5])
    assert lens.project((1, -4, 2), out) is False
    assert list(out) == [0.0, 0.0]


def test_camel_case_and_third_numbers_as_panda3ds_samples_call_them():
    ours, theirs = both("perspective", [("setFov", 60), ("setNearFar", 1, 100)])
    near, far, other_near, other_far = (core.LPoint3() for _ in range(4))
    assert ours.extrude(core.LPoint3(0.5, 0.25, 9), near, far)
    theirs.extrude(core.LPoint2(0.5, 0.25), other_near, other_far)
    assert np.array(near) == near_to(other_near)
    assert np.array(far) == near_to(other_far, rtol=1e-5)


@pytest.mark.parametrize("reverse", [False, True])
def test_a_near_plane_at_infinity(reverse):
    ours, theirs = both("perspective", [("set_near_far", math.inf, 2.0), ("set_fov", 50.0, 40.0)])
    assert (ours.get_near(), ours.get_far()) == (theirs.get_near(), theirs.get_far()) == (math.inf, 2.0)
    expected = np.array([tuple(row) for row in theirs.get_projection_mat().get_rows()])
    assert ours.get_projection_mat() == pytest.approx(expected, rel=4 * EPS32)
    ordinary = PerspectiveLens(fov=(50.0, 40.0), near=2.0, far=math.inf)
    assert np.array_equal(ours.frustum_planes(), ordinary.frustum_planes())
    assert ours.constants("gl", reverse) == ordinary.constants("gl", not reverse)
    width, height = 640, round(640 * math.tan(math.radians(20)) / math.tan(math.radians(25)))
    drawn = ours.for_picture(width, height)
    assert (drawn.get_near(), drawn.get_far()) == (2.0, math.inf)
    assert drawn.constants() == ordinary.constants()
    assert ours.intrinsics((width, height)) == ordinary.intrinsics((width, height))
    assert ours.get_near() == math.inf


def test_planes_are_set_one_by_one_as_in_panda3d():
    ours, theirs = both("perspective", [("set_near", math.inf), ("set_far", 3.0)])
    assert (ours.get_near(), ours.get_far()) == (theirs.get_near(), theirs.get_far())
    ours.set_near(1.0)
    assert ours.near_first() is ours
    assert (ours.get_near(), ours.get_far()) == (1.0, 3.0)


PAIRS = {
    "set_fov": ("get_fov", (50.0, 30.0)),
    "set_film_size": ("get_film_size", (4.0, 3.0)),
    "set_film_offset": ("get_film_offset", (0.5, -0.25)),
}


@pytest.mark.parametrize("setter", PAIRS)
@pytest.mark.parametrize("kind", [tuple, core.LVecBase2, np.array])
def test_setters_take_a_pair_as_one(setter, kind):
    getter, value = PAIRS[setter]
    ours, theirs = both("perspective", [])
    getattr(ours, setter)(kind(value) if kind is not core.LVecBase2 else core.LVecBase2(*value))
    getattr(theirs, setter)(core.LVecBase2(*value))
    assert getattr(ours, getter)() == pytest.approx(tuple(getattr(theirs, getter)()), rel=1e-6)


def test_a_cameras_lens_is_shared_or_copied_as_in_panda3d():
    scene = Scene()
    camera, other = scene.camera_node, Camera("other")
    lens = PerspectiveLens(fov=50)
    camera.set_lens(lens)
    other.copy_lens(lens)
    lens.set_fov(70)
    assert camera.get_lens() is camera.lens is scene.lens is lens
    assert other.get_lens().get_hfov() == pytest.approx(50)
    assert copy.deepcopy(camera).get_lens() is not lens
    with pytest.raises(NodeError, match="got None"):
        camera.set_lens(None)
    camera.set_camera_mask(2)
    assert camera.camera_mask == camera.get_camera_mask() == 2
    assert NodePath(other).node().get_lens() is other.lens
