"""Tables of frames, against what theory says; times are not asserted."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.lab import numerics_frames
from firefly_sample.lab.numerics_cost import PAIRS, cost
from firefly_sample.lab.numerics_rates import rates
from tests.conftest import make_renderer
from tests.reference import BOUNDS


def test_cost_tells_a_ratio_of_each_pair(device):
    table = cost(device, rounds=2, size=(40, 30))
    assert [row[0] for row in table.rows] == list(PAIRS)
    assert all(ratio > 0.0 and spread >= 0.0 and ms > 0.0 for _, ratio, spread, ms in table.rows)


def test_rates_are_of_each_format(device):
    table = rates(device, rounds=2, size=(100, 80), blended=200, read=20)
    assert [row[0].partition(",")[0] for row in table.rows] == ["blending"] * 4 + ["reading"] * 2
    assert all(np.isfinite([ns, ratio, spread]).all() for _, ns, ratio, spread in table.rows)
    for row in table.rows[0], table.rows[4]:
        assert row[2:] == (1.0, 0.0)


@pytest.fixture(scope="module")
def counting():
    with make_renderer(count_fragments=True) as renderer:
        yield renderer


def test_frames(counting):
    table = numerics_frames.frames(counting, 3, (64, 48))
    assert [row[0] for row in table.rows] == list(numerics_frames.POSITIONS)
    for name, bound in BOUNDS.items():
        assert 0.0 < table.value(name, "median") <= table.value(name, "largest") <= bound
    for column in ("largest", "median"):
        errors = [row[table.columns.index(column)] for row in table.rows]
        assert errors == sorted(errors)
    assert table.value("linear32f", "largest") < 0.1 * table.value("depth32f", "largest")


def test_fragments(counting):
    table = numerics_frames.fragments(counting, 1, (100, 75))
    tested, untested, cells = (row[1] for row in table.rows)
    pairs = table.value("clusters", "pairs")
    assert {row[2] for row in table.rows} == {pairs}
    # nothing is missed, and without a test volumes are shaded wherever they are seen
    assert pairs < cells
    assert pairs < tested < 0.5 * untested
    for row in table.rows:
        assert row[3] == row[1] / pairs
