"""Numbers of frames: ranges and their texts, views of a moment, times, and the shares of shards."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, overload

from firefly_sample.errors import OutputError
from firefly_sample.settings import to_number, to_whole

MAX_FRAMES = 1_000_000
"""Frame numbers end below this: file names have six digits, so that they sort."""
_MOST_SHARDS = 100_000


@dataclass(frozen=True)
class Shard:
    """A share of a capture's frames: the `number`-th of `count`, from 1."""

    number: int
    count: int

    def has(self, place: int) -> bool:
        """Return whether the frame at a place, counted from 0, belongs to this share: every `count`-th."""
        return place % self.count == self.number - 1

    @property
    def label(self) -> str:
        """The share's name in names of files, for example "2-of-8"."""
        return f"{self.number}-of-{self.count}"

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"


def parse_shard(shard: str | tuple[int, int]) -> Shard:
    """Return a share, from "2/8" or (2, 8): the second of eight."""
    parts: list[int | None]
    if isinstance(shard, str):
        match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", shard.strip(), re.ASCII)
        parts = [int(part) for part in match.groups()] if match else []
    else:
        parts = [to_whole(part) for part in shard]
    if len(parts) == 2:
        number, count = parts
        if number is not None and count is not None and 1 <= number <= count <= _MOST_SHARDS:
            return Shard(number, count)
    raise OutputError(
        f"a shard is I/N, the I-th of N shares with I from 1 to N (at most {_MOST_SHARDS}), got {shard!r}"
    )


def parse_frames(frames: str | int | range) -> range:
    """Return the frame numbers of "FIRST:END", "FIRST:END:STEP" (END is not included) or one number."""
    numbers = frames
    if isinstance(numbers, str):
        match = re.fullmatch(r"(\d+)(?::(\d+)(?::(\d+))?)?", numbers.strip(), re.ASCII)
        if match is None:
            raise OutputError(
                f"frames must be FIRST:END, FIRST:END:STEP or one number, none negative, got {frames!r}"
            )
        first, end, step = (None if part is None else int(part) for part in match.groups())
        assert first is not None
        if step == 0:
            raise OutputError(f"frames {frames!r}: the step must be 1 or more")
        numbers = first if end is None else range(first, end, step or 1)
    if not isinstance(numbers, range):
        number = to_whole(numbers)
        if number is None:
            raise OutputError(f"frames must be a range, its text, or one whole number, got {frames!r}")
        numbers = range(number, number + 1)
    if not numbers:
        raise OutputError(f"frames {frames!r} holds no frame: the end is not included, so 0:1 is one frame")
    if min(numbers[0], numbers[-1]) < 0 or max(numbers[0], numbers[-1]) >= MAX_FRAMES:
        raise OutputError(f"frames must be between 0 and {MAX_FRAMES - 1}, got {frames!r}")
    return numbers


@dataclass(frozen=True)
class FrameNumbers(Sequence[int]):
    """The numbers of the frames that show some moments, each from all of its views; ordered by moment.

    Frame ``moment * views + view`` shows a moment from a view. With one view the numbers are the moments.

    Attributes
    ----------
    moments : range
    views : int
        1 or more.
    """

    moments: range
    views: int = 1

    def __len__(self) -> int:
        return len(self.moments) * self.views

    def __iter__(self) -> Iterator[int]:
        for moment in self.moments:
            yield from range(moment * self.views, (moment + 1) * self.views)

    def __contains__(self, number: object) -> bool:
        return isinstance(number, int) and number // self.views in self.moments

    @overload
    def __getitem__(self, place: int) -> int: ...
    @overload
    def __getitem__(self, place: slice) -> list[int]: ...
    def __getitem__(self, place: int | slice) -> int | list[int]:
        if isinstance(place, slice):
            return [self[one] for one in range(*place.indices(len(self)))]
        if not -len(self) <= place < len(self):
            raise IndexError(f"place {place} of {len(self)} frames")
        turn, view = divmod(place % len(self), self.views)
        return self.moments[turn] * self.views + view

    def index(self, number: int, start: int = 0, stop: int | None = None) -> int:
        """Return the place of a number; raise a ValueError if it is not among those from start to stop."""
        moment, view = divmod(number, self.views)
        if moment in self.moments:
            place = self.moments.index(moment) * self.views + view
            if place in range(*slice(start, stop).indices(len(self))):
                return place
        raise ValueError(f"frame {number} is not among these frames")

    def __str__(self) -> str:
        text = f"{self.moments.start}:{self.moments.stop}:{self.moments.step}"
        return text if self.views == 1 else f"{text} from {self.views} views"


def frame_numbers(frames: str | int | range, views: int = 1) -> FrameNumbers:
    """Return the numbers of frames of a range of moments, see `parse_frames`, from this many views."""
    moments = parse_frames(frames)
    last = (max(moments[0], moments[-1]) + 1) * views - 1
    if last >= MAX_FRAMES:
        raise OutputError(
            f"frames {frames!r} from {views:,} views each have numbers up to {last:,} "
            f"({max(moments[0], moments[-1]):,} x {views:,} + {views - 1:,}), and they must be below "
            f"{MAX_FRAMES:,}: capture fewer frames or fewer views"
        )
    return FrameNumbers(moments, views)


def asked_numbers(run: Mapping[str, Any]) -> FrameNumbers:
    """Return the frames that a run was asked for: see `firefly_sample.capture.journal.Asked`."""
    return FrameNumbers(range(*run["frames"]), run.get("views", 1))


def frame_times(frames: str | int | range, fps: float, time: float) -> tuple[float, ...]:
    """Return the times in seconds of at most five of some frames: the first, the last, and some between."""
    numbers = parse_frames(frames)
    check_clock(fps, time)
    sample = dict.fromkeys(numbers[(len(numbers) - 1) * part // 4] for part in range(5))
    return tuple(time + index / fps for index in sample)


def check_clock(fps: float, time: float) -> None:
    """Raise an OutputError if frames cannot be at these times."""
    if not 0.0 < to_number(fps) < math.inf:
        raise OutputError(f"fps must be a finite number above 0, got {fps!r}")
    if not math.isfinite(to_number(time)):
        raise OutputError(f"time must be a finite number of seconds, got {time!r}")
    if not math.isfinite(float(time) + MAX_FRAMES / float(fps)):
        raise OutputError(f"fps must be large enough for times that are finite numbers, got {fps!r}")
