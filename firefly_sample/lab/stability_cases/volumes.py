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

from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.lab.stability_cases.bench import Bench
from firefly_sample.lab.stability_cases.case import ACCURATE, Case, positioned, within_law
from firefly_sample.lab.stability_cases.scenes import WALL, facing_wall, geom_node, wall, wall_scene
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.plan.position_error import position_error
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import PointLight, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

CONES = {"narrow": (8.0, 12.0), "wide": (30.0, 50.0), "wider": (60.0, 85.0)}
"""Drawn as a cone, as a cone, and as a sphere."""
FLOAT_STEP = 2.0**-24
"""What float32 may round of a number, relative."""


def missed(bench: Bench, scene: Scene, settings: Settings, capabilities: Capabilities | None = None) -> float:
    """Share of pixels where volumes or clusters differ from full-screen passes; 1 if none is lit: no proof.

    A method whose positions are noise lights by chance: only accurate ones must light anything.
    """
    given: dict[str, Any] = {"capabilities": capabilities}
    volumes = bench.draw(scene, settings, **given)["radiance"]
    everywhere = bench.draw(scene, settings.with_changes(light_method="fullscreen"), **given)["radiance"]
    accurate = settings.position != "depth32f" if capabilities else True
    if accurate and bench.law_of(settings.position) in ACCURATE and not everywhere.any():
        return 1.0
    cells = bench.draw(scene, settings.with_changes(light_method="clustered"), **given)["radiance"]
    return float(((volumes != everywhere) | (cells != everywhere)).any(axis=2).mean())


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


FAR_AWAY, BEFORE, ABOVE = 1000.0, 0.3, 0.1
"""Where the wall of the small far lights is, and how far before it and above its middle they are."""
TILTS = 20.0, 60.0
BESIDE = BEFORE * math.cos(math.radians(60.0)) + ABOVE * math.sin(math.radians(60.0))
"""How near the lights come to the wall, at the larger tilt."""
FADES = 0.6
"""(1 - d)^2 and the cosine change by at most 5 of themselves for each unit there, not by 2 / d."""


def _far_scene(kind: str, tilt: float, near: float) -> Scene:
    scene = Scene()
    scene.camera_node.lens = PerspectiveLens(vfov=0.15, near=near, far=3.0 * FAR_AWAY)
    plane = scene.root.attach_new_node(geom_node("wall", wall(60.0, 8)))
    plane.set_pos_hpr(0, FAR_AWAY, 0, 0, -tilt, 0)
    scene.root.attach_new_node(_light(kind, 1.0)).set_pos(0, FAR_AWAY - BEFORE, ABOVE)
    return scene


def _far(ratio: float) -> Case:
    """A light of reach 1, a thousand units away, behind a near plane that is as near as `ratio` says.

    The largest difference to float64, over its largest value. Methods that find the surface must also light
    the same pixels by volumes and by full-screen passes, through a standard depth buffer as well, which is
    what there is without clip control.
    """
    near = FAR_AWAY / ratio

    def expected_of(bench: Bench, kind: str, tilt: float) -> Float64:
        key = f"small far {kind}, {tilt:g}"
        if key not in bench.kept:
            settings = positioned("linear32f", light_method="fullscreen")
            drawn = bench.draw(_far_scene(kind, tilt, 0.1), settings, outputs=("light", "visibility"))
            visibility = np.asarray(drawn.frame["visibility"], dtype=np.int32)
            bench.kept[key] = render_reference(drawn.plan, visibility, threads=1).light
            bench.begin_warnings()
        kept: Float64 = bench.kept[key]
        return kept

    def run(bench: Bench, method: str) -> float:
        worst = 0.0
        for kind, tilt in product(("point", "spot"), TILTS):
            expected = expected_of(bench, kind, tilt)
            scene = _far_scene(kind, tilt, near)
            light = bench.draw(scene, positioned(method, normals="rgba32f"), outputs=("light",))["light"]
            worst = max(worst, float(np.abs(light - expected).max() / expected.max()))
            if bench.law_of(method) not in ACCURATE:
                continue
            for capabilities in (None, Capabilities(clip_control=False, snorm_targets=False)):
                if missed(bench, scene, positioned(method), capabilities):
                    return math.inf
        return worst

    def bound(method: str) -> float:
        error = position_error(method, near, 3.0 * FAR_AWAY, True, FAR_AWAY)
        return within_law(1e-6, error, BESIDE, FADES)

    return Case(f"small far light at y/n {ratio:g}", run, bound)


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


def _below_a_pixel(reach: float) -> Case:
    """Largest difference to float64 on what is stored, over its largest value.

    Infinite if a pixel is lit and must not be, or the other way, or differs from a full-screen pass.
    """
    before = 0.4 * reach

    def run(bench: Bench, method: str) -> float:
        worst = 0.0
        settings = positioned(method)
        for kind, size in product(("point", "spot"), ((65, 49), (64, 48))):
            scene = wall_scene(cells=4)
            light = scene.root.attach_new_node(_light(kind, reach))
            light.set_pos(0.003, WALL - before, 0.002)
            drawn = bench.draw(scene, settings, size, ("light",), gbuffer=True)
            everywhere = bench.draw(scene, settings.with_changes(light_method="fullscreen"), size, ("light",))
            _, expected = drawn.expected_light()
            given = drawn["light"]
            if ((given > 0) != (expected > 0)).any() or (given != everywhere["light"]).any():
                return math.inf
            worst = max(worst, float(np.abs(given - expected).max() / (expected.max() or 1.0)))
        return worst

    def bound(method: str) -> float:
        own = 1e-5
        if method == "linear32f":
            return own
        if method in ("stored16f", "stored32f"):
            return own + 2.0 * FLOAT_STEP * WALL / before  # what is stored is the place, in float32's steps
        # of what is stored, 16 bits are computed with as 24 are
        name = {"depth16": "depth24"}.get(method, method)
        return within_law(own, position_error(name, 1.0, 100.0, True, WALL), before)

    return Case(f"light below a pixel, reach {reach:g}", run, bound)


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
    *(_below_a_pixel(reach) for reach in (0.02, 0.1, 0.3)),
)
