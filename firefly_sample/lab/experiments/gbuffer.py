"""Errors of normals and colours in the G-buffer, and surfaces with no normals or (almost) no area.

Normals and colours go through the targets themselves: packed and unpacked by the shaders' own functions,
stored and read by the driver.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import EPS, FLOAT64, Experiment, Value
from firefly_sample.lab.experiments.position_bounds import positioned
from firefly_sample.lab.experiments.scenes import WALL, geom_node, wall, wall_scene
from firefly_sample.lab.probes.probe import evaluate
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.plan.targets import ALBEDO_FORMATS, FORMATS, NORMAL_FORMATS, UNSIGNED
from firefly_sample.plan.variants import AlbedoFormat, NormalFormat
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb

Float64 = NDArray[np.float64]

CHUNK = 500_000
"""Rows that are drawn at a time, to bound the memory."""

# --- Normals ---

LARGEST_ANGLES = {
    "oct16": 0.0037,
    "rgb10a2": 0.096,
    "rgba8": 0.387,
    "oct8": 0.95,
    "rgba16f": 0.0262,  # 0.023 where a driver rounds half floats instead of cutting them off
    "rgba32f": 2.8e-6,
}
"""Degrees, by setting `normal_format`."""
SLACK = 1.05


def normal_bounds() -> dict[str, float]:
    """Return the largest angle in radians, to first order, by which each `normal_format` changes a normal.

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


@lru_cache(maxsize=1)
def _random_directions(count: int) -> Float64:
    """Return unit vectors (count, 3), uniform over the sphere, with float32 coordinates."""
    rng = np.random.Generator(np.random.PCG64(2))
    v = rng.normal(size=(count, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    return v.astype(np.float32).astype(np.float64)


@lru_cache(maxsize=1)
def _difficult_directions(count: int = 1_000_000) -> NDArray[np.float32]:
    """Return unit vectors: random ones, the axes, and both sides of the seams of the octahedron."""
    rng = np.random.default_rng(13)
    random = rng.normal(size=(count - 30_000, 3))
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    near_axes = axes[rng.integers(0, 6, 10_000)] + rng.normal(size=(10_000, 3)) * 1e-4
    seams = rng.normal(size=(20_000 - len(axes), 3))
    seams[np.arange(len(seams)), rng.integers(0, 3, len(seams))] = rng.choice([0.0, 1e-7, -1e-7], len(seams))
    every = np.concatenate([random, axes, near_axes, seams])
    return np.asarray(every / np.linalg.norm(every, axis=1, keepdims=True), dtype=np.float32)


def _normal_format(device: Device, setting: str) -> tuple[str, str]:
    target, packing = NORMAL_FORMATS[setting]
    return UNSIGNED if target == "rg16_snorm" and not device.capabilities.snorm_targets else (target, packing)


def stored_normals(device: Device, unit: ArrayLike, setting: str) -> Float64:
    """Return unit vectors (n, 3) as they are read back from the target of a setting `normal_format`."""
    target, packing = _normal_format(device, setting)
    stored = evaluate(
        device,
        ["gbuffer"],
        "result = encode_normal(a.xyz);",
        np.pad(np.asarray(unit, dtype=np.float32), ((0, 0), (0, 1))),
        {"NORMAL_FORMAT": get_args(NormalFormat).index(packing), "ALBEDO_FORMAT": 0},
        target=target,
        then="result.rgb = decode_normal(a);",
    )
    return stored[:, :3].astype(np.float64)


def degrees_between(a: Float64, b: Float64) -> Float64:
    """Return the angles between vectors (n, 3) of any length but 0, without the arc cosine's loss near 0."""
    a, b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    return np.asarray(
        np.degrees(2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)))
    )


def _normal_errors(bench: ExperimentBench, name: str, samples: int) -> tuple[Value, ...]:
    exact = _random_directions(samples)
    angles, largest = [], 0.0
    for first in range(0, samples, CHUNK):
        true = exact[first : first + CHUNK]
        back = stored_normals(bench.device, true, name)
        unit = true / np.linalg.norm(true, axis=1, keepdims=True)
        angles.append(degrees_between(back, unit))
        largest = max(largest, float(np.linalg.norm(back - unit, axis=1).max()))
    degrees = np.concatenate(angles)
    size = FORMATS[_normal_format(bench.device, name)[0]].bytes_per_pixel
    bound = math.degrees(normal_bounds()[name])
    return size, float(degrees.mean()), float(degrees.max()), bound, largest


def _largest_angle(bench: ExperimentBench, method: str) -> float:
    """Return the largest angle in degrees between a normal and what is read back of it."""
    given = _difficult_directions()
    back = stored_normals(bench.device, given, method)
    return float(degrees_between(back, given.astype(np.float64)).max()) if np.isfinite(back).all() else 180.0


# --- Albedo ---


def _albedo_errors(bench: ExperimentBench, name: str, samples: int) -> tuple[Value, ...]:
    """Measure values evenly over 0..1, and as many within a tenth around 0.01."""
    rng = np.random.Generator(np.random.PCG64(3))
    even = rng.uniform(0.0, 1.0, samples).astype(np.float32).astype(np.float64)
    dark = (0.01 * rng.uniform(0.9, 1.1, samples)).astype(np.float32).astype(np.float64)
    target, packing = ALBEDO_FORMATS[name]
    back, dim = (_through_albedo(bench.device, values, target, packing) for values in (even, dark))
    return (
        FORMATS[target].bytes_per_pixel,
        float(np.abs(dim / dark - 1.0).max()),
        _dark_bound(name, float(dark.min())),
        float(np.abs(linear_to_srgb(back) - linear_to_srgb(even)).max()) * 255.0,
        float(back.mean() / even.mean()) - 1.0,
    )


def _dark_bound(name: str, value: float) -> float | None:
    """Return the largest relative error of a value: half a step of it, or of its square root."""
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


# --- Surfaces without normals, without area, or hardly any ---


def _wall_with(geom: Geom) -> Scene:
    scene = wall_scene()
    scene.root.find("wall").detach_node()
    scene.root.attach_new_node(geom_node("wall", geom, Material("grey", (0.5, 0.5, 0.5, 1.0)))).set_y(WALL)
    scene.camera_node.lens = OrthographicLens(film_size=(16, 12), near=1, far=100)
    scene.root.attach_new_node(PointLight("light", radius=12.0)).set_pos(1, 6, 1)
    return scene


def _difference(bench: ExperimentBench, method: str, one: Geom, other: Geom) -> float:
    settings = positioned(method)
    pictures = [bench.draw(_wall_with(geom), settings)["radiance"] for geom in (one, other)]
    return float(np.abs(pictures[0] - pictures[1]).max()) if pictures[0].any() else math.inf


def _no_normals(bench: ExperimentBench, method: str) -> float:
    """Compare normals of length 0, which face the eye, with those of a wall across parallel rays."""
    plain = wall(20.0, 4)
    return _difference(bench, method, plain, wall(20.0, 4, np.zeros_like(plain.vertices)))


def _no_area(bench: ExperimentBench, method: str) -> float:
    """Add triangles of one point, of two, of three in a line, and of points that are one in float32."""
    plain = wall(20.0, 4)
    n = len(plain.vertices)
    more = np.array(
        [(0, -1, 0), (1, -1, 0), (2, -1, 0), (1e-30, -1, 1e-30), (0, -1, 1e-30)], dtype=np.float64
    )
    flat = [(n, n, n), (n, n + 1, n + 1), (n, n + 1, n + 2), (n, n + 3, n + 4)]
    normals = np.concatenate([plain.normals, np.zeros((len(more), 3))])
    holed = Geom(np.concatenate([plain.vertices, more]), np.concatenate([flat, plain.triangles]), normals)
    return _difference(bench, method, plain, holed)


NEEDLES = 1000


def _needles() -> Scene:
    """Return triangles from a pixel to a ten-thousandth of one high, whose corners have different normals."""
    rng = np.random.default_rng(17)
    angle = rng.uniform(0.0, 2.0 * np.pi, NEEDLES)
    along = np.stack([np.cos(angle), rng.uniform(-0.5, 0.5, NEEDLES), np.sin(angle)], axis=1)
    aside = np.stack([-np.sin(angle), rng.uniform(-1.0, 1.0, NEEDLES), np.cos(angle)], axis=1)
    start = rng.uniform((-7, 0, -5), (7, 4, 5), (NEEDLES, 3))
    height = 10.0 ** rng.uniform(-5.0, -1.0, (NEEDLES, 1))
    corners = np.stack([start, start + 5.0 * along, start + 2.5 * along + height * aside], axis=1)
    normals = rng.normal(size=(3 * NEEDLES, 3)) - (0.0, 2.0, 0.0)
    geom = Geom(corners.reshape(-1, 3), np.arange(3 * NEEDLES).reshape(-1, 3), normals, name="needles")
    scene = Scene()
    steel = Material("steel", (0.5, 0.5, 0.5, 1.0), double_sided=True)
    scene.root.attach_new_node(geom_node("needles", geom, steel)).set_pos_hpr(0, 12, 0, 3, 2, 1)
    scene.camera_node.lens = PerspectiveLens(vfov=50.0, near=0.5, far=100.0)
    return scene


def _thin_triangles(bench: ExperimentBench, method: str) -> float:
    """Return the largest error of a normal, or relative error of a distance, against float64."""
    settings = Settings().with_changes(interpolation=method, normal_format="rgba32f")
    drawn = bench.draw(_needles(), settings, outputs=("visibility", "normal", "depth"))
    found = see_surfaces(drawn.plan, drawn.visibility())
    normal = np.abs(drawn["normal"] - found.gbuffer.normal).max(axis=-1)
    distance = np.abs(drawn["depth"] / found.gbuffer.position[..., 1] - 1.0)
    if np.count_nonzero(found.covered) < NEEDLES // 4:
        return math.inf  # too few pixels to measure
    return float(np.maximum(normal, distance)[found.covered].max())


EXPERIMENTS = (
    Experiment(
        "normals",
        _normal_errors,
        tuple(NORMAL_FORMATS),
        ("normals", "bytes", "mean deg", "max deg", "max deg bound", "max N.L"),
        "Angle between a normal and what is read back of it, over {samples:,} random directions; and the "
        "largest error of N.L, the cosine of the angle between normal and light.",
        {"samples": 2_000_000},
    ),
    Experiment(
        "albedo",
        _albedo_errors,
        tuple(ALBEDO_FORMATS),
        ("albedo", "bytes", "at 0.01", "at 0.01 bound", "codes", "bias"),
        "What is read back of a colour: the largest relative error near 0.01; the largest error anywhere in "
        "codes, the 255 steps of a display from black to white; and the relative error of the mean.",
        {"samples": 1_000_000},
    ),
    Experiment(
        "normals, a million",
        _largest_angle,
        tuple(LARGEST_ANGLES),
        bound=lambda method: SLACK * LARGEST_ANGLES[method],
    ),
    Experiment("normals without length", _no_normals, bound=0.0),
    Experiment("triangles without area", _no_area, bound=0.0),
    Experiment("thin triangles", _thin_triangles, FLOAT64, bound=1e-6, needs="float64"),
)
