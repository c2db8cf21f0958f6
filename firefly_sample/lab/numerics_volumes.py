"""What light volumes miss: small far ones by how depths are compared, and large ones that a plane cuts open.

Volumes are drawn as their back faces, which must lie behind a surface for it to be lit. Their depths and the
surface's go through real depth buffers of their own, and are compared afterwards.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.blocks import view_values
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.light_drawing import BEHIND
from firefly_sample.gpu.proxies import circumscribed_icosphere
from firefly_sample.lab.numerics_table import Table, Value
from firefly_sample.lab.probes.raster import rasterise
from firefly_sample.plan.view import View
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lens_constants import Clip

Float64 = NDArray[np.float64]

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
TESTS = {
    "greater, D24": (False, -1.0),
    "greater or equal, D24": (False, 0.0),
    f"greater or equal, {BEHIND:g} steps behind, D24": (False, BEHIND),
    "greater or equal, D32F reversed": (True, 0.0),
}
"""Whether depth is reversed, in the clip range 0..1; and by how many steps a volume may lie before the
surface."""
CUT = {
    "across the far plane": ((0.0, 95.0, 0.0), 20.0),
    "across the near plane": ((0.0, 0.9, 0.0), 0.5),
    "around the camera": ((0.0, 0.0, 0.0), 20.0),
    "around all that is seen": ((0.0, 0.0, 0.0), 300.0),
}
"""Place and reach of a light before a lens with planes at 1 and 100."""


def depth_tests(device: Device, lights: int = 20) -> Table:
    """Share of the pixels in reach of small far lights that a depth test loses.

    Parameters
    ----------
    lights : int
        Across and down, none before another.
    """
    rows: list[tuple[Value, ...]] = []
    for name, (reverse, steps) in TESTS.items():
        if reverse and not device.capabilities.clip_control:
            continue
        missed = (_missed(device, FAR_AWAY / ratio, reverse, steps, lights) for ratio in RATIOS.values())
        rows.append((name, *missed))
    about = (
        "Share of the pixels in reach of small lights that the depth test of their volumes loses, by their "
        f"distance over the near plane's. They reach 1 unit, and are at a wall {FAR_AWAY:,.0f} units away "
        "that leans back by 60 degrees."
    )
    return Table("depth_tests", about, ("test", *RATIOS), rows)


def _missed(device: Device, near: float, reverse: bool, steps: float, lights: int) -> float:
    clip: Clip = "zero_to_one" if reverse else "gl"
    side = lights * ACROSS
    fov = 2.0 * math.degrees(math.atan(0.5 * lights * SPACING / FAR_AWAY))
    lens = PerspectiveLens(fov=(fov, fov), near=near, far=3.0 * FAR_AWAY).constants(clip, reverse)
    view = View((side, side), lens, reverse, near, 3.0 * FAR_AWAY, np.eye(4), np.eye(4))
    places, in_reach = far_lights(0.5 * lights * SPACING / FAR_AWAY, lights)

    def drawn(corners: Float64) -> Float64:
        image = rasterise(
            device,
            corners,
            view_values(view),
            view.size,
            "result.r = depth;",
            target="r32f",
            depth="depth32f" if reverse else "depth24",
            reverse=reverse,
            zero_to_one=reverse,
        )
        return image[..., 0].astype(np.float64)

    wall, volume = drawn(_wall(0.5 * lights * SPACING)), drawn(_back_faces(places, 1.0))
    # a reversed depth grows towards the eye, by no fixed step
    behind = volume <= wall if reverse else np.round(volume * LARGEST) + steps >= np.round(wall * LARGEST)
    covered = volume != (0.0 if reverse else 1.0)
    return float(1.0 - (behind & covered)[in_reach].mean())


def far_lights(half: float, lights: int) -> tuple[Float64, NDArray[np.bool_]]:
    """Places (n, 3) of lights before and in a wall, and which pixels of the wall are within 1 unit of one.

    Parameters
    ----------
    half : float
        The slope of the way through the picture's edge.
    """
    normal = np.array([0.0, -1.0, SLOPE]) / math.hypot(1.0, SLOPE)
    rng = np.random.Generator(np.random.PCG64(12))
    before = rng.uniform(-0.95, 0.95, (lights, lights))

    def on_ray(count: int, off: Float64 | float) -> Float64:
        """Where the ways through the centres of count by count cells are `off` before the wall."""
        slope = half * ((np.arange(count) + 0.5) * 2.0 / count - 1.0)
        x, z = np.meshgrid(slope, slope)
        ray = np.stack([x, np.ones_like(x), z], axis=-1)
        return np.asarray(ray * ((FAR_AWAY * normal[1] + off) / (ray @ normal))[..., None])

    places, seen = on_ray(lights, before), on_ray(lights * ACROSS, 0.0)
    own = np.repeat(np.repeat(places, ACROSS, axis=0), ACROSS, axis=1)
    return places.reshape(-1, 3), np.linalg.norm(seen - own, axis=-1) < 1.0


def _wall(half: float, cells: int = 40) -> Float64:
    """The wall's triangles (n, 3, 3), somewhat wider than the picture."""
    edge = np.linspace(-1.2 * half, 1.2 * half, cells + 1)
    x, z = np.meshgrid(edge, edge)
    points = np.stack([x, FAR_AWAY + SLOPE * z, z], axis=-1)
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    triangles = [np.stack(corners, axis=-2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d))]
    return np.concatenate(triangles)


def _back_faces(places: Float64, reach: float) -> Float64:
    """Those triangles (n, 3, 3) of the lights' volumes that face away from the eye, at the origin."""
    mesh = circumscribed_icosphere(1) * reach
    faces = np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0])
    corners = places[:, None, None] + mesh
    return np.asarray(corners[np.einsum("nfi,fi->nf", corners[:, :, 0], faces) > 0.0])


def depth_clamp(device: Device, side: int = 300) -> Table:
    """Share of a volume's pixels that are lost where the near and the far plane cut it.

    Parameters
    ----------
    side : int
        Pixels across and down.
    """
    lens = PerspectiveLens(fov=(60.0, 60.0), near=1.0, far=100.0).constants()
    view = view_values(View((side, side), lens, False, 1.0, 100.0, np.eye(4), np.eye(4)))
    rows: list[tuple[Value, ...]] = []
    for name, (place, reach) in CUT.items():
        corners = _back_faces(np.array([place]), reach)
        covered = []
        for clamped in (True, False):
            _clamp(device, clamped)
            image = rasterise(device, corners, view, (side, side), "result.r = 1.0;", target="r32f")
            covered.append(int(np.count_nonzero(image[..., 0])))
        _clamp(device, False)
        rows.append((name, *covered, 1.0 - covered[1] / covered[0]))
    about = (
        f"Pixels of {side * side:,} that the back faces of a light's volume cover with depth clamp and "
        "without, and the share that is lost without."
    )
    return Table("depth_clamp", about, ("volume", "clamped", "not clamped", "lost"), rows)


def _clamp(device: Device, on: bool) -> None:
    with device:
        device.set_depth_clamp(on)
