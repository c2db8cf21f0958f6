"""The same scene elsewhere, and in other units: the picture stays."""

from __future__ import annotations

import numpy as np

from firefly_sample.measure.stability_cases.bench import Bench
from firefly_sample.measure.stability_cases.case import ACCURATE, Case, positioned, within_law
from firefly_sample.measure.stability_cases.scenes import GARDEN_FAR, GARDEN_LIGHTS, GARDEN_NEAR, garden
from firefly_sample.plan.position_error import position_error

__all__ = ["CASES"]

BOUND = 1e-4
FARTHEST = 16.0
"""Of what is lit in the garden, along the view axis."""


def _difference(bench: Bench, method: str, scale: float, offset: float) -> float:
    """Largest difference to the garden as it is, over its largest value."""
    settings = positioned(method)
    shift = offset * np.array([1.0, 1.0, -1.0])
    here = bench.draw(garden(), settings)["radiance"]
    bench.begin_warnings()
    there = bench.draw(garden(scale, shift), settings)["radiance"]
    return float(np.abs(there - here).max() / here.max())


def _bound(method: str, scale: float, offset: float) -> float:
    if method in ACCURATE:
        return BOUND
    near, far, farthest = scale * GARDEN_NEAR, scale * GARDEN_FAR, scale * FARTHEST
    error = position_error(method, near, far, True, farthest, 3.0**0.5 * offset)
    return within_law(BOUND, error, scale * GARDEN_LIGHTS)


def _moved(power: int) -> Case:
    return Case(
        f"moved by 2^{power}",
        lambda bench, method: _difference(bench, method, 1.0, 2.0**power),
        lambda method: _bound(method, 1.0, 2.0**power),
    )


def _scaled(scale: float) -> Case:
    return Case(
        f"scaled by {scale:g}",
        lambda bench, method: _difference(bench, method, scale, 0.0),
        lambda method: _bound(method, scale, 0.0),
    )


CASES = (
    *(_moved(power) for power in (10, 20, 30)),
    *(_scaled(scale) for scale in (1e-6, 1e-3, 1e3, 1e6)),
)
