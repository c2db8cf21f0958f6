"""Scene plugins that end the process which draws them, or that only some processes can import."""

from __future__ import annotations

import os
import signal

from firefly_sample.errors import SceneError
from firefly_sample.scene.scene import Scene

if "FIREFLY_TESTS_NO_PLUGIN" in os.environ:
    raise ImportError("this worker lacks a library")


class OwnError(SceneError):
    """An error with a constructor that unpickling cannot call."""

    def __init__(self, name: str, number: int) -> None:
        super().__init__(f"{name} {number}")


class _DeadlyScene(Scene):
    def update(self, time: float) -> None:
        if time == 3.0:
            os.kill(os.getpid(), signal.SIGKILL)
        if time == 4.0:
            raise OwnError("no frame", 4)


class Deadly:
    """The frame at 3 seconds kills its process, and the one at 4 seconds fails."""

    name = "deadly"
    summary = "It kills."
    parameters = ()

    def build(self) -> Scene:
        return _DeadlyScene()


deadly = Deadly()
