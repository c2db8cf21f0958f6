"""Whole pictures: what is never drawn, sizes from a pixel to a line of thousands, times far from now."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.measure.stability_cases.bench import SIZE, Bench
from firefly_sample.measure.stability_cases.case import Case, positioned, within_law
from firefly_sample.measure.stability_cases.scenes import (
    GARDEN_FAR,
    GARDEN_LIGHTS,
    GARDEN_NEAR,
    garden,
    wall_scene,
)
from firefly_sample.plan.position_error import position_error
from firefly_sample.reference.shade import nearest_light
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import DirectionalLight, PointLight, PointLights
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes import build_scene, find_scene

__all__ = ["CASES"]

BACKGROUND = (0.125, 0.25, 2.0)
EONS = 1e9


def _background(lights: str, far: float) -> Case:
    """Largest difference to the background where nothing is drawn, whatever passes over it."""

    def run(bench: Bench, method: str) -> float:
        scene = garden()
        scene.background = BACKGROUND
        endless = PointLight("endless")
        endless.set_attenuation((0.0, 0.0, 1.0))
        endless.set_shadow_caster(True, 64)
        scene.root.attach_new_node(endless).set_pos(0, 6, 3)
        for path in scene.root.find_all_matches("sun"):
            sun = path.node()
            assert isinstance(sun, DirectionalLight)
            sun.set_shadow_caster(True, 64)
        scene.camera_node.lens = PerspectiveLens(fov=70.0, near=GARDEN_NEAR, far=far)
        settings = positioned(method, lights=lights)
        drawn = bench.draw(scene, settings, outputs=("radiance", "light", "id"))
        empty = drawn.frame["id"] == -1
        if not 0.1 < empty.mean() < 0.9:
            return 1.0
        off = np.abs(drawn["radiance"][empty] - BACKGROUND).max()
        return float(max(off, np.abs(drawn["light"][empty]).max()))

    return Case(f"background, {lights}, far {far:g}", run, 0.0)


def _size(size: tuple[int, int]) -> Case:
    """A picture's size, against float64 on what is stored, over the largest value."""

    def run(bench: Bench, method: str) -> float:
        settings = positioned(method)
        drawn = bench.draw(garden(), settings, size, ("light", "color"), gbuffer=True)
        _, expected = drawn.expected_light()
        assert drawn.gbuffer is not None
        known = np.isfinite(drawn.gbuffer.position).all(axis=2)
        known &= ~(nearest_light(drawn.gbuffer.position, drawn.plan.lights, 3.0) < 0.02)
        off = np.abs(drawn["light"] - expected)[known]
        return float(off.max(initial=0.0) / (expected[known].max(initial=0.0) or 1.0))

    def bound(method: str) -> float:
        name = {"depth16": "depth24", "stored16f": "stored32f"}.get(method, method)
        if name not in ("depth24", "inverse_matrix"):
            return 1e-5
        error = position_error(name, GARDEN_NEAR, GARDEN_FAR, True, 16.0, 4.0)
        return within_law(1e-5, error, GARDEN_LIGHTS)

    return Case(f"picture of {size[0]}x{size[1]}", run, bound)


def _circling(time: float) -> tuple[ArrayLike, ArrayLike, ArrayLike]:
    """Lights on a circle: a plain function of time, as scenes have them."""
    angle = math.fmod(time, 2.0 * math.pi) + np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False)
    return np.stack([3 * np.cos(angle), 8.0 + 0 * angle, 2 * np.sin(angle)], axis=1), (1, 1, 1), 4.0


def _time(name: str) -> Case:
    """Values that are no number in frames a billion seconds before and after now."""

    def scene_of(bench: Bench) -> Scene:
        if name == "circling lights":
            scene = wall_scene()
            scene.root.attach_new_node(PointLights("circle", function=_circling))
            return scene
        if name not in bench.kept:
            bench.kept[name] = build_scene(find_scene(name))
        kept: Scene = bench.kept[name]
        return kept

    def run(bench: Bench, method: str) -> float:
        scene, wrong = scene_of(bench), 0
        for time in (-EONS, EONS):
            settings = positioned(method)
            drawn = bench.draw(scene, settings, SIZE, ("radiance", "color"), time)
            wrong += int(np.count_nonzero(~np.isfinite(drawn["radiance"])))
        return float(wrong)

    return Case(f"time of 1e9 s either way, {name}", run, 0.0)


CASES = (
    *(_background(lights, 100.0) for lights in ("volumes", "fullscreen", "loop")),
    _background("volumes", math.inf),
    *(_size(size) for size in ((1, 1), (33, 17), (1, 4096), (4096, 1))),
    *(_time(name) for name in ("circling lights", "forest", "lightbulbs")),
)
