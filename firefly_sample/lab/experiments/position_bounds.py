"""Settings of position methods, and the bounds that follow from the methods' error laws."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from firefly_sample.plan.position_error import codes_shown
from firefly_sample.settings import Settings

ACCURATE = ("linear32f", "depth32f", "stored32f")
"""Position methods that are accurate to float32 at any near and far plane. They must hold every case's own
bound, except that of the widest view with stored float32 positions: see the cases "distance, fov"."""


def positioned(method: str, **changes: Any) -> Settings:
    """Return settings with a position method and other changes; lights are drawn as volumes.

    Volumes can miss more pixels than other light methods.
    """
    return Settings(light_method="volumes").with_changes(position_method=method, **changes)


def decoded_as(method: str) -> str:
    """Return the method by whose arithmetic a stored position is decoded: 16-bit depth as 24-bit depth."""
    return "depth24" if method == "depth16" else method


def within_law(bound: float, error: float, from_light: float, share: float = 1.0) -> float:
    """Return the bound of a picture, relative to its largest value, for positions with a given error.

    An error of the position changes the light at the distance `from_light` by 2 * error / from_light; `share`
    is the part of that which a picture may show. If the whole of it exceeds a display code, the bound is the
    case's own `bound`, and a method that does not hold it must warn.
    """
    if codes_shown(error, from_light) > 1.0:
        return bound
    return bound + share * 2.0 * error / from_light


def error_warning(lines: Iterable[str], method: str) -> str:
    """Return the warning about the error of a method's positions, or "" if there is none.

    A warning that the driver lacks what the method needs is not about its error.
    """
    own = (line for line in lines if line.startswith(f"position_method={method}:"))
    return next((line for line in own if "the driver lacks" not in line), "")
