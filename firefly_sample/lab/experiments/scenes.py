"""Small scenes for the experiments, made by hand, with every position known."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.lab.experiments.cases import ACCURATE, within_law
from firefly_sample.lab.experiments.experiment import Float64
from firefly_sample.plan.position_error import position_error
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lights import DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.scene import Scene

GREY = Material("grey", (0.5, 0.5, 0.5, 1.0))
WHITE = Material("white", (1.0, 1.0, 1.0, 1.0))
WALL = 9.7
"""Distance of the wall of `wall_scene`, which neither float32 nor half floats represent exactly."""


def geom_node(name: str, geom: Geom, material: Material | None = None) -> GeomNode:
    """Return a node of one Geom."""
    node = GeomNode(name)
    node.add_geom(geom, material)
    return node


def halves(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike) -> Any:
    """Return two triangles per quadrangle a, b, c, d; their corners are a new last axis."""
    return np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])


def wall(size: float | tuple[float, float], cells: int = 1, normals: ArrayLike | None = None) -> Geom:
    """Return a rectangle at y = 0 that faces -Y, of `cells` by `cells` squares.

    Large triangles interpolate with errors of their own; more cells make them small.
    """
    n = cells + 1
    width, height = size if isinstance(size, tuple) else (size, size)
    x, z = np.meshgrid(np.linspace(-0.5, 0.5, n) * width, np.linspace(-0.5, 0.5, n) * height)
    vertices = np.stack([x.ravel(), np.zeros(n * n), z.ravel()], axis=1)
    first = (np.arange(cells)[:, None] * n + np.arange(cells)).ravel()
    facing = np.tile([0.0, -1.0, 0.0], (n * n, 1)) if normals is None else normals
    return Geom(vertices, halves(first, first + 1, first + n + 1, first + n), facing, name="wall")


def ball(radius: float, rings: int = 16) -> Geom:
    """Return a sphere by latitude and longitude."""
    up, around = np.meshgrid(
        np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, 2 * rings + 1), indexing="ij"
    )
    unit = np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=-1)
    unit = unit.reshape(-1, 3)
    row = 2 * rings + 1
    first = (np.arange(rings)[:, None] * row + np.arange(2 * rings)).ravel()
    return Geom(radius * unit, halves(first, first + row, first + row + 1, first + 1), unit, name="ball")


def wall_scene(
    distance: float = WALL,
    size: float = 20.0,
    cells: int = 1,
    material: Material | None = GREY,
    near: float = 1.0,
    far: float = 100.0,
    hpr: tuple[float, float, float] = (0.0, 0.0, 0.0),
    lens: Lens | None = None,
) -> Scene:
    """Return a wall around the view axis, +Y, of a camera at the origin.

    Without `lens`, the view is 60 degrees high, and the wall fills it.
    """
    scene = Scene()
    path = scene.root.attach_new_node(geom_node("wall", wall(size, cells), material))
    path.set_pos_hpr(0.0, distance, 0.0, *hpr)
    scene.camera_node.lens = lens or PerspectiveLens(vfov=60.0, near=near, far=far)
    return scene


def on_grid(values: ArrayLike) -> Float64:
    """Return values rounded to multiples of 2^-16: sums with powers of two up to 2^36 are exact."""
    return np.round(np.asarray(values, dtype=np.float64) * 2.0**16) / 2.0**16


GARDEN_NEAR, GARDEN_FAR, GARDEN_FARTHEST, GARDEN_LIGHTS = 1.0, 30.0, 16.0, 0.75
"""The planes of `garden`'s lens, the largest distance of a lit surface along the view axis, and the smallest
distance of a light from a surface."""


def garden(scale: float = 1.0, offset: ArrayLike = (0.0, 0.0, 0.0)) -> Scene:
    """Return two balls on a floor under lights of every kind, `scale` times as large and moved by `offset`.

    Reaches and attenuations are scaled with it, so that the picture is the same.
    """
    scene, s = Scene(background=(0.02, 0.03, 0.05)), scale
    shift = np.asarray(offset, dtype=np.float64)

    def put(node: PandaNode, position: ArrayLike, hpr: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        scene.root.attach_new_node(node).set_pos_hpr(*(s * on_grid(position) + shift), *hpr)

    clay = Material("clay", (0.7, 0.5, 0.3, 1.0))
    shiny = Material("shiny", (0.3, 0.4, 0.6, 1.0), specular=(0.4, 0.4, 0.3), shininess=24.0)
    earth = Material("earth", (0.5, 0.5, 0.4, 1.0))
    put(geom_node("clay", ball(s), clay), (-1.5, 8.0, 0.0))
    put(geom_node("shiny", ball(s), shiny), (1.5, 9.0, 0.0))
    put(geom_node("floor", wall((24.0 * s, 20.0 * s), 8), earth), (0.0, 10.0, -1.0), (0.0, -90.0, 0.0))
    rng = np.random.default_rng(7)
    positions = on_grid(rng.uniform((-5, 4, -0.25), (5, 14, 2), (60, 3)))
    centers = np.array([(-1.5, 8.0, 0.0), (1.5, 9.0, 0.0)])
    away = np.linalg.norm(positions[:, None] - centers, axis=2).min(axis=1)
    positions = positions[away > 1.0 + GARDEN_LIGHTS][:24]
    colors = rng.uniform(0.2, 1.0, (len(positions), 3))
    put(PointLights("ramp", s * positions, colors, 3.0 * s), (0.0, 0.0, 0.0))
    lamp = PointLight("lamp", (0.6, 0.5, 0.4))
    lamp.set_attenuation((1.0, 0.1 / s, 0.2 / s / s))
    lamp.set_max_distance(12.0 * s)
    put(lamp, (0.0, 6.0, 3.0))
    spot = Spotlight("spot", (0.8, 0.9, 1.0))
    spot.set_cone(20.0, 30.0)
    spot.set_radius(12.0 * s)
    put(spot, (-4.0, 5.0, 5.0), (-50.0, -50.0, 0.0))
    sun = DirectionalLight("sun", (0.1, 0.1, 0.08))
    sun.set_direction((0.3, 0.8, -2.0))
    scene.root.attach_new_node(sun)
    scene.camera.set_pos_hpr(*(s * np.array([0.0, -2.0, 3.0]) + shift), 3.0, -14.0, 2.0)
    scene.camera_node.lens = PerspectiveLens(vfov=50.0, near=GARDEN_NEAR * s, far=GARDEN_FAR * s)
    return scene


def garden_bound(
    base: float, method: str, scale: float = 1.0, from_origin: float = 0.0, share: float = 1.0
) -> float:
    """Return `within_law` for a picture of `garden`, with the camera `from_origin` away from the origin."""
    if method in ACCURATE:
        return base
    numbers = (GARDEN_NEAR, GARDEN_FAR, GARDEN_FARTHEST, GARDEN_LIGHTS)
    near, far, farthest, lights = (scale * number for number in numbers)
    return within_law(base, position_error(method, near, far, True, farthest, from_origin), lights, share)
