"""Scenes far from the world's origin and in other units: the picture must stay the same."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.blocks import view_values
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import Experiment, relative_error
from firefly_sample.lab.experiments.position_bounds import ACCURATE, positioned, within_law
from firefly_sample.lab.experiments.scenes import GARDEN_FAR, GARDEN_LIGHTS, GARDEN_NEAR, garden
from firefly_sample.lab.probes.probe import evaluate
from firefly_sample.plan.position_error import position_error
from firefly_sample.plan.view import View
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.transform_state import TransformState

Float64 = NDArray[np.float64]

EXACT, ROUNDED = 1e-6, 1e-4
"""Bounds where float64 represents every position, and where it rounds them: relative to the largest value."""
FARTHEST = 16.0
"""Largest distance of a lit surface in the garden, along the view axis."""
SHARE = 0.1
"""Of a method's law: both pictures store positions in the same steps, so only few pixels differ in one."""
SMALLEST_HALF = 2.0**-24
"""The rounding error of half floats near 0, in any units."""
SMALLEST_POWER = -20
"""Of 2: half floats cannot represent scenes that are smaller."""


def _changed(name: str, bound: Callable[[str], float], scale: float = 1.0, offset: float = 0.0) -> Experiment:
    """Return the case of the garden that is moved or scaled: its largest relative difference."""

    def run(bench: ExperimentBench, method: str) -> float:
        settings = positioned(method)
        here = bench.draw(garden(), settings)["radiance"]
        bench.warnings.clear()
        there = bench.draw(garden(scale, offset * np.array([1.0, 1.0, -1.0])), settings)["radiance"]
        return relative_error(there, here)

    return Experiment(name, run, bound=bound)


def _bound(method: str, own: float, scale: float = 1.0, offset: float = 0.0) -> float:
    if method in ACCURATE:
        return own
    near, far, farthest = scale * GARDEN_NEAR, scale * GARDEN_FAR, scale * FARTHEST
    error = position_error(method, near, far, True, farthest, 3.0**0.5 * offset)
    return within_law(own, error, scale * GARDEN_LIGHTS, SHARE)


def _bound_of_power(method: str, power: int) -> float:
    """Return the bound of a scale that is a power of two, which changes no digit: the picture is the same."""
    if method != "stored16f" or not SMALLEST_POWER < power <= 0:
        return 0.0
    return SHARE * 2.0 * SMALLEST_HALF / (2.0**power * GARDEN_LIGHTS)


def _distance_errors(bench: ExperimentBench, offset: float, samples: int) -> tuple[float, ...]:
    """Return errors of a light's distance in float32: in world and view space with bounds, from pixels."""
    size = (1024, 768)
    lens = PerspectiveLens(fov=60.0, aspect_ratio=size[0] / size[1], near=0.1, far=100.0).constants()
    camera = TransformState.make_pos_hpr_scale_shear((offset, offset, offset), (30.0, -7.5, 2.4)).get_mat()
    back = np.linalg.inv(camera[:3, :3])
    view = View(size, lens, False, 0.1, 100.0, np.eye(4), camera)
    rng = np.random.Generator(np.random.PCG64(7))
    pixel = np.floor(rng.uniform(size=(samples, 2)) * size) + 0.5
    ndc_x, ndc_z = (pixel * 2.0 / size - 1.0).T
    surface = lens.view_from_distance(ndc_x, ndc_z, rng.uniform(5.0, 100.0, samples))
    direction = rng.normal(size=(samples, 3))
    light = surface + direction / np.linalg.norm(direction, axis=1, keepdims=True)
    light[:, 1] = light[:, 1].astype(np.float32)  # a light's record keeps the digits beyond float32, too
    exact = np.linalg.norm(light - surface, axis=1)

    def largest(found: NDArray[np.float32]) -> float:
        return float(np.abs(found.astype(np.float64) - exact).max())

    def by_distance(one: Float64, other: Float64) -> float:
        one, other = (np.pad(positions, ((0, 0), (0, 1))) for positions in (one, other))
        return largest(
            evaluate(bench.device, [], "result.r = distance(a.xyz, b.xyz);", one, more=other)[:, 0]
        )

    def bound(coordinate: float) -> float:
        """Return the error if the coordinates of both positions are off by half a unit in the last place."""
        return float(np.sqrt(3.0) * np.spacing(np.float32(coordinate)))

    world = [positions @ camera[:3, :3] + camera[3, :3] for positions in (surface, light)]
    seen = [(positions - camera[3, :3]) @ back for positions in world]
    at = (seen[1][:, [0, 2]] / seen[1][:, 1:2] * (lens.a, lens.c) + 1.0) * (0.5 * np.array(size))
    near = at.astype(np.float32).astype(np.float64)
    defines = (
        "ORTHOGRAPHIC",
        "RADIANCE",
        "LIGHT_RESOLUTION",
        "SPECULAR_MODEL",
        "POSITION_SOURCE",
        "NORMAL_FORMAT",
        "ALBEDO_FORMAT",
    )
    by_pixel = evaluate(
        bench.device,
        ["surface"],
        "Surface s; s.pixel = a.xy; s.y = a.z; s.ray = (ndc_from_pixel(a.xy) - u_film.xy) * u_film.zw;"
        " result.r = length(way_to_light(s, vec4(0.0, a.w, 0.0, 0.0), b, 0.0));",
        np.concatenate([pixel, seen[0][:, 1:2], seen[1][:, 1:2]], axis=1),
        dict.fromkeys(defines, 0) | {"PLACED": 1},
        {"View": view_values(view)},
        more=np.concatenate([near, at - near], axis=1),
    )[:, 0]
    return by_distance(*world), bound(offset + 100.0), by_distance(*seen), bound(100.0), largest(by_pixel)


EXPERIMENTS = (
    *(
        _changed(f"moved by 2^{power}", partial(_bound, own=own, offset=2.0**power), offset=2.0**power)
        for power, own in ((10, EXACT), (20, EXACT), (30, ROUNDED))
    ),
    *(
        _changed(f"scaled by {scale:g}", partial(_bound, own=ROUNDED, scale=scale), scale)
        for scale in (1e-6, 1e-3, 1e3, 1e6)
    ),
    *(
        _changed(f"scaled by 2^{power}", partial(_bound_of_power, power=power), 2.0**power)
        for power in (-50, -10, 10, 50)
    ),
    Experiment(
        "far_from_origin",
        _distance_errors,
        {"0": 0.0, "1e6": 1e6, "1e7": 1e7, "1e9": 1e9},
        ("offset", "world", "world bound", "view", "view bound", "from pixels"),
        "Largest error of the distance of a light one unit from a surface, with scene and camera this far "
        "from the world's origin along each axis: from positions in world space in float32; in view space, "
        "formed in float64; and from pixels, as shaders find it.",
        {"samples": 200_000},
    ),
)
