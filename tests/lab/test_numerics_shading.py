"""Angles, powers, coordinates and filters, against theory."""

from __future__ import annotations

import math

import pytest

from firefly_sample.lab.experiments import TABLES, shading
from firefly_sample.lab.experiments.experiment import EPS
from firefly_sample.lab.experiments.gbuffer import normal_bounds
from tests.lab.bounds import holds_its_bounds


def test_the_edge_of_a_cone(bench):
    table = TABLES["cones"].table(bench, samples=10_000)
    for name, from_cosine, from_sine in table.rows:
        degrees = float(name.split()[0])
        angle = math.radians(degrees)
        # a cosine is off by a few 2^-24 of 1; a sine by as much, and its square by twice that over the sine
        assert from_cosine <= 4.0 * EPS / (1.0 - math.cos(angle))
        assert from_sine <= 4.0 * EPS * (1.0 + 1.0 / math.sin(angle))
        if degrees <= 10.0:
            assert from_sine < 0.1 * from_cosine
    assert table.value("0.01 degrees", "1 - cosine") > 1.0


def test_highlights(bench):
    """The slope of cos^m is sqrt(m / e) at its steepest, for large m."""
    table = TABLES["highlights"].table(bench)
    for name, off in normal_bounds().items():
        for column, m in shading.SHININESS.items():
            expected = off * math.sqrt(m / math.e)
            assert table.value(name, column) <= 1.02 * expected
            if expected < 0.05:
                assert table.value(name, column) == pytest.approx(expected, rel=0.03)


def test_powers(bench):
    table = TABLES["powers"].table(bench, samples=20_000)
    assert holds_its_bounds(table)
    for name, m in shading.EXPONENTS.items():
        # the error in the power of a cosine near 1 that is rounded to 2^-25, and the built-in logarithm's
        assert m * 2.0**-26 <= table.value(name, "pow") <= m * 2.0**-21


def test_ndc(bench):
    table = TABLES["ndc"].table(bench)
    for row in table.rows:
        assert row[-1] is None or max(row[1:-1]) <= row[-1]
    for size in table.columns[1:-1]:
        middle_first, middle_last, *interpolated = (row[table.columns.index(size)] for row in table.rows)
        assert middle_first < 0.6 * middle_last
        assert middle_last < min(interpolated)
        assert max(interpolated) < 1e-6


def test_far_from_origin(bench):
    table = TABLES["far_from_origin"].table(bench, samples=50_000)
    assert holds_its_bounds(table)
    for row in table.rows:
        assert table.value(row[0], "world") >= 0.4 * table.value(row[0], "world bound")
    for column in ("view", "from pixels"):
        errors = [table.value(row[0], column) for row in table.rows]
        assert max(errors) <= 1.05 * min(errors)
        assert max(errors) <= 6e-6
    assert table.value("1e9", "world") > 1e6 * table.value("1e9", "view")


def test_filtering(bench):
    table = TABLES["filtering"].table(bench, lines=16)
    for bits in ("8 bits", "16 bits"):
        given, own = (
            table.value(f"{bits}, {filtering}", "largest")
            for filtering in ("trilinear", "trilinear, level by the driver")
        )
        assert given < own < 0.05
    if bench.device.software:
        # weights of 8 bits in both directions, and a weighted mean
        assert 1.0 / 256 < table.value("8 bits, bilinear", "largest") < 2.0 / 256
        assert table.value("16 bits, bilinear", "largest") < 3.0 * EPS
