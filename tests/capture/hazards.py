"""Scene plugins that end the process that draws them, or keep it busy, at some times."""

from __future__ import annotations

import os
import signal
import time as clock
from pathlib import Path
from typing import Any

from firefly_sample.capture.job import Job
from firefly_sample.errors import FireflyError
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings


class OddError(FireflyError):
    """It can be pickled, but not unpickled."""

    def __init__(self, one: str, two: str) -> None:
        super().__init__(one + two)


class Hazards:
    """A frame at each second: 2 ends its process, 3 does so the first time, and 4 fails."""

    name = "hazards"
    summary = "Ends processes."
    parameters = (
        Parameter("marker", str, "marker", "The file that is there after the first time."),
        Parameter("in_build", bool, False, "End each process when the scene is built."),
    )

    def build(self, *, marker: str, in_build: bool) -> Scene:
        if in_build:
            os._exit(7)
        return _HazardsScene(marker)


class _HazardsScene(Scene):
    def __init__(self, marker: str) -> None:
        super().__init__()
        self._marker = Path(marker)

    def update(self, time: float) -> None:
        print(f"second {time:g}")
        os.system(f"echo shell {time:g}")
        if time == 2.0:
            os.kill(os.getpid(), signal.SIGKILL)
        if time == 3.0 and not self._marker.exists():
            self._marker.touch()
            raise MemoryError
        if time == 4.0:
            raise OddError("one", "two")


class Sleeper:
    """Any frame but the first takes ten minutes."""

    name = "sleeper"
    summary = "Takes long."
    parameters = ()

    def build(self) -> Scene:
        return _SleeperScene()


class _SleeperScene(Scene):
    def update(self, time: float) -> None:
        if time > 0.0:
            clock.sleep(600)


hazards, sleeper = Hazards(), Sleeper()


def job(scene: str, size: tuple[int, int] = (64, 48), **changes: Any) -> Job:
    """A job with a frame at each second from 0."""
    parameters = changes.pop("parameters", {})
    return Job(scene, parameters, Settings(), 1.0, size, ("color",), 1.0, 0.0, **changes)
