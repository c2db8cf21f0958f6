"""Whether the plan warns of positions that are off when the picture really is: neither late nor early.

A surface near a light, under the very lens, is held against float64. The warning must be there where any
pixel is off by more than a display code, and must not where none is off by a tenth of one. In between the
law, which knows neither how the light fades nor where rounding falls, may say either.
"""

from __future__ import annotations

import math

import numpy as np

from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.lab.reference.shading import tone_curve
from firefly_sample.lab.stability_cases.bench import Bench
from firefly_sample.lab.stability_cases.case import Case, error_warning, positioned
from firefly_sample.lab.stability_cases.scenes import geom_node, wall
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb

DISTANCE, FAR, TILT = 50.0, 400.0, 10.0
RATIOS = [10.0 ** (0.5 * power) for power in range(1, 12)]
"""Of the distance and the near plane's."""
LATE, EARLY = 1.0, 0.1
"""Display codes: above the first the warning must be there, below the second it must not."""


def _scene(near: float, reach: float, fades: bool, from_origin: float) -> Scene:
    """A wall, a quarter of a light's reach behind it and as bright there as a display goes."""
    scene = Scene()
    shift = np.array([from_origin, 0.0, 0.0])
    plaster = Material("plaster", (1.0, 1.0, 1.0, 1.0))
    path = scene.root.attach_new_node(geom_node("wall", wall(2.5 * reach, 8), plaster))
    path.set_pos_hpr(*(shift + np.array([0.0, DISTANCE, 0.0])), 0, -TILT, 0)
    beside = 0.25 * reach
    light = PointLight("light", radius=reach)
    strength = 0.95 / 0.75**2
    if fades:
        light.set_attenuation((1.0, 0.0, 1.0 / beside**2))
        strength = 0.95 * 2.0
    light.set_color((strength,) * 3)
    scene.root.attach_new_node(light).set_pos(*(shift + np.array([0.0, DISTANCE - beside, 0.0])))
    scene.camera.set_pos(*shift)
    fov = 2.0 * math.degrees(math.atan(reach / DISTANCE))
    scene.camera_node.lens = PerspectiveLens(fov=fov, aspect_ratio=4 / 3, near=near, far=FAR)
    return scene


def _codes_off(bench: Bench, scene: Scene, settings: Settings) -> float:
    """How many display codes, and parts of them, the worst pixel is off by."""
    drawn = bench.draw(scene, settings, (64, 48), ("radiance", "visibility", "albedo"))
    visibility = np.asarray(drawn.frame["visibility"], dtype=np.int32)
    reference = render_reference(drawn.plan, visibility, albedo=drawn["albedo"], threads=1)
    seen = (visibility[..., :1] >= 0) & (reference.radiance <= 1.0)  # what clips hides an error

    def codes(radiance: np.ndarray) -> np.ndarray:
        return np.asarray(255.0 * linear_to_srgb(tone_curve(np.minimum(radiance, 1.0), "none")))

    off = np.abs(codes(drawn["radiance"]) - codes(reference.radiance))
    return float(np.where(seen, off, 0.0).max())


def _wrong(bench: Bench, method: str, fades: bool, from_origin: float) -> float:
    settings = positioned(
        method,
        normals="rgba32f",
        albedo="rgba32f",
        cutoff_budget=0.0,
        tone="none",
    )
    wrong = 0
    for reach in (1.0, 8.0, 64.0):
        for ratio in RATIOS:
            bench.begin_warnings()
            codes = _codes_off(bench, _scene(DISTANCE / ratio, reach, fades, from_origin), settings)
            warned = error_warning(bench.warnings, method) != ""
            wrong += codes < EARLY if warned else codes > LATE
    bench.begin_warnings()
    return float(wrong)


def _case(name: str, fades: bool, from_origin: float) -> Case:
    return Case(
        f"warnings late or early, {name}",
        lambda bench, method: _wrong(bench, method, fades, from_origin),
        0.0,
    )


CASES = (
    _case("lights with a radius", False, 0.0),
    _case("attenuated lights", True, 0.0),
    _case("far from the origin", False, 1e4),
)
