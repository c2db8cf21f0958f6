"""One format of films, and the choices of a user: what it can hold, at which size and rate."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import OutputError
from firefly_sample.frame import check_size

Pixels = NDArray[np.uint8]
"""A frame of a film: shape (height, width, 3 or 4), display codes."""

FINEST_RATE = 65535
"""The largest denominator of a number of frames per second: it holds 24000/1001, and fits every container."""

LONGEST = 600
"""The most seconds that a frame may last: GIF holds 655."""


@dataclass(frozen=True)
class FilmChoices:
    """Choices for a film: its rate, its quality and its padding.

    Attributes
    ----------
    fps : float, Fraction or str
        Frames per second, for example 24, 12.5 or "24000/1001". A float stands for the nearest fraction with
        a denominator of at most 65535, so that 24000 / 1001 and 1 / 3 are what was meant.
    crf : int or None
        The quality of MP4 (0 to 51) and WebM (0 to 63): lower is better, 0 is without loss in RGB. None
        means 18 for MP4 and 22 for WebM.
    quality : int or None
        The quality of animated WebP, 1 to 100. None means without loss.
    pad : bool
        Repeat the last column and row where the format needs even sides.
    """

    fps: float | Fraction | str = 24
    crf: int | None = None
    quality: int | None = None
    pad: bool = False

    @property
    def rate(self) -> Fraction:
        """Frames per second as a fraction; OutputError if `fps` is no number above 0."""
        try:
            given = Fraction(self.fps)
        except (ValueError, OverflowError, ZeroDivisionError, TypeError):
            given = Fraction(0)
        rate = given.limit_denominator(FINEST_RATE)
        if given > 0 and rate == 0:
            raise OutputError(_too_slow(self.fps))
        if rate <= 0:
            raise OutputError(
                f"fps must be a number above 0, or a fraction such as 24000/1001, got {self.fps!r}"
            )
        return rate

    def as_json(self) -> dict[str, str | int | bool | None]:
        """Return the choices for a manifest: the rate as text such as "24000/1001", which has no rounding."""
        return {"fps": str(self.rate), "crf": self.crf, "quality": self.quality, "pad": self.pad}


@dataclass(frozen=True)
class Film:
    """A format of films.

    Attributes
    ----------
    suffix, name : str
        The ending of its files, and its name for people.
    channels : tuple of int
        The numbers of channels that its frames may have.
    largest : int
        Pixels of the longest side.
    fastest : int
        The most frames per second.
    why_fastest : str
        The reason of that limit.
    even : bool
        True if both sides must be even, unless it is without loss.
    largest_crf : int
        The end of the range of `FilmChoices.crf`; 0 if it has none.
    has_quality : bool
        True if `FilmChoices.quality` means something.
    always_exact : bool
        True if it is always without loss. False if that depends on the choices, or it always has loss.
    encoders : tuple of str
        The encoders of FFmpeg that it needs; () if Pillow suffices.
    clock : str
        How exactly it keeps the time of a frame.
    """

    suffix: str
    name: str
    channels: tuple[int, ...]
    largest: int
    fastest: int
    why_fastest: str
    clock: str
    even: bool = False
    largest_crf: int = 0
    has_quality: bool = False
    always_exact: bool = False
    encoders: tuple[str, ...] = ()

    def is_exact(self, choices: FilmChoices) -> bool:
        """Return whether decoded frames have the same bits as the encoded ones."""
        lossless_video = self.largest_crf > 0 and choices.crf == 0
        return self.always_exact or lossless_video or (self.has_quality and choices.quality is None)

    def stored_size(self, size: tuple[int, int], choices: FilmChoices) -> tuple[int, int]:
        """Return the size of the film for frames of `size`, which is larger if they are padded."""
        width, height = size
        if self._needs_even(choices) and choices.pad:
            return width + width % 2, height + height % 2
        return width, height

    def check_size(self, size: tuple[int, int], choices: FilmChoices) -> None:
        """Raise an OutputError if frames of this size do not fit."""
        width, height = check_size(size)
        if max(self.stored_size(size, choices)) > self.largest:
            raise OutputError(
                f"a {self.suffix} has at most {self.largest} pixels a side, not {width}x{height}: "
                f"choose a smaller size"
            )
        if self._needs_even(choices) and not choices.pad and (width % 2 or height % 2):
            below = f"{width - width % 2}x{height - height % 2}"
            above = f"{width + width % 2}x{height + height % 2}"
            sizes = f"the size {above}" if min(width, height) < 2 else f"one of the sizes {below} and {above}"
            raise OutputError(
                f"{self.name} needs even sides, not {width}x{height}: choose {sizes}, "
                f"or --pad, which repeats the last column and row"
            )

    def check_rate(self, choices: FilmChoices) -> None:
        """Raise an OutputError if the rate is above or below those that it can show."""
        rate, given = choices.rate, choices.fps
        if rate > self.fastest:
            raise OutputError(
                f"fps must be at most {self.fastest} for {self.suffix} ({self.why_fastest}), got {given}"
            )
        if rate * LONGEST < 1:
            raise OutputError(_too_slow(given))

    def _needs_even(self, choices: FilmChoices) -> bool:
        return self.even and choices.crf != 0


def _too_slow(fps: float | Fraction | str) -> str:
    return f"fps must be at least 1/{LONGEST}, got {fps}"
