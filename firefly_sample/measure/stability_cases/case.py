"""What a case is, and the bounds that follow from the law of each position method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, get_args

from firefly_sample.measure.stability_cases.bench import Bench
from firefly_sample.plan.position_error import codes_shown
from firefly_sample.settings import PositionMethod, Settings

__all__ = ["ACCURATE", "DOUBLES", "POSITIONS", "Case", "positioned", "within_law"]

POSITIONS: tuple[PositionMethod, ...] = get_args(PositionMethod)
ACCURATE = ("linear32f", "depth32f", "stored32f")
"""Position methods whose error does not depend on near and far: they must hold every case's own bound."""
DOUBLES = ("float64",)
"""The method of cases that draw nothing: they measure what is computed before a frame. And a choice of
`Settings.interpolation`."""


@dataclass(frozen=True)
class Case:
    """One extreme.

    Attributes
    ----------
    name : str
    run : callable
        ``run(bench, method)`` draws and gives what was measured, which must not pass the bound.
    bound : float, or callable
        ``bound(method)`` where methods have laws of their own.
    methods : tuple of str
        Mostly those of `Settings.position`.
    """

    name: str
    run: Callable[[Bench, str], float]
    bound: float | Callable[[str], float]
    methods: tuple[str, ...] = POSITIONS

    def bound_for(self, method: str) -> float:
        """The bound that a method must hold."""
        return self.bound(method) if callable(self.bound) else self.bound


def within_law(bound: float, error: float, from_light: float) -> float:
    """The bound of a picture, relative to its largest value, for a method whose positions err by `error`.

    Light at `from_light` changes by 2 * error / from_light, and a difference of two pictures has that twice.
    Where that shows, the law is no excuse: the bound is the case's own, and who does not hold it must warn.
    """
    if codes_shown(error, from_light) > 1.0:
        return bound
    return bound + 4.0 * error / from_light


def positioned(method: str, **changes: Any) -> Settings:
    """Settings with a position method, and others changed."""
    return Settings().with_changes(position=method, **changes)
