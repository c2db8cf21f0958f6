"""Scene plugins for the tests of the command line: small, animated, and one that can be broken."""

from __future__ import annotations

from typing import Any

import numpy as np

from firefly_sample.errors import SceneError
from firefly_sample.model.load import load_model
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.scene import Scene
from tests.scenes import ball, ball_scene


class Glade:
    """Balls on a floor; lights circle above them. With a ball of glass, some plans have a warning."""

    name = "glade"
    summary = "Three balls and circling lights."
    lights_parameter = "fireflies"
    parameters = (
        Parameter("fireflies", int, 40, "How many lights.", 0, 20_000),
        Parameter("seed", int, 7, "Chooses where they are.", 0),
        Parameter("reach", float, 2.5, "How far a light reaches.", 0.0, 100.0, "units"),
        Parameter("glass", bool, False, "Put up a ball of glass."),
        Parameter("dusk", bool, True, "Ambient light."),
    )

    def build(self, *, fireflies: int, seed: int, reach: float, glass: bool, dusk: bool) -> Scene:
        scene = ball_scene(lights=0, ambient=(0.05, 0.05, 0.05) if dusk else (0.0, 0.0, 0.0))
        rng = np.random.default_rng(seed)
        radius, height, phase = rng.uniform((0.5, -0.5, 0.0), (5.0, 2.0, 6.28), (fireflies, 3)).T
        colors = rng.uniform(0.3, 1.0, (fireflies, 3))

        def circle(time: float) -> tuple[Any, Any, Any]:
            angle = phase + time
            across, along = radius * np.cos(angle), 10.0 + radius * np.sin(angle)
            return np.stack([across, along, height], axis=1), colors, reach

        scene.root.attach_new_node(PointLights("fireflies", function=circle))
        if glass:
            pane = GeomNode("pane")
            pane.add_geom(ball(), Material("glass", (1, 1, 1, 0.6), alpha_mode="blend"))
            scene.root.attach_new_node(pane).set_pos(0, 6, 1)
        return scene


class Metered(Glade):
    """It brings settings of its own."""

    name = "metered"
    settings = {"exposure": "auto", "normal_format": "oct8", "supersample": 1}  # noqa: RUF012


class Statue:
    """One model from a file, which may be missing or damaged."""

    name = "statue"
    summary = "A model from a file."
    parameters = (Parameter("model", str, "statue.glb", "The file."),)

    def build(self, *, model: str) -> Scene:
        scene = Scene()
        load_model(model).reparent_to(scene.root)
        return scene


class Empty:
    """No parameters, not even a seed."""

    name = "empty"
    summary = "Nothing."
    parameters = ()

    def build(self) -> Scene:
        return Scene()


class Crowded(Empty):
    """Its parameters have the names of options that every scene has."""

    name = "crowded"
    parameters = (
        Parameter("size", float, 1.0, "How big."),
        Parameter("look", bool, False, "Whether it has one."),
    )

    def build(self, *, size: float, look: bool) -> Scene:
        return super().build()


class Doubled(Empty):
    """Two of its parameters would be one option."""

    name = "doubled"
    parameters = (Parameter("size", int, 1, "How big."), Parameter("scene_size", int, 1, "How big."))


class Growing(Glade):
    """Its geometry changes between frames, and with it the names behind the output id."""

    name = "growing"

    def build(self, **parameters: Any) -> Scene:
        return _GrowingScene(super().build(**parameters))


class Ticking(Empty):
    """Says on stdout whenever a frame is planned, for those who must know that it is drawing."""

    name = "ticking"

    def build(self) -> Scene:
        return _TickingScene()


class Failing(Empty):
    """Cannot be drawn from the third second on."""

    name = "failing"

    def build(self) -> Scene:
        return _FailingScene()


class _FailingScene(Scene):
    def update(self, time: float) -> None:
        if time >= 3.0:
            raise SceneError("no fourth frame")


class _TickingScene(Scene):
    def update(self, time: float) -> None:
        print("tick", flush=True)


class _GrowingScene(Scene):
    def __init__(self, grown: Scene) -> None:
        super().__init__(grown.root, grown.camera, grown.background)
        self._extra = GeomNode("extra")
        self._extra.add_geom(ball())

    def update(self, time: float) -> None:
        for path in self.root.find_all_matches("extra"):
            path.detach_node()
        if time >= 1.0:
            self.root.attach_new_node(self._extra).set_pos(1, 5, 1)


glade, statue, empty, growing = Glade(), Statue(), Empty(), Growing()
crowded, doubled, ticking, failing = Crowded(), Doubled(), Ticking(), Failing()
metered = Metered()
