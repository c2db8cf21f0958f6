"""Sums of lights: no light, one, and very many. Sums stay accurate in any order and with any light method.

The tables "accumulation" and "cutoff" are about 500 lights that fade by 1/(1 + 0.7 d + 1.8 d^2), spread
evenly over a box 100 units wide, 100 deep and 10 high, as seen from random positions in the box.
"""

from __future__ import annotations

import math
from functools import lru_cache, partial
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.cases import cases, positioned
from firefly_sample.lab.experiments.experiment import (
    EPS,
    POSITIONS,
    Experiment,
    Figures,
    Float64,
    relative_error,
    rounded,
)
from firefly_sample.lab.experiments.scenes import garden, wall_scene
from firefly_sample.lab.probe import accumulate
from firefly_sample.lab.reference.shading import attenuation
from firefly_sample.plan.lights.reach import budget_thresholds, light_reach
from firefly_sample.plan.targets import ACCUMULATION_FORMATS, FORMATS
from firefly_sample.scene.lights import PointLight, PointLights
from firefly_sample.settings import HALF_CODE, LightMethod, Settings
from firefly_sample.srgb import linear_to_srgb

# --- Sums in the blender ---

LIGHTS = 500
FADING = (1.0, 0.7, 1.8)
BOX = (100.0, 100.0, 10.0)
BATCH = 64
NEAREST_HALF = "rgba16f, to the nearest, computed"


@lru_cache(maxsize=2)
def seen_lights(positions: int) -> tuple[Float64, Float64]:
    """Return distances (lights, positions), and the light of each there in float32, at intensity 1."""
    rng = np.random.default_rng(5)
    lights, seen = rng.uniform(size=(LIGHTS, 3)) * BOX, rng.uniform(size=(positions, 3)) * BOX
    square = np.zeros((LIGHTS, positions))
    for axis in range(3):
        square += (lights[:, None, axis] - seen[None, :, axis]) ** 2
    distance = np.sqrt(square)
    return distance, rounded(attenuation(distance, FADING))


def _accumulation(bench: ExperimentBench, name: str, positions: int) -> Figures:
    """Add the lights up at these positions, a pixel each, by the driver's blending."""
    _, parts = seen_lights(positions)
    target = ACCUMULATION_FORMATS[name.partition(",")[0]]
    nearest = name == NEAREST_HALF
    total = _in_half_floats(parts) if nearest else accumulate(bench.device, parts[..., None], target)[:, 0]
    error = total.astype(np.float64) / parts.sum(axis=0) - 1.0
    bound = LIGHTS * EPS if name == "rgba32f" else None
    return FORMATS[target].bytes_per_pixel, float(np.abs(error).max()), bound, float(error.mean())


def _in_half_floats(parts: Float64) -> NDArray[np.float16]:
    """Return the sums of a driver that rounds to the nearest half float after each pass."""
    total = np.zeros(parts.shape[1], dtype=np.float16)
    for part in parts.astype(np.float32):
        total = (total.astype(np.float32) + part).astype(np.float16)
    return total


def _piles(bench: ExperimentBench, row: tuple[int, bool], values: int) -> Figures:
    """Add up lights of `values` intensities from 1/2 to 1, with a pixel each."""
    count, in_batches = row
    rng = np.random.default_rng(6)
    strength = rng.uniform(0.5, 1.0, values).astype(np.float32)
    one = strength[None, :, None]
    add = _in_batches if in_batches else partial(accumulate, target="rgba32f")
    total = add(bench.device, one, repeat=count)[:, 0]
    error = total.astype(np.float64) / (count * strength.astype(np.float64)) - 1.0
    sums = BATCH + -(-count // BATCH) if in_batches else count
    return float(np.abs(error).max()), 0.5 * sums * EPS


def _in_batches(device: Device, one: NDArray[np.float32], repeat: int) -> NDArray[np.float32]:
    """Blend whole batches, then their sums and the remainder."""
    whole, rest = divmod(repeat, BATCH)
    passes = [accumulate(device, one, "rgba32f", BATCH)] * whole
    if rest:
        passes.append(accumulate(device, one, "rgba32f", rest))
    return accumulate(device, np.stack(passes), "rgba32f")


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


def bound_of_sum(method: str, count: int) -> float:
    """Return the relative error that float32 may add to a sum of lights."""
    if method == "clustered" and count:
        return 2e-6  # the error of a cell's sum does not grow with the number of lights
    return 2e-8 * count + 1e-6 if count else 0.0


def _error_of_pile(bench: ExperimentBench, method: str, count: int) -> float:
    """Return the relative difference of N lights of intensity 1/N to one light of a different light method.

    It is infinite if any light is dropped. `method` is that of the positions, or of the lights.
    """
    settings = positioned(method) if method in POSITIONS else Settings().with_changes(light_method=method)
    settings = settings.with_changes(albedo_format="rgba32f")  # "forward" rounds no colour
    other_method = "fullscreen" if settings.light_method == "volumes" else "volumes"

    def picture(many: int, light_method: str) -> Float64:
        scene = wall_scene()
        if many:
            positions, colors = np.tile(POSITION, (many, 1)), np.full((many, 3), 1.0 / many)
            scene.root.attach_new_node(PointLights("lights", positions, colors, 12.0))
        size = SMALL if count <= 2000 else TINY
        drawn = bench.draw(scene, settings.with_changes(light_method=light_method), size)
        if drawn.frame.lights.dropped or drawn.frame.lights.in_view != many:
            return np.full(drawn["radiance"].shape, math.inf)
        return drawn["radiance"]

    found = picture(count, settings.light_method)
    return relative_error(found, picture(1, other_method)) if count else float(np.abs(found).max())


def _order(bench: ExperimentBench, method: str, count: int) -> float:
    """Compare overlapping lights in two orders."""
    rng = np.random.default_rng(3)
    positions, colors = rng.uniform((-4, 6, -3), (4, 10, 3), (count, 3)), rng.uniform(0, 0.01, (count, 3))

    def picture(order: NDArray[np.intp]) -> Float64:
        scene = wall_scene(cells=4)
        scene.root.attach_new_node(PointLights("lights", positions[order], colors[order], 6.0))
        return bench.draw(scene, positioned(method), SMALL)["radiance"]

    return relative_error(picture(rng.permutation(count)), picture(np.arange(count)))


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
    *cases("{count:,} lights", _error_of_pile, bound_of_sum, count=(0, 1, 500, 2000, 10_000, 100_000)),
    *cases(
        "{count:,} lights without volumes", _error_of_pile, bound_of_sum, WITHOUT_VOLUMES, count=(0, 1, 500)
    ),
    *cases(
        "{count:,} lights without volumes",
        _error_of_pile,
        bound_of_sum,
        ("clustered", "loop", "forward"),
        count=(10_000, 100_000),
    ),
    Experiment(f"garden, {len(LIT_GBUFFER)} light methods", _light_methods, bound=5e-6),
    *cases("{count:,} lights in another order", _order, bound_of_sum, count=(500, 2000)),
    Experiment("equal lights in one place", _twice, bound=bound_of_sum("volumes", 2)),
)
