"""Sums of lights and their reach, against theory."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.lab.experiments import TABLES, lights
from firefly_sample.lab.experiments.reach import exact_reach
from firefly_sample.lab.probe import accumulate
from tests.lab.bounds import holds_its_bounds


def test_the_blender_adds_as_numpy_does(device):
    """One pass after the other, each sum rounded once."""
    _, parts = lights.seen_lights(500)
    expected = np.add.accumulate(parts.astype(np.float32), axis=0)[-1]
    found = accumulate(device, np.repeat(parts[..., None], 3, axis=2), "rgba32f")
    assert (found == expected[:, None]).all()


def test_accumulation(bench):
    table = TABLES["accumulation"].table(bench, positions=2048)
    assert holds_its_bounds(table)
    largest = [table.value(name, "largest") for name in ("rgba32f", "rgba16f", "r11g11b10f", "rgba8")]
    assert largest == sorted(largest)
    assert largest[0] <= 2e-6
    assert abs(table.value("rgba32f", "bias")) <= 1e-8
    nearest = table.value(lights.NEAREST_HALF, "largest")
    assert 0.01 < nearest < 0.5 * largest[1] or not bench.device.software


def test_piles(bench):
    table = TABLES["piles"].table(bench, values=64)
    assert holds_its_bounds(table)
    for count in ("1,000", "10,000"):
        single, batches = (
            table.value(f"{count}, {method}", "largest") for method in ("blending", "batches of 64")
        )
        assert 8.0 * batches < single
    assert 1e-5 < table.value("1,000, blending", "largest") < 2e-5
    assert 1e-4 < table.value("10,000, blending", "largest") < 2e-4


def test_cutoff(bench):
    table = TABLES["cutoff"].table(bench, positions=1000)
    assert holds_its_bounds(table)
    for name, threshold in (
        ("threshold 5/256", 5 / 256),
        ("threshold 1e-3", 1e-3),
        ("threshold 1.5e-4", 1.5e-4),
    ):
        reach = table.value(name, "reach")
        assert 1.0 / (1.0 + 0.7 * reach + 1.8 * reach**2) == pytest.approx(threshold, rel=1e-12)
    dropped = [row[2] for row in table.rows]
    assert dropped == sorted(dropped, reverse=True)
    assert 0.7 < dropped[0] < 0.85
    assert table.value("budget 1.5e-4", "codes") <= 0.5


def test_reach(bench):
    table = TABLES["reach"].table(bench, samples=200)
    assert all(row[2] <= 6e-16 for row in table.rows)
    textbook = [row[1] for row in table.rows]
    assert textbook[0] < 1e-14
    assert textbook[2] > 1e-6
    assert min(textbook[3:]) >= 1.0  # no digit is left


def test_the_exact_reach():
    assert exact_reach(1.0, 0.0, 1.0, 26.0, 1.0) == 5
    assert exact_reach(1.0, 2.0, 0.0, 3.0, 0.5) == 2.5
    assert exact_reach(1.0, 0.0, 0.0, 2.0, 1.0).is_infinite()
    for intensity in (0.0, 1.0, 0.5):
        assert exact_reach(1.0, 1.0, 1.0, intensity, 1.0) == 0
    # k is 1e-30 of what it is the difference of
    assert float(exact_reach(1.0, 1.0, 1e-30, 1.0 + 2.0**-52, 1.0)) == 2.0**-52
