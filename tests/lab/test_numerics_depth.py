"""The accuracy of depth buffers and stored distances, against theory."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firefly_sample.lab.experiments import TABLES
from firefly_sample.lab.experiments import depth as depth_tables
from firefly_sample.lab.experiments.experiment import EPS
from firefly_sample.lab.probe import WIDTH
from firefly_sample.plan.position_error import HALF_FLOAT_END
from firefly_sample.scene.lens import PerspectiveLens
from tests.lab.bounds import holds_its_bounds


@pytest.fixture(scope="module")
def depth(bench):
    return TABLES["depth"].table(bench, samples=40_000)


def test_depth_has_the_error_of_the_law(depth):
    assert holds_its_bounds(depth)
    for name in (
        "depth24",
        "depth24, not folded",
        "standard, D32F",
        "standard, D32F, not folded",
        "reversed in -1..1, D32F",
        "reversed in 0..1, D24",
    ):
        for ratio in ("10", "1e3"):
            # the law adds up the worst of each rounding
            assert depth.value(name, ratio) > depth.value(name, f"{ratio} bound") / 7.0


def test_sixteen_bits_have_an_error_of_half_a_step_where_the_last_depths_lie(depth):
    """Nothing else matters beside a step of 1/65535, at whichever side a driver rounds."""
    for name in ("10", "1e3"):
        error = (depth_tables.RATIOS[name] - 1.0) / 65535  # times y/|E|, at y = f
        found = depth.value("depth16", name)
        assert 0.45 * error <= found <= 1.01 * error / (1.0 - error)


@pytest.mark.parametrize("ratio", ["10", "1e3", "1e6"])
def test_float_depth_has_the_error_of_float32_arithmetic(depth, ratio):
    """The same steps in NumPy have the same error, to a factor of two."""
    f = depth_tables.RATIOS[ratio]
    lens = PerspectiveLens(fov=60.0, near=1.0, far=f).constants()
    y = np.exp(np.random.default_rng(0).uniform(np.log(1.003), np.log(0.997 * f), 40_000)).astype(np.float32)
    b, d, e, w = (np.float32(value) for value in (lens.b, lens.d, lens.y_fold, lens.w_fold))
    stored = np.float32(0.5) * ((b * y + d) / y) + np.float32(0.5)
    expected = np.abs((e / (stored + w)).astype(float) / y - 1.0).max()
    assert 0.5 * expected <= depth.value("standard, D32F", ratio) <= 2.0 * expected


def test_methods_with_the_same_error_at_any_far_plane(depth):
    for name in ("depth32f", "depth32f, infinite far", "linear32f", "stored32f", "linear32f, tilted"):
        errors = [depth.value(name, ratio) for ratio in depth_tables.RATIOS]
        assert EPS <= min(errors) <= max(errors) <= 8.0 * EPS
        assert max(errors) <= 1.5 * min(errors)
    assert depth.value("depth32f, tilted", "1e9") <= 8.0 * EPS


def test_methods_that_fail_at_far_planes(depth):
    for name in ("depth16", "depth24", "standard, D32F", "inverse_matrix"):
        assert depth.value(name, "1e9") == math.inf
    for name in ("stored16f", "linear in R16F"):
        for ratio in ("10", "1e3"):
            # half a step at least: 2^-11, just above a power of two
            assert 0.9 * 2.0**-11 <= depth.value(name, ratio) <= 2.0**-10 + 4.0 * EPS
            assert depth.value(name, f"{ratio} bound") == 2.0**-10 + 4.0 * EPS


@pytest.mark.parametrize("name", ["1e6", "1e9"])
def test_half_floats_end_at_65504(depth, device, name):
    """Drivers that cut off keep the largest; others turn what is larger into infinity."""
    size = (WIDTH, 40)
    ratio = depth_tables.RATIOS[name]
    y, _ = depth_tables.distances(ratio, size)
    lens = PerspectiveLens(fov=depth_tables.FOV, near=1.0, far=ratio).constants()
    index = np.arange(len(y))
    x, z = ((index % size[0] + 0.5) * 2.0 / size[0] - 1.0), ((index // size[0] + 0.5) * 2.0 / size[1] - 1.0)
    positions = lens.view_from_distance(x, z, y)
    for stored, true in (("linear in R16F", positions[:, 1:2]), ("stored16f", positions)):
        lost = true - np.clip(true, -HALF_FLOAT_END, HALF_FLOAT_END)
        expected = (np.linalg.norm(lost, axis=1) / np.linalg.norm(true, axis=1)).max()
        if device.software:
            assert depth.value(stored, name) == pytest.approx(expected, abs=2.0**-10)
        else:
            assert depth.value(stored, name) in (math.inf, pytest.approx(expected, abs=2.0**-10))
        assert depth.value(stored, f"{name} bound") is None


def test_the_inverse_matrix_is_no_better_and_worse_far_from_the_origin(depth):
    assert depth.value("inverse_matrix", "1e3") >= 0.5 * depth.value("depth24", "1e3")
    # a position 10,000 units off has steps of 2^-10, beside distances from 1 on
    assert 2.0**-11 <= depth.value("inverse_matrix, 1e4 off", "10") <= 0.02
