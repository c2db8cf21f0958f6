"""What the text in the corner says: counts, times and values, calm enough to be read."""

from __future__ import annotations

from firefly_sample.frame import Frame
from firefly_sample.viewer.overlay import Rows
from firefly_sample.viewer.shown_scene import Stage, value_text

PERIOD = 0.4
"""Seconds over which rates are averaged; the text changes as often."""
MOST_PARAMETERS = 8


class Meter:
    """Frames a second and GPU time a frame, averaged over `PERIOD`."""

    def __init__(self) -> None:
        self._began: float | None = None
        self._frames = 0
        self._gpu = 0.0
        self.text = "measuring"

    def add(self, now: float, gpu_milliseconds: float) -> bool:
        """Count a frame that is drawn at `now` (seconds of any clock); True if `text` has changed."""
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


def status_rows(stage: Stage, frame: Frame, rate: str, paused: bool, test: str = "") -> Rows:
    """Names and values for the corner; `test` is how far a performance test is.

    Of a scene with more than `MOST_PARAMETERS`, those that are not as they are by default.
    """
    parameters = stage.plugin.parameters
    if len(parameters) > MOST_PARAMETERS:
        parameters = tuple(p for p in parameters if stage.values[p.name] != p.default)
    counts = frame.lights
    lights = f"{counts.in_view} in view of {counts.in_scene}"
    width, height = frame.size
    return (
        ("time", f"{frame.time:.1f} s{', paused' if paused else ''}"),
        ("lights", lights if not counts.dropped else f"{lights}, {counts.dropped} dropped"),
        ("frame", rate),
        *((("test", test),) if test else ()),
        ("picture", f"{width} x {height}"),
        *((p.name.replace("_", " "), value_text(p, stage.values[p.name])) for p in parameters),
    )
