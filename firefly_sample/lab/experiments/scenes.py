"""Small scenes for the experiments, made by hand, with every position known."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.scene import Scene

Float64 = NDArray[np.float64]

WALL = 9.7
"""Distance of the wall of `wall_scene`, which neither float32 nor half floats represent exactly."""


def geom_node(name: str, geom: Geom, material: Material | None = None) -> GeomNode:
    """Return a node of one Geom."""
    node = GeomNode(name)
    node.add_geom(geom, material)
    return node


def wall(size: float | tuple[float, float], cells: int = 1, normals: ArrayLike | None = None) -> Geom:
    """Return a rectangle at y = 0 that faces -Y, of `cells` by `cells` squares.

    Large triangles interpolate with errors of their own; more cells make them small.
    """
    n = cells + 1
    width, height = size if isinstance(size, tuple) else (size, size)
    x, z = np.meshgrid(np.linspace(-0.5, 0.5, n) * width, np.linspace(-0.5, 0.5, n) * height)
    vertices = np.stack([x.ravel(), np.zeros(n * n), z.ravel()], axis=1)
    corner = (np.arange(cells)[:, None] * n + np.arange(cells)).ravel()
    triangles = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + n + 1], 1),
            np.stack([corner, corner + n + 1, corner + n], 1),
        ]
    )
    facing = np.tile([0.0, -1.0, 0.0], (n * n, 1)) if normals is None else normals
    return Geom(vertices, triangles, facing, name="wall")


def ball(radius: float, rings: int = 16) -> Geom:
    """Return a sphere by latitude and longitude."""
    up, around = np.meshgrid(
        np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, 2 * rings + 1), indexing="ij"
    )
    unit = np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=-1)
    row = 2 * rings + 1
    first = (np.arange(rings)[:, None] * row + np.arange(2 * rings)).ravel()
    triangles = np.concatenate(
        [
            np.stack([first, first + row, first + row + 1], 1),
            np.stack([first, first + row + 1, first + 1], 1),
        ]
    )
    return Geom(radius * unit.reshape(-1, 3), triangles, unit.reshape(-1, 3), name="ball")


def wall_scene(
    distance: float = WALL,
    size: float = 20.0,
    cells: int = 1,
    material: Material | None = None,
    near: float = 1.0,
    far: float = 100.0,
) -> Scene:
    """Return a grey wall that fills the view of 60 degrees of a camera at the origin, along +Y."""
    scene = Scene()
    grey = material or Material("grey", (0.5, 0.5, 0.5, 1.0))
    scene.root.attach_new_node(geom_node("wall", wall(size, cells), grey)).set_pos(0, distance, 0)
    scene.camera_node.lens = PerspectiveLens(vfov=60.0, near=near, far=far)
    return scene


def on_grid(values: ArrayLike) -> Float64:
    """Return values rounded to multiples of 2^-16: sums with powers of two up to 2^36 are exact."""
    return np.round(np.asarray(values, dtype=np.float64) * 2.0**16) / 2.0**16


GARDEN_NEAR, GARDEN_FAR, GARDEN_LIGHTS = 1.0, 30.0, 0.75
"""The planes of `garden`'s lens, and the smallest distance of its lights from its surfaces."""


def garden(scale: float = 1.0, offset: ArrayLike = (0.0, 0.0, 0.0)) -> Scene:
    """Return two balls on a floor under lights of every kind, `scale` times as large and moved by `offset`.

    Reaches and attenuations are scaled with it, so that the picture is the same.
    """
    scene, s = Scene(background=(0.02, 0.03, 0.05)), scale
    shift = np.asarray(offset, dtype=np.float64)

    def put(node: PandaNode, position: ArrayLike) -> None:
        path = scene.root.attach_new_node(node)
        path.set_pos(*(s * on_grid(position) + shift))

    shiny = Material("shiny", (0.3, 0.4, 0.6, 1.0), specular=(0.4, 0.4, 0.3), shininess=24.0)
    clay = geom_node("clay", ball(s), Material("clay", (0.7, 0.5, 0.3, 1.0)))
    put(clay, (-1.5, 8.0, 0.0))
    put(geom_node("shiny", ball(s), shiny), (1.5, 9.0, 0.0))
    floor = geom_node("floor", wall((24.0 * s, 20.0 * s), 8), Material("earth", (0.5, 0.5, 0.4, 1.0)))
    put(floor, (0.0, 10.0, -1.0))
    scene.root.find("floor").set_hpr(0, -90, 0)
    rng = np.random.default_rng(7)
    positions = on_grid(rng.uniform((-5, 4, -0.25), (5, 14, 2), (60, 3)))
    centers = np.array([(-1.5, 8.0, 0.0), (1.5, 9.0, 0.0)])
    away = np.linalg.norm(positions[:, None] - centers, axis=2).min(axis=1)
    positions = positions[away > 1.0 + GARDEN_LIGHTS][:24]
    colors = rng.uniform(0.2, 1.0, (len(positions), 3))
    many = PointLights("ramp", s * positions, colors, 3.0 * s)
    put(many, (0.0, 0.0, 0.0))
    lamp = PointLight("lamp", (0.6, 0.5, 0.4))
    lamp.set_attenuation((1.0, 0.1 / s, 0.2 / s / s))
    lamp.set_max_distance(12.0 * s)
    put(lamp, (0.0, 6.0, 3.0))
    spot = Spotlight("spot", (0.8, 0.9, 1.0))
    spot.set_cone(20.0, 30.0)
    spot.set_radius(12.0 * s)
    put(spot, (-4.0, 5.0, 5.0))
    scene.root.find("spot").set_hpr(-50.0, -50.0, 0.0)
    sun = DirectionalLight("sun", (0.1, 0.1, 0.08))
    sun.set_direction((0.3, 0.8, -2.0))
    scene.root.attach_new_node(sun)
    scene.camera.set_pos(*(s * np.array([0.0, -2.0, 3.0]) + shift))
    scene.camera.set_hpr(3.0, -14.0, 2.0)
    scene.camera_node.lens = PerspectiveLens(vfov=50.0, near=GARDEN_NEAR * s, far=GARDEN_FAR * s)
    return scene
