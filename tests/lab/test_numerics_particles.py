"""Tables of particles: what must be true of their errors; times are not asserted."""

from __future__ import annotations

from dataclasses import replace

import pytest

from firefly_sample.lab.experiments import TABLES
from firefly_sample.lab.experiments.particles import METHODS


def test_errors_of_each_method(bench):
    table = TABLES["particle_shadows"].table(bench)
    assert [row[0] for row in table.rows] == list(METHODS)
    for cloud in ("blob", "sheets", "faint"):
        for row in table.rows:
            largest = table.value(row[0], f"{cloud} max")
            assert 0.0 < table.value(row[0], f"{cloud} rms") < largest <= 1.0
        finest = table.value("optical_depth", f"{cloud} rms")
        assert all(finest <= table.value(row[0], f"{cloud} rms") for row in table.rows)
        # the sums are the same, before or after they are looked up
        assert table.value("loop, all", f"{cloud} rms") == pytest.approx(
            table.value("blend", f"{cloud} rms"), rel=1e-3
        )
    assert table.value("blend, 8 bits", "faint max") > 0.9


def test_errors_by_slices(bench):
    experiment = replace(TABLES["particle_shadow_slices"], rows={"16": 0, "32": 1})
    table = experiment.table(bench, count=5000, slices=(16, 32))
    first, second = table.rows
    assert first[2] is first[4] is None
    assert second[2] == second[1] / first[1] < 0.6
    assert second[4] == second[3] / first[3] < 0.8


def test_costs_are_ratios_per_method(bench):
    table = TABLES["particle_shadow_cost"].table(bench, counts=(50, 100), size=(64, 48), rounds=2)
    assert [row[0] for row in table.rows] == [
        *(name for name in METHODS if "stepped" not in name),
        *(f"optical_depth, {slices} slices" for slices in (16, 32, 64, 128, 256)),
    ]
    assert table.columns == ("method", "50 particles", "spread", "100 particles", "spread")
    assert all(value > 0.0 for row in table.rows for value in row[1::2])


def test_orders_with_more_distinct_depths_differ_less(bench):
    table = TABLES["particle_order"].table(bench, count=1500, size=(64, 48))
    fine, coarse, none = (
        table.value(name, "mean") for name in ("view, 4,096 depths", "view, 64 depths", "unsorted")
    )
    assert fine <= coarse < none
    assert table.value("view, 4,096 depths", "max") <= 2
