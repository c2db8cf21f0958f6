"""Meshes that are drawn for lights: how well they fit, and the pixels that depth tests and clipping lose.

Volumes are drawn as their back faces, which must lie behind a surface for it to be lit. Their depths and the
surface's go through real depth buffers of their own, and are compared afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.gpu.drawing import BEHIND
from firefly_sample.gpu.proxies import circumscribed_cone, circumscribed_cube, circumscribed_icosphere
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import Experiment, Figures, Float64
from firefly_sample.lab.probe import rasterise
from firefly_sample.plan.view import View
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lens_constants import Clip

# --- Silhouettes ---

HALF_ANGLES = (10.0, 30.0, 45.0, 53.0, 60.0)
SIDES = 16


def _proxies(bench: ExperimentBench, proxy: Callable[[], Float64] | float, views: int) -> Figures:
    """Measure a mesh for spheres, or that for cones of a half-angle in degrees."""
    if callable(proxy):
        outside, exact = proxy(), math.pi
        radius = np.linalg.norm(outside, axis=2).max()
        inside, scale = outside / radius, float(radius) / _inradius(outside)
    else:
        tangent = math.tan(math.radians(proxy))
        outside = circumscribed_cone(SIDES) * np.array([tangent, 1.0, tangent])
        scale = float(np.hypot(outside[:, :, 0], outside[:, :, 2]).max()) / tangent
        inside = outside / (scale, 1.0, scale)
        # of a convex body, the silhouette is a quarter of the surface on average (Cauchy)
        exact = 0.25 * math.pi * tangent * (tangent + math.hypot(1.0, tangent))
    covered, reached = (_silhouette(mesh, _even_directions(views)) for mesh in (outside, inside))
    return len(outside), scale, 1.0 - reached / exact, covered / exact - 1.0, covered / math.pi


def _normals(mesh: Float64) -> Float64:
    """Return a normal per triangle (n, 3), as long as twice its area."""
    return np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0])


def _silhouette(mesh: Float64, seen_from: Float64) -> float:
    """Return the mean projected area of a convex mesh: half of its faces' areas, since a line meets two."""
    faces = 0.5 * _normals(mesh)
    return float(
        np.mean([0.5 * np.abs(part @ faces.T).sum(axis=1).mean() for part in np.split(seen_from, 20)])
    )


def _inradius(mesh: Float64) -> float:
    """Return the distance of the nearest face from the origin."""
    faces = _normals(mesh)
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    return float((faces * mesh[:, 0]).sum(axis=1).min())


def _even_directions(count: int) -> Float64:
    """Return unit vectors (count, 3) on a spiral whose turns are the golden angle apart, evenly in height."""
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - math.sqrt(5.0)) * np.arange(count)
    ring = np.sqrt(1.0 - height**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)


# --- Depth tests of small far lights, and lights that a plane cuts ---

FAR_AWAY = 1000.0
SLOPE = math.tan(math.radians(60.0))
"""Units by which the wall recedes a unit of height."""
SPACING = 3.0
"""Units from light to light; they reach 1."""
ACROSS = 24
"""Pixels from light to light."""
RATIOS = {"1e3": 1e3, "1e4": 1e4, "1e5": 1e5, "1e6": 1e6}
"""The wall's distance over the near plane's."""
LARGEST = 2**24 - 1
TESTS: dict[str, tuple[bool, float]] = {
    "greater, D24": (False, -1.0),
    "greater or equal, D24": (False, 0.0),
    f"greater or equal, {BEHIND:g} steps behind, D24": (False, BEHIND),
    "greater or equal, D32F reversed": (True, 0.0),
}
"""True for reversed depth in the clip range 0..1; and the number of depth steps that a volume may lie in
front of the surface."""
CUT = {
    "across the far plane": ((0.0, 95.0, 0.0), 20.0),
    "across the near plane": ((0.0, 0.9, 0.0), 0.5),
    "around the camera": ((0.0, 0.0, 0.0), 20.0),
    "around all that is seen": ((0.0, 0.0, 0.0), 300.0),
}
"""Position and reach of a light in front of a lens with planes at 1 and 100."""


def _depth_test(bench: ExperimentBench, test: tuple[bool, float], lights: int) -> Figures | None:
    if test[0] and not bench.capabilities.clip_control:
        return None
    return tuple(_lost(bench.device, FAR_AWAY / ratio, *test, lights) for ratio in RATIOS.values())


def _lost(device: Device, near: float, reverse: bool, steps: float, lights: int) -> float:
    """Return the share of the lit pixels that are lost, for `lights` lights across and down."""
    clip: Clip = "zero_to_one" if reverse else "gl"
    side = lights * ACROSS
    fov = 2.0 * math.degrees(math.atan(0.5 * lights * SPACING / FAR_AWAY))
    lens = PerspectiveLens(fov=(fov, fov), near=near, far=3.0 * FAR_AWAY).constants(clip, reverse)
    view = View((side, side), lens, reverse, near, 3.0 * FAR_AWAY, np.eye(4), np.eye(4))
    positions, in_reach = far_lights(0.5 * lights * SPACING / FAR_AWAY, lights)

    def drawn(corners: Float64) -> Float64:
        depth = "depth32f" if reverse else "depth24"
        image = rasterise(device, view, corners, "result.r = a.r;", "r32f", depth)
        return image[..., 0].astype(np.float64)

    wall, volume = drawn(_wall(0.5 * lights * SPACING)), drawn(_back_faces(positions, 1.0))
    # a reversed depth grows towards the eye, by no fixed step
    behind = volume <= wall if reverse else np.round(volume * LARGEST) + steps >= np.round(wall * LARGEST)
    covered = volume != (0.0 if reverse else 1.0)
    return float(1.0 - (behind & covered)[in_reach].mean())


def far_lights(half: float, lights: int) -> tuple[Float64, NDArray[np.bool_]]:
    """Return positions (n, 3) of lights around a wall, and which pixels of the wall are within 1 unit of one.

    `half` is the slope of the view ray through the picture's edge.
    """
    normal = np.array([0.0, -1.0, SLOPE]) / math.hypot(1.0, SLOPE)
    before = np.random.default_rng(12).uniform(-0.95, 0.95, (lights, lights))

    def on_ray(count: int, off: Float64 | float) -> Float64:
        """Return points `off` in front of the wall, on rays through the centres of count by count cells."""
        slope = half * ((np.arange(count) + 0.5) * 2.0 / count - 1.0)
        x, z = np.meshgrid(slope, slope)
        ray = np.stack([x, np.ones_like(x), z], axis=-1)
        return np.asarray(ray * ((FAR_AWAY * normal[1] + off) / (ray @ normal))[..., None])

    positions, seen = on_ray(lights, before), on_ray(lights * ACROSS, 0.0)
    nearest = np.repeat(np.repeat(positions, ACROSS, axis=0), ACROSS, axis=1)
    return positions.reshape(-1, 3), np.linalg.norm(seen - nearest, axis=-1) < 1.0


def _wall(half: float, cells: int = 40) -> Float64:
    """Return the wall's triangles (n, 3, 3), somewhat wider than the picture."""
    edge = np.linspace(-1.2 * half, 1.2 * half, cells + 1)
    x, z = np.meshgrid(edge, edge)
    points = np.stack([x, FAR_AWAY + SLOPE * z, z], axis=-1)
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    triangles = [np.stack(corners, axis=-2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d))]
    return np.concatenate(triangles)


def _back_faces(positions: Float64, reach: float) -> Float64:
    """Return the triangles (n, 3, 3) of the lights' volumes that face away from the eye, at the origin."""
    mesh = circumscribed_icosphere(1) * reach
    corners = positions[:, None, None] + mesh
    return np.asarray(corners[np.einsum("nfi,fi->nf", corners[:, :, 0], _normals(mesh)) > 0.0])


def _depth_clamp(
    bench: ExperimentBench, light: tuple[tuple[float, float, float], float], side: int
) -> Figures:
    position, reach = light
    lens = PerspectiveLens(fov=(60.0, 60.0), near=1.0, far=100.0).constants()
    view = View((side, side), lens, False, 1.0, 100.0, np.eye(4), np.eye(4))
    corners = _back_faces(np.array([position]), reach)
    device, covered = bench.device, []
    for clamped in (True, False):
        with device:
            device.set_depth_clamp(clamped)
        image = rasterise(device, view, corners, "result.r = 1.0;", "r32f")
        covered.append(int(np.count_nonzero(image[..., 0])))
    return *covered, 1.0 - covered[1] / covered[0]


EXPERIMENTS = (
    Experiment(
        "proxies",
        _proxies,
        {
            "cube": circumscribed_cube,
            **{f"icosphere{level}": partial(circumscribed_icosphere, level) for level in range(4)},
            **{f"cone, {degrees:g} degrees": degrees for degrees in HALF_ANGLES},
        },
        ("proxy", "triangles", "scale", "missed inscribed", "extra circumscribed", "of a sphere's"),
        "Meshes for lights: triangles; how much an inscribed one must grow to hold its sphere or cone; the "
        "share of the silhouette that it misses if it does not; what it covers in vain if it does; and all "
        "that it covers, over the silhouette of a sphere of the same reach.",
        {"views": 20_000},
    ),
    Experiment(
        "depth_tests",
        _depth_test,
        TESTS,
        ("test", *RATIOS),
        "Share of the pixels in reach of small lights that the depth test of their volumes loses, by their "
        "distance over the near plane's. They reach 1 unit, and are at a wall 1,000 units away that leans "
        "back by 60 degrees.",
        {"lights": 20},
    ),
    Experiment(
        "depth_clamp",
        _depth_clamp,
        CUT,
        ("volume", "clamped", "not clamped", "lost"),
        "Pixels of {side} by {side} that the back faces of a light's volume cover with depth clamp and "
        "without, and the share that is lost without.",
        {"side": 300},
    ),
)
