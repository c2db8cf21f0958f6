"""Lenses against Panda3D's own, and what they refuse.

Panda3D computes in float32. Setting one measure costs it a handful of roundings, which the cotangent of
half the field of view h amplifies by h / sin(h); eight roundings a setter bound what 20,000 random
sequences showed (at most 4.4).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample.errors import LensError
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lens_base import Lens

HALF_ULP = 2.0**-24


def log_floats(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log(low), math.log(high)).map(math.exp)


ANGLE, SIZE, RATIO = log_floats(5, 150), log_floats(1, 10), log_floats(0.3, 3)
SHAPE_SETTERS = (
    st.tuples(st.just("set_film_size"), SIZE),
    st.tuples(st.just("set_film_size"), SIZE, SIZE),
    st.tuples(st.just("set_aspect_ratio"), RATIO),
    st.tuples(st.just("set_film_offset"), st.floats(-2, 2), st.floats(-2, 2)),
    st.tuples(st.just("set_near_far"), log_floats(1e-2, 10), log_floats(20, 1e5)),
)
PERSPECTIVE_SETTERS = (
    *SHAPE_SETTERS,
    st.tuples(st.just("set_fov"), ANGLE),
    st.tuples(st.just("set_fov"), ANGLE, ANGLE),
    st.tuples(st.just("set_min_fov"), log_floats(5, 90)),
    st.tuples(st.just("set_focal_length"), SIZE),
)


def both(kind: str, calls: list[tuple]) -> tuple[Lens, panda.Lens]:
    """The same calls on a lens of ours and one of Panda3D's."""
    ours = {"perspective": PerspectiveLens, "orthographic": OrthographicLens}[kind]()
    theirs = {"perspective": panda.PerspectiveLens, "orthographic": panda.OrthographicLens}[kind]()
    for name, *values in calls:
        getattr(ours, name)(*values)
        getattr(theirs, name)(*values)
    return ours, theirs


def tolerance(lens: Lens, calls: list[tuple]) -> float:
    amplification = 1.0
    if isinstance(lens, PerspectiveLens):
        amplification = max(h / math.sin(h) for h in map(math.radians, lens.get_fov()))
    return 8 * HALF_ULP * amplification * max(1, len(calls))


def assert_same_matrix(lens: Lens, theirs: panda.Lens, rtol: float) -> None:
    expected, given_mat = np.array(theirs.get_projection_mat()), lens.get_projection_mat()
    assert given_mat.dtype == np.float64
    # An offset of the order of 1 is a quotient that keeps its relative error; the rest likewise.
    np.testing.assert_allclose(given_mat, expected, rtol=rtol, atol=rtol * 1e-3)


@given(st.lists(st.one_of(PERSPECTIVE_SETTERS), min_size=1, max_size=6))
def test_perspective_setters_interplay_as_in_panda3d(calls):
    lens, theirs = both("perspective", calls)
    rtol = tolerance(lens, calls)
    assert_same_matrix(lens, theirs, rtol)
    assert lens.get_film_size() == pytest.approx(tuple(theirs.get_film_size()), rel=rtol)
    assert lens.get_focal_length() == pytest.approx(theirs.get_focal_length(), rel=rtol)
    assert lens.get_aspect_ratio() == pytest.approx(theirs.get_aspect_ratio(), rel=rtol)
    assert lens.get_fov() == pytest.approx(tuple(theirs.get_fov()), rel=rtol)
    assert lens.get_film_offset() == pytest.approx(tuple(theirs.get_film_offset()), rel=HALF_ULP)
    assert lens.revision >= len(calls)


@given(st.lists(st.one_of(SHAPE_SETTERS), min_size=1, max_size=6))
def test_orthographic_setters_as_in_panda3d(calls):
    lens, theirs = both("orthographic", calls)
    rtol = tolerance(lens, calls)
    assert_same_matrix(lens, theirs, rtol)
    assert lens.get_film_size() == pytest.approx(tuple(theirs.get_film_size()), rel=rtol)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_default_lens_is_panda3ds(kind):
    lens, theirs = both(kind, [])
    assert_same_matrix(lens, theirs, tolerance(lens, []))


def test_infinite_far_plane_as_in_panda3d():
    lens, theirs = both("perspective", [("set_fov", 60.0), ("set_near_far", 2.0, math.inf)])
    assert_same_matrix(lens, theirs, 1e-6)
    assert (lens.constants().b, lens.constants().d) == (1.0, -4.0)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
@given(
    points=st.lists(
        st.tuples(st.floats(-5, 5), st.floats(-5, 40).filter(lambda y: abs(y) > 0.1), st.floats(-5, 5)),
        min_size=1,
        max_size=5,
    )
)
def test_project_and_extrude_as_in_panda3d(kind, points):
    calls = [("set_film_size", 6.0, 4.0), ("set_film_offset", 0.5, -0.75), ("set_near_far", 2.0, 20.0)]
    lens, theirs = both(kind, calls)
    many = lens.project(np.array(points))
    assert many.shape == (len(points), 2)
    for point, of_many in zip(points, many, strict=True):
        flat, deep = panda.Point2(), panda.Point3()
        seen = theirs.project(panda.Point3(*point), flat)
        theirs.project(panda.Point3(*point), deep)
        mine = lens.project(point)
        if np.abs(np.abs(flat) - 1.0).min() < 1e-4:
            continue  # float32 may put a point on the film's edge on either side
        assert (mine is not None) == seen
        assert np.array_equal(of_many, (np.nan, np.nan) if mine is None else mine, equal_nan=True)
        if mine is None:
            continue
        assert mine == pytest.approx(tuple(flat), rel=1e-5, abs=1e-6)

        near, far = panda.Point3(), panda.Point3()
        theirs.extrude(panda.Point2(*mine), near, far)
        np.testing.assert_allclose(lens.extrude(mine), (near, far), rtol=1e-5, atol=1e-5)

        back = panda.Point3()
        theirs.extrude_depth(deep, back)
        # Near and far 2 and 20: an error of one float32 step in z_ndc moves y by y*y*step/4.
        assert np.abs(lens.extrude_depth(deep) - np.array(back)).max() <= 1e-5 * max(10.0, point[1] ** 2)


@pytest.mark.parametrize("lens", [PerspectiveLens(), OrthographicLens()])
def test_near_and_far_do_not_hide_a_point_from_project(lens):
    lens.set_near_far(2.0, 10.0)
    assert lens.project((0, 1, 0)) == (0.0, 0.0)
    assert lens.project((0, 11, 0)) == (0.0, 0.0)


def test_points_behind_the_eye_are_seen_by_parallel_rays_only():
    assert PerspectiveLens().project((0, -5, 0)) is None
    assert PerspectiveLens().project((0, 0, 0)) is None
    assert OrthographicLens().project((0, -5, 0)) == (0.0, 0.0)


def test_extrude_takes_many_points():
    lens = PerspectiveLens(fov=90.0, near=1.0, far=3.0)
    near, far = lens.extrude([[0.0, 0.0], [1.0, -1.0]])
    np.testing.assert_allclose(near, [[0, 1, 0], [1, 1, -1]], atol=1e-15)
    np.testing.assert_allclose(far, [[0, 3, 0], [3, 3, -3]], atol=1e-15)


LENSES = [
    PerspectiveLens(fov=(39.32, 30), near=50, far=500),
    PerspectiveLens(film_size=(36, 24), focal_length=20, film_offset=(9, -30), near=1, far=math.inf),
    OrthographicLens(film_size=(6, 4), film_offset=(5, 1), near=-3, far=8),
]


@pytest.mark.parametrize("lens", LENSES)
def test_frustum_planes_hold_exactly_what_the_matrix_keeps(lens):
    planes = lens.frustum_planes()
    assert planes.shape == (6 if math.isfinite(lens.get_far()) else 5, 4)
    np.testing.assert_allclose(np.linalg.norm(planes[:, :3], axis=1), 1.0, rtol=1e-15)
    rng = np.random.Generator(np.random.PCG64(5))
    # Points around the volume: inside, outside and behind the eye.
    ndc = rng.uniform(-1.6, 1.6, (2, 20_000))
    points = lens.constants().view_from_distance(*ndc, rng.uniform(0.2, 600.0, 20_000))
    points[::3] = rng.uniform(-60, 60, (len(points[::3]), 3))
    homogeneous = np.column_stack((points, np.ones(len(points))))
    clip = homogeneous @ lens.get_projection_mat()
    inside = (np.abs(clip[:, :3]) <= clip[:, 3:]).all(axis=1)
    assert 0 < inside.sum() < len(points)
    assert np.array_equal(inside, (homogeneous @ planes.T >= 0.0).all(axis=1))


@pytest.mark.parametrize("lens", LENSES)
def test_with_aspect_ratio_is_a_copy_that_was_set(lens):
    before, wide, by_setter = lens.get_projection_mat(), lens.with_aspect_ratio(2.5), lens.make_copy()
    by_setter.set_aspect_ratio(2.5)
    np.testing.assert_array_equal(wide.get_projection_mat(), by_setter.get_projection_mat())
    np.testing.assert_array_equal(lens.get_projection_mat(), before)


def test_copies_are_independent():
    lens = PerspectiveLens(fov=60.0)
    copy = lens.make_copy()
    copy.set_fov(20.0)
    assert lens.get_hfov() == pytest.approx(60.0)


SETTERS = [
    (PerspectiveLens, "set_fov", (40.0, 30.0)),
    (PerspectiveLens, "set_min_fov", (40.0,)),
    (PerspectiveLens, "set_vfov", (40.0,)),
    (OrthographicLens, "set_film_height", (40.0,)),
    (OrthographicLens, "scale_film", (2.0,)),
    (PerspectiveLens, "set_focal_length", (2.0,)),
    *[
        (kind, name, values)
        for kind in (PerspectiveLens, OrthographicLens)
        for name, values in (
            ("set_film_size", (3.0, 2.0)),
            ("set_aspect_ratio", (2.0,)),
            ("set_film_offset", (0.1, 0.2)),
            ("set_near_far", (2.0, 3.0)),
            ("set_near", (2.0,)),
            ("set_far", (3.0,)),
        )
    ],
]


@pytest.mark.parametrize(("kind", "name", "values"), SETTERS)
def test_every_setter_raises_the_revision_and_changes_the_matrix(kind, name, values):
    lens = kind(film_offset=(0.0, 0.5))
    revision, before = lens.revision, lens.get_projection_mat()
    getattr(lens, name)(*values)
    assert lens.revision > revision
    assert not np.array_equal(before, lens.get_projection_mat())


BAD_CALLS = [
    ("set_fov", (0,), "0 and below 180 degrees, got 0:"),
    ("set_fov", (180,), "got 180: for parallel rays use an OrthographicLens"),
    ("set_fov", (-10,), "got -10"),
    ("set_fov", (math.nan,), "got nan"),
    ("set_fov", (60, 200), "vertical field of view must be above 0 and below 180 degrees, got 200"),
    ("set_fov", ("wide",), "must be a number, got 'wide'"),
    ("set_min_fov", (180,), "got 180"),
    ("set_min_fov", (30, 0), "above 0 and below 180 degrees, got 0"),
    ("set_min_fov", (30, 1e-310), "too extreme for float64"),
    ("set_vfov", (0,), "vertical field of view must be above 0 and below 180 degrees, got 0"),
    ("set_vfov", (5e-324,), "too extreme for float64"),
    ("set_fov", (1e-310,), "too extreme for float64"),
    ("set_fov", (5e-324,), "too extreme for float64"),
    ("set_fov", (5e-324, 30), "too extreme for float64"),
    ("set_film_size", (0,), "film width must be above 0, got 0"),
    ("set_film_size", (1, -2), "film height must be above 0, got -2"),
    ("set_film_size", (math.inf,), "film width must be a finite number, got inf"),
    ("set_focal_length", (0,), "focal length must be above 0, got 0"),
    ("set_aspect_ratio", (0,), "aspect ratio must be above 0, got 0"),
    ("set_film_offset", (0, math.nan), "film offset y must be a finite number, got nan"),
    ("set_near_far", (0, 10), "near of a perspective lens must be above 0, got 0"),
    ("set_near_far", (10, 10), "far must be beyond near, got near 10 and far 10"),
    ("set_near_far", (1, math.nan), "far must be beyond near, got near 1 and far nan"),
    ("set_near_far", (math.inf, math.inf), "near must be a finite number, got inf"),
    ("set_near", (2e5,), r"near 200000 and far 100000: set both at once with set_near_far\(near, far\)"),
    ("set_far", (0.5,), "near 1 and far 0.5: set both at once"),
]


@pytest.mark.parametrize(("name", "values", "message"), BAD_CALLS)
def test_a_refused_value_is_named_and_changes_nothing(name, values, message):
    lens = PerspectiveLens()
    before, revision = lens.get_projection_mat(), lens.revision
    with pytest.raises(LensError, match=message) as error:
        getattr(lens, name)(*values)
    assert "\n" not in str(error.value)
    assert np.array_equal(lens.get_projection_mat(), before)
    assert lens.revision == revision


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: OrthographicLens(far=math.inf), "far inf: give a finite far"),
        (lambda: OrthographicLens(near=-1e308, far=1e308), "give a finite far"),
        (lambda: OrthographicLens(film_size=1e-310), "too extreme for float64"),
        (lambda: OrthographicLens(film_size=(1, 2), aspect_ratio=2), "film_size and aspect_ratio each fix"),
        (lambda: PerspectiveLens(fov=(40, 30), aspect_ratio=2), "fov and aspect_ratio each fix"),
        (lambda: PerspectiveLens(fov=(40, 30), film_size=(2, 1)), "film_size and fov each fix"),
        (lambda: PerspectiveLens(fov=40, film_size=2, focal_length=1), "any two of the three"),
        (
            lambda: PerspectiveLens(vfov=40, film_size=2, focal_length=1),
            "vfov, film_size and focal_length fix",
        ),
        (lambda: PerspectiveLens(fov=40, vfov=30), "fov and vfov set the same thing: give one of them"),
        (
            lambda: OrthographicLens(film_size=4, film_height=3),
            "film_size and film_height set the same thing",
        ),
        (lambda: OrthographicLens(film_height=0), "film height must be above 0, got 0"),
        (lambda: OrthographicLens(film_height=1e308, aspect_ratio=1e9), "too extreme for float64"),
        (lambda: PerspectiveLens(fov=(40, 30, 20)), r"fov must be two numbers, got \(40, 30, 20\)"),
        (lambda: PerspectiveLens(film_offset=3), "film_offset must be two numbers, got 3"),
        (
            lambda: PerspectiveLens(film_size=1e-10, film_offset=(1e300, 0)).constants(),
            "film of .* too extreme for float64",
        ),
        (
            lambda: PerspectiveLens().constants(clip="d3d"),
            "clip must be one of 'gl', 'zero_to_one'; got 'd3d'",
        ),
        (lambda: PerspectiveLens().extrude((0, 0), [0, 0, 0]), "give both near and far, or neither"),
        (lambda: PerspectiveLens().project((0, 1, 0), (0, 0)), r"an array or a list, got \(0, 0\)"),
        (
            lambda: PerspectiveLens().project([(0, 1, 0)] * 2, [0, 0]),
            r"one point at a time .* shape \(2, 3\)",
        ),
        (lambda: PerspectiveLens().set_film_offset(1), "film offset must be two numbers, got 1"),
        (
            lambda: PerspectiveLens().set_film_size((1, 2, 3)),
            r"film size must be two numbers, got \(1, 2, 3\)",
        ),
        (lambda: PerspectiveLens().set_near_far(math.inf, -1), "near of a perspective lens must be above 0"),
        (lambda: OrthographicLens().set_near_far(math.inf, 1), "near must be a finite number, got inf"),
        (lambda: PerspectiveLens().project((1, 2)), r"shape \(3,\) or \(..., 3\), got \(2,\)"),
        (lambda: PerspectiveLens().extrude(1.0), r"shape \(2,\) or \(..., 2\), got \(\)"),
    ],
)
def test_impossible_lenses_and_points(make, message):
    with pytest.raises(LensError, match=message):
        make()


def test_constructor_says_what_the_setters_say():
    by_setters = PerspectiveLens()
    by_setters.set_film_size(36, 24)
    by_setters.set_focal_length(50)
    by_setters.set_film_offset(3, 4)
    by_setters.set_near_far(1, 10)
    at_once = PerspectiveLens(film_size=(36, 24), focal_length=50, film_offset=(3, 4), near=1, far=10)
    assert np.array_equal(by_setters.get_projection_mat(), at_once.get_projection_mat())
    assert PerspectiveLens(fov=60, film_size=36).get_focal_length() == pytest.approx(
        18 / math.tan(math.pi / 6)
    )
    assert PerspectiveLens(fov=60, focal_length=2).get_film_size()[0] == pytest.approx(
        4 * math.tan(math.pi / 6)
    )
    assert PerspectiveLens(aspect_ratio=2.0).get_vfov() == pytest.approx(30.0)
    assert PerspectiveLens(aspect_ratio=0.5).get_min_fov() == PerspectiveLens(aspect_ratio=0.5).get_hfov()


@given(across=ANGLE, up=ANGLE, ratio=RATIO)
def test_two_least_angles_are_in_view_and_one_of_them_fills_the_picture(across, up, ratio):
    lens = PerspectiveLens()
    lens.set_min_fov(across, up)
    seen = lens.with_aspect_ratio(ratio).get_fov()
    larger = sorted(seen[side] / least for side, least in enumerate((across, up)))
    assert larger[0] == pytest.approx(1.0, rel=1e-12)
    assert larger[1] >= 1.0 - 1e-12


@given(angle=ANGLE, ratio=RATIO)
def test_one_least_angle_is_two_equal_ones(angle, ratio):
    one, two = PerspectiveLens(), PerspectiveLens()
    two.set_min_fov(20, 70)
    one.set_min_fov(angle)
    two.set_min_fov(angle, angle)
    matrices = [lens.with_aspect_ratio(ratio).get_projection_mat() for lens in (one, two)]
    assert np.array_equal(*matrices)
