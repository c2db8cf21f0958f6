"""Light volumes of any position and size: they miss no lit pixel.

Volumes are compared with one full-screen pass per light, which cannot miss any: the pictures are equal, to
the bit.
"""

from __future__ import annotations

import math
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import EPS, Experiment, relative_error
from firefly_sample.lab.experiments.position_bounds import ACCURATE, decoded_as, positioned, within_law
from firefly_sample.lab.experiments.scenes import WALL, geom_node, wall, wall_scene
from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.plan.position_error import position_error
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import PointLight, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

CONES = {"narrow": (8.0, 12.0), "wide": (30.0, 50.0), "wider": (60.0, 85.0)}
"""Half-angles in degrees; the volumes of the first two are cones, that of the last is a sphere."""


def missed(
    bench: ExperimentBench, scene: Scene, settings: Settings, capabilities: Capabilities | None = None
) -> float:
    """Return the share of pixels where volumes or clusters differ from full-screen passes.

    It is 1 if no pixel is lit, which would prove nothing. Only accurate methods must light any: positions of
    the others may be noise.
    """

    def radiance(light_method: str) -> Float64:
        changed = settings.with_changes(light_method=light_method)
        return bench.draw(scene, changed, capabilities=capabilities)["radiance"]

    volumes, everywhere = radiance(settings.light_method), radiance("fullscreen")
    accurate = settings.position_method != "depth32f" if capabilities else True
    if accurate and bench.law_of(settings.position_method) in ACCURATE and not everywhere.any():
        return 1.0
    return float(((volumes != everywhere) | (radiance("clustered") != everywhere)).any(axis=2).mean())


def _light(kind: str, reach: float | None) -> PointLight | Spotlight:
    if kind == "point":
        return PointLight("light", radius=reach)
    spot = Spotlight("light", radius=reach)
    if kind in CONES:
        spot.set_cone(*CONES[kind])
    return spot


def _placed(name: str, position: tuple[float, float, float], reach: float) -> Experiment:
    def run(bench: ExperimentBench, method: str) -> float:
        shares = []
        for kind in ("point", *CONES):
            scene = wall_scene(cells=8)
            scene.root.find("wall").set_p(-80)  # faces the eye and the sky
            path = scene.root.attach_new_node(_light(kind, reach))
            path.set_pos(*position)
            path.look_at(0.0, 12.0, -1.0)  # towards the wall
            shares.append(missed(bench, scene, positioned(method)))
        return max(shares)

    return Experiment(f"volume {name}", run, bound=0.0)


FAR_AWAY, BEFORE, ABOVE = 1000.0, 0.3, 0.1
"""Distance of the wall of the small far lights, and their distances in front of it and above its middle."""
TILTS = 20.0, 60.0
BESIDE = BEFORE * math.cos(math.radians(60.0)) + ABOVE * math.sin(math.radians(60.0))
"""Distance of the lights from the wall, at the larger tilt."""
FADES = 0.6
"""(1 - d)^2 and the cosine change by at most 5 of themselves for each unit there, not by 2 / d."""


def _far_scene(kind: str, tilt: float, near: float) -> Scene:
    scene = Scene()
    scene.camera_node.lens = PerspectiveLens(vfov=0.15, near=near, far=3.0 * FAR_AWAY)
    plane = scene.root.attach_new_node(geom_node("wall", wall(60.0, 8)))
    plane.set_pos_hpr(0, FAR_AWAY, 0, 0, -tilt, 0)
    scene.root.attach_new_node(_light(kind, 1.0)).set_pos(0, FAR_AWAY - BEFORE, ABOVE)
    return scene


def _far_reference(bench: ExperimentBench, kind: str, tilt: float) -> Float64:
    settings = positioned("linear32f", light_method="fullscreen")
    drawn = bench.draw(_far_scene(kind, tilt, 0.1), settings, outputs=("light", "visibility"))
    bench.warnings.clear()
    return render_reference(drawn.plan, drawn.visibility(), threads=1).light


def _far(ratio: float) -> Experiment:
    """Return the case of a light of reach 1, a thousand units and `ratio` near-plane distances away.

    It measures the largest difference to float64, over its largest value. Accurate methods must also light
    the same pixels by volumes and by full-screen passes, as well through the standard depth buffer of drivers
    without clip control.
    """
    near = FAR_AWAY / ratio

    def run(bench: ExperimentBench, method: str) -> float:
        worst = 0.0
        for kind, tilt in product(("point", "spot"), TILTS):
            expected = bench.once(("far", kind, tilt), partial(_far_reference, bench, kind, tilt))
            scene = _far_scene(kind, tilt, near)
            light = bench.draw(scene, positioned(method, normal_format="rgba32f"), outputs=("light",))[
                "light"
            ]
            worst = max(worst, relative_error(light, expected))
            if bench.law_of(method) not in ACCURATE:
                continue
            for capabilities in (None, Capabilities(clip_control=False, snorm_targets=False)):
                if missed(bench, scene, positioned(method), capabilities):
                    return math.inf
        return worst

    def bound(method: str) -> float:
        error = position_error(method, near, 3.0 * FAR_AWAY, True, FAR_AWAY)
        return within_law(1e-6, error, BESIDE, FADES)

    return Experiment(f"small far light at y/n {ratio:g}", run, bound=bound)


def _endless(reach: float) -> Experiment:
    def run(bench: ExperimentBench, method: str) -> float:
        worst = 0.0
        for kind in ("point", "spot"):
            material = Material("shiny", (0.5, 0.5, 0.5, 1.0), specular=(0.5, 0.5, 0.5), shininess=20.0)
            scene = wall_scene(cells=4, material=material)
            light = _light(kind, None)
            light.set_max_distance(reach)
            scene.root.attach_new_node(light).set_pos(1, 3, 1)
            worst = max(worst, missed(bench, scene, positioned(method)))
        return worst

    return Experiment(f"reach {reach:g}", run, bound=0.0)


def _below_a_pixel(reach: float) -> Experiment:
    """Return the case of a light smaller than a pixel.

    It measures the largest relative difference from the float64 reference. It is infinite if a pixel is lit
    that must not be, or is not lit that must be, or differs from a full-screen pass.
    """
    before = 0.4 * reach

    def run(bench: ExperimentBench, method: str) -> float:
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
            return own + 2.0 * EPS * WALL / before  # the position itself is stored, rounded to float32
        return within_law(own, position_error(decoded_as(method), 1.0, 100.0, True, WALL), before)

    return Experiment(f"light below a pixel, reach {reach:g}", run, bound=bound)


EXPERIMENTS = (
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
