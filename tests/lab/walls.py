"""Scenes of a wall under lights that are known, to measure the speed of."""

from __future__ import annotations

import numpy as np

from firefly_sample.lab.speed import measure_speed
from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.scene import Scene
from tests.scenes import wall_scene

NAME = "tests.lab.walls:object"
SIZE = (64, 48)
PIXELS = 64 * 48
DISTANCE = 10.0


def places(seed, where):
    """Centres and radii, all in view: on the wall, short of it, or behind it without reaching it."""
    rng = np.random.default_rng(seed)
    y = {"on": DISTANCE, "before": 6.0, "behind": 14.0}[where]
    x, z = rng.uniform(-2.0, 2.0, (2, 12))
    return np.stack([x, np.full(12, y), z], axis=1), rng.uniform(0.5, 2.0, 12)


class Walled:
    """Lights around a wall that fills the view, and two behind the camera that nobody draws."""

    name = "walled"
    summary = "Lights around a wall."
    parameters = (
        Parameter("seed", int, 0, "Chooses where the lights are.", 0),
        Parameter("where", str, "on", "Where the lights are."),
        Parameter("wide", bool, False, "One more light, which holds everything in view."),
        Parameter("wall", bool, True, "Whether there is a wall."),
    )

    def build(self, *, seed: int, where: str, wide: bool, wall: bool) -> Scene:
        scene = wall_scene(DISTANCE) if wall else Scene()
        positions, radii = places(seed, where)
        scene.root.attach_new_node(PointLights("lights", positions, radii=radii))
        scene.root.attach_new_node(PointLights("unseen", [(0, -5, 0), (1, -9, 0)], radii=1.0))
        if wide:
            scene.root.attach_new_node(PointLights("wide", [(0, DISTANCE, 0)], radii=1e4))
        return scene


class Counted:
    """As many lights as one says on a wall, and one more that nobody sees; what moves is counted."""

    name = "counted"
    summary = "A number of lights."
    lights_parameter = "lamps"
    parameters = (
        Parameter("lamps", int, 3, "How many lights.", 0, 40),
        Parameter("seed", int, 0, "Chooses where the lights are.", 0),
    )

    def __init__(self) -> None:
        self.times: list[float] = []

    def build(self, *, lamps: int, seed: int) -> Scene:
        scene = _Timed(wall_scene(DISTANCE), self.times)
        rng = np.random.default_rng(seed)
        x, z = rng.uniform(-2.0, 2.0, (2, 40))[:, :lamps]
        positions = np.stack([x, np.full(lamps, DISTANCE), z], axis=1)
        scene.root.attach_new_node(PointLights("lamps", positions, radii=1.5))
        scene.root.attach_new_node(PointLights("unseen", [(0, -5, 0)], radii=1.0))
        return scene


class _Timed(Scene):
    def __init__(self, walled: Scene, times: list[float]) -> None:
        super().__init__(walled.root, walled.camera)
        self._times = times

    def update(self, time: float) -> None:
        self._times.append(time)


object, counted = Walled(), Counted()  # noqa: A001
COUNTED = "tests.lab.walls:counted"


def measure(**options):
    parameters = {name: options.pop(name) for name in ("where", "wide", "wall") if name in options}
    return measure_speed(NAME, parameters=parameters, sizes=[SIZE], **{"rounds": 1, **options})
