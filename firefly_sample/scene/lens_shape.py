"""The shape of a lens's film, and the lens that a picture of a different shape is drawn with."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeVar

from firefly_sample.errors import LensError

if TYPE_CHECKING:
    from firefly_sample.scene.lens_base import Lens

AnyLens = TypeVar("AnyLens", bound="Lens")


class Shape(NamedTuple):
    """Width over height of a lens's film, and the setting that fixed it."""

    ratio: float = 1.0
    fixed_by: str = ""  # in words; empty if each picture's shape decides
    pixel: float = 1.0  # width over height of one pixel on the film
    calibrated: bool = False  # True for intrinsics, which are meaningless for a picture of a different shape
    measure: str = ""  # the measure that `fixed_by` quotes: the words are true as long as it stays

    @property
    def picture(self) -> float:
        """Width over height, in pixels, of the pictures that it fits."""
        return self.ratio / self.pixel

    def fits(self, width: int, height: int) -> bool:
        """Return True if a picture of this size has this shape, rounded to whole pixels."""
        picture = self.picture
        return min(abs(width / picture - height), abs(height * picture - width)) <= 0.5 + 1e-9

    def refusal(self, width: int, height: int) -> str:
        """Return the message for a picture of a different shape, with both shapes and the way out."""
        picture = self.picture
        size = (width, width / picture) if width >= picture else (height * picture, height)
        draw = f"draw {round(size[0])}x{round(size[1])}, or " if max(size) <= 1e9 else ""
        return (
            f"its {self.fixed_by} fixes the picture's aspect ratio at {picture:.5g}, but a picture of "
            f"{width}x{height} has {width / height:.5g}: {draw}let the picture decide by one angle or one "
            "film size alone, or set_aspect_ratio(None)"
        )


def lens_for_picture(lens: AnyLens, size: tuple[int, int]) -> tuple[AnyLens, str]:
    """Return the lens that a picture of a size is drawn with, and how it contradicts the picture's shape.

    If two of the lens's numbers contradict it, one is kept, as in Panda3D's window; a lens of intrinsics is a
    `LensError`. The text begins with "its"; it is empty if there is no contradiction.
    """
    shape = lens.shape
    if not shape.fixed_by or shape.fits(*size):
        return lens.for_picture(*size), ""
    if shape.calibrated:
        raise LensError(shape.refusal(*size))
    return reshaped(lens, size), shape.refusal(*size)


def reshaped(lens: AnyLens, size: tuple[int, int]) -> AnyLens:
    """Return a copy of a lens that takes a picture's shape, whatever fixed its own."""
    lens = lens.make_copy()
    lens.set_aspect_ratio(None)
    return lens.for_picture(*size)
