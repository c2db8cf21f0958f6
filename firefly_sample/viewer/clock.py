"""The time of the scene, and the rate of the frames."""

from __future__ import annotations

PERIOD = 0.4
"""Seconds over which the rate is averaged; its text changes as often."""


class Clock:
    """Scene time, which follows the wall clock and can be paused.

    Parameters
    ----------
    start : float
        Scene time now, in seconds.
    now : float
        The wall clock's time, as in every method: seconds, monotonic, from any origin.
    """

    def __init__(self, start: float, now: float) -> None:
        self._time = start
        self._since: float | None = now

    @property
    def paused(self) -> bool:
        """True while time stands still."""
        return self._since is None

    def time(self, now: float) -> float:
        """Return the scene time in seconds."""
        return self._time if self._since is None else self._time + (now - self._since)

    def toggle(self, now: float) -> None:
        """Pause, or continue from the time of the pause."""
        self._time = self.time(now)
        self._since = now if self.paused else None


class RateMeter:
    """Frames per second and GPU time per frame, averaged over `PERIOD`."""

    def __init__(self) -> None:
        self._began: float | None = None
        self._frames = 0
        self._gpu = 0.0
        self.text = "measuring"

    def add(self, now: float, gpu_milliseconds: float) -> bool:
        """Count a frame that was drawn at `now` (seconds of any clock); return True if `text` has changed."""
        if self._began is None:
            self._began = now
            return True
        self._frames += 1
        self._gpu += gpu_milliseconds
        if now - self._began < PERIOD:
            return False
        rate = self._frames / (now - self._began)
        self.text = f"{rate:.{0 if rate >= 10 else 1}f} fps, GPU {self._gpu / self._frames:.1f} ms"
        self._began, self._frames, self._gpu = now, 0, 0.0
        return True
