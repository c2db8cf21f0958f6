"""Tables of frames and of times, against theory; times are not asserted."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from firefly_sample.columns import align
from firefly_sample.lab.experiments import TABLES, pictures
from firefly_sample.lab.experiments.times import PAIRS
from tests.reference import BOUNDS


def test_cost_has_a_ratio_per_pair(bench):
    table = TABLES["cost"].table(bench, rounds=2, size=(40, 30))
    assert [row[0] for row in table.rows] == list(PAIRS)
    assert all(ratio > 0.0 and spread >= 0.0 and ms > 0.0 for _, ratio, spread, ms in table.rows)


def test_rates_have_each_format(bench):
    table = TABLES["rates"].table(bench, rounds=2, size=(100, 80), blended=200, read=20)
    assert [row[0].partition(",")[0] for row in table.rows] == ["blending"] * 4 + ["reading"] * 2
    assert all(np.isfinite([ns, ratio, spread]).all() for _, ns, ratio, spread in table.rows)
    for row in table.rows[0], table.rows[4]:
        assert row[2:] == (1.0, 0.0)


def test_frames(bench):
    table = TABLES["frames"].table(bench, moments=3, size=(64, 48))
    assert [row[0] for row in table.rows] == list(pictures.POSITIONS)
    for name, bound in BOUNDS.items():
        assert 0.0 < table.value(name, "median") <= table.value(name, "largest") <= bound
    for column in ("largest", "median"):
        errors = [row[table.columns.index(column)] for row in table.rows]
        assert errors == sorted(errors)
    assert table.value("linear32f", "largest") < 0.1 * table.value("depth32f", "largest")


def test_fragments(bench):
    table = TABLES["fragments"].table(bench, moments=1, size=(100, 75))
    tested, untested, cells = (row[1] for row in table.rows)
    pairs = table.value("clusters", "pairs")
    assert {row[2] for row in table.rows} == {pairs}
    # no pair is missed, and without a depth test volumes are shaded wherever they are visible
    assert pairs < cells
    assert pairs < tested < 0.5 * untested
    for row in table.rows:
        assert row[3] == row[1] / pairs


def test_the_page_has_the_counts_of_fragments(bench):
    page = (Path(__file__).parents[2] / "docs" / "numerics.md").read_text()
    assert (
        align(TABLES["fragments"].table(bench).as_text()) in page
    )  # the same on every machine with llvmpipe
