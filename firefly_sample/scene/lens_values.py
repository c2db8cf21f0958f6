"""The values that a lens is given: checks of numbers, and the shape of the film that some of them fix."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from firefly_sample.errors import LensError
from firefly_sample.settings import number_or_none

_LARGEST_PICTURE = 1e9
"""Longest side in pixels of a picture that a message recommends."""


class Shape(NamedTuple):
    """Width over height of a lens's film, and the setting that fixed it.

    Attributes
    ----------
    ratio : float
        Width over height of the film.
    fixed_by : str
        A description of the setting that fixed the ratio; empty if each picture's shape decides.
    pixel : float
        Width over height of one pixel on the film.
    calibrated : bool
        True for intrinsics, which are meaningless for a picture of a different shape.
    measure : str
        The measure that `fixed_by` quotes, which is true as long as the measure stays; empty for none.
    """

    ratio: float = 1.0
    fixed_by: str = ""
    pixel: float = 1.0
    calibrated: bool = False
    measure: str = ""

    @property
    def picture(self) -> float:
        """Width over height, in pixels, of the pictures that it fits."""
        return self.ratio / self.pixel

    def after(self, before: Mapping[str, float], now: Mapping[str, float]) -> Shape:
        """Return this shape after a change of measures, with a description that is still true."""
        if self.measure and before.get(self.measure) != now.get(self.measure):
            return ratio_shape(self.ratio)
        return self

    def fits(self, width: int, height: int) -> bool:
        """Return True if a picture of this size has this shape, rounded to whole pixels."""
        picture = self.picture
        return min(abs(width / picture - height), abs(height * picture - width)) <= 0.5 + 1e-9

    def refusal(self, width: int, height: int) -> str:
        """Return the message for a picture of a different shape, with both shapes and the way out."""
        picture = self.picture
        size = (width, width / picture) if width >= picture else (height * picture, height)
        draw = f"draw {round(size[0])}x{round(size[1])}, or " if max(size) <= _LARGEST_PICTURE else ""
        return (
            f"its {self.fixed_by} fixes the picture's aspect ratio at {picture:.5g}, but a picture of "
            f"{width}x{height} has {width / height:.5g}: {draw}let the picture decide by one angle or one "
            "film size alone, or set_aspect_ratio(None)"
        )


def film_size(measures: Mapping[str, float], ratio: float) -> tuple[float, float]:
    """Return width and height of a film, one of which is given."""
    if "film_height" in measures:
        return measures["film_height"] * ratio, measures["film_height"]
    return measures["film_width"], measures["film_width"] / ratio


def film_shape(width: float, height: float) -> Shape:
    """Return the shape fixed by a film's width, which is checked already, and height."""
    ratio = width / positive("film height", height)
    return Shape(ratio, f"film size of {width:g} x {height:g}", measure="film_width")


def ratio_shape(ratio: float) -> Shape:
    """Return the shape fixed by an aspect ratio, which is checked already."""
    return Shape(ratio, f"aspect ratio of {ratio:.5g}")


def cot_half(name: str, degrees: float) -> float:
    """Return the cotangent of half an angle between 0 and 180 degrees, accurate to a few ulp."""
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
    """Return `value` as a float, which may be infinite or NaN."""
    found = number_or_none(value)
    if found is None:
        raise LensError(f"{name} must be a number, got {value!r}")
    return found


def finite(name: str, value: float) -> float:
    """Return `value` as a finite float."""
    result = number(name, value)
    if not math.isfinite(result):
        raise LensError(f"{name} must be a finite number, got {result:g}")
    return result


def positive(name: str, value: float) -> float:
    """Return `value` as a finite float above 0."""
    result = finite(name, value)
    if result <= 0.0:
        raise LensError(f"{name} must be above 0, got {result:g}")
    return result


def pixels(name: str, value: int) -> int:
    """Return `value` as a whole number of 1 or more."""
    result = positive(name, value)
    if result != int(result):
        raise LensError(f"{name} must be a whole number of pixels, got {result:g}")
    return int(result)


def pair(name: str, value: Any) -> tuple[Any, Any]:
    """Return `value` as two numbers, still unchecked."""
    try:
        first, second = value
    except (TypeError, ValueError):
        raise LensError(f"{name} must be two numbers, got {value!r}") from None
    return first, second


def is_pair(value: object) -> bool:
    """Return whether `value` is meant as two numbers."""
    return isinstance(value, tuple | list | np.ndarray)
