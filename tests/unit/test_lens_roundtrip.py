"""A lens there and back in float64, its constants against 60 digits, and the law of the depth buffer's error.

With u = 2**-53, one rounding. Under perspective depth = E/y - w (E = y_fold, w = w_fold), and |E| >= near.
The forward pass rounds E/y and the difference, the way back rounds depth + w and the quotient; both use the
same E and w. To first order dy/y <= u * (4 + |depth| * y / |E|): the error law of docs/unprojection.md.
"""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.errors import LensError
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lens_constants import LensConstants

U = 2.0**-53
CONVENTIONS = [(clip, reverse) for clip in ("gl", "zero_to_one") for reverse in (False, True)]
conventions = pytest.mark.parametrize(("clip", "reverse"), CONVENTIONS)


def log_floats(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log(low), math.log(high)).map(math.exp)


ANGLE = st.one_of(log_floats(1e-3, 90), log_floats(1e-3, 90).map(lambda angle: 180.0 - angle))
NDC = st.tuples(st.floats(-1, 1), st.floats(-1, 1))


@st.composite
def perspective_lenses(draw) -> PerspectiveLens:
    near = draw(log_floats(1e-6, 1e6))
    far = near * draw(st.one_of(st.just(math.inf), log_floats(1.01, 1e12)))
    offset = draw(st.tuples(st.floats(-3, 3), st.floats(-3, 3)))
    return PerspectiveLens((draw(ANGLE), draw(ANGLE)), near=near, far=far, film_offset=offset)


@st.composite
def orthographic_lenses(draw) -> OrthographicLens:
    near = draw(st.floats(-1e6, 1e6))
    far = near + draw(log_floats(1e-3, 1e9))
    size = draw(st.tuples(log_floats(1e-3, 1e6), log_floats(1e-3, 1e6)))
    offset = draw(st.tuples(st.floats(-3, 3), st.floats(-3, 3)))
    return OrthographicLens(size, near=near, far=far, film_offset=offset)


def sideways_bound(k: LensConstants, point: np.ndarray, ndc: np.ndarray, y_error: float) -> np.ndarray:
    """What x and z may lose: the error of y, six roundings, the offset's cancellation, underflow."""
    w = point[1] if k.perspective else 1.0
    relative = y_error / abs(point[1]) if k.perspective else 0.0
    scales = np.array([k.a, k.c])
    offsets = np.abs([k.x_offset, k.z_offset])
    return np.abs(point[[0, 2]]) * (relative + 6 * U) + w / scales * 3 * U * (np.abs(ndc) + offsets) + 1e-300


@conventions
@given(perspective_lenses(), NDC, st.floats(0, 1))
def test_perspective_there_and_back(clip, reverse, lens, ndc, share):
    k = lens.constants(clip, reverse)
    far = min(lens.get_far(), 1e9 * lens.get_near())
    y = lens.get_near() * (far / lens.get_near()) ** share
    point = k.view_from_distance(*ndc, y)
    forward = k.ndc_from_view(point)
    depth = forward[2]
    slack = 4 * U * max(1.0, abs(k.w_fold))
    assert -slack <= depth <= 1 + slack
    back = k.view_from_depth(*forward)
    y_bound = U * y * (4 + abs(depth) * y / abs(k.y_fold))
    assert abs(back[1] - y) <= y_bound
    assert (np.abs(back - point)[[0, 2]] <= sideways_bound(k, point, forward[:2], y_bound)).all()


@conventions
@given(orthographic_lenses(), NDC, st.floats(0, 1))
def test_orthographic_there_and_back(clip, reverse, lens, ndc, share):
    k = lens.constants(clip, reverse)
    near, far = lens.get_near(), lens.get_far()
    y = near + share * (far - near)
    point = k.view_from_distance(*ndc, y)
    forward = k.ndc_from_view(point)
    back = k.view_from_depth(*forward)
    y_bound = U * (4 * abs(y) + (far - near))
    assert abs(back[1] - y) <= y_bound
    assert (np.abs(back - point)[[0, 2]] <= sideways_bound(k, point, forward[:2], y_bound)).all()


@conventions
@given(st.one_of(perspective_lenses(), orthographic_lenses()), NDC, st.floats(0.01, 0.99))
def test_the_matrix_and_the_constants_are_one_projection(clip, reverse, lens, ndc, share):
    k = lens.constants(clip, reverse)
    near, far = lens.get_near(), min(lens.get_far(), 1e3 * abs(lens.get_near()) + lens.get_near())
    point = k.view_from_distance(*ndc, near + share * (max(far, near + 1e-3) - near))
    clip_space = np.append(point, 1.0) @ lens.get_projection_mat(clip, reverse)
    from_matrix = clip_space / clip_space[3]
    from_matrix[2] = k.depth_scale * from_matrix[2] + k.depth_offset
    assert (k.depth_scale, k.depth_offset) == ((0.5, 0.5) if clip == "gl" else (1.0, 0.0))
    scale = 1.0 + abs(k.b) + abs(k.d) / abs(clip_space[3]) + abs(k.b * point[1] / clip_space[3])
    offsets = 1.0 + abs(k.x_offset) + abs(k.z_offset)
    np.testing.assert_allclose(k.ndc_from_view(point)[:2], from_matrix[:2], rtol=8 * U, atol=8 * U * offsets)
    np.testing.assert_allclose(k.ndc_from_view(point)[2], from_matrix[2], rtol=0, atol=8 * U * scale)


@conventions
@pytest.mark.parametrize(
    "lens",
    [
        PerspectiveLens((39.32, 30), near=50, far=500, film_offset=(0.2, -0.1)),
        PerspectiveLens(60, near=0.1, far=math.inf),
        OrthographicLens((20, 15), near=-5, far=10, film_offset=(3, 4)),
    ],
)
def test_planes_meet_the_ends_of_the_depth_buffer(clip, reverse, lens):
    k = lens.constants(clip, reverse)
    ends = (1.0, 0.0) if reverse else (0.0, 1.0)
    got = k.depth_from_distance([lens.get_near(), lens.get_far()])
    np.testing.assert_allclose(got, ends, rtol=0, atol=4 * U)
    np.testing.assert_allclose(
        k.distance_from_depth(ends), [lens.get_near(), lens.get_far()], rtol=1e-14, atol=1e-14
    )


@given(log_floats(1e-6, 1e6), log_floats(1e-30, 1.0))
def test_reversed_infinite_far_is_near_over_depth_exactly(near, depth):
    k = PerspectiveLens(near=near, far=math.inf).constants("zero_to_one", reverse=True)
    assert (k.b, k.d, k.y_fold, k.w_fold) == (0.0, near, near, 0.0)
    assert float(k.distance_from_depth(depth)) == near / depth


@pytest.mark.parametrize(("clip", "reverse"), CONVENTIONS)
def test_depth_at_an_infinite_far_plane_is_infinitely_far(clip, reverse):
    k = PerspectiveLens(far=math.inf).constants(clip, reverse)
    assert k.distance_from_depth(0.0 if reverse else 1.0) == math.inf
    point = k.view_from_depth(0.5, -0.5, 0.0 if reverse else 1.0)
    assert np.array_equal(point, [math.inf, math.inf, -math.inf])


def exact(lens, clip: str, reverse: bool) -> dict[str, mpmath.mpf]:
    """The constants in 60 digits, from the textbook matrix of the clip range."""
    n, f = mpmath.mpf(lens.get_near()), mpmath.mpf(lens.get_far())
    s, o = (mpmath.mpf(1) / 2, mpmath.mpf(1) / 2) if clip == "gl" else (mpmath.mpf(1), mpmath.mpf(0))
    at_near, at_far = ((1, 0) if reverse else (0, 1)) if clip != "gl" else ((1, -1) if reverse else (-1, 1))
    if lens.is_perspective():
        # B + D/y runs from at_near to at_far.
        d = (at_near - at_far) / (1 / n - (0 if mpmath.isinf(f) else 1 / f))
        b = at_near - d / n
        return {"b": b, "d": d, "y_fold": s * d, "w_fold": -o - s * b}
    b = (at_far - at_near) / (f - n)
    d = at_near - b * n
    return {"b": b, "d": d, "y_fold": 1 / (s * b), "w_fold": -o - s * d}


@conventions
@given(st.one_of(perspective_lenses(), orthographic_lenses()))
def test_depth_constants_against_sixty_digits(clip, reverse, lens):
    k = lens.constants(clip, reverse)
    with mpmath.workdps(60):
        for name, value in exact(lens, clip, reverse).items():
            # Three roundings make each of them and none cancels; 1e-50 is the sixty digits' own.
            assert abs(getattr(k, name) - value) <= 4 * U * abs(value) + mpmath.mpf("1e-50"), name


@given(ANGLE, ANGLE)
def test_scales_against_sixty_digits_from_a_thousandth_to_179_999_degrees(h, v):
    lens = PerspectiveLens((h, v))
    k = lens.constants()
    with mpmath.workdps(60):
        for value, angle, roundings in ((k.a, h, 6), (k.c, v, 16)):
            true = mpmath.cot(mpmath.radians(mpmath.mpf(angle)) / 2)
            assert abs(value - true) <= roundings * U * true
    assert lens.get_fov() == pytest.approx((h, v), rel=1e-14)


def test_the_shifted_numerator_keeps_digits_that_the_subtraction_loses():
    k = PerspectiveLens(near=1.0, far=1e12).constants("gl", reverse=True)
    true = 1.0 / (1e12 - 1.0)
    assert abs(k.w_fold - true) <= 2 * U * true
    assert abs((-0.5 - 0.5 * k.b) - true) > 1e-5 * true


@given(log_floats(1e-3, 1e3), log_floats(1.1, 1e6), st.floats(0, 1))
def test_error_law_of_a_24_bit_buffer(near, ratio, share):
    """dy/y = d_depth * y * (f - n) / (f n), with half a step of 2**-24 for d_depth."""
    lens = PerspectiveLens(near=near, far=near * ratio)
    k = lens.constants()
    y = near * ratio**share
    steps = 2.0**24 - 1
    stored = np.round(k.depth_from_distance(y) * steps) / steps
    law = (0.5 / steps) * y / abs(k.y_fold)
    # The law is its first order; law/(1 - law) is all orders.
    if law < 0.5:
        assert abs(k.distance_from_depth(stored) / y - 1) <= law / (1 - law) + 1e-14 * (1 + y / near)


@given(log_floats(1e-3, 1e3), st.one_of(st.just(math.inf), log_floats(1.1, 1e9)), st.floats(0, 1))
def test_error_law_of_a_reversed_float_buffer(near, ratio, share):
    """Half a float32 step of the depth is all that is ever lost, however far the far plane."""
    k = PerspectiveLens(near=near, far=near * ratio).constants("zero_to_one", reverse=True)
    y = near * min(ratio, 1e9) ** share
    stored = np.float64(np.float32(k.depth_from_distance(y)))
    assert abs(k.distance_from_depth(stored) / y - 1) <= 2.0**-24 * (1 + 1e-6)


@given(log_floats(1e-2, 1e2), log_floats(1.1, 1e4), ANGLE, ANGLE, st.booleans())
def test_short_form_is_the_general_form(near, ratio, h, v, reverse):
    k = PerspectiveLens((h, v), near=near, far=near * ratio).constants("gl", reverse)
    p = k.unprojection()
    assert p.y_proj == pytest.approx(0.5 * k.d, rel=4 * U)
    assert p.w_proj == pytest.approx(-0.5 - 0.5 * k.b, rel=4 * U, abs=4 * U)
    assert p.x_proj * k.a == pytest.approx(p.y_proj, rel=4 * U)
    assert p.z_proj * k.c == pytest.approx(p.y_proj, rel=4 * U)
    depth = k.depth_from_distance(near * math.sqrt(ratio))
    short = np.array([0.3 * p.x_proj, p.y_proj, -0.7 * p.z_proj]) / (depth + p.w_proj)
    np.testing.assert_allclose(short, k.view_from_depth(0.3, -0.7, depth), rtol=8 * U)


@pytest.mark.parametrize(
    ("constants", "reason"),
    [
        (OrthographicLens().constants(), "an orthographic lens"),
        (PerspectiveLens(film_offset=(0.1, 0)).constants(), "a film offset"),
        (PerspectiveLens().constants("zero_to_one"), 'clip "zero_to_one"'),
    ],
)
def test_short_form_says_where_it_does_not_reach(constants, reason):
    with pytest.raises(LensError, match=f"not defined for {reason}: use the general form"):
        constants.unprojection()


@pytest.mark.parametrize("lens", [PerspectiveLens(far=math.inf), OrthographicLens()])
def test_arrays_broadcast(lens):
    k = lens.constants("zero_to_one", reverse=True)
    x, y = np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 3))
    depth = np.full((3, 5), 0.25)
    points = k.view_from_depth(x, y, depth)
    assert points.shape == (3, 5, 3)
    assert points.dtype == np.float64
    assert np.array_equal(points, k.view_from_depth(x, y, 0.25))
    np.testing.assert_allclose(k.ndc_from_view(points), np.stack((x, y, depth), axis=-1), atol=1e-14)


@pytest.mark.parametrize("degrees", [1e-3, 179.999])
def test_rays_at_extreme_fields_of_view(degrees):
    """Point 4 of the extremes: NDC within 1e-7, rays within 1e-6; float64 has nine digits to spare."""
    lens = PerspectiveLens((degrees, degrees), near=1, far=math.inf)
    k = lens.constants("zero_to_one", reverse=True)
    ndc = np.linspace(-1, 1, 41)
    points = k.view_from_distance(ndc, ndc[::-1], 3.0)
    with mpmath.workdps(60):
        slope = float(mpmath.tan(mpmath.radians(mpmath.mpf(degrees)) / 2))
    np.testing.assert_allclose(points[:, 0], ndc * slope * 3.0, rtol=1e-15)
    np.testing.assert_allclose(k.ndc_from_view(points)[:, 0], ndc, rtol=1e-15)
