"""The shape of a lens's film, and which pictures it fits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from firefly_sample.scene.lens_checks import positive

LARGEST_PICTURE = 1e9
"""Longest side of a picture that a message advises."""


class Shape(NamedTuple):
    """Width over height of a lens's film, and what fixed it.

    Attributes
    ----------
    ratio : float
        Width over height of the film, as long as no picture says otherwise.
    fixed_by : str
        What the user set that fixes it, in words; empty where the picture's shape decides.
    pixel : float
        Width over height of one pixel of the picture on the film.
    calibrated : bool
        True for intrinsics, which make no sense in a picture of another shape.
    measure : str
        The lens's measure that the words of `fixed_by` name, which hold as long as it stays; empty for none.
    """

    ratio: float = 1.0
    fixed_by: str = ""
    pixel: float = 1.0
    calibrated: bool = False
    measure: str = ""

    def after(self, before: Mapping[str, float], now: Mapping[str, float]) -> Shape:
        """Return this shape after a change of the lens's measures, in words that hold of it now."""
        if self.measure and before.get(self.measure) != now.get(self.measure):
            return ratio_shape(self.ratio)
        return self

    @property
    def picture(self) -> float:
        """Width over height of the pictures that it fits, in pixels."""
        return self.ratio / self.pixel

    def fits(self, width: int, height: int) -> bool:
        """Return True if a picture of this size has this shape, rounded to whole pixels."""
        picture = self.picture
        return min(abs(width / picture - height), abs(height * picture - width)) <= 0.5 + 1e-9

    def refusal(self, width: int, height: int) -> str:
        """Return the message for a picture of another shape, with both shapes and the way out."""
        picture = self.picture
        size = (width, width / picture) if width >= picture else (height * picture, height)
        draw = f"draw {round(size[0])}x{round(size[1])}, or " if max(size) <= LARGEST_PICTURE else ""
        return (
            f"its {self.fixed_by} fixes the picture's aspect ratio at {picture:.5g}, but a picture of "
            f"{width}x{height} has {width / height:.5g}: {draw}let the picture decide by one angle or one "
            "film size alone, or set_aspect_ratio(None)"
        )


def film_shape(width: float, height: float) -> Shape:
    """Return the shape that a film of this width, checked, and height, in any unit, fixes."""
    ratio = width / positive("film height", height)
    return Shape(ratio, f"film size of {width:g} x {height:g}", measure="film_width")


def ratio_shape(ratio: float) -> Shape:
    """Return the shape that an aspect ratio, checked, fixes."""
    return Shape(ratio, f"aspect ratio of {ratio:.5g}")
