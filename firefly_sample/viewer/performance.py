"""The rate of the frames, and the performance test.

In the test the camera goes once around the scene in half a minute, and every frame is counted. A frame counts
when the GPU has finished it: `Renderer.draw` waits for the time of each pass, which the driver reports only
when the pass is done.
"""

from __future__ import annotations

import math
import statistics
from array import array
from dataclasses import asdict, dataclass
from typing import Any

from firefly_sample.errors import SettingsError
from firefly_sample.frame import Frame, LightCounts
from firefly_sample.settings import Settings
from firefly_sample.viewer.orbit import TURN, OrbitCamera

PERIOD = 0.4
"""Seconds over which the rate is averaged; its text changes as often."""
SECONDS = 30.0
"""Default duration of a test."""
LONGEST = 3600.0
TURN_SECONDS = 30.0
"""Duration of one turn of the camera around its pivot."""


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


def check_seconds(seconds: float) -> float:
    """Return the duration of a test as a float; raise a SettingsError unless it is in (0, `LONGEST`]."""
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
    parameters : dict of str to object
        The scene's values at the end.
    size : (int, int)
        Width and height in pixels, at the end.
    frames : int
        Number of frames without the first, which compiles shaders and uploads the scene.
    seconds : float
        From the end of the first frame to the end of the last.
    lights : LightCounts
        In the scene and in view: averages over the frames; dropped: of the last frame.
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
    lights: LightCounts
    milliseconds: dict[str, float]

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
            f"{self.lights.in_view} lights in view of {self.lights.in_scene} ({self.driver})"
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
            "lights": asdict(self.lights),
            "milliseconds": self.milliseconds,
            "settings": self.settings.as_dict(),
        }


class PerformanceTest:
    """A running test of `seconds`, counted from the end of the first frame; see `check_seconds`."""

    def __init__(self, seconds: float = SECONDS) -> None:
        self._limit = check_seconds(seconds)
        self._began: float | None = None
        self._last = 0.0
        self._frames = 0
        self._in_scene = self._in_view = 0
        # packed, because an hour has many frames
        self._milliseconds: dict[str, array[float]] = {}

    def advance(self, now: float, frame: Frame, camera: OrbitCamera) -> None:
        """Count a frame that was finished at `now` (seconds), and turn the camera for the next one.

        The first frame only starts the clock.
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
        count, lights = self._frames, frame.lights
        if count:
            averages = round(self._in_scene / count), round(self._in_view / count)
            lights = LightCounts(*averages, lights.dropped)
        return PerformanceResult(
            scene=scene,
            parameters=dict(parameters),
            settings=settings,
            size=frame.size,
            driver=frame.driver,
            software=frame.software,
            frames=count,
            seconds=self.elapsed,
            lights=lights,
            milliseconds={name: statistics.median(values) for name, values in self._milliseconds.items()},
        )
