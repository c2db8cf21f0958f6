"""What a case is, and the bounds that follow from the law of each position method."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, get_args

from firefly_sample.lab.experiments.bench import Bench
from firefly_sample.plan.position_error import codes_shown
from firefly_sample.settings import PositionMethod, Settings

POSITIONS: tuple[PositionMethod, ...] = get_args(PositionMethod)
ACCURATE = ("linear32f", "depth32f", "stored32f")
"""Position methods that keep float32's digits at any near and far plane. They must hold every case's own
bound, but for what stored float32 positions lose in the widest view: see the cases "distance, fov"."""
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
        ``run(bench, method)`` draws and gives what was measured, which must not exceed the bound.
    bound : float, or callable
        ``bound(method)`` where methods have laws of their own.
    methods : tuple of str
        Mostly those of `Settings.position`.
    needs : str
        The one of `Capabilities` without which a driver cannot draw the case; empty if every driver can.
    """

    name: str
    run: Callable[[Bench, str], float]
    bound: float | Callable[[str], float]
    methods: tuple[str, ...] = POSITIONS
    needs: str = ""

    def bound_for(self, method: str) -> float:
        """The bound that a method must hold."""
        return self.bound(method) if callable(self.bound) else self.bound


def within_law(bound: float, error: float, from_light: float, share: float = 1.0) -> float:
    """The bound of a picture, relative to its largest value, for a method whose positions err by `error`.

    Light at `from_light` changes by 2 * error / from_light; `share` says how much of that a picture may show.
    Where the whole of it shows, the law is no excuse: the bound is the case's own, and a method that does
    not hold it must warn.
    """
    if codes_shown(error, from_light) > 1.0:
        return bound
    return bound + share * 2.0 * error / from_light


def error_warning(lines: Iterable[str], method: str) -> str:
    """The line that says how far off a method's positions are; empty if there is none.

    Plans say other things of a method, too: that a driver lacks what it needs is no word on its error.
    """
    about_errors = ("errs by", "half floats end")
    for line in lines:
        if line.startswith(f"position={method}:") and any(words in line for words in about_errors):
            return line
    return ""


def positioned(method: str, **changes: Any) -> Settings:
    """Settings with a position method, and others changed; lights are volumes, what may miss most pixels."""
    return Settings(light_method="volumes").with_changes(position=method, **changes)
