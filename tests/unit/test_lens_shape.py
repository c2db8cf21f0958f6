"""The lens that a picture is drawn with: what stays of it at every shape, and what a lens refuses."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from firefly_sample.errors import LensError
from firefly_sample.pipeline import PASSES, build_plan
from firefly_sample.plan.build import Planner
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.unit.test_lens import ANGLE, SIZE, assert_same_matrix, both, log_floats, tolerance

SIDE = st.integers(1, 4096)
ONE_NUMBER = (
    st.tuples(st.just("set_film_size"), SIZE),
    st.tuples(st.just("set_film_offset"), st.floats(-2, 2), st.floats(-2, 2)),
    st.tuples(st.just("set_near_far"), log_floats(1e-2, 10), log_floats(20, 1e5)),
)
ONE_NUMBER_PERSPECTIVE = (
    *ONE_NUMBER,
    st.tuples(st.just("set_fov"), ANGLE),
    st.tuples(st.just("set_min_fov"), log_floats(5, 90)),
    st.tuples(st.just("set_focal_length"), SIZE),
)


def fov_of(lens: Lens) -> tuple[float, float]:
    k = lens.constants()
    return 2 * math.degrees(math.atan(1 / k.a)), 2 * math.degrees(math.atan(1 / k.c))


def as_show_base_does(kind: str, calls: list[tuple], width: int, height: int) -> None:
    """ShowBase sets the window's aspect ratio on the main camera's lens, whatever was set before."""
    lens, theirs = both(kind, calls)
    theirs.set_aspect_ratio(width / height)
    seen = lens.for_picture(width, height)
    assert_same_matrix(seen, theirs, tolerance(seen, [*calls, ()]))


@given(st.lists(st.one_of(ONE_NUMBER_PERSPECTIVE), max_size=5), SIDE, SIDE)
def test_one_number_of_a_perspective_lens_stays_as_in_panda3d_s_window(calls, width, height):
    as_show_base_does("perspective", calls, width, height)


@given(st.lists(st.one_of(ONE_NUMBER), max_size=5), SIDE, SIDE)
def test_one_number_of_an_orthographic_lens_stays_as_in_panda3d_s_window(calls, width, height):
    as_show_base_does("orthographic", calls, width, height)


def test_one_angle_is_horizontal_at_every_shape():
    """40 degrees in 640x480 leave atan(tan 20 / (4/3)) * 2 = 30.54 degrees of height."""
    for size in ((640, 480), (480, 640), (1920, 804), (7, 5)):
        horizontal, vertical = fov_of(PerspectiveLens(fov=40).for_picture(*size))
        assert horizontal == pytest.approx(40.0, rel=1e-14)
        assert math.tan(math.radians(vertical) / 2) == pytest.approx(
            math.tan(math.radians(20.0)) * size[1] / size[0], rel=1e-14
        )
    assert fov_of(PerspectiveLens(fov=40).for_picture(640, 480))[1] == pytest.approx(30.54, abs=0.005)


@given(ANGLE, SIZE, SIDE, SIDE)
def test_a_vertical_measure_stays_and_pixels_are_square(angle, length, width, height):
    lens = PerspectiveLens(vfov=angle).for_picture(width, height)
    assert lens.get_vfov() == pytest.approx(angle, rel=1e-13)
    assert lens.constants().c / lens.constants().a == pytest.approx(width / height, rel=1e-13)
    flat = OrthographicLens(film_height=length).for_picture(width, height)
    assert flat.get_film_size() == pytest.approx((length * width / height, length), rel=1e-14)


def test_the_default_is_30_degrees_of_the_narrower_side():
    for size in ((640, 480), (480, 640), (64, 64)):
        assert min(fov_of(PerspectiveLens().for_picture(*size))) == pytest.approx(30.0, rel=1e-14)


FIXED = st.one_of(
    st.builds(lambda h, v: PerspectiveLens(fov=(h, v)), ANGLE, ANGLE),
    st.builds(lambda w, h: PerspectiveLens(film_size=(w, h), focal_length=3), SIZE, SIZE),
    st.builds(lambda angle, ratio: PerspectiveLens(fov=angle, aspect_ratio=ratio), ANGLE, SIZE),
    st.builds(lambda angle, ratio: PerspectiveLens(vfov=angle, aspect_ratio=ratio), ANGLE, SIZE),
    st.builds(lambda w, h: OrthographicLens(film_size=(w, h)), SIZE, SIZE),
    st.builds(lambda w, ratio: OrthographicLens(film_size=w, aspect_ratio=ratio), SIZE, SIZE),
    st.builds(
        lambda fx, fy, w, h: PerspectiveLens.from_intrinsics(fx, fy, w / 3, h / 3, w, h),
        *(SIZE, SIZE, SIDE, SIDE),
    ),
)


@given(FIXED, SIDE, SIDE)
def test_a_fixed_shape_is_drawn_exactly_or_refused_with_a_size_that_fits(lens, width, height):
    shape = lens.get_aspect_ratio() / lens.shape.pixel
    rounds = {(width, round(width / shape)), (round(height * shape), height)}
    on_the_edge = min(abs(width / shape % 1 - 0.5), abs(height * shape % 1 - 0.5)) < 1e-6
    assume(not on_the_edge)
    if (width, height) in rounds:
        assert lens.for_picture(width, height) is lens
        return
    with pytest.raises(LensError, match=f"a picture of {width}x{height} has ") as error:
        lens.for_picture(width, height)
    said = re.search(r"aspect ratio at (\S+), but .* has (\S+): draw (\d+)x(\d+), or", str(error.value))
    assert float(said[1]) == pytest.approx(shape, rel=1e-4)
    assert float(said[2]) == pytest.approx(width / height, rel=1e-4)
    assert lens.for_picture(int(said[3]), int(said[4])) is lens


@pytest.mark.parametrize(
    ("lens", "fixed_by"),
    [
        (PerspectiveLens(fov=(60, 40)), "field of view of 60 x 40 degrees fixes .* at 1.5863"),
        (PerspectiveLens(film_size=(36, 24), focal_length=50), "film size of 36 x 24 fixes .* at 1.5,"),
        (PerspectiveLens(fov=60, aspect_ratio=1.5), "aspect ratio of 1.5 fixes .* at 1.5,"),
        (OrthographicLens(film_size=(3, 2)), "film size of 3 x 2 fixes .* at 1.5,"),
        (
            PerspectiveLens.from_intrinsics(500, 480, 300, 200, 600, 400),
            "calibration for pictures of 600x400 fixes .* at 1.5,",
        ),
    ],
)
def test_planning_a_picture_of_another_shape_names_the_camera_and_both_shapes(lens, fixed_by):
    scene = Scene()
    scene.camera.node().lens = lens
    said = rf"^camera \S*camera: its {fixed_by}.* 640x480 has 1.3333: draw 640x4"
    if lens.shape.calibrated:
        with pytest.raises(LensError, match=said):
            build_plan(scene, size=(640, 480))
    else:
        plan = build_plan(scene, size=(640, 480))
        (warning,) = plan.warnings
        assert re.search(said, warning)
        assert plan.view.lens.a == pytest.approx(lens.constants().a, rel=1e-14)
        assert plan.view.lens.c / plan.view.lens.a == pytest.approx(4 / 3, rel=1e-14)
    in_a_window = Planner([kind() for kind in PASSES], window=True)
    for size in ((640, 480), (300, 400)):
        plan = in_a_window.plan(scene, Settings(), size, ("color",), 0.0, Capabilities())
        (warning,) = plan.warnings
        assert re.search(rf"^the camera's {fixed_by.rstrip(',')} and the window has another", warning)
        # as in Panda3D's window, the width stays
        assert plan.view.lens.a == pytest.approx(lens.constants().a, rel=1e-14)
        assert plan.view.lens.c / plan.view.lens.a == pytest.approx(size[0] / size[1], rel=1e-14)
    fitting = in_a_window.plan(
        scene, Settings(), (648, round(648 / lens.shape.picture)), ("color",), 0.0, Capabilities()
    )
    assert fitting.warnings == ()
    assert fitting.view.lens == lens.constants("zero_to_one", True)


def test_a_shape_can_be_left_to_the_picture_again():
    lens = PerspectiveLens(fov=(60, 40))
    lens.set_fov(50)  # as in Panda3D, the aspect ratio stays
    assert lens.shape.fixed_by == "aspect ratio of 1.5863"
    own = lens.get_aspect_ratio()
    lens.set_aspect_ratio(None)
    assert lens.get_aspect_ratio() == own
    assert lens.for_picture(300, 100).get_fov()[0] == pytest.approx(50.0, rel=1e-14)
    assert lens.for_picture(300, 100).get_aspect_ratio() == 3.0


PAIR = (60, 40)
FIELD, FILM, RATIO = "field of view of 60 x 40 degrees", "film size of 60 x 40", "aspect ratio of "


@pytest.mark.parametrize(
    ("lens", "change", "says"),
    [
        (PerspectiveLens(fov=PAIR), ("set_fov", 60), FIELD),
        (PerspectiveLens(fov=PAIR), ("set_film_size", 3), FIELD),
        (PerspectiveLens(fov=PAIR), ("set_near_far", 1, 2), FIELD),
        (PerspectiveLens(fov=PAIR), ("set_film_size", 3, 2), "film size of 3 x 2"),
        (PerspectiveLens(fov=PAIR), ("set_vfov", 40), RATIO),
        (PerspectiveLens(fov=PAIR), ("set_min_fov", 50), RATIO),
        (PerspectiveLens(fov=PAIR, film_size=3), ("set_focal_length", 9), FIELD),
        (PerspectiveLens(fov=PAIR, focal_length=3), ("set_film_size", 9), FIELD),
        (PerspectiveLens(film_size=PAIR), ("set_film_size", 50), RATIO),
        (PerspectiveLens(film_size=PAIR), ("set_focal_length", 50), FILM),
        (PerspectiveLens(film_size=PAIR, focal_length=9), ("set_fov", 50), RATIO),
        (PerspectiveLens(film_size=PAIR, focal_length=9), ("set_fov", 50, 40), "field of view of 50 x 40"),
        (OrthographicLens(film_size=PAIR), ("set_film_size", 60), FILM),
        (OrthographicLens(film_size=PAIR), ("set_film_size", 50), RATIO),
        (OrthographicLens(film_size=PAIR), ("set_film_height", 30), RATIO),
        (OrthographicLens(film_size=PAIR), ("scale_film", 2.0), RATIO),
    ],
)
def test_what_fixes_a_shape_is_said_in_numbers_that_hold(lens, change, says):
    lens = lens.make_copy()
    name, *numbers = change
    getattr(lens, name)(*numbers)
    said = lens.shape.fixed_by
    if says == RATIO:
        says = f"aspect ratio of {lens.get_aspect_ratio():.5g}"
    assert said.startswith(says)
    if (numbers_said := re.search(r"(\S+) x (\S+)", said)) is not None:
        holds = fov_of(lens) if "field" in said else lens.get_film_size()
        assert (float(numbers_said[1]), float(numbers_said[2])) == pytest.approx(holds, rel=1e-5)


@pytest.mark.parametrize("ratio", [1.5e308, 1e-300, 1e30, 5e-308])
def test_the_wildest_aspect_ratio_is_warned_of_like_others(ratio):
    scene = Scene()
    scene.camera.node().lens = PerspectiveLens(vfov=60, aspect_ratio=ratio)
    (warning,) = build_plan(scene, size=(640, 480)).warnings
    assert re.search(r"its aspect ratio of \S+ fixes .* 640x480 has 1.3333: let the picture", warning)


INTRINSICS = st.tuples(
    log_floats(10, 1e4), log_floats(10, 1e4), st.floats(-500, 5000), st.floats(-500, 5000), SIDE, SIDE
)


@given(INTRINSICS, st.sampled_from([0.0, 0.5]), st.floats(-3, 3), log_floats(0.1, 100), st.floats(-3, 3))
def test_intrinsics_put_points_where_opencv_s_formula_does(intrinsics, pixel_center, x, y, z):
    fx, fy, cx, cy, width, height = intrinsics
    lens = PerspectiveLens.from_intrinsics(*intrinsics, pixel_center=pixel_center)
    ndc_x, ndc_y, _ = lens.constants().ndc_from_view((x, y, z))
    # a pixel's centre lies half a pixel from its edges, and that has the image coordinate `pixel_center`
    u = (ndc_x + 1.0) * width / 2.0 - 0.5 + pixel_center
    v = (1.0 - ndc_y) * height / 2.0 - 0.5 + pixel_center
    assert u == pytest.approx(fx * x / y + cx, rel=1e-10, abs=1e-8)
    assert v == pytest.approx(cy - fy * z / y, rel=1e-10, abs=1e-8)


@given(INTRINSICS)
def test_intrinsics_are_panda3d_s_film(intrinsics):
    """With square pixels: a film as large as the picture, as many units away as the focal length."""
    fx, _, cx, cy, width, height = intrinsics
    calls = [
        ("set_film_size", width, height),
        ("set_film_offset", width / 2 - cx, cy - height / 2),
        ("set_focal_length", fx),
    ]
    _, theirs = both("perspective", calls)
    lens = PerspectiveLens.from_intrinsics(fx, fx, cx, cy, width, height, pixel_center=0.5)
    # cancellation in the offsets: Panda3D rounds them to float32
    np.testing.assert_allclose(
        lens.get_projection_mat(), np.array(theirs.get_projection_mat()), rtol=2e-6, atol=1e-6
    )


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((0, 1, 2, 3, 4, 5), "fx must be above 0, got 0"),
        ((1, -1, 2, 3, 4, 5), "fy must be above 0, got -1"),
        ((1, 1, math.nan, 3, 4, 5), "cx must be a finite number, got nan"),
        ((1, 1, 2, 3, 4.5, 5), "width must be a whole number of pixels, got 4.5"),
        ((1, 1, 2, 3, 4, 0), "height must be above 0, got 0"),
        ((1, 1, 2, 3, 4, 5, -1), "near of a perspective lens must be above 0"),
    ],
)
def test_impossible_intrinsics(values, message):
    with pytest.raises(LensError, match=message):
        PerspectiveLens.from_intrinsics(*values)
