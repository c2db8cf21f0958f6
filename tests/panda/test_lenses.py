"""Lenses: the matrix of a lens of ours, in its place, is Panda3D's; the others are refused by name."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from panda3d import core
from panda3d.fx import FisheyeLens

from firefly_sample.errors import LensError
from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.lenses import read_lens
from firefly_sample.model.panda3d.transforms import affine_matrix
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from tests.panda.compare import draw_ours
from tests.panda.lit_cards import lamp_and_lens
from tests.unit.panda_twins import EPS32, float32s

BOUND = 16 * EPS32
"""Of an entry, over the largest one of its column: Panda3D multiplies up to four matrices of float32."""


def converted(theirs):
    """Our lens, its place as a matrix, and what was said of it."""
    losses = Losses()
    ours, placed = read_lens(theirs, "eye", losses)
    return ours, np.eye(4) if placed is None else placed, losses.lines()


def assert_same_projection(theirs, reverse=False):
    """Compare Panda3D's matrix with that of our lens at its place, up to a factor above 0."""
    ours, placed, _ = converted(theirs)
    assert np.allclose(placed[:3, :3] @ placed[:3, :3].T, np.eye(3), rtol=0.0, atol=1e-12)
    assert np.linalg.det(placed) > 0.0
    expected = affine_matrix(theirs.get_projection_mat())
    expected /= np.linalg.norm(expected[:3, 3]) or expected[3, 3]
    found = np.linalg.inv(placed) @ ours.get_projection_mat()
    if reverse:
        found[:, 2] *= -1.0
    assert (np.abs(found - expected) <= BOUND * np.abs(expected).max(axis=0)).all()
    return ours


def called(lens, calls):
    """The lens after calls of its methods: pairs of a name and the arguments."""
    for name, *arguments in calls:
        getattr(lens, name)(*arguments)
    return lens


angles = float32s(5, 150)
sizes = float32s(0.125, 50)
shifts = float32s(-2, 2)
nears = float32s(0.0625, 10)
views = [
    st.just([]),
    st.tuples(st.just("set_view_hpr"), float32s(-180, 180), float32s(-80, 80), float32s(-180, 180)).map(
        lambda call: [call]
    ),
    st.builds(
        lambda x, y, z: [("set_view_mat", core.LMatrix4.translate_mat(x, y, z))],
        float32s(-5, 5),
        float32s(-5, 5),
        float32s(-5, 5),
    ),
    st.just([("set_coordinate_system", core.CS_yup_right)]),
]
placings = st.one_of(views)


@st.composite
def perspectives(draw):
    near = draw(nears)
    calls = [("set_near_far", near, draw(st.one_of(st.just(math.inf), sizes.map(lambda d: near + d))))]
    film = ("set_film_size", draw(sizes), draw(sizes))
    measures = [
        [("set_fov", draw(angles))],
        [("set_fov", draw(angles), draw(angles))],
        [("set_min_fov", draw(angles)), ("set_aspect_ratio", draw(float32s(0.25, 4)))],
        [film, ("set_focal_length", draw(float32s(1, 50)))],
        [("set_fov", draw(angles)), film],
        [],
    ]
    calls += draw(st.sampled_from(measures))
    lens = called(core.PerspectiveLens(), calls + draw(placings))
    if draw(st.booleans()):
        lens.set_film_offset(draw(shifts) * lens.get_film_size()[0], draw(shifts) * lens.get_film_size()[1])
    return lens


@given(perspectives())
def test_perspective_lenses(theirs):
    ours = assert_same_projection(theirs)
    assert isinstance(ours, PerspectiveLens)
    assert ours.get_near() == pytest.approx(theirs.get_near(), rel=1e-5)
    assert ours.get_far() == pytest.approx(theirs.get_far(), rel=1e-3)


@given(sizes, sizes, shifts, shifts, float32s(-50, 50), sizes, placings)
def test_orthographic_lenses(width, height, x, y, near, depth, placing):
    theirs = core.OrthographicLens()
    calls = [
        ("set_film_size", width, height),
        ("set_film_offset", x, y),
        ("set_near_far", near, near + depth),
    ]
    ours = assert_same_projection(called(theirs, calls + placing))
    assert isinstance(ours, OrthographicLens)


scales = float32s(0.25, 4)


@given(scales, scales, shifts, shifts, nears, sizes, st.booleans(), placings)
def test_matrices_of_the_family(a, c, x, y, near, depth, perspective, placing):
    made = (PerspectiveLens if perspective else OrthographicLens)(near=near, far=near + depth)
    matrix = made.get_projection_mat()
    matrix[0, 0], matrix[2, 1] = a, c
    matrix[1 if perspective else 3, :2] = x, y
    theirs = core.MatrixLens()
    theirs.set_user_mat(core.LMatrix4(*matrix.ravel().tolist()))
    ours = assert_same_projection(called(theirs, placing))
    assert ours.is_perspective() == perspective


@pytest.mark.parametrize(
    ("calls", "film", "offset", "measure"),
    [
        ([], (1, 1), (0, 0), ("get_min_fov", 30)),
        ([("set_aspect_ratio", 2)], (1, 0.5), (0, 0), ("get_min_fov", 30)),
        ([("set_fov", 50), ("set_aspect_ratio", 2)], (1, 0.5), (0, 0), ("get_hfov", 50)),
        (
            [("set_film_size", 36, 24), ("set_focal_length", 50), ("set_film_offset", 3, 2)],
            (36, 24),
            (3, 2),
            ("get_focal_length", 50),
        ),
    ],
)
def test_the_numbers_of_a_lens_stay(calls, film, offset, measure):
    ours, placed, said = converted(called(core.PerspectiveLens(), calls))
    assert np.array_equal(placed, np.eye(4))
    assert said == []
    assert ours.get_film_size() == pytest.approx(film, rel=1e-6)
    assert ours.get_film_offset() == pytest.approx(offset, rel=1e-6)
    name, value = measure
    assert getattr(ours, name)() == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize(
    "calls",
    [
        [],
        [("set_fov", 50)],
        [("set_fov", 50, 20)],
        [("set_min_fov", 50)],
        [("set_film_size", 4, 3), ("set_focal_length", 2)],
    ],
)
@pytest.mark.parametrize("ratio", [0.5, 3.0])
def test_a_picture_of_another_shape_keeps_the_same_angle(calls, ratio):
    theirs = called(core.PerspectiveLens(), calls)
    ours, _, _ = converted(theirs)
    theirs.set_aspect_ratio(ratio)
    assert ours.with_aspect_ratio(ratio).get_fov() == pytest.approx(tuple(theirs.get_fov()), rel=1e-5)


def test_only_the_first_aspect_ratio_is_the_pictures():
    ours, _, _ = converted(core.PerspectiveLens())
    assert not ours.shape.fixed_by
    theirs = core.PerspectiveLens()
    theirs.set_aspect_ratio(1.5)
    assert converted(theirs)[0].shape.ratio == 1.5
    assert converted(theirs)[0].shape.fixed_by


@pytest.mark.parametrize("planes", [(math.inf, 2.0), (10.0, 2.0)])
def test_a_near_plane_beyond_the_far_one_changes_places_with_it(planes):
    theirs = core.PerspectiveLens()
    theirs.set_near_far(*planes)
    ours = assert_same_projection(theirs, reverse=True)
    assert (ours.get_near(), ours.get_far()) == (2.0, planes[0])
    assert "near beyond far" in converted(theirs)[2][0]


def matrix_lens(**entries):
    """A MatrixLens with ordinary entries but for some, named like r1c3."""
    matrix = np.array([[2, 0, 0, 0], [0, 0, 1.1, 1], [0, 3, 0, 0], [0, 0, -2, 0]], dtype=float)
    for name, value in entries.items():
        matrix[int(name[1]), int(name[3])] = value
    lens = core.MatrixLens()
    lens.set_user_mat(core.LMatrix4(*matrix.ravel().tolist()))
    return lens


@pytest.mark.parametrize(
    ("theirs", "said"),
    [
        (FisheyeLens(), "a FisheyeLens bends straight lines"),
        (
            called(core.PerspectiveLens(), [("set_near_far", 1, 1)]),
            "nan in row 0, column 0, with near 1 and far 1",
        ),
        (
            called(core.PerspectiveLens(), [("set_near_far", 0, 1)]),
            "near of a perspective lens must be above 0, got 0",
        ),
        (
            called(core.OrthographicLens(), [("set_far", math.inf)]),
            "with near 1 and far inf: set finite numbers",
        ),
        (
            called(core.PerspectiveLens(), [("set_keystone", core.LVecBase2(0.5, 0))]),
            "in row 0, column 2, which no lens has",
        ),
        (
            called(core.PerspectiveLens(), [("set_coordinate_system", core.CS_zup_left)]),
            "mirrors the picture",
        ),
        (matrix_lens(r0c0=-2), "mirrors the picture"),
        (matrix_lens(r0c0=0), "leaves the picture flat"),
        (matrix_lens(r0c1=0.5), "0.5 in row 0, column 1, which no lens has"),
        (matrix_lens(r2c2=0.3), "0.3 in row 2, column 2, which no lens has"),
        (matrix_lens(r1c3=0, r3c3=-1), "-1 in row 3, column 3, so that nothing is in front"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_other_projections_are_refused_by_name(theirs, said):
    with pytest.raises(LensError, match="camera 'eye': .*" + re.escape(said)):
        converted(theirs)


@pytest.mark.parametrize(
    ("kind", "planes", "placing"),
    [
        (
            "perspective",
            (1, math.inf),
            [("lens", "set_view_hpr", 5, 3, 10), ("lens", "set_film_offset", 0.1, -0.2)],
        ),
        (
            "perspective",
            (1, 100),
            [("lens", "set_coordinate_system", core.CS_yup_right), ("camera", "set_p", 90)],
        ),
        (
            "orthographic",
            (-10, 100),
            [("lens", "set_film_offset", 0.5, 0.25), ("lens", "set_view_hpr", 5, 3, 10)],
        ),
        ("matrix", (1, 100), []),
    ],
    ids=["turned", "y-up", "parallel", "matrix"],
)
def test_the_picture_is_panda3ds(by_panda, kind, planes, placing):
    theirs = by_panda(lamp_and_lens, kind, planes, placing)
    ours, _ = draw_ours(lamp_and_lens, kind, planes, placing)
    assert np.abs(theirs.color[..., :3].astype(int) - ours.color.astype(int)).max() <= 1
    assert np.array_equal(theirs.covered, np.isfinite(ours.depth))
