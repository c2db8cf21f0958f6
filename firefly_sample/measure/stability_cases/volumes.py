"""Light volumes, wherever they lie and whatever their size: no lit pixel is missed.

Volumes are held against one full-screen pass a light, which cannot miss any: the pictures are equal, to the
bit.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.measure.stability_cases.bench import Bench
from firefly_sample.measure.stability_cases.case import ACCURATE, Case, positioned
from firefly_sample.measure.stability_cases.scenes import facing_wall, geom_node, wall, wall_scene
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.spotlight import Spotlight
from firefly_sample.settings import Settings

__all__ = ["CASES", "missed"]

Float64 = NDArray[np.float64]

CONES = {"narrow": (8.0, 12.0), "wide": (30.0, 50.0), "wider": (60.0, 85.0)}
"""Drawn as a cone, as a cone, and as a sphere."""


def missed(bench: Bench, scene: Scene, settings: Settings, capabilities: Capabilities | None = None) -> float:
    """Share of pixels where volumes and full-screen passes differ; 1 if none is lit, which proves nothing.

    A method whose positions are noise lights by chance: only accurate ones must light anything.
    """
    given: dict[str, Any] = {"capabilities": capabilities}
    volumes = bench.draw(scene, settings, **given)["radiance"]
    everywhere = bench.draw(scene, settings.with_changes(lights="fullscreen"), **given)["radiance"]
    accurate = settings.position != "depth32f" if capabilities else True
    if accurate and bench.law_of(settings.position) in ACCURATE and not everywhere.any():
        return 1.0
    return float((volumes != everywhere).any(axis=2).mean())


def _light(kind: str, reach: float | None) -> PointLight | Spotlight:
    if kind == "point":
        return PointLight("light", radius=reach)
    spot = Spotlight("light", radius=reach)
    if kind in CONES:
        spot.set_cone(*CONES[kind])
    return spot


def _placed(name: str, place: tuple[float, float, float], reach: float) -> Case:
    def run(bench: Bench, method: str) -> float:
        worst = 0.0
        for kind in ("point", *CONES):
            scene = wall_scene(cells=8)
            scene.root.find("wall").set_p(-80)  # faces the eye and the sky
            facing_wall(scene, _light(kind, reach), place)
            worst = max(worst, missed(bench, scene, positioned(method)))
        return worst

    return Case(f"volume {name}", run, 0.0)


def _far(ratio: float) -> Case:
    """A light of reach 1, a thousand units away, behind a near plane that is as near as `ratio` says.

    Also through a standard depth buffer, which is what there is without clip control.
    """

    def run(bench: Bench, method: str) -> float:
        y, worst = 1000.0, 0.0
        for kind, tilt in product(("point", "spot"), (20.0, 60.0)):
            scene = Scene()
            scene.camera_node.lens = PerspectiveLens(fov=0.15, near=y / ratio, far=3.0 * y)
            plane = scene.root.attach_new_node(geom_node("wall", wall(60.0, 8)))
            plane.set_pos_hpr(0, y, 0, 0, -tilt, 0)
            light = scene.root.attach_new_node(_light(kind, 1.0))
            light.set_pos(0, y - (0.3 if kind == "spot" else 0.0), 0.1)
            for capabilities in (None, Capabilities(clip_control=False, snorm_targets=False)):
                worst = max(worst, missed(bench, scene, positioned(method), capabilities))
        return worst

    return Case(f"small far light at y/n {ratio:g}", run, 0.0)


def _endless(reach: float) -> Case:
    def run(bench: Bench, method: str) -> float:
        worst = 0.0
        for kind in ("point", "spot"):
            material = Material("shiny", (0.5, 0.5, 0.5, 1.0), specular=(0.5, 0.5, 0.5), shininess=20.0)
            scene = wall_scene(cells=4, material=material)
            light = _light(kind, None)
            light.set_max_distance(reach)
            scene.root.attach_new_node(light).set_pos(1, 3, 1)
            worst = max(worst, missed(bench, scene, positioned(method)))
        return worst

    return Case(f"reach {reach:g}", run, 0.0)


def _below_a_pixel(bench: Bench, method: str) -> float:
    """Share of pixels that are lit and must not be, or the other way, by float64 on what is stored."""
    worst = 0.0
    settings = positioned(method)
    for kind in ("point", "spot"):
        for size in ((65, 49), (64, 48)):
            for reach in (0.02, 0.1, 0.3):
                scene = wall_scene(cells=4)
                light = scene.root.attach_new_node(_light(kind, reach))
                light.set_pos(0.003, 10.0 - 0.4 * reach, 0.002)
                drawn = bench.draw(scene, settings, size, ("light",), gbuffer=True)
                _, expected = drawn.expected_light()
                worst = max(worst, float(((drawn["light"] > 0) != (expected > 0)).mean()))
                everywhere = bench.draw(scene, settings.with_changes(lights="fullscreen"), size, ("light",))
                worst = max(worst, float((drawn["light"] != everywhere["light"]).mean()))
    return worst


CASES = (
    *(_far(ratio) for ratio in (1e3, 1e4, 1e6, 1e9)),
    _placed("around the camera", (0.0, 0.5, 0.5), 30.0),
    _placed("from behind the camera", (0.0, -3.0, 2.0), 30.0),
    _placed("across the near plane", (0.0, 1.5, 0.0), 9.5),
    _placed("across the far plane", (0.0, 99.0, 40.0), 120.0),
    _placed("that holds the view", (0.0, 9.0, 2.0), 1e3),
    _placed("from beside", (30.0, 9.0, 5.0), 60.0),
    _placed("of radius 1e20", (0.0, 9.0, 2.0), 1e20),
    _placed("of radius 1e300", (0.0, 9.0, 2.0), 1e300),
    *(_endless(reach) for reach in (1e20, 1e36, 1e38, math.inf)),
    Case("light below a pixel", _below_a_pixel, 0.0),
)
