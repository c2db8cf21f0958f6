"""Checks of the numbers that a lens is given: LensError with the name, the value, the way out."""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from firefly_sample.errors import LensError
from firefly_sample.settings import number_or_none


def cot_half(name: str, degrees: float) -> float:
    """Cotangent of half an angle between 0 and 180 degrees, to a few ulp over the whole range."""
    degrees = number(name, degrees)
    if not 0.0 < degrees < 180.0:
        raise LensError(
            f"{name} must be above 0 and below 180 degrees, got {degrees:g}: for parallel rays use an "
            "OrthographicLens, for more than half a turn several cameras"
        )
    if degrees > 90.0:
        # 180 - degrees is exact here; the tangent near its pole would lose digits.
        return math.tan(math.radians(180.0 - degrees) / 2.0)
    tangent = math.tan(math.radians(degrees) / 2.0)
    return 1.0 / tangent if tangent > 0.0 else math.inf


def number(name: str, value: float) -> float:
    """`value` as a float, perhaps infinite or NaN."""
    found = number_or_none(value)
    if found is None:
        raise LensError(f"{name} must be a number, got {value!r}")
    return found


def finite(name: str, value: float) -> float:
    """`value` as a finite float."""
    result = number(name, value)
    if not math.isfinite(result):
        raise LensError(f"{name} must be a finite number, got {result:g}")
    return result


def positive(name: str, value: float) -> float:
    """`value` as a finite float above 0."""
    result = finite(name, value)
    if result <= 0.0:
        raise LensError(f"{name} must be above 0, got {result:g}")
    return result


def whole(name: str, value: int) -> int:
    """Return `value` as a whole number of 1 or more."""
    result = positive(name, value)
    if result != int(result):
        raise LensError(f"{name} must be a whole number of pixels, got {result:g}")
    return int(result)


def pair(name: str, value: float | tuple[float, float]) -> tuple[float, float]:
    """`value` as two numbers, still unchecked."""
    try:
        first, second = value  # type: ignore[misc]
    except (TypeError, ValueError):
        raise LensError(f"{name} must be two numbers, got {value!r}") from None
    return first, second


def one_or_two(name: str, value: float | tuple[float, float]) -> tuple[float, float | None]:
    """`value` as one number and perhaps a second, still unchecked."""
    return pair(name, value) if _is_pair(value) else (cast(float, value), None)


def one_of(**given: object) -> str:
    """Return the name of the one thing that is given, empty without any; refuse several."""
    names = [name for name, value in given.items() if value is not None]
    if len(names) > 1:
        raise LensError(f"{' and '.join(names)} set the same thing: give one of them")
    return names[0] if names else ""


def one_shape(**given: float | tuple[float, float] | None) -> None:
    """Refuse an aspect ratio that is given more than once: as such, or by a pair."""
    says = [
        name
        for name, value in given.items()
        if _is_pair(value) or (name == "aspect_ratio" and value is not None)
    ]
    if len(says) > 1:
        raise LensError(
            f"{' and '.join(says)} each fix the aspect ratio: give one pair alone, "
            "or single numbers and the ratio"
        )


def _is_pair(value: object) -> bool:
    return isinstance(value, (tuple, list, np.ndarray))
