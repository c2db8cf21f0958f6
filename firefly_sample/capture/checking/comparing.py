"""The difference of two images of one output, and the limits that it is held to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.capture.datasets.masks import known_info
from firefly_sample.errors import OutputError
from firefly_sample.frame import Image
from firefly_sample.settings import to_number

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Limits:
    """The largest differences with which two images still count as the same; by default there are none.

    A pixel is over the limit if any of its channels is. Two numbers are needed, because drivers differ in two
    ways: the last digits of many pixels, and whole values of the few pixels at edges.

    Attributes
    ----------
    max_codes : float
        The largest difference of a pixel of 8-bit outputs, in codes (0 to 255).
    max_error : float
        The largest difference of a pixel of float outputs, divided by the 99.9th percentile of the expected
        image's absolute values. It suits all units, and one bright pixel does not change it.
    max_share : float
        The share of an image's pixels, 0 to 1, that may be over these limits. Pixels of integer outputs, such
        as "id", are over the limit if they are not equal.

    Raises
    ------
    OutputError
        If one is not a number in its range.
    """

    max_codes: float = 0.0
    max_error: float = 0.0
    max_share: float = 0.0

    def __post_init__(self) -> None:
        for name, most in (("max_codes", 255.0), ("max_error", math.inf), ("max_share", 1.0)):
            value = getattr(self, name)
            if not 0.0 <= to_number(value) <= most:
                between = f"a number from 0 to {most:g}" if most < math.inf else "a number, 0 or more"
                raise OutputError(f"{name} must be {between}, got {value!r}")


@dataclass(frozen=True)
class Difference:
    """The difference of two images.

    Attributes
    ----------
    pixels, of : int
        The number of pixels over the limit, and of all pixels.
    largest, mean : float or None
        The largest and the mean absolute difference of all values: in codes for 8-bit outputs, in the
        output's unit for float outputs; None for integer outputs. The largest is inf if a value is finite in
        only one of the images, as at the edge of an object before the sky; the mean leaves such values out.
    scale : float or None
        For float outputs: the 99.9th percentile of the expected image's absolute values.
    over : ndarray
        The pixels over the limit, shape (height, width).
    """

    pixels: int
    of: int
    largest: float | None
    mean: float | None
    scale: float | None
    over: Mask

    def is_within(self, limits: Limits) -> bool:
        """Return True if no more pixels are over the limit than may be."""
        return self.pixels <= limits.max_share * self.of


def measure(output: str, expected: Image, actual: Image, limits: Limits) -> Difference:
    """Return the difference of two images of the same shape and dtype."""
    kind = known_info(output).dtype
    largest = mean = scale = None
    if kind == "int32":
        over = expected != actual
    else:
        away = absolute_difference(expected, actual)
        finite = away[np.isfinite(away)]
        largest = float(away.max(initial=0.0))
        mean = float(finite.mean()) if finite.size else 0.0
        if kind == "uint8":
            over = away > limits.max_codes
        else:
            scale = _scale(expected)
            over = away > limits.max_error * scale
    if over.ndim == 3:
        over = over.any(axis=2)
    return Difference(int(over.sum()), over.size, largest, mean, scale, over)


def absolute_difference(expected: Image, actual: Image) -> NDArray[np.float64]:
    """Return |actual - expected|: 0 where both are NaN or the same infinity, inf where only one is finite."""
    with np.errstate(invalid="ignore"):
        away = np.abs(actual.astype(np.float64) - expected)
    away[np.isnan(away)] = np.inf
    away[(expected == actual) | (np.isnan(expected) & np.isnan(actual))] = 0.0
    return away


def _scale(image: Image) -> float:
    finite = np.abs(image[np.isfinite(image)])
    return float(np.percentile(finite, 99.9)) if finite.size else 0.0


def by_name(expected: Image, names: Sequence[str], actual: Image, others: Sequence[str]) -> tuple[Any, Any]:
    """Return two images of the output "id" with common numbers: the same name has the same one in both."""
    numbers: dict[str, int] = {}

    def renumbered(image: Image, names: Sequence[str]) -> Image:
        table = np.array([*(numbers.setdefault(name, len(numbers)) for name in names), -1], np.int32)
        known = (image >= 0) & (image < len(names))
        return np.where(known, table[np.where(known, image, -1)], np.where(image < 0, image, -2 - image))

    return renumbered(expected, names), renumbered(actual, others)
