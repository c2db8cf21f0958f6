"""Depth buffers and what a depth is worth, against what theory says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firefly_sample.lab import numerics_depth
from firefly_sample.lab.numerics_table import EPS
from firefly_sample.scene.lens import PerspectiveLens
from tests.lab.bounds import holds_its_bounds


@pytest.fixture(scope="module")
def depth(device):
    return numerics_depth.depth(device, 40_000)


def test_depth_errs_as_the_law_says(depth):
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


def test_sixteen_bits_err_by_half_a_step_where_the_last_depths_lie(depth):
    """Nothing else matters beside a step of 1/65535, at whichever side a driver rounds."""
    for name in ("10", "1e3"):
        worth = (numerics_depth.RATIOS[name] - 1.0) / 65535  # times y/|E|, at y = f
        found = depth.value("depth16", name)
        assert 0.45 * worth <= found <= 1.01 * worth / (1.0 - worth)


@pytest.mark.parametrize("ratio", ["10", "1e3", "1e6"])
def test_float_depth_errs_as_float32_arithmetic_does(depth, ratio):
    """The same steps in NumPy lose as much, to a factor of two."""
    f = numerics_depth.RATIOS[ratio]
    lens = PerspectiveLens(fov=60.0, near=1.0, far=f).constants()
    y = np.exp(np.random.default_rng(0).uniform(np.log(1.003), np.log(0.997 * f), 40_000)).astype(np.float32)
    b, d, e, w = (np.float32(value) for value in (lens.b, lens.d, lens.y_fold, lens.w_fold))
    stored = np.float32(0.5) * ((b * y + d) / y) + np.float32(0.5)
    expected = np.abs((e / (stored + w)).astype(float) / y - 1.0).max()
    assert 0.5 * expected <= depth.value("standard, D32F", ratio) <= 2.0 * expected


def test_what_errs_alike_at_any_far_plane(depth):
    for name in ("depth32f", "depth32f, infinite far", "linear32f", "stored32f", "linear32f, tilted"):
        errors = [depth.value(name, ratio) for ratio in numerics_depth.RATIOS]
        assert EPS <= min(errors) <= max(errors) <= 8.0 * EPS
        assert max(errors) <= 1.5 * min(errors)
    assert depth.value("depth32f, tilted", "1e9") <= 8.0 * EPS


def test_what_ends(depth):
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
    size = (numerics_depth.WIDTH, 40)
    ratio = numerics_depth.RATIOS[name]
    y, _ = numerics_depth.distances(ratio, size)
    lens = PerspectiveLens(fov=numerics_depth.FOV, near=1.0, far=ratio).constants()
    index = np.arange(len(y))
    x, z = ((index % size[0] + 0.5) * 2.0 / size[0] - 1.0), ((index // size[0] + 0.5) * 2.0 / size[1] - 1.0)
    places = lens.view_from_distance(x, z, y)
    for way, true in (("linear in R16F", places[:, 1:2]), ("stored16f", places)):
        lost = true - np.clip(true, -numerics_depth.LARGEST_HALF, numerics_depth.LARGEST_HALF)
        expected = (np.linalg.norm(lost, axis=1) / np.linalg.norm(true, axis=1)).max()
        if device.software:
            assert depth.value(way, name) == pytest.approx(expected, abs=2.0**-10)
        else:
            assert depth.value(way, name) in (math.inf, pytest.approx(expected, abs=2.0**-10))
        assert depth.value(way, f"{name} bound") is None


def test_the_inverse_matrix_is_no_better_and_errs_far_from_the_origin(depth):
    assert depth.value("inverse_matrix", "1e3") >= 0.5 * depth.value("depth24", "1e3")
    # a place 10,000 units off has steps of 2^-10, beside distances from 1 on
    assert 2.0**-11 <= depth.value("inverse_matrix, 1e4 off", "10") <= 0.02
