"""The performance test: the camera goes once around the scene in half a minute, and every frame is counted.

A frame counts when the GPU has finished it: `Renderer.draw` waits for the time of each pass, which the driver
reports only when the pass is done.
"""

from __future__ import annotations

import math
import statistics
from array import array
from dataclasses import dataclass
from typing import Any

from firefly_sample.errors import SettingsError
from firefly_sample.frame import Frame
from firefly_sample.settings import Settings
from firefly_sample.viewer.orbit import TURN, OrbitCamera

SECONDS = 30.0
"""Default duration of a test."""
LONGEST = 3600.0
TURN_SECONDS = 30.0
"""Duration of one turn of the camera around its pivot."""


def check_seconds(seconds: float) -> float:
    """Return the duration of a test as a float.

    Raises
    ------
    SettingsError
        If it is not a finite number above 0, or above `LONGEST`.
    """
    if not 0.0 < seconds <= LONGEST:  # false for NaN, too
        raise SettingsError(
            f"a performance test must last a finite number of seconds above 0, at most {LONGEST:g}, "
            f"got {seconds:g}: {SECONDS:g} are one turn of the camera"
        )
    return float(seconds)


@dataclass(frozen=True)
class PerformanceResult:
    """The results of a performance test.

    Attributes
    ----------
    scene : str
    parameters : dict of str to object
        The scene's values at the end.
    settings : Settings
    size : (int, int)
        Width and height in pixels, at the end.
    driver : str
        The GL renderer string.
    software : bool
        True if that is a software rasteriser.
    frames : int
        Number of frames without the first, which compiles shaders and uploads the scene.
    seconds : float
        From the end of the first frame to the end of the last.
    lights_in_scene, lights_in_view : int
        Averages over the frames.
    milliseconds : dict of str to float
        Median time of each pass over the frames that had it.
    """

    scene: str
    parameters: dict[str, Any]
    settings: Settings
    size: tuple[int, int]
    driver: str
    software: bool
    frames: int
    seconds: float
    lights_in_scene: int
    lights_in_view: int
    milliseconds: dict[str, float]
    lights_dropped: int = 0
    """Lights in view that the last frame did not draw."""

    @property
    def frames_per_second(self) -> float:
        """The average rate; 0 if no frame was counted."""
        return self.frames / self.seconds if self.seconds > 0.0 else 0.0

    def line(self) -> str:
        """Return the result as one line of text."""
        frames = "1 frame" if self.frames == 1 else f"{self.frames} frames"
        width, height = self.size
        return (
            f"performance test: {frames} in {self.seconds:.1f} s, {self.frames_per_second:.1f} frames/s "
            f"at {width}x{height}, "
            f"{self.lights_in_view} lights in view of {self.lights_in_scene} ({self.driver})"
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the result as ``firefly run --performance-test --json`` prints it."""
        return {
            "scene": self.scene,
            "parameters": self.parameters,
            "size": list(self.size),
            "driver": self.driver,
            "software": self.software,
            "frames": self.frames,
            "seconds": self.seconds,
            "frames_per_second": self.frames_per_second,
            "lights": {
                "in_scene": self.lights_in_scene,
                "in_view": self.lights_in_view,
                "dropped": self.lights_dropped,
            },
            "milliseconds": self.milliseconds,
            "settings": self.settings.as_dict(),
        }


class PerformanceTest:
    """A running test, which turns a camera and counts frames.

    Parameters
    ----------
    seconds : float
        Duration, counted from the end of the first frame.

    Raises
    ------
    SettingsError
        See `check_seconds`.
    """

    def __init__(self, seconds: float = SECONDS) -> None:
        self._limit = check_seconds(seconds)
        self._began: float | None = None
        self._last = 0.0
        self._frames = 0
        self._in_scene = self._in_view = 0
        # packed, because an hour has many frames
        self._milliseconds: dict[str, array[float]] = {}

    def advance(self, now: float, frame: Frame, camera: OrbitCamera) -> None:
        """Count a finished frame, and turn the camera for the next one; the first only starts the clock.

        Parameters
        ----------
        now : float
            Seconds of any monotonic clock.
        """
        if self._began is None:
            self._began = self._last = now
            return
        degrees = 360.0 * (now - self._last) / TURN_SECONDS
        self._last = now
        self._frames += 1
        self._in_scene += frame.lights.in_scene
        self._in_view += frame.lights.in_view
        for name, milliseconds in frame.milliseconds.items():
            self._milliseconds.setdefault(name, array("f")).append(milliseconds)
        camera.turn(degrees / TURN, 0.0)

    @property
    def began(self) -> bool:
        """True after the first frame."""
        return self._began is not None

    @property
    def elapsed(self) -> float:
        """Seconds from the end of the first frame to the end of the last one counted."""
        return 0.0 if self._began is None else self._last - self._began

    @property
    def done(self) -> bool:
        """True when the duration is over."""
        return self.elapsed >= self._limit

    @property
    def progress(self) -> str:
        """The progress as text."""
        return f"{math.floor(self.elapsed)} of {self._limit:g} s"

    def result(
        self, scene: str, parameters: dict[str, Any], settings: Settings, frame: Frame
    ) -> PerformanceResult:
        """Return the results so far; `frame` is the last one that was drawn."""
        count = self._frames
        return PerformanceResult(
            scene=scene,
            parameters=dict(parameters),
            settings=settings,
            size=frame.size,
            driver=frame.driver,
            software=frame.software,
            frames=count,
            seconds=self.elapsed,
            lights_in_scene=round(self._in_scene / count) if count else frame.lights.in_scene,
            lights_in_view=round(self._in_view / count) if count else frame.lights.in_view,
            milliseconds={name: statistics.median(values) for name, values in self._milliseconds.items()},
            lights_dropped=frame.lights.dropped,
        )
