"""The pace of a long command: how many steps a second it does, and how much time is left."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable

_RECENT_SECONDS, _RECENT_STEPS = 30.0, 10
"""The pace is that of the last half minute, or of the last ten steps if those took longer."""
_SHORTEST = 1.0
"""Seconds before there is a pace: several processes finish their first frames at almost the same time."""
_APART = 0.1
"""Seconds between the moments that are remembered."""


class Pace:
    """The rate of recent steps, and the time left.

    Steps that were done before the first call of `advance`, and the first step after it, do not count: the
    former belong to an earlier run, and the latter takes longer, because much is made only once.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._done: int | None = None
        self._recent: deque[tuple[float, int]] = deque()
        self._state: tuple[float | None, float, int] = None, 0.0, 0

    def advance(self, done: int, total: int) -> None:
        """Take note of how many steps are done, and of how many there are in all."""
        now = self._clock()
        if self._done is None or done < self._done:  # steps are done again
            self._recent.clear()
        elif done > self._done:
            if not self._recent or now - self._recent[-1][0] >= _APART:
                self._recent.append((now, done))
            while len(self._recent) > _RECENT_STEPS and now - self._recent[0][0] > _RECENT_SECONDS:
                self._recent.popleft()
        else:
            now = self._state[1]
        self._done = done
        first, before = self._recent[0] if self._recent else (now, done)
        rate = (done - before) / (now - first) if now - first >= _SHORTEST else None
        self._state = rate, now, total - done  # at once, because another thread reads it

    @property
    def rate(self) -> float | None:
        """Steps per second; None as long as it is unknown."""
        return self._state[0]

    @property
    def seconds_left(self) -> float | None:
        """Seconds until all steps are done, at this rate; None as long as it is unknown."""
        rate, since, left = self._state
        return None if rate is None else max(left / rate - (self._clock() - since), 0.0)

    def text(self, unit: str = "") -> str:
        """Return time left and rate for people, for example "0:01:05 left, 3.2 s/frame".

        The rate is left out without `unit`, the noun for one step, and both as long as they are unknown.
        """
        rate, left = self.rate, self.seconds_left
        if rate is None or left is None:
            return ""
        whole = math.ceil(left)
        text = f"{whole // 3600}:{whole // 60 % 60:02}:{whole % 60:02} left"
        return f"{text}, {rate_text(rate, unit)}" if unit else text


def rate_text(rate: float, unit: str) -> str:
    """Return a rate above 0 per second, as the time of one step where that is longer than a second."""
    return f"{_short(rate)} {unit}s/s" if rate >= 1.0 else f"{_short(1.0 / rate)} s/{unit}"


def _short(number: float) -> str:
    return f"{number:.1f}" if number < 99.95 else f"{number:.0f}"
