"""A scene for the tests of the window: balls on a floor, and lamps whose number, size and floor keys change.

It prints what the window does to it, one line of JSON each.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene
from tests.scenes import ball_scene


def say(**what: Any) -> None:
    print(json.dumps(what), flush=True)


class LampScene(Scene):
    """Lamps on a circle that turns once in 20 seconds."""

    def __init__(self, count: int, reach: float, dusk: bool) -> None:
        made = ball_scene(lights=0, ambient=(0.1, 0.1, 0.12) if dusk else (0.0, 0.0, 0.0))
        super().__init__(made.root, made.camera, made.background)
        self.count, self.reach = count, reach
        self.root.attach_new_node(PointLights("lamps", function=self.lamps))
        self.root.attach_new_node(Sprites("dots", function=self.dots))

    def lamps(self, time: float) -> tuple[Any, Any, float]:
        angle = np.arange(self.count) / max(self.count, 1) * 2 * np.pi + time * 2 * np.pi / 20
        places = np.stack([4 * np.cos(angle), 10 + 4 * np.sin(angle), np.full(self.count, 0.3)], axis=1)
        return places, np.tile([1.0, 0.8, 0.4], (self.count, 1)), self.reach

    def dots(self, time: float) -> tuple[Any, Any, float]:
        places, colors, _ = self.lamps(time)
        return places, 2.0 * colors, 0.1

    def set(self, name: str, value: Any) -> None:
        if name not in ("lamps", "reach"):
            super().set(name, value)
        say(set=name, value=value)
        setattr(self, "count" if name == "lamps" else name, value)


class Lamps:
    name = "lamps"
    summary = "Lamps that go round."
    parameters = (
        Parameter(
            "lamps",
            int,
            10,
            "How many.",
            0,
            200,
            keys=(KeyStep("up", 1.111, help="more lamps"), KeyStep("down", 0.9, help="fewer lamps")),
        ),
        Parameter(
            "reach",
            float,
            3.0,
            "How far each shines.",
            0.1,
            50.0,
            "units",
            keys=(KeyStep("right", 1.111, help="brighter lamps"), KeyStep("left", 0.9, help="dimmer lamps")),
        ),
        Parameter(
            "dusk", bool, True, "Ambient light.", keys=(KeyStep("d", help="dusk or night"),), live=False
        ),
    )

    def build(self, *, lamps: int, reach: float, dusk: bool) -> Scene:
        say(build={"lamps": lamps, "reach": reach, "dusk": dusk})
        return LampScene(lamps, reach, dusk)


lamps = Lamps()
