"""The driver's own arithmetic: how it converts numbers, and how it filters textures."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import EPS, Experiment, Figures, Float64, rounded
from firefly_sample.lab.probe import WIDTH, evaluate
from firefly_sample.lab.reference.texture import Sampler
from firefly_sample.mipmaps import mip_chain
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear

Levels = list[NDArray[np.uint8]] | list[NDArray[np.uint16]]

# --- Conversions ---

STEPS = {"rgba8": 255, "rgb10_a2": 1023, "rg16_snorm": 32767, "rgba16": 65535}
"""Steps from 0 to 1 of formats of whole numbers."""
DIGITS = {"rgba16f": 11, "r11f_g11f_b10f": 7}
"""Binary digits of formats of floats."""
ENCODING, DECODING = "sRGB, encoding", "sRGB, decoding"


def _conversion(bench: ExperimentBench, name: str, samples: int) -> Figures | None:
    """Convert values evenly over 0..1, or decode the 256 codes of sRGB."""
    if name == "rg16_snorm" and not bench.capabilities.snorm_targets:
        return None
    if name == DECODING:
        every = np.arange(256) / 255.0
        decoded = _stored(bench.device, every, "srgb8_alpha8", then="result = a;")
        return None, None, float(np.abs(decoded - srgb_to_linear(every)).max())
    values = rounded(np.random.default_rng(4).uniform(0.0, 1.0, samples))
    if name == ENCODING:
        stored = _stored(bench.device, values, "srgb8_alpha8", encode=True) * 255.0
        exact = linear_to_srgb(values) * 255.0
    else:
        exponent = np.floor(np.log2(np.maximum(values, 2.0**-14))) + 1.0
        steps = np.exp2(DIGITS[name] - exponent) if name in DIGITS else STEPS[name]
        stored, exact = _stored(bench.device, values, name) * steps, values * steps
    error = np.abs(stored - exact)
    # farther off than half a step and float32's own rounding
    not_nearest = error > 0.5 + 4.0 * EPS * np.abs(exact) + 1e-4
    return float(error.max()), float(not_nearest.mean()), None


def _stored(
    device: Device, values: Float64, target: str, encode: bool = False, then: str | None = None
) -> Float64:
    found = evaluate(device, [], "result = a;", values[:, None], target=target, then=then, encode=encode)
    return found[:, 0].astype(np.float64)


# --- Filtering of white noise ---

SIDE = 256
"""Texels across and down."""


@cache
def _noise(bits: int) -> tuple[Levels, Sampler]:
    """Return all mipmap levels of a texture of white noise, and its float64 sampler."""
    noise = mip_chain(np.random.default_rng(8).uniform(0.0, 1.0, (SIDE, SIDE, 4)).astype(np.float32), None)
    levels = [np.round(level * (2**bits - 1)).astype(f"u{bits // 8}") for level in noise]
    # 255 is 65535/257: eight bits are sixteen without rounding
    factor = np.uint16(257 if bits == 8 else 1)
    return levels, Sampler([level.astype(np.uint16) * factor for level in levels])


@cache
def _samples(lines: int) -> dict[int, tuple[Float64, Float64]]:
    """Return texture coordinates (n, 2) and levels of detail (n,), by bits."""
    rng = np.random.default_rng(8)
    rng.uniform(size=(SIDE, SIDE, 4))  # those of the noise
    count = lines * WIDTH
    return {
        bits: (rounded(rng.uniform(size=(count, 2))), rounded(rng.uniform(0.0, 4.0, count)))
        for bits in (8, 16)
    }


def _filtering(bench: ExperimentBench, row: tuple[int, str], lines: int) -> Figures:
    bits, filtering = row
    levels, sampler = _noise(bits)
    if filtering == "driver":
        return _by_driver(bench.device, levels, sampler, lines)
    at, detail = _samples(lines)[bits]
    level = detail if filtering == "trilinear" else np.zeros(len(at))
    body = "result = textureLod(u_texture, a.xy, a.z);"
    found = evaluate(bench.device, [], body, np.column_stack([at, level]), levels=levels)
    return _errors(found, sampler.sample(at, level))


def _by_driver(device: Device, levels: Levels, sampler: Sampler, lines: int) -> Figures:
    """Sample on grids whose neighbours are as far apart as the level of detail asks for."""
    found, exact = [], []
    for detail in (0.25, 0.75, 1.5, 2.3, 3.6):
        step = np.float64(np.float32(2.0**detail / SIDE))
        x, y = np.meshgrid(np.arange(WIDTH), np.arange(lines))
        at = rounded(np.stack([x.ravel(), y.ravel()], axis=1) * step + 0.3 * step)
        found.append(evaluate(device, [], "result = texture(u_texture, a.xy);", at, levels=levels))
        exact.append(sampler.sample(at, np.full(len(at), np.log2(step * SIDE))))
    return _errors(np.concatenate(found), np.concatenate(exact))


def _errors(found: NDArray[np.float32], exact: Float64) -> Figures:
    error = np.abs(found.astype(np.float64) - exact)
    return float(error.max()), float(error.mean())


EXPERIMENTS = (
    Experiment(
        "conversions",
        _conversion,
        (*STEPS, *DIGITS, ENCODING, DECODING),
        ("format", "steps", "not nearest", "absolute"),
        "How the driver converts numbers: the largest error in steps of the format, 0.5 for the nearest; the "
        "share of values that do not become the nearest; and the absolute error of what it decodes.",
        {"samples": 1_000_000},
    ),
    Experiment(
        "filtering",
        _filtering,
        {
            f"{bits} bits, {name}": (bits, filtering)
            for bits in (8, 16)
            for name, filtering in (
                ("bilinear", "bilinear"),
                ("trilinear", "trilinear"),
                ("trilinear, level by the driver", "driver"),
            )
        },
        ("texture", "largest", "mean"),
        "Filtering of white noise of 0..1 by the driver, against float64 on the same texels: with a level of "
        "detail that is given, and with the driver's own from differences between neighbours.",
        {"lines": 128},
    ),
)
