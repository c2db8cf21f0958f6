"""A scene in which every buffer has something: a sun and a spotlight that cast shadows, lamps, a shiny ball,
a ball that shines by itself."""

from __future__ import annotations

import numpy as np

from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.light import FadingLight
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.scene.scene import Scene
from tests.scenes import ball, geom_node, wall
from tests.shadows import box

EMISSION = (2.0, 0.6, 0.1)
SPECULAR = (0.2, 0.5, 0.9)


class Workshop:
    """Nothing moves: a frame is the same at any time."""

    name = "workshop"
    summary = "Balls and a box under a sun, a spotlight and lamps."
    parameters = (
        Parameter("shadows", bool, True, "Whether lights cast any.", keys=(KeyStep("k"),), live=False),
        Parameter("lamps", int, 24, "How many.", 0, 10_000),
    )

    def build(self, *, shadows: bool, lamps: int) -> Scene:
        scene = Scene(background=(0.01, 0.015, 0.03))
        floor = geom_node("floor", wall(16.0, 8), Material("floor", (0.45, 0.42, 0.38, 1)))
        scene.root.attach_new_node(floor).set_p(-90)
        things = (
            ("box", box((1.4, 1.2, 2.2)), (-2.0, 0.6, 1.1), Material("wood", (0.6, 0.35, 0.2, 1))),
            ("dull", ball(0.8), (0.2, 1.8, 0.8), Material("clay", (0.3, 0.6, 0.3, 1))),
            ("shiny", ball(1.0, 4), (1.8, -0.4, 1.0), shiny()),
            (
                "ember",
                ball(0.5),
                (0.0, -1.8, 0.5),
                Material("ember", (0.1, 0.05, 0.05, 1), emission=EMISSION),
            ),
        )
        for name, geom, place, material in things:
            scene.root.attach_new_node(geom_node(name, geom, material)).set_pos(*place)
        sun, spot = DirectionalLight("sun", (0.35, 0.33, 0.3)), Spotlight("spot", (1.2, 1.1, 0.8))
        spot.set_cone(15, 22)
        spot.set_attenuation((1.0, 0.0, 0.0))
        self._place(scene, sun, (4.0, -4.0, 6.0), shadows, 256)
        self._place(scene, spot, (-4.0, -3.0, 5.0), shadows, 128)
        rng = np.random.default_rng(3)
        places = rng.uniform((-5, -4, 0.2), (5, 5, 1.6), (lamps, 3))
        scene.root.attach_new_node(PointLights("lamps", places, rng.uniform(0.1, 0.9, (lamps, 3)), 1.8))
        scene.root.attach_new_node(AmbientLight("sky", (0.05, 0.06, 0.08)))
        scene.camera.set_pos(0, -9, 5.5)
        scene.camera.look_at(0, 0, 0.6)
        scene.camera.node().lens = PerspectiveLens(vfov=50, near=0.5, far=60)
        return scene

    def _place(self, scene: Scene, light: FadingLight | DirectionalLight, place, shadows, resolution) -> None:
        light.set_shadow_caster(shadows, resolution)
        path = scene.root.attach_new_node(light)
        path.set_pos(*place)
        path.look_at(0, 0, 0.5)


def shiny() -> Material:
    return Material("enamel", (0.5, 0.1, 0.15, 1), specular=SPECULAR, shininess=40.0)


workshop = Workshop()
