"""Scene time from the wall clock, with a pause."""

from __future__ import annotations


class Clock:
    """Says what scene time it is; what is drawn then depends on that time alone.

    Parameters
    ----------
    start : float
        Scene time now, in seconds.
    now : float
        The wall clock's seconds, as in every method: monotonic, from any origin.
    """

    def __init__(self, start: float, now: float) -> None:
        self._time = start
        self._since: float | None = now

    @property
    def paused(self) -> bool:
        """Whether time stands still."""
        return self._since is None

    def time(self, now: float) -> float:
        """Scene time in seconds."""
        return self._time if self._since is None else self._time + (now - self._since)

    def toggle(self, now: float) -> None:
        """Pause, or go on from the time at which it was paused."""
        self._time = self.time(now)
        self._since = now if self.paused else None
