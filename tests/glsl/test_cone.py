"""Spotlight cones against float64, from a hundredth of a degree to the whole sphere."""

import numpy as np
import pytest

from firefly_sample.lab.reference.shading import cone_strength, opening
from tests.glsl.harness import evaluate

EPS = float(np.finfo(np.float32).eps)
ANGLES = (0.01, 0.1, 1.0, 20.0, 53.0, 60.0, 89.9, 90.0, 120.0, 179.0, 180.0)


def vec4(*values):
    return f"vec4({', '.join(repr(float(value)) for value in values)})"


def one_minus_cos(degrees):
    return 2.0 * np.sin(np.radians(degrees) / 2.0) ** 2


def directions_around(axis, widest, n, rng):
    """Unit vectors up to an angle in degrees from an axis."""
    angle = np.radians(widest) * np.sqrt(rng.uniform(0, 1, n))
    side = np.cross(axis, rng.normal(size=(n, 3)))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    return np.cos(angle)[:, None] * axis + np.sin(angle)[:, None] * side


@pytest.mark.parametrize("outer", ANGLES)
@pytest.mark.parametrize("exponent", [0.0, 50.0])
def test_the_edge_is_where_it_should_be(device, outer, exponent):
    rng = np.random.default_rng(7)
    axis = np.array([0.36, 0.48, 0.8])
    inner = outer * 2 / 3
    to_surface = directions_around(axis, min(1.5 * outer, 180.0), 20000, rng)
    inputs = np.zeros((len(to_surface), 4), dtype=np.float32)
    inputs[:, :3] = -to_surface
    low, high = one_minus_cos(inner), one_minus_cos(outer)
    body = f"result.r = cone_strength(a.xyz, {vec4(*axis, high)}, {vec4(1 / (high - low), exponent, 0, 0)});"
    result = evaluate(device, ["cone"], body, inputs, {"SPECULAR_MODEL": 0})[:, 0]
    exact_axis = np.array(axis, dtype=np.float32).astype(np.float64)
    opened = opening(inputs[:, :3].astype(np.float64), exact_axis)
    expected = cone_strength(opened, low, high, exponent)
    # a smooth step's slope is at most 1.5 over its width; the sine of the angle errs by an eps,
    # and so does the length of a vector that is taken for a unit vector
    sine = np.sin(np.radians(min(outer, 90.0)))
    bound = 1e-6 + 1.5 * EPS * (sine + high) / (high - low) + 2 * EPS * np.sqrt(exponent)
    assert np.abs(result - expected).max() <= bound
    if outer < 90:
        assert bound <= {0.01: 1e-2, 0.1: 1e-3, 1.0: 1e-4}.get(outer, 1e-4)


@pytest.mark.parametrize("half", ANGLES[:-1])
def test_a_hard_cone_is_one_inside_and_nothing_outside(device, half):
    rng = np.random.default_rng(8)
    axis = np.array([0.36, 0.48, 0.8])
    to_surface = directions_around(axis, min(1.5 * half, 180.0), 20000, rng)
    inputs = np.zeros((len(to_surface), 4), dtype=np.float32)
    inputs[:, :3] = -to_surface
    high = one_minus_cos(half)
    body = f"result.r = cone_strength(a.xyz, {vec4(*axis, high)}, vec4(0.0));"
    result = evaluate(device, ["cone"], body, inputs, {"SPECULAR_MODEL": 0})[:, 0]
    angle = np.degrees(2 * np.arcsin(np.sqrt(opening(inputs[:, :3].astype(np.float64), axis) / 2)))
    clear = np.abs(angle - half) > 2e-5
    assert np.array_equal(result[clear], (angle[clear] < half).astype(np.float32))
    assert clear.mean() > 0.99


def test_the_opening_is_one_minus_the_cosine():
    axis = np.array([0.0, 1.0, 0.0])
    for degrees in (0.0, 1e-6, 0.01, 30.0, 90.0, 150.0, 180.0):
        angle = np.radians(degrees)
        to_light = -np.array([np.sin(angle), np.cos(angle), 0.0])
        assert opening(to_light, axis) == pytest.approx(one_minus_cos(degrees), rel=1e-9, abs=1e-30)


def test_a_smooth_step_is_flat_at_both_ends():
    low, high, step = 0.1, 0.3, 1e-7
    for at in (low, high):
        values = cone_strength(np.array([at - step, at, at + step]), low, high, 0.0)
        assert np.abs(np.diff(values)).max() / step < 1e-4
    assert cone_strength(np.array(0.2), low, high, 0.0) == pytest.approx(0.5)
