"""Sums of lights: no light, one, and very many. Sums stay accurate in any order and with any light method.

The tables "accumulation" and "cutoff" are about 500 lights that fade by 1/(1 + 0.7 d + 1.8 d^2), spread
evenly over a box 100 units wide, 100 deep and 10 high, as seen from random positions in the box.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import EPS, Experiment, Value, relative_error
from firefly_sample.lab.experiments.position_bounds import positioned
from firefly_sample.lab.experiments.scenes import garden, wall_scene
from firefly_sample.lab.probes.probe import accumulate
from firefly_sample.lab.reference.shading import attenuation
from firefly_sample.plan.lights.reach import budget_thresholds, light_reach
from firefly_sample.plan.targets import ACCUMULATION_FORMATS, FORMATS
from firefly_sample.scene.lights import PointLight, PointLights
from firefly_sample.settings import HALF_CODE, LightMethod, Settings
from firefly_sample.srgb import linear_to_srgb

Float64 = NDArray[np.float64]
Figures = tuple[Value, ...]

# --- Sums in the blender ---

LIGHTS = 500
FADING = (1.0, 0.7, 1.8)
BOX = (100.0, 100.0, 10.0)
BATCH = 64
NEAREST_HALF = "rgba16f, to the nearest, computed"


@lru_cache(maxsize=2)
def seen_lights(positions: int) -> tuple[Float64, Float64]:
    """Return distances (lights, positions), and the light of each there in float32, at intensity 1."""
    rng = np.random.Generator(np.random.PCG64(5))
    lights, seen = rng.uniform(size=(LIGHTS, 3)) * BOX, rng.uniform(size=(positions, 3)) * BOX
    square = np.zeros((LIGHTS, positions))
    for axis in range(3):
        square += (lights[:, None, axis] - seen[None, :, axis]) ** 2
    distance = np.sqrt(square)
    return distance, attenuation(distance, FADING).astype(np.float32).astype(np.float64)


def _accumulation(bench: ExperimentBench, name: str, positions: int) -> Figures:
    """Add the lights up at these positions, a pixel each, by the driver's blending."""
    _, parts = seen_lights(positions)
    target = ACCUMULATION_FORMATS[name.partition(",")[0]]
    if name == NEAREST_HALF:
        total = _in_half_floats(parts)
    else:
        total = accumulate(bench.device, np.repeat(parts[..., None], 3, axis=2), target)[:, 0].astype(
            np.float64
        )
    error = total / parts.sum(axis=0) - 1.0
    bound = LIGHTS * EPS if name == "rgba32f" else None
    return FORMATS[target].bytes_per_pixel, float(np.abs(error).max()), bound, float(error.mean())


def _in_half_floats(parts: Float64) -> Float64:
    """Return the sums of a driver that rounds to the nearest half float after each pass."""
    total = np.zeros(parts.shape[1], dtype=np.float16)
    for part in parts.astype(np.float32):
        total = (total.astype(np.float32) + part).astype(np.float16)
    return total.astype(np.float64)


def _piles(bench: ExperimentBench, row: tuple[int, bool], values: int) -> Figures:
    """Add up lights of `values` intensities from 1/2 to 1, with a pixel each."""
    count, in_batches = row
    rng = np.random.Generator(np.random.PCG64(6))
    strength = rng.uniform(0.5, 1.0, values).astype(np.float32)
    one = np.repeat(strength[None, :, None], 3, axis=2)
    total = (_in_batches if in_batches else _one_by_one)(bench.device, one, count)
    error = total.astype(np.float64) / (count * strength.astype(np.float64)) - 1.0
    sums = BATCH + -(-count // BATCH) if in_batches else count
    return float(np.abs(error).max()), 0.5 * sums * EPS


def _one_by_one(device: Device, one: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    return accumulate(device, one, "rgba32f", count)[:, 0]


def _in_batches(device: Device, one: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    """Blend whole batches, then their sums and the remainder."""
    whole, rest = divmod(count, BATCH)
    batch = accumulate(device, one, "rgba32f", BATCH)
    passes = [batch] * whole + ([accumulate(device, one, "rgba32f", rest)] if rest else [])
    return accumulate(device, np.stack(passes), "rgba32f")[:, 0]


def _cutoff(bench: ExperimentBench, threshold: float | None, positions: int) -> Figures:
    """Cut the lights off at a threshold, or by the error budget; in float64."""
    distance, parts = seen_lights(positions)
    intensity = np.ones(LIGHTS)
    thresholds = budget_thresholds(intensity, HALF_CODE) if threshold is None else np.full(LIGHTS, threshold)
    reach = light_reach(np.tile(FADING, (LIGHTS, 1)), intensity, thresholds)
    exact, kept = parts.sum(axis=0), np.where(distance < reach[:, None], parts, 0.0).sum(axis=0)
    codes = 255.0 * np.abs(linear_to_srgb(exact) - linear_to_srgb(kept)).max()
    dropped = float(1.0 - kept.sum() / exact.sum())
    return float(reach[0]), dropped, float((exact - kept).max()), float(thresholds.sum()), float(codes)


# --- Sums in pictures ---

POSITION = (0.5, 6.0, 0.25)
SMALL, TINY = (48, 36), (8, 6)
"""Sizes of pictures that up to 2,000 lights and that more of them fill."""
LIT_GBUFFER: tuple[LightMethod, ...] = ("volumes", "clustered", "fullscreen", "loop")
"""Light methods that light a G-buffer; "forward" has none, so that nothing is rounded in one."""
WITHOUT_VOLUMES = tuple(method for method in get_args(LightMethod) if method not in ("auto", "volumes"))


def bound_of_sum(count: int) -> float:
    """Return the relative error that float32 may add to a sum of lights."""
    return 2e-8 * count + 1e-6 if count else 0.0


def _error_of_pile(bench: ExperimentBench, settings: Settings, count: int, size: tuple[int, int]) -> float:
    """Return the relative difference of N lights of intensity 1/N to one light of a different light method.

    It is infinite if any light is dropped.
    """
    settings = settings.with_changes(albedo_format="rgba32f")  # "forward" rounds no colour
    other_method = "fullscreen" if settings.light_method == "volumes" else "volumes"

    def picture(many: int, light_method: str) -> Float64:
        scene = wall_scene()
        if many:
            positions, colors = np.tile(POSITION, (many, 1)), np.full((many, 3), 1.0 / many)
            scene.root.attach_new_node(PointLights("lights", positions, colors, 12.0))
        drawn = bench.draw(scene, settings.with_changes(light_method=light_method), size)
        if drawn.frame.lights.dropped or drawn.frame.lights.in_view != many:
            return np.full(drawn["radiance"].shape, math.inf)
        return drawn["radiance"]

    found = picture(count, settings.light_method)
    if count == 0:
        return float(np.abs(found).max())
    return relative_error(found, picture(1, other_method))


def _pile(count: int, size: tuple[int, int]) -> Experiment:
    return Experiment(
        f"{count:,} lights",
        lambda bench, method: _error_of_pile(bench, positioned(method), count, size),
        bound=bound_of_sum(count),
    )


def _pile_without_volumes(count: int, size: tuple[int, int], methods: tuple[str, ...]) -> Experiment:
    def run(bench: ExperimentBench, method: str) -> float:
        return _error_of_pile(bench, Settings().with_changes(light_method=method), count, size)

    def bound(method: str) -> float:
        # the error of a cell's sum does not grow with the number of lights
        return 2e-6 if method == "clustered" and count else bound_of_sum(count)

    return Experiment(f"{count:,} lights without volumes", run, methods, bound=bound)


def _order(count: int) -> Experiment:
    """Return the case of overlapping lights in two orders."""

    def run(bench: ExperimentBench, method: str) -> float:
        rng = np.random.default_rng(3)
        positions, colors = rng.uniform((-4, 6, -3), (4, 10, 3), (count, 3)), rng.uniform(0, 0.01, (count, 3))

        def picture(order: NDArray[np.intp]) -> Float64:
            scene = wall_scene(cells=4)
            scene.root.attach_new_node(PointLights("lights", positions[order], colors[order], 6.0))
            return bench.draw(scene, positioned(method), SMALL)["radiance"]

        return relative_error(picture(rng.permutation(count)), picture(np.arange(count)))

    return Experiment(f"{count:,} lights in another order", run, bound=bound_of_sum(count))


def _twice(bench: ExperimentBench, method: str) -> float:
    """Compare two equal lights in one place with one of twice the intensity."""
    pictures = []
    for copies, strength in ((2, 0.4), (1, 0.8)):
        scene = wall_scene()
        for index in range(copies):
            light = PointLight(f"light {index}", (strength,) * 3, radius=12.0)
            scene.root.attach_new_node(light).set_pos(*POSITION)
        pictures.append(bench.draw(scene, positioned(method))["radiance"])
    return relative_error(*pictures)


def _light_methods(bench: ExperimentBench, method: str) -> float:
    """Return the largest difference of the garden by two of `LIT_GBUFFER`, over the 99.9th percentile."""
    pictures = [
        bench.draw(garden(), positioned(method, light_method=lights))["radiance"] for lights in LIT_GBUFFER
    ]
    bright = np.percentile(pictures[0], 99.9)
    return float(np.ptp(pictures, axis=0).max() / bright) if bright > 0.0 else math.inf


EXPERIMENTS = (
    Experiment(
        "accumulation",
        _accumulation,
        (*ACCUMULATION_FORMATS, NEAREST_HALF),
        ("accumulation", "bytes", "largest", "bound", "bias"),
        f"The sum of {LIGHTS} additive passes: largest relative error, and its mean, the bias.",
        {"positions": 8192},
    ),
    Experiment(
        "piles",
        _piles,
        {
            f"{count:,}, {name}": (count, in_batches)
            for count in (1_000, 10_000)
            for name, in_batches in (("blending", False), (f"batches of {BATCH}", True))
        },
        ("lights", "largest", "bound"),
        "N equal lights in one place: largest relative error of their sum in float32.",
        {"values": 256},
    ),
    Experiment(
        "cutoff",
        _cutoff,
        {
            "threshold 5/256": 5.0 / 256.0,
            "threshold 1e-3": 1e-3,
            "threshold 1.5e-4": 1.5e-4,
            "budget 1.5e-4": None,
        },
        ("cut off at", "reach", "dropped", "loss", "loss bound", "codes"),
        f"{LIGHTS} lights of intensity 1 in a box 100 units wide, cut off: their reach in units, the share "
        "of light that is dropped, the largest loss of radiance at a position, and that in display codes.",
        {"positions": 4096},
    ),
    *(_pile(count, SMALL) for count in (0, 1, 500, 2000)),
    *(_pile(count, TINY) for count in (10_000, 100_000)),
    *(_pile_without_volumes(count, SMALL, WITHOUT_VOLUMES) for count in (0, 1, 500)),
    *(_pile_without_volumes(count, TINY, ("clustered", "loop", "forward")) for count in (10_000, 100_000)),
    Experiment(f"garden, {len(LIT_GBUFFER)} light methods", _light_methods, bound=5e-6),
    *(_order(count) for count in (500, 2000)),
    Experiment("equal lights in one place", _twice, bound=bound_of_sum(2)),
)
