"""Spotlights from a hundredth of a degree to nearly a half space, against float64 on what is stored."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.shade import each_light
from firefly_sample.lab.stability_cases.bench import Bench, Drawn
from firefly_sample.lab.stability_cases.case import Case, positioned
from firefly_sample.lab.stability_cases.scenes import WALL, geom_node, wall
from firefly_sample.lab.stability_cases.volumes import missed
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import Spotlight
from firefly_sample.scene.scene import Scene

NEAR, FAR, LIGHT = 0.5, 100.0, 4.0
BOUND = 1e-5


def _scene(half: float, soft: float) -> Scene:
    scene = Scene()
    fov = min(4.0 * half, 80.0)
    scene.camera_node.lens = PerspectiveLens(vfov=fov, near=NEAR, far=FAR)
    scene.root.attach_new_node(geom_node("wall", wall(60.0, 8))).set_pos_hpr(0, WALL, 0, 20, -15, 0)
    light = Spotlight("light")
    light.set_cone(soft * half if soft else half, half)
    path = scene.root.attach_new_node(light)
    path.set_pos(0.3 * math.tan(math.radians(fov / 2.0)), LIGHT, 0.0)
    path.look_at(0.0, WALL, 0.0)
    return scene


def _on_the_edge(drawn: Drawn) -> NDArray[np.bool_]:
    """Pixels where a hard cone ends: float32 may find them on the other side."""
    assert drawn.gbuffer is not None
    place = drawn.gbuffer.position.reshape(-1, 3)
    edge = np.zeros(len(place), dtype=bool)
    for one in each_light(drawn.plan.lights):
        inner, outer, _ = one.lights.cones[one.row]
        if inner == outer:
            to_light, _ = one.directions(place)
            direction = one.lights.directions[one.row]
            across = np.linalg.norm(np.cross(to_light, direction), axis=1)
            angle = np.arctan2(across, -(to_light @ direction))
            half = 2.0 * np.arcsin(np.sqrt(outer / 2.0))
            edge |= np.abs(angle - half) < 1e-6 + 1e-5 * half
    return edge.reshape(drawn.gbuffer.position.shape[:-1])


def _cone(half: float) -> Case:
    def run(bench: Bench, method: str) -> float:
        worst = 0.0
        settings = positioned(method)
        for soft in (0.0, 0.7):
            scene = _scene(half, soft)
            drawn = bench.draw(scene, settings, outputs=("light",), gbuffer=True)
            _, expected = drawn.expected_light()
            if not expected.any():
                return math.inf
            off = np.abs(drawn["light"] - expected)[~_on_the_edge(drawn)]
            worst = max(worst, float(off.max() / np.percentile(expected, 99.9)))
            if missed(bench, scene, settings):
                return math.inf
        return worst

    return Case(f"spot of {half:g} degrees", run, BOUND)


CASES = tuple(_cone(half) for half in (180.0, 120.0, 89.9, 60.0, 53.0, 52.9, 1.0, 0.1, 0.01))
