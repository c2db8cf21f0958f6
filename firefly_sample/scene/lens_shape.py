"""The shape of a lens's film, and which pictures it fits."""

from __future__ import annotations

from typing import NamedTuple

from firefly_sample.scene.lens_checks import positive

__all__ = ["Shape", "film_shape"]


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
    """

    ratio: float = 1.0
    fixed_by: str = ""
    pixel: float = 1.0
    calibrated: bool = False

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
        size = (width, round(width / picture)) if width >= picture else (round(height * picture), height)
        return (
            f"its {self.fixed_by} fixes the picture's aspect ratio at {picture:.5g}, but a picture of "
            f"{width}x{height} has {width / height:.5g}: draw {size[0]}x{size[1]}, or let the picture decide "
            "by one angle or one film size alone, or set_aspect_ratio(None)"
        )


def film_shape(width: float, height: float) -> Shape:
    """Return the shape that a film of this width, checked, and height, in any unit, fixes."""
    ratio = width / positive("film height", height)
    return Shape(ratio, f"film size of {width:g} x {height:g}")
