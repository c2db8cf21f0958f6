"""Which frames are worth waiting for: a method that takes absurdly long with some lights will with more."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Size = tuple[int, int]


def predict(known: Sequence[tuple[int, float]], lights: int) -> float | None:
    """Milliseconds of a frame with so many lights: on the line through the last two (lights, milliseconds).

    A line that falls is taken to be level. None where fewer than two are known.
    """
    if len(known) < 2:
        return None
    (fewer, quicker), (last, ms) = known[-2:]
    slope = max((ms - quicker) / (last - fewer), 0.0)
    return ms + slope * (lights - last)


class LeftOut:
    """Which methods are not drawn any more, and why.

    Parameters
    ----------
    longest : float
        Seconds that one frame may take.
    """

    def __init__(self, longest: float) -> None:
        self.longest = longest
        self.rows: list[dict[str, Any]] = []
        self._known: dict[tuple[Size, str], list[tuple[int, float]]] = {}
        self._stops: dict[str, list[tuple[Size, int]]] = {}

    def learn(self, size: Size, method: str, count: int, ms: float) -> None:
        """The quickest frame with `count` lights took so many milliseconds; counts only ever rise."""
        self._known.setdefault((size, method), []).append((count, ms))

    def foresees(self, size: Size, method: str, count: int) -> bool:
        """Whether to leave a method out of a step before it is drawn; that is noted."""
        for other, fewer in self._stops.get(method, []):
            if other[0] * other[1] <= size[0] * size[1] and fewer <= count:
                self._note(size, method, count, f"too long already with {fewer:,} at {other[0]}x{other[1]}")
                return True
        ms = predict(self._known.get((size, method), []), count)
        if ms is None or ms <= 1e3 * self.longest:
            return False
        self._stop(size, method, count, f"a frame would take about {ms / 1e3:.3g} s")
        return True

    def is_too_long(self, size: Size, method: str, count: int, ms: float) -> bool:
        """Whether to leave a method out of a step after a frame that took so long; that is noted."""
        if ms <= 1e3 * self.longest:
            return False
        self._stop(size, method, count, f"a frame took {ms / 1e3:.3g} s")
        return True

    def _stop(self, size: Size, method: str, count: int, because: str) -> None:
        self._stops.setdefault(method, []).append((size, count))
        self._note(size, method, count, f"{because}, more than {self.longest:g} s")

    def _note(self, size: Size, method: str, count: int, because: str) -> None:
        self.rows.append({"size": list(size), "lights": count, "method": method, "because": because})
