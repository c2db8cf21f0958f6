"""What the formats of the G-buffer leave of normals and colours, and how a driver converts numbers.

All of it goes through the targets themselves: packed and unpacked by the shaders' own functions, stored and
read by the driver.
"""

from __future__ import annotations

import math
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.lab.numerics_table import EPS, Table, Value
from firefly_sample.lab.probes.probe import evaluate
from firefly_sample.plan.targets import ALBEDO_FORMATS, FORMATS, NORMAL_FORMATS, UNSIGNED
from firefly_sample.plan.variants import AlbedoFormat, NormalFormat
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear

Float64 = NDArray[np.float64]

CHUNK = 500_000
"""Rows that are drawn at a time, to bound the memory."""


def directions(count: int) -> Float64:
    """Unit vectors (count, 3), uniform over the sphere, each as float32 has it."""
    rng = np.random.Generator(np.random.PCG64(2))
    v = rng.normal(size=(count, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    return v.astype(np.float32).astype(np.float64)


def normals(device: Device, samples: int = 2_000_000) -> Table:
    """Angles between normals and what comes back of them, by setting `normals`.

    Parameters
    ----------
    samples : int
        Random directions. The error of N.L is that of the light for which it is largest.
    """
    exact = directions(samples)
    bounds = normal_bounds()
    rows: list[tuple[Value, ...]] = []
    for name, (target, packing) in NORMAL_FORMATS.items():
        if target == "rg16_snorm" and not device.capabilities.snorm_targets:
            target, packing = UNSIGNED
        angles, off = [], 0.0
        for first in range(0, samples, CHUNK):
            true = exact[first : first + CHUNK]
            back = stored_normals(device, true, packing, target).astype(np.float64)
            unit = true / np.linalg.norm(true, axis=1, keepdims=True)
            angles.append(degrees_between(back, unit))
            off = max(off, float(np.linalg.norm(back - unit, axis=1).max()))
        degrees = np.concatenate(angles)
        size = FORMATS[target].bytes_per_pixel
        bound = math.degrees(bounds[name])
        rows.append((name, size, float(degrees.mean()), float(degrees.max()), bound, off))
    about = (
        f"Angle between a normal and what comes back of it, over {samples:,} random directions; and the "
        "largest error of N.L, the cosine of the angle between normal and light."
    )
    return Table(
        "normals", about, ("normals", "bytes", "mean deg", "max deg", "max deg bound", "max N.L"), rows
    )


def stored_normals(device: Device, unit: ArrayLike, packing: str, target: str) -> NDArray[np.float32]:
    """Unit vectors (n, 3) as they come back from a target, by the shaders' own functions.

    Parameters
    ----------
    packing, target : str
        As `firefly_sample.plan.targets.NORMAL_FORMATS` has them.
    """
    return evaluate(
        device,
        ["gbuffer"],
        "result = encode_normal(a.xyz);",
        np.pad(np.asarray(unit, dtype=np.float32), ((0, 0), (0, 1))),
        {"NORMAL_FORMAT": get_args(NormalFormat).index(packing), "ALBEDO_FORMAT": 0},
        target=target,
        then="result.rgb = decode_normal(a);",
    )[:, :3]


def normal_bounds() -> dict[str, float]:
    """The largest angle in radians that each setting `normals` may err by, to first order.

    A coordinate is off by half a step at most. In a cube that is half its diagonal, all of which may lie
    across the normal. On the octahedron, p = (u, v, 1 - |u| - |v|), half steps of u and v move p by sqrt(6)
    of them at most, and where that lies across the normal, in the middle of a face, p has the length
    1/sqrt(3): in all sqrt(18) half steps. Half floats may be cut off, which is a whole step, 2^-11 for
    coordinates above 1/2.
    """
    cube, octahedron = math.sqrt(3.0), math.sqrt(18.0)
    return {
        "oct16": octahedron * 0.5 / 32767,
        "rgb10a2": cube / 1023,
        "rgba8": cube / 255,
        "oct8": octahedron * 0.5 / 127,
        "rgba16f": cube * 2.0**-11,
        "rgba32f": EPS,
    }


def degrees_between(a: Float64, b: Float64) -> Float64:
    """Between vectors (n, 3) of any length but 0, without the loss of the arc cosine near 0."""
    a, b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    return np.asarray(
        np.degrees(2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)))
    )


def albedo(device: Device, samples: int = 1_000_000) -> Table:
    """What comes back of colours, by setting `albedo`.

    Parameters
    ----------
    samples : int
        Values, evenly over 0..1; as many lie within a tenth around 0.01.
    """
    rng = np.random.Generator(np.random.PCG64(3))
    even = rng.uniform(0.0, 1.0, samples).astype(np.float32).astype(np.float64)
    dark = (0.01 * rng.uniform(0.9, 1.1, samples)).astype(np.float32).astype(np.float64)
    rows: list[tuple[Value, ...]] = []
    for name, (target, packing) in ALBEDO_FORMATS.items():
        back, dim = (_through_albedo(device, values, target, packing) for values in (even, dark))
        relative = float(np.abs(dim / dark - 1.0).max())
        codes = float(np.abs(linear_to_srgb(back) - linear_to_srgb(even)).max()) * 255.0
        size = FORMATS[target].bytes_per_pixel
        bound = _dark_bound(name, float(dark.min()))
        rows.append((name, size, relative, bound, codes, float(back.mean() / even.mean()) - 1.0))
    about = (
        "What comes back of a colour: the largest relative error near 0.01; the largest error anywhere in "
        "codes, the 255 steps of a display from black to white; and the relative error of the mean."
    )
    return Table("albedo", about, ("albedo", "bytes", "at 0.01", "at 0.01 bound", "codes", "bias"), rows)


def _dark_bound(name: str, value: float) -> float | None:
    """The largest relative error of a value: half a step of it, or of its square root."""
    if name.startswith("sqrt"):
        half = 0.5 / (2.0 ** int(name.removeprefix("sqrt")) - 1.0)
        return 2.0 * half / math.sqrt(value) + half * half / value
    others: dict[str, float] = {"rgba8": 0.5 / 255 / value, "rgba16f": 2.0**-10, "rgba32f": EPS}
    return others.get(name)


def _through_albedo(device: Device, values: Float64, target: str, packing: str) -> Float64:
    inputs = np.repeat(values[:, None], 4, axis=1)
    given = {"NORMAL_FORMAT": 0, "ALBEDO_FORMAT": get_args(AlbedoFormat).index(packing)}
    if packing == "sqrt10":  # a whole number, which every target keeps as it is
        body = "result = vec4(unpack_color(uvec4(pack_color(a.rgb))), 1.0);"
        return evaluate(device, ["gbuffer"], body, inputs, given)[:, 0].astype(np.float64)
    result = evaluate(
        device,
        ["gbuffer"],
        "result = pack_color(a.rgb);",
        inputs,
        given,
        target=target,
        then="result.rgb = unpack_color(a);",
        encode=FORMATS[target].srgb,
    )
    return result[:, 0].astype(np.float64)


def conversions(device: Device, samples: int = 1_000_000) -> Table:
    """How a driver converts what a shader writes: how far it is off in steps of the format, and how often.

    Parameters
    ----------
    samples : int
        Values, evenly over 0..1.
    """
    rng = np.random.Generator(np.random.PCG64(4))
    values = rng.uniform(0.0, 1.0, samples).astype(np.float32).astype(np.float64)
    rows: list[tuple[Value, ...]] = []
    for target, steps in (("rgba8", 255), ("rgb10_a2", 1023), ("rg16_snorm", 32767), ("rgba16", 65535)):
        if target == "rg16_snorm" and not device.capabilities.snorm_targets:
            continue
        stored = _stored(device, values, target).astype(np.float64) * steps
        rows.append((target, *_steps(stored, values * steps), None))
    for target, digits in (("rgba16f", 11), ("r11f_g11f_b10f", 7)):
        step = np.exp2(np.floor(np.log2(np.maximum(values, 2.0**-14))) + 1.0 - digits)
        stored = _stored(device, values, target).astype(np.float64)
        rows.append((target, *_steps(stored / step, values / step), None))
    codes = _stored(device, values, "srgb8_alpha8", encode=True).astype(np.float64) * 255.0
    rows.append(("sRGB, encoding", *_steps(codes, linear_to_srgb(values) * 255.0), None))
    every = np.arange(256) / 255.0
    decoded = evaluate(
        device,
        [],
        "result = a;",
        np.repeat(every[:, None], 4, axis=1),
        target="srgb8_alpha8",
        then="result = a;",
    )[:, 0].astype(np.float64)
    rows.append(("sRGB, decoding", None, None, float(np.abs(decoded - srgb_to_linear(every)).max())))
    about = (
        "How the driver converts numbers: the largest error in steps of the format, 0.5 for the nearest; the "
        "share of values that do not become the nearest; and the absolute error of what it decodes."
    )
    return Table("conversions", about, ("format", "steps", "not nearest", "absolute"), rows)


def _stored(device: Device, values: Float64, target: str, encode: bool = False) -> NDArray[np.float32]:
    inputs = np.repeat(values[:, None], 4, axis=1)
    return evaluate(device, [], "result = a;", inputs, target=target, encode=encode)[:, 0]


def _steps(stored: Float64, exact: Float64) -> tuple[float, float]:
    """Largest distance, and the share that is farther off than half a step and float32's own rounding."""
    off = np.abs(stored - exact)
    return float(off.max()), float((off > 0.5 + 4.0 * EPS * np.abs(exact) + 1e-4).mean())
