"""Interpolation of keys against closed forms; clamping and looping."""

from __future__ import annotations

import copy
import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.model.animated import named_clips
from firefly_sample.model.animation import Clip, slerp, unit_quats, wrapped
from firefly_sample.model.data import AnimationData, ChannelData
from firefly_sample.model.root import ModelRoot

FINITE = st.floats(-100.0, 100.0)
TIMES = st.lists(st.integers(0, 400), min_size=1, max_size=6, unique=True).map(
    lambda given: np.array(sorted(given)) / 16.0
)


def channel(times, values, interpolation="LINEAR", path="translation", node=0):
    return ChannelData(node, path, np.array(times, dtype=float), np.array(values, dtype=float), interpolation)


def value_at(made, time):
    """The value of an animation that is one channel."""
    (value,) = Clip(AnimationData("a", [made])).evaluate(time)
    return np.array(value)


def about(axis, degrees):
    half = math.radians(degrees) / 2.0
    return (math.cos(half), *(math.sin(half) * np.array(axis)))


@st.composite
def vectors_over_time(draw, width=3):
    times = draw(TIMES)
    rows = [[draw(FINITE) for _ in range(width)] for _ in times]
    return times, np.array(rows)


# --- Vectors ---


@given(keys=vectors_over_time(), time=st.floats(0.0, 30.0))
def test_linear_vectors_are_those_of_numpys_interp_and_clamped(keys, time):
    times, values = keys
    # a second key track that lasts longer, so that the first is asked beyond its last key
    long = channel([0.0, 64.0], [[0.0] * 3, [1.0] * 3], node=1)
    clip = Clip(AnimationData("a", [channel(times, values), long]))
    found = dict(zip(clip.targets, clip.evaluate(time), strict=True))
    expected = [np.interp(time, times, column) for column in values.T]
    np.testing.assert_allclose(found[0, "translation"], expected, rtol=0, atol=1e-11)


@given(keys=vectors_over_time(), time=st.floats(0.0, 30.0))
def test_step_is_the_last_key_that_has_come(keys, time):
    times, values = keys
    long = channel([0.0, 64.0], [[0.0] * 3, [1.0] * 3], node=1)
    clip = Clip(AnimationData("a", [channel(times, values, "STEP"), long]))
    found = dict(zip(clip.targets, clip.evaluate(time), strict=True))
    come = [row for key, row in zip(times, values, strict=True) if key <= time]
    assert found[0, "translation"] == (come[-1] if come else values[0]).tolist()


@given(
    times=st.lists(st.integers(0, 40), min_size=2, max_size=5, unique=True).map(sorted),
    factors=st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4),
    share=st.floats(0.0, 1.0),
)
def test_a_cubic_spline_with_the_slopes_of_a_cubic_is_that_cubic(times, factors, share):
    curve = np.polynomial.Polynomial(factors)
    slope = curve.deriv()
    rows = [[[slope(t)] * 3, [curve(t)] * 3, [slope(t)] * 3] for t in times]
    time = times[0] + share * (times[-1] - times[0]) * 0.999
    found = value_at(channel(times, rows, "CUBICSPLINE"), time)
    assert found == pytest.approx([curve(time)] * 3, rel=1e-9, abs=1e-9)


def test_a_cubic_spline_uses_the_out_tangent_before_and_the_in_tangent_after():
    # glTF 2.0, appendix C, by hand: t = 1/2 of 2 seconds; v = (v0 + v1) / 2 + 2 (b0 - a1) / 8
    rows = [[[7.0] * 3, [1.0] * 3, [8.0] * 3], [[4.0] * 3, [5.0] * 3, [9.0] * 3]]
    assert value_at(channel([0.0, 2.0], rows, "CUBICSPLINE"), 1.0).tolist() == [4.0] * 3


@pytest.mark.parametrize("interpolation", ["STEP", "LINEAR", "CUBICSPLINE"])
def test_at_a_key_the_value_is_the_keys(interpolation):
    values = np.array([[0.1, 0.2, 0.3], [1e9, -5.0, 1e-9], [0.7, 0.7, 0.7], [3.0, 2.0, 1.0]])
    rows = np.repeat(values[:, None], 3, axis=1) if interpolation == "CUBICSPLINE" else values
    times = [0.1, 0.3, 0.7, 1.1]
    for time, value in zip(times[:-1], values, strict=False):
        assert value_at(channel(times, rows, interpolation), time).tolist() == value.tolist()


# --- Rotations ---


@given(start=st.floats(-360.0, 360.0), turn=st.floats(-179.0, 179.0), share=st.floats(0.0, 0.999))
def test_a_rotation_about_one_axis_turns_evenly(start, turn, share):
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    keys = [about(axis, start), about(axis, start + turn)]
    found = value_at(channel([0.0, 1.0], keys, path="rotation"), share)
    expected = np.array(about(axis, start + share * turn))
    assert min(abs(found - expected).max(), abs(found + expected).max()) < 1e-13


def exact_slerp(start, end, share):
    """Slerp by glTF's formula, in 60 digits."""
    with mpmath.workdps(60):
        a, b = ([mpmath.mpf(float(x)) for x in row] for row in (start, end))
        a, b = ([x / mpmath.sqrt(sum(y * y for y in row)) for x in row] for row in (a, b))
        dot = sum(x * y for x, y in zip(a, b, strict=True))
        angle = mpmath.acos(min(abs(dot), mpmath.mpf(1)))
        sign = -1 if dot < 0 else 1
        t = mpmath.mpf(float(share))
        if angle == 0:
            return np.array([float(x) for x in a])
        first, second = mpmath.sin(angle * (1 - t)), sign * mpmath.sin(angle * t)
        return np.array(
            [float((first * x + second * y) / mpmath.sin(angle)) for x, y in zip(a, b, strict=True)]
        )


QUATS = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1)


@given(start=QUATS, end=QUATS, share=st.floats(0.0, 1.0))
def test_slerp_is_that_of_the_specification(start, end, share):
    a, b = unit_quats(np.array([start, end]))
    found = slerp(a[None], b[None], np.array([[share]]))[0]
    if abs(a @ b) > 1e-12:  # else both arcs are as short
        np.testing.assert_allclose(found, exact_slerp(a, b, share), rtol=0, atol=4e-15)
    assert np.linalg.norm(found) == pytest.approx(1.0, abs=4e-16)


@pytest.mark.parametrize("apart", [0.0, *(10.0**-power for power in range(1, 18))])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_nearly_equal_and_opposite_quaternions_lose_no_digit(apart, sign):
    start = np.array([0.5, 0.5, -0.5, 0.5])
    side = np.array([0.5, -0.5, 0.5, 0.5])
    end = sign * (math.cos(apart) * start + math.sin(apart) * side)
    for share in (0.0, 0.25, 0.5, 0.9, 1.0):
        found = slerp(start[None], end[None], np.array([[share]]))[0]
        np.testing.assert_allclose(found, exact_slerp(start, end, share), rtol=0, atol=4e-16)


def test_a_quarter_turn_apart_in_four_dimensions_is_a_half_turn():
    found = slerp(np.array([[1.0, 0, 0, 0]]), np.array([[0, 0, 0, 1.0]]), np.array([[0.5]]))[0]
    np.testing.assert_allclose(found, about((0, 0, 1), 90.0), rtol=0, atol=2e-16)


@given(start=QUATS, end=QUATS, tangents=st.tuples(QUATS, QUATS), share=st.floats(0.0, 0.999))
def test_cubic_rotations_are_the_spline_normalised(start, end, tangents, share):
    rows = [[[9.0] * 4, start, tangents[0]], [tangents[1], end, [9.0] * 4]]
    found = value_at(channel([1.0, 3.0], rows, "CUBICSPLINE", "rotation"), 1.0 + 2.0 * share)
    t = (1.0 + 2.0 * share - 1.0) / 2.0
    spline = (
        (2 * t**3 - 3 * t**2 + 1) * np.array(start)
        + 2.0 * (t**3 - 2 * t**2 + t) * np.array(tangents[0])
        + (3 * t**2 - 2 * t**3) * np.array(end)
        + 2.0 * (t**3 - t**2) * np.array(tangents[1])
    )
    if np.linalg.norm(spline) > 1e-3:
        np.testing.assert_allclose(found, spline / np.linalg.norm(spline), rtol=0, atol=1e-11)
    assert np.linalg.norm(found) == pytest.approx(1.0, abs=4e-16)


@pytest.mark.parametrize("interpolation", ["STEP", "LINEAR"])
def test_rotations_that_are_not_of_length_1_are_made_so(interpolation):
    keys = [(2e-200, 0.0, 0.0, 0.0), (0.0, 0.0, 3.0, 4.0), (0.0, 0.0, 0.0, 0.0)]
    made = channel([0.0, 1.0, 2.0], keys, interpolation, "rotation")
    assert value_at(made, 0.0).tolist() == [1.0, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(value_at(made, 1.0), [0.0, 0.0, 0.6, 0.8], rtol=0, atol=2e-16)
    assert np.linalg.norm(value_at(made, 1.75)) == pytest.approx(1.0, abs=4e-16)


# --- Time ---


@given(keys=vectors_over_time(), time=st.integers(-4000, 4000), rounds=st.integers(-50, 50))
def test_an_animation_loops_backwards_too(keys, time, rounds):
    times, values = keys
    clip = Clip(AnimationData("a", [channel(times, values)]))
    assert clip.duration == times[-1]
    seconds = time / 32.0  # all sums are exact
    assert clip.evaluate(seconds) == clip.evaluate(seconds + rounds * clip.duration)


@given(st.floats(-1e9, 1e9), st.floats(1e-3, 1e3))
def test_wrapped_time_is_within_the_duration(time, duration):
    assert 0.0 <= wrapped(time, duration) < duration


def test_a_tiny_negative_time_is_no_time():
    assert -1e-300 % 2.0 == 2.0  # Python rounds so
    assert wrapped(-1e-300, 2.0) == 0.0


def test_the_duration_is_the_largest_last_key_and_others_wait():
    short = channel([0.5, 1.0], [[1.0] * 3, [3.0] * 3])
    long = channel([0.0, 4.0], [[0.0] * 3, [4.0] * 3], node=1)
    clip = Clip(AnimationData("a", [short, long]))
    assert (clip.duration, set(clip.targets)) == (4.0, {(0, "translation"), (1, "translation")})
    for time, expected in {0.0: 1.0, 0.5: 1.0, 0.75: 2.0, 1.0: 3.0, 3.0: 3.0, 4.25: 1.0, -3.25: 2.0}.items():
        assert dict(zip(clip.targets, clip.evaluate(time), strict=True))[0, "translation"] == [expected] * 3


@pytest.mark.parametrize("interpolation", ["STEP", "LINEAR", "CUBICSPLINE"])
@pytest.mark.parametrize("key", [0.0, 2.5])
def test_a_single_key_is_a_constant(interpolation, key):
    values = (
        [[[9.0] * 3, [1.0, 2.0, 3.0], [9.0] * 3]] if interpolation == "CUBICSPLINE" else [[1.0, 2.0, 3.0]]
    )
    for time in (-7.0, 0.0, 1.0, 2.5, 1e12):
        assert value_at(channel([key], values, interpolation), time).tolist() == [1.0, 2.0, 3.0]


def test_an_animation_without_keys_has_no_targets():
    clip = Clip(AnimationData("a", [channel([], np.zeros((0, 3)))]))
    assert (clip.targets, clip.duration, clip.evaluate(3.0)) == ((), 0.0, [])


def test_channels_of_all_kinds_are_evaluated_together_as_one_by_one():
    rng = np.random.default_rng(3)
    made = []
    for node in range(40):
        for path, width in {
            "translation": 3,
            "rotation": 4,
            "scale": 3,
            "morph_weights": 1 + node % 3,
        }.items():
            kind = ("STEP", "LINEAR", "CUBICSPLINE")[int(rng.integers(3))]
            times = np.sort(rng.uniform(0.0, 9.0, int(rng.integers(1, 9))))
            shape = (len(times), 3, width) if kind == "CUBICSPLINE" else (len(times), width)
            made.append(channel(times, rng.normal(size=shape), kind, path, node))
    made.append(channel([0.0, 10.0], [[0.0] * 3, [0.0] * 3], node=99))
    clip = Clip(AnimationData("a", made))
    for time in (0.0, 2.5, 7.75, -3.0):
        together = dict(zip(clip.targets, clip.evaluate(time), strict=True))
        for one in made[:-1]:
            alone = Clip(AnimationData("a", [one, made[-1]]))
            value = dict(zip(alone.targets, alone.evaluate(time), strict=True))[one.node, one.path]
            assert together[one.node, one.path] == value


def test_no_value_is_minus_zero():
    value = value_at(channel([0.0, 1.0], [[-0.0] * 3, [-0.0] * 3]), 0.5)
    assert not np.signbit(value).any()


def test_copies_share_a_clip():
    clip = Clip(AnimationData("a", []))
    assert copy.copy(clip) is copy.deepcopy(clip) is clip


# --- Names ---


def test_animations_without_names_and_with_equal_ones_get_their_own():
    made = [AnimationData(name, []) for name in ("", "walk", "walk", "walk#2", "", "walk")]
    clips = named_clips(made)
    assert list(clips) == ["animation 0", "walk", "walk#3", "walk#2", "animation 4", "walk#4"]
    assert [clip.name for clip in clips.values()] == list(clips)


def test_an_animation_may_be_called_all():
    root = ModelRoot("m")
    root.bind_pose(None, named_clips([AnimationData("one", []), AnimationData("all", [])]))
    root.play("all")
    assert root.playing == "all"
