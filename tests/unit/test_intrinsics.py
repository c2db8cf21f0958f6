"""Intrinsics by hand, there and back for both kinds of lens, and what a dict of them may not say."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.errors import LensError
from firefly_sample.scene.intrinsics import Intrinsics
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens, lens_from_intrinsics
from tests.unit.test_lens import log_floats
from tests.unit.test_lens_roundtrip import orthographic_lenses, perspective_lenses

U = 2.0**-53
FULL_FRAME = PerspectiveLens(
    film_size=(36, 24), focal_length=50, film_offset=(3, -1.2), near=0.1, far=math.inf
)


@pytest.mark.parametrize(
    ("lens", "size", "fx", "fy", "cx", "cy"),
    [
        # tan 45 degrees is 1: the focal length is half the width
        (PerspectiveLens(fov=90), (640, 480), 320, 320, 319.5, 239.5),
        (PerspectiveLens(vfov=90), (640, 480), 240, 240, 319.5, 239.5),
        (PerspectiveLens(fov=90), (3, 5), 1.5, 1.5, 1, 2),
        # 720 pixels for 36 mm are 20 a millimetre; the film's centre is 3 right and 1.2 below the axis
        (FULL_FRAME, (720, 480), 1000, 1000, 360 - 60 - 0.5, 240 - 24 - 0.5),
        # 16 pixels a unit; the centre is half a unit to the right and a quarter up
        (OrthographicLens(4, film_offset=(0.5, 0.25)), (64, 48), 16, 16, 32 - 8 - 0.5, 24 + 4 - 0.5),
        (OrthographicLens((4, 6)), (4, 6), 1, 1, 1.5, 2.5),
    ],
)
def test_intrinsics_by_hand(lens, size, fx, fy, cx, cy):
    found = lens.intrinsics(size)
    np.testing.assert_allclose(found.matrix(), [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], rtol=4 * U)
    assert (found.near, found.far) == (lens.get_near(), lens.get_far())
    assert (found.size, found.is_perspective()) == (size, lens.is_perspective())
    corner = lens.intrinsics(size, pixel_center=0.5)
    assert (corner.cx, corner.cy, corner.pixel_center) == pytest.approx((cx + 0.5, cy + 0.5, 0.5), rel=4 * U)
    if lens.is_orthographic():
        assert found.film_size == pytest.approx(lens.for_picture(*size).get_film_size(), rel=4 * U)
        assert found.film_offset == pytest.approx(lens.get_film_offset(), rel=4 * U)
    else:
        assert found.film_size is found.film_offset is None


def test_a_picture_of_another_shape_is_as_it_is_drawn():
    """With two angles the horizontal one stays; a calibrated lens refuses."""
    assert PerspectiveLens(fov=(90, 40)).intrinsics((640, 480)) == PerspectiveLens(fov=90).intrinsics(
        (640, 480)
    )
    calibrated = PerspectiveLens.from_intrinsics(500, 500, 320, 240, 640, 480)
    with pytest.raises(LensError, match=r"calibration for pictures of 640x480 fixes .* 100x100 has 1: draw"):
        calibrated.intrinsics((100, 100))
    assert calibrated.intrinsics((320, 240)).fx == 250
    for size, says in (
        (8, "size must be two numbers"),
        ((8, 0), "height must be above 0"),
        ((8.5, 8), "width"),
    ):
        with pytest.raises(LensError, match=says):
            PerspectiveLens().intrinsics(size)


INTRINSICS = st.builds(
    Intrinsics,
    *(st.sampled_from(["perspective", "orthographic"]), st.integers(1, 4096), st.integers(1, 4096)),
    *(log_floats(1e-3, 1e4), log_floats(1e-3, 1e4), st.floats(-500, 5000), st.floats(-500, 5000)),
    *(log_floats(1e-3, 10), log_floats(20, 1e5), st.sampled_from([0.0, 0.5])),
)


def assert_same(one: Intrinsics, other: Intrinsics) -> None:
    """A few roundings of the focal length, and of the largest number behind the principal point."""
    assert (one.fx, one.fy) == pytest.approx((other.fx, other.fy), rel=8 * U)
    assert one.cx == pytest.approx(other.cx, rel=0, abs=8 * U * (one.width + abs(one.cx)))
    assert one.cy == pytest.approx(other.cy, rel=0, abs=8 * U * (one.height + abs(one.cy)))
    for name in ("projection", "size", "near", "far", "pixel_center"):
        assert getattr(one, name) == getattr(other, name)


@settings(max_examples=40)
@given(INTRINSICS)
def test_from_intrinsics_to_a_lens_and_back(intrinsics):
    lens = lens_from_intrinsics(intrinsics)
    assert lens.is_perspective() == intrinsics.is_perspective()
    assert_same(lens.intrinsics(intrinsics.size, intrinsics.pixel_center), intrinsics)
    half = lens.intrinsics((2 * intrinsics.width, 2 * intrinsics.height))
    assert half.fx == pytest.approx(2 * intrinsics.fx, rel=8 * U)


@settings(max_examples=40)
@given(
    st.one_of(perspective_lenses(), orthographic_lenses()), st.integers(1, 4096), st.sampled_from([0.0, 0.5])
)
def test_from_a_lens_to_intrinsics_and_back(lens, width, pixel_center):
    size = (width, max(1, round(width / lens.get_aspect_ratio())))
    if size[1] > 1e9:
        return
    drawn = lens.with_aspect_ratio(size[0] / size[1])
    back = lens_from_intrinsics(drawn.intrinsics(size, pixel_center)).constants()
    k = drawn.constants()
    assert (back.a, back.c) == pytest.approx((k.a, k.c), rel=12 * U)
    assert (back.x_offset, back.z_offset) == pytest.approx(
        (k.x_offset, k.z_offset), rel=0, abs=16 * U * (1 + max(abs(k.x_offset), abs(k.z_offset)))
    )
    assert (back.b, back.d) == (k.b, k.d)


@settings(max_examples=40)
@given(INTRINSICS)
def test_a_dict_and_json_lose_nothing(intrinsics):
    assert Intrinsics.from_dict(json.loads(json.dumps(intrinsics.as_dict()))) == intrinsics


def test_the_dict_of_an_infinite_far_plane_and_of_parallel_rays():
    written = FULL_FRAME.intrinsics((720, 480)).as_dict()
    assert " ".join(written) == "projection width height fx fy cx cy pixel_center near far"
    assert written["far"] is None
    assert Intrinsics.from_dict(written).far == math.inf
    flat = OrthographicLens(4, film_offset=(0.5, 0.25), near=-1, far=1).intrinsics((64, 48)).as_dict()
    assert (flat["film_size"], flat["film_offset"]) == ([4, 3], [0.5, 0.25])
    without = {
        key: value for key, value in flat.items() if key not in ("film_size", "film_offset", "pixel_center")
    }
    assert Intrinsics.from_dict(without).as_dict() == flat


@settings(max_examples=40)
@given(INTRINSICS, st.integers(0, 2**32 - 1))
def test_points_come_back_to_the_pixels_that_they_are_seen_in(intrinsics, seed):
    small = Intrinsics(**{**vars(intrinsics), "width": 4, "height": 3})
    depth = np.random.default_rng(seed).uniform(0.1, 100.0, (3, 4)) * np.where(np.arange(4) == 2, np.inf, 1)
    points = small.view_points(depth)
    assert points.shape == (3, 4, 3)
    assert np.isnan(points[:, 2]).all()
    u, v, distance = small.project(points)
    seen = np.arange(4) != 2
    rows, columns = np.mgrid[:3, :4] + small.pixel_center
    bound = 8 * U * (4 + abs(small.cx) + abs(small.cy))
    np.testing.assert_allclose(u[:, seen], columns[:, seen], rtol=0, atol=bound)
    np.testing.assert_allclose(v[:, seen], rows[:, seen], rtol=0, atol=bound)
    np.testing.assert_array_equal(distance[:, seen], depth[:, seen])


def test_a_point_behind_the_eye_has_no_pixel_unless_rays_are_parallel():
    pinhole = Intrinsics("perspective", 4, 4, 2, 2, 1.5, 1.5, 1, 2)
    u, v, distance = pinhole.project([[0, -1, 0], [0, 0, 0], [1, 1, 1]])
    np.testing.assert_array_equal(u, [np.nan, np.nan, 3.5])
    np.testing.assert_array_equal(v, [np.nan, np.nan, -0.5])
    np.testing.assert_array_equal(distance, [-1, 0, 1])
    assert OrthographicLens(4).intrinsics((4, 4)).project((1, -1, 1)) == (2.5, 0.5, -1)


GOOD = PerspectiveLens(fov=90).intrinsics((64, 48)).as_dict()
FLAT = OrthographicLens(4).intrinsics((64, 48)).as_dict()


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({**GOOD, "focal": 3}, "intrinsics have no key 'focal'"),
        ({**GOOD, "heigth": 3}, r"no key 'heigth' \(did you mean 'height'\?\)"),
        ({k: v for k, v in GOOD.items() if k not in ("fx", "far")}, "intrinsics lack 'fx', 'far'"),
        ({**GOOD, "projection": "ortographic"}, r"projection must be .* \(did you mean 'orthographic'\?\)"),
        ({**GOOD, "projection": None}, "projection must be 'perspective' or 'orthographic', got None"),
        ({**GOOD, "width": 64.5}, "width must be a whole number of pixels, got 64.5"),
        ({**GOOD, "height": "48"}, "height must be a number, got '48'"),
        ({**GOOD, "fx": 0}, "fx must be above 0, got 0"),
        ({**GOOD, "fy": True}, "fy must be a number, got True"),
        ({**GOOD, "cx": math.nan}, "cx must be a finite number, got nan"),
        ({**GOOD, "pixel_center": [0]}, r"pixel_center must be a number, got \[0\]"),
        ({**GOOD, "near": None}, "near must be a number, got None"),
        ({**GOOD, "near": -1}, "near of a perspective lens must be above 0"),
        ({**GOOD, "far": 0.5}, "far must be beyond near"),
        ({**FLAT, "far": None}, "both must be finite; got near 1 and far inf"),
        ({**GOOD, "film_size": [4, 3]}, "film_size belongs to orthographic intrinsics"),
        ({**FLAT, "film_size": [4, 3.1]}, r"film_size contradicts fx, .* make it 4, 3: got \[4, 3.1\]"),
        ({**FLAT, "film_offset": [0]}, r"film_offset contradicts"),
        ({**FLAT, "film_offset": "x"}, "film_offset must be two numbers"),
        ([1], r"intrinsics must be a dict, got \[1\]"),
    ],
)
def test_a_wrong_key_is_named(values, says):
    with pytest.raises(LensError, match=says):
        Intrinsics.from_dict(values)


def test_a_depth_image_of_another_size_is_refused():
    with pytest.raises(LensError, match=r"depth must have shape \(48, 64\), .* got \(64, 48\)"):
        Intrinsics.from_dict(GOOD).view_points(np.zeros((64, 48)))
    with pytest.raises(LensError, match=r"points must have shape \(\.\.\., 3\), got \(2,\)"):
        Intrinsics.from_dict(GOOD).project([1, 2])
