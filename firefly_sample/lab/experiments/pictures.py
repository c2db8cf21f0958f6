"""Whole pictures: what is never drawn, sizes from a pixel to a line of thousands, times far from now."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.lab.experiments.bench import SIZE, Bench, Drawn
from firefly_sample.lab.experiments.case import Case, positioned, within_law
from firefly_sample.lab.experiments.scenes import (
    GARDEN_FAR,
    GARDEN_LIGHTS,
    GARDEN_NEAR,
    garden,
    wall_scene,
)
from firefly_sample.lab.reference.shade import nearest_light
from firefly_sample.plan.position_error import position_error
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import DirectionalLight, PointLight, PointLights
from firefly_sample.scenes import build_scene, find_scene

Float64 = NDArray[np.float64]

BACKGROUND = (0.125, 0.25, 2.0)
EONS = 1e9
"""Seconds."""
LIT = 0.25
"""The least share of a picture's pixels that a scene's lights reach."""
SCENES = {"forest": (50.0, 500.0, 377.0, 1.4), "lightbulbs": (0.5, 400.0, 65.0, 0.75)}
"""Near and far planes, how far away something is lit, and a quarter of a light's reach."""
FROM_ORIGIN = 220.0
"""How far the camera is from the world's origin in either, rounded up."""
SHARE = 0.1
"""Of a method's law: only the farthest surface right beside a light could show the whole of it."""


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
        scene.camera_node.lens = PerspectiveLens(vfov=70.0, near=GARDEN_NEAR, far=far)
        settings = positioned(method, light_method=lights)
        drawn = bench.draw(scene, settings, outputs=("radiance", "light", "id"))
        empty = drawn.frame["id"] == -1
        if not 0.1 < empty.mean() < 0.9:
            return 1.0
        off = np.abs(drawn["radiance"][empty] - BACKGROUND).max()
        return float(max(off, np.abs(drawn["light"][empty]).max()))

    return Case(f"background, {lights}, far {far:g}", run, 0.0)


def _error_of_light(drawn: Drawn) -> float:
    """Largest difference to float64 on what is stored, over its largest value, but right beside a light."""
    expected = drawn.expected_light()[1] + np.asarray(drawn.plan.ambient)
    assert drawn.gbuffer is not None
    known = np.isfinite(drawn.gbuffer.position).all(axis=2)
    known &= ~(nearest_light(drawn.gbuffer.position, drawn.plan.lights, 3.0) < 0.02)
    if not expected[known].any():
        return math.inf
    return float(np.abs(drawn["light"] - expected)[known].max() / expected[known].max())


def _size(size: tuple[int, int]) -> Case:
    """A picture's size, against float64 on what is stored, over the largest value."""

    def run(bench: Bench, method: str) -> float:
        settings = positioned(method)
        drawn = bench.draw(garden(), settings, size, ("light", "color"), gbuffer=True)
        return _error_of_light(drawn)

    def bound(method: str) -> float:
        name = {"depth16": "depth24", "stored16f": "stored32f"}.get(method, method)
        if name not in ("depth24", "inverse_matrix"):
            return 1e-5
        error = position_error(name, GARDEN_NEAR, GARDEN_FAR, True, 16.0, 4.0)
        return within_law(1e-5, error, GARDEN_LIGHTS)

    return Case(f"picture of {size[0]}x{size[1]}", run, bound)


AROUND = np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False)
REACH = 4.0


def _on_ellipse(cosine: Float64, sine: Float64) -> Float64:
    return np.stack([3.0 * cosine, np.full(len(AROUND), 8.0), 2.0 * sine], axis=1)


def _circling(time: float) -> tuple[ArrayLike, ArrayLike, ArrayLike]:
    """Lights on an ellipse: a plain function of time, as scenes have them."""
    return _on_ellipse(np.cos(time + AROUND), np.sin(time + AROUND)), (1, 1, 1), REACH


def _places_at(time: float) -> Float64:
    """Where `_circling` puts its lights, to float64's own accuracy: `time` itself is not rounded by a sum."""
    cosine, sine = math.cos(time), math.sin(time)
    return _on_ellipse(
        cosine * np.cos(AROUND) - sine * np.sin(AROUND), sine * np.cos(AROUND) + cosine * np.sin(AROUND)
    )


def _time_of_circling(bench: Bench, method: str) -> float:
    """Lights that move, against lights that stand where they are a billion seconds before and after now."""
    worst = 0.0
    for time in (-EONS, EONS):
        moving, standing = wall_scene(), wall_scene()
        moving.root.attach_new_node(PointLights("circle", function=_circling))
        standing.root.attach_new_node(PointLights("circle", _places_at(time), (1, 1, 1), REACH))
        given = bench.draw(moving, positioned(method), time=time)["radiance"]
        expected = bench.draw(standing, positioned(method))["radiance"]
        if not expected.any():
            return math.inf
        worst = max(worst, float(np.abs(given - expected).max() / expected.max()))
    return worst


def _time_of_scene(name: str) -> Case:
    """A scene a billion seconds before and after now, against float64 on what is stored."""

    def run(bench: Bench, method: str) -> float:
        if name not in bench.kept:
            bench.kept[name] = build_scene(find_scene(name))
        worst = 0.0
        for time in (-EONS, EONS):
            drawn = bench.draw(bench.kept[name], positioned(method), SIZE, ("light", "color"), time, True)
            if (drawn["light"] > 1.01 * drawn.plan.ambient + 1e-3).any(axis=2).mean() < LIT:
                return math.inf
            worst = max(worst, _error_of_light(drawn))
        return worst

    def bound(method: str) -> float:
        if method in ("linear32f", "stored32f"):
            return 1e-5
        # of what is stored, 16 bits are computed with as 24 are
        method = {"depth16": "depth24"}.get(method, method)
        near, far, farthest, beside = SCENES[name]
        error = position_error(method, near, far, True, farthest, FROM_ORIGIN)
        return within_law(1e-5, error, beside, SHARE)

    return Case(f"time of 1e9 s either way, {name}", run, bound)


CASES = (
    *(_background(lights, 100.0) for lights in ("volumes", "clustered", "fullscreen", "loop")),
    _background("volumes", math.inf),
    *(_size(size) for size in ((1, 1), (33, 17), (1, 4096), (4096, 1))),
    Case("time of 1e9 s either way, circling lights", _time_of_circling, 1e-6),
    *(_time_of_scene(name) for name in SCENES),
)
