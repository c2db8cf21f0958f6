"""What adding many lights up costs in accuracy, and what cutting them off does.

Two of the tables are about 500 lights that fade by 1/(1 + 0.7 d + 1.8 d^2), strewn evenly over a box 100
units wide, 100 deep and 10 high, as random places in the box see them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.lab.numerics_table import EPS, Table, Value
from firefly_sample.lab.probes.probe import accumulate
from firefly_sample.lab.reference.shading import attenuation
from firefly_sample.plan.lights.reach import budget_thresholds, light_reach
from firefly_sample.plan.targets import ACCUMULATION_FORMATS, FORMATS
from firefly_sample.settings import HALF_CODE
from firefly_sample.srgb import linear_to_srgb

Float64 = NDArray[np.float64]

LIGHTS = 500
FADING = (1.0, 0.7, 1.8)
NEAREST_HALF = "rgba16f, to the nearest, computed"
BOX = (100.0, 100.0, 10.0)


def seen_lights(places: int) -> tuple[Float64, Float64]:
    """Distances (lights, places), and what each light of strength 1 adds there, as float32 has it."""
    rng = np.random.Generator(np.random.PCG64(5))
    lights, seen = rng.uniform(size=(LIGHTS, 3)) * BOX, rng.uniform(size=(places, 3)) * BOX
    square = np.zeros((LIGHTS, places))
    for axis in range(3):
        square += (lights[:, None, axis] - seen[None, :, axis]) ** 2
    distance = np.sqrt(square)
    return distance, attenuation(distance, FADING).astype(np.float32).astype(np.float64)


def accumulation(device: Device, places: int = 8192) -> Table:
    """Sums of 500 lights by the driver's blending, by setting `accumulation`, against float64.

    Parameters
    ----------
    places : int
        Where the lights are seen from; each is a pixel.
    """
    _, parts = seen_lights(places)
    exact = parts.sum(axis=0)
    passes = np.repeat(parts[..., None], 3, axis=2)
    sums = {name: accumulate(device, passes, target)[:, 0] for name, target in ACCUMULATION_FORMATS.items()}
    sums[NEAREST_HALF] = _in_half_floats(parts).astype(np.float32)
    rows: list[tuple[Value, ...]] = []
    for name, total in sums.items():
        error = total.astype(np.float64) / exact - 1.0
        size = FORMATS[ACCUMULATION_FORMATS[name.partition(",")[0]]].bytes_per_pixel
        bound = LIGHTS * EPS if name == "rgba32f" else None
        rows.append((name, size, float(np.abs(error).max()), bound, float(error.mean())))
    about = f"The sum of {LIGHTS} additive passes: largest relative error, and its mean, the bias."
    return Table("accumulation", about, ("accumulation", "bytes", "largest", "bound", "bias"), rows)


def _in_half_floats(parts: Float64) -> NDArray[np.float16]:
    """The sum as a driver has it that rounds to the nearest half float after each pass."""
    total = np.zeros(parts.shape[1], dtype=np.float16)
    for part in parts.astype(np.float32):
        total = (total.astype(np.float32) + part).astype(np.float16)
    return total


def piles(device: Device, values: int = 256) -> Table:
    """N equal lights in one place, added up by the driver's blending and in batches.

    Parameters
    ----------
    values : int
        Strengths of 1/2 to 1, each with a pixel of its own.
    """
    rng = np.random.Generator(np.random.PCG64(6))
    strength = rng.uniform(0.5, 1.0, values).astype(np.float32)
    one = np.repeat(strength[None, :, None], 3, axis=2)
    exact = strength.astype(np.float64)
    rows: list[tuple[Value, ...]] = []
    for count in (1_000, 10_000):
        for name, total in (
            ("blending", accumulate(device, one, "rgba32f", count)[:, 0]),
            ("batches of 64", None),
        ):
            if total is None:
                total = _in_batches(device, one, count)
            error = float(np.abs(total.astype(np.float64) / (count * exact) - 1.0).max())
            depth = count if name == "blending" else 64 + -(-count // 64)
            rows.append((f"{count:,}, {name}", error, 0.5 * depth * EPS))
    about = "N equal lights in one place: largest relative error of their sum in float32."
    return Table("piles", about, ("lights", "largest", "bound"), rows)


def _in_batches(device: Device, one: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    """Whole batches of 64 are blended, and so are their sums, and what is left after them."""
    whole, rest = divmod(count, 64)
    batch = accumulate(device, one, "rgba32f", 64)
    passes = [batch] * whole + ([accumulate(device, one, "rgba32f", rest)] if rest else [])
    return accumulate(device, np.stack(passes), "rgba32f")[:, 0]


def cutoff(device: Device | None = None, places: int = 4096) -> Table:
    """What cutting 500 lights off loses, at each threshold in wide use and by the error budget; in float64.

    Parameters
    ----------
    places : int
        Where the lights are seen from.
    """
    distance, parts = seen_lights(places)
    exact = parts.sum(axis=0)
    intensity = np.ones(LIGHTS)
    ways = {
        "threshold 5/256": np.full(LIGHTS, 5.0 / 256.0),
        "threshold 1e-3": np.full(LIGHTS, 1e-3),
        "threshold 1.5e-4": np.full(LIGHTS, 1.5e-4),
        "budget 1.5e-4": budget_thresholds(intensity, HALF_CODE),
    }
    rows: list[tuple[Value, ...]] = []
    for name, thresholds in ways.items():
        reach = light_reach(np.tile(FADING, (LIGHTS, 1)), intensity, thresholds)
        kept = np.where(distance < reach[:, None], parts, 0.0).sum(axis=0)
        codes = 255.0 * np.abs(linear_to_srgb(exact) - linear_to_srgb(kept)).max()
        dropped = 1.0 - kept.sum() / exact.sum()
        lost = float((exact - kept).max())
        bound = float(thresholds.sum())
        rows.append((name, float(reach[0]), float(dropped), lost, bound, float(codes)))
    about = (
        f"{LIGHTS} lights of strength 1 in a box 100 units wide, cut off: their reach in units, the share of "
        "light that is dropped, the largest loss of radiance at a place, and the same in display codes."
    )
    return Table("cutoff", about, ("cut off at", "reach", "dropped", "loss", "loss bound", "codes"), rows)
