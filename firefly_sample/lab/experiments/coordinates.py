"""The same scene elsewhere, and in other units: the picture stays."""

from __future__ import annotations

import numpy as np

from firefly_sample.lab.experiments.bench import Bench
from firefly_sample.lab.experiments.case import ACCURATE, Case, positioned, within_law
from firefly_sample.lab.experiments.scenes import GARDEN_FAR, GARDEN_LIGHTS, GARDEN_NEAR, garden
from firefly_sample.plan.position_error import position_error

EXACT, ROUNDED = 1e-6, 1e-4
"""Bounds where float64 represents every place, and where it rounds them: relative to the largest value."""
FARTHEST = 16.0
"""Of what is lit in the garden, along the view axis."""
SHARE = 0.1
"""Of a method's law: both pictures store positions in the same steps, so only few pixels differ in one."""
SMALLEST_HALF = 2.0**-24
"""Half floats lose up to this of places near 0, in any units."""
SMALLEST_POWER = -20
"""Of 2: scenes that are smaller are nothing to half floats."""


def _difference(bench: Bench, method: str, scale: float, offset: float) -> float:
    """Largest difference to the garden as it is, over its largest value."""
    settings = positioned(method)
    shift = offset * np.array([1.0, 1.0, -1.0])
    here = bench.draw(garden(), settings)["radiance"]
    bench.begin_warnings()
    there = bench.draw(garden(scale, shift), settings)["radiance"]
    return float(np.abs(there - here).max() / here.max())


def _bound(method: str, own: float, scale: float, offset: float) -> float:
    if method in ACCURATE:
        return own
    near, far, farthest = scale * GARDEN_NEAR, scale * GARDEN_FAR, scale * FARTHEST
    error = position_error(method, near, far, True, farthest, 3.0**0.5 * offset)
    return within_law(own, error, scale * GARDEN_LIGHTS, SHARE)


def _moved(power: int, own: float) -> Case:
    return Case(
        f"moved by 2^{power}",
        lambda bench, method: _difference(bench, method, 1.0, 2.0**power),
        lambda method: _bound(method, own, 1.0, 2.0**power),
    )


def _scaled(scale: float) -> Case:
    return Case(
        f"scaled by {scale:g}",
        lambda bench, method: _difference(bench, method, scale, 0.0),
        lambda method: _bound(method, ROUNDED, scale, 0.0),
    )


def _scaled_exactly(power: int) -> Case:
    """By a power of two, which changes no digit: the picture is the same."""
    scale = 2.0**power

    def bound(method: str) -> float:
        if method != "stored16f" or not SMALLEST_POWER < power <= 0:
            return 0.0
        return SHARE * 2.0 * SMALLEST_HALF / (scale * GARDEN_LIGHTS)

    return Case(f"scaled by 2^{power}", lambda bench, method: _difference(bench, method, scale, 0.0), bound)


CASES = (
    *(_moved(power, own) for power, own in ((10, EXACT), (20, EXACT), (30, ROUNDED))),
    *(_scaled(scale) for scale in (1e-6, 1e-3, 1e3, 1e6)),
    *(_scaled_exactly(power) for power in (-50, -10, 10, 50)),
)
