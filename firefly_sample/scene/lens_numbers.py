"""Checks of the numbers that describe a lens; each raises a LensError with the number's name."""

from __future__ import annotations

import math
from typing import Any

from firefly_sample.errors import LensError
from firefly_sample.settings import number_or_none


def number(name: str, value: float) -> float:
    """Return `value` as a float, which may be infinite or NaN."""
    found = number_or_none(value)
    if found is None:
        raise LensError(f"{name} must be a number, got {value!r}")
    return found


def finite(name: str, value: float, above: float = -math.inf) -> float:
    """Return `value` as a finite float above a bound."""
    found = number(name, value)
    if not math.isfinite(found):
        raise LensError(f"{name} must be a finite number, got {found:g}")
    if found <= above:
        raise LensError(f"{name} must be above {above:g}, got {found:g}")
    return found


def pair(name: str, value: Any) -> tuple[Any, Any]:
    """Return `value` as two numbers, still unchecked."""
    try:
        first, second = value
    except (TypeError, ValueError):
        raise LensError(f"{name} must be two numbers, got {value!r}") from None
    return first, second


def one_or_two(name: str, first: Any, second: float | None) -> tuple[Any, Any]:
    """Return the two arguments of a setter; the first may be a pair of both, or the second None."""
    if second is None and hasattr(first, "__len__") and not isinstance(first, str):
        return pair(name, first)
    return first, second


def pixels(name: str, value: int) -> int:
    """Return `value` as a whole number of 1 or more."""
    found = finite(name, value, above=0.0)
    if found != int(found):
        raise LensError(f"{name} must be a whole number of pixels, got {found:g}")
    return int(found)


def planes(perspective: bool, near: float, far: float) -> tuple[float, float]:
    """Return the distances of the near and the far plane; only in perspective, `far` may be infinite."""
    near, far = finite("near", near), number("far", far)
    if not far > near:
        raise LensError(
            f"far must be beyond near, got near {near:g} and far {far:g}: "
            "set both at once with set_near_far(near, far)"
        )
    if perspective and near <= 0.0:
        raise LensError(
            f"near of a perspective lens must be above 0, got {near:g}: move the near plane in front "
            "of the eye, or use an OrthographicLens"
        )
    if not perspective and not math.isfinite(far - near):
        raise LensError(
            "the depth of an orthographic lens is linear from near to far, so both must be finite; got "
            f"near {near:g} and far {far:g}: give a finite far"
        )
    return near, far
