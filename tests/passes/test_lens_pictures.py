"""The angles that pictures are drawn with, measured on a wall that faces the camera.

`position_world` gives the point of the wall in each pixel's centre. The outermost centres lie half a pixel
within the picture's edges, so the edges are (n / (n - 1)) times as far apart.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample import Renderer
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lens_base import Lens
from tests.scenes import wall_scene

DISTANCE = 10.0
ANGLE, LENGTH = st.floats(5.0, 150.0), st.floats(1.0, 10.0)
SIZES = st.sampled_from([(32, 24), (24, 32), (40, 12), (17, 31), (16, 16)])
ONE_NUMBER = st.one_of(
    st.tuples(st.just("set_fov"), ANGLE),
    st.tuples(st.just("set_min_fov"), st.floats(5.0, 90.0)),
    st.tuples(st.just("set_film_size"), LENGTH),
    st.tuples(st.just("set_focal_length"), LENGTH),
)


@pytest.fixture(scope="module")
def renderer():
    with Renderer((16, 16)) as made:
        yield made


def wall_seen_by(renderer: Renderer, lens: Lens, size: tuple[int, int], warned: str = "") -> np.ndarray:
    """X and Z of the wall in each pixel, shape (height, width, 2); `warned` is part of the only warning."""
    scene = wall_scene(DISTANCE, size=2000.0)
    scene.camera.node().lens = lens
    renderer.resize(size)
    frame = renderer.render(scene, outputs=("position_world",))
    assert len(frame.warnings) == bool(warned)
    assert all(warned in warning for warning in frame.warnings)
    return frame.position_world[..., [0, 2]].astype(np.float64)


def sides(wall: np.ndarray) -> tuple[float, float]:
    """Width and height of what is seen of the wall."""
    height, width = wall.shape[:2]
    across, up = wall[0, -1, 0] - wall[0, 0, 0], wall[0, 0, 1] - wall[-1, 0, 1]
    return across * width / (width - 1), up * height / (height - 1)


def angles(wall: np.ndarray) -> list[float]:
    return [2 * math.degrees(math.atan(side / 2 / DISTANCE)) for side in sides(wall)]


@settings(max_examples=25)
@given(st.lists(ONE_NUMBER, max_size=3), SIZES)
def test_pictures_have_the_angles_of_panda3d_s_main_camera(renderer, calls, size):
    lens, theirs = PerspectiveLens(near=0.5, far=100.0), panda.PerspectiveLens()
    for name, value in calls:
        getattr(lens, name)(value)
        getattr(theirs, name)(value)
    theirs.set_aspect_ratio(size[0] / size[1])
    assert angles(wall_seen_by(renderer, lens, size)) == pytest.approx(tuple(theirs.get_fov()), rel=1e-5)


@settings(max_examples=25)
@given(ANGLE, st.booleans(), SIZES)
def test_pictures_have_the_one_angle_that_was_asked_for(renderer, angle, upright, size):
    lens = PerspectiveLens(**{"vfov" if upright else "fov": angle}, near=0.5, far=100.0)
    drawn = angles(wall_seen_by(renderer, lens, size))
    assert drawn[int(upright)] == pytest.approx(angle, rel=1e-5)
    across, up = (math.tan(math.radians(each) / 2) for each in drawn)
    assert across / up == pytest.approx(size[0] / size[1], rel=1e-5)  # square pixels


@settings(max_examples=15)
@given(ANGLE, ANGLE, st.integers(8, 40), st.integers(8, 40))
def test_pictures_have_both_angles_that_were_asked_for_or_a_warning(renderer, h, v, width, height):
    lens = PerspectiveLens(fov=(h, v), near=0.5, far=100.0)
    shape = math.tan(math.radians(h) / 2) / math.tan(math.radians(v) / 2)
    if not lens.shape.fits(width, height):
        said = f"but a picture of {width}x{height} has"
        across, up = angles(wall_seen_by(renderer, lens, (width, height), said))
        assert across == pytest.approx(h, rel=1e-5)
        ratio = math.tan(math.radians(across) / 2) / math.tan(math.radians(up) / 2)
        assert ratio == pytest.approx(width / height, rel=1e-5)
        width, height = (round(24 * shape), 24) if shape > 1 else (24, round(24 / shape))
    assert angles(wall_seen_by(renderer, lens, (width, height))) == pytest.approx((h, v), rel=1e-5)


@settings(max_examples=10)
@given(LENGTH, LENGTH, SIZES)
def test_pictures_have_the_film_of_an_orthographic_lens(renderer, length, offset, size):
    ratio = size[0] / size[1]
    wide = OrthographicLens(film_size=length, film_offset=(offset, -2 * offset), near=0.5, far=100.0)
    wall = wall_seen_by(renderer, wide, size)
    assert sides(wall) == pytest.approx((length, length / ratio), rel=1e-5)
    assert wall.mean(axis=(0, 1)) == pytest.approx((offset, -2 * offset), rel=1e-5)
    high = OrthographicLens(film_height=length, near=0.5, far=100.0)
    assert sides(wall_seen_by(renderer, high, size)) == pytest.approx((length * ratio, length), rel=1e-5)


@settings(max_examples=15)
@given(*[st.floats(10.0, 60.0)] * 2, *[st.floats(-5.0, 40.0)] * 2, SIZES, st.sampled_from([0.0, 0.5]))
def test_each_pixel_sees_what_its_intrinsics_say(renderer, fx, fy, cx, cy, size, pixel_center):
    """Column c and row r have the image coordinates u = c + pixel_center and v = r + pixel_center."""
    lens = PerspectiveLens.from_intrinsics(fx, fy, cx, cy, *size, 0.5, 100.0, pixel_center=pixel_center)
    v, u = np.indices(size[::-1]) + pixel_center
    expected = np.stack([(u - cx) / fx, (cy - v) / fy], axis=-1) * DISTANCE
    bound = 1e-5 * np.abs(expected).max()
    np.testing.assert_allclose(wall_seen_by(renderer, lens, size), expected, rtol=0, atol=bound)
    # the same camera at twice the resolution: each of the pixels before is four, around the same point
    finer = wall_seen_by(renderer, lens, (2 * size[0], 2 * size[1]))
    finer = finer.reshape(size[1], 2, size[0], 2, 2).mean(axis=(1, 3))
    np.testing.assert_allclose(finer, expected, rtol=0, atol=bound)
