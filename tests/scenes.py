"""Small scenes with known answers, built by hand."""

from __future__ import annotations

import numpy as np

from firefly_sample.camera import FrameCamera
from firefly_sample.pipeline import PASSES
from firefly_sample.plan.build import Planner
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene


def plain_camera(size=(64, 48)):
    """The camera of a frame that nobody drew: at the origin, looking along +Y."""
    return FrameCamera(PerspectiveLens().intrinsics(size), np.eye(4))


def geom_node(name, geom, material=None):
    node = GeomNode(name)
    node.add_geom(geom, material)
    return node


def wall(size=20.0, cells=1, name="wall"):
    """A square at y = 0 that faces -Y (towards the camera), `size` wide, texture v up."""
    n = cells + 1
    x, z = np.meshgrid(np.linspace(-0.5, 0.5, n), np.linspace(-0.5, 0.5, n))
    vertices = np.stack([x.ravel() * size, np.zeros(n * n), z.ravel() * size], axis=1)
    uv = np.stack([x.ravel() + 0.5, z.ravel() + 0.5], axis=1)
    i = np.arange(cells)
    a = (i[:, None] * n + i[None]).ravel()
    triangles = np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)])
    return Geom(vertices, triangles, np.tile([0.0, -1.0, 0.0], (n * n, 1)), uv, name=name)


def icosahedron():
    """Its 12 vertices at distance 1 from the origin, and its 20 triangles."""
    golden = (1 + 5**0.5) / 2
    plane = np.array([(-1, golden), (1, golden), (-1, -golden), (1, -golden)])
    vertices = np.zeros((3, 4, 3))
    for axis in range(3):
        vertices[axis, :, [axis, (axis + 1) % 3]] = plane.T
    triangles = """
        0 11 5   0 5 1   0 1 7   0 7 10  0 10 11  1 5 9  5 11 4  11 10 2  10 7 6  7 1 8
        3 9 4    3 4 2   3 2 6   3 6 8   3 8 9    4 9 5  2 4 11  6 2 10   8 6 7   9 8 1
    """
    return vertices.reshape(12, 3) / np.hypot(1, golden), np.array(triangles.split(), int).reshape(20, 3)


def ball(radius=1.0, subdivisions=3):
    """A ball of nearly equal triangles, whose normals are means of its faces' by the angles there.

    By hand, since importing trimesh takes longer than all the rest that a process of these tests does.
    """
    vertices, triangles = icosahedron()
    for _ in range(subdivisions):
        a, b, c = triangles.T
        ends = np.stack([triangles, triangles[:, [1, 2, 0]]])
        edges, numbers = np.unique(ends.max(axis=0) * len(vertices) + ends.min(axis=0), return_inverse=True)
        ab, bc, ca = len(vertices) + numbers.reshape(-1, 3).T
        triangles = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
        middles = vertices[np.stack(np.divmod(edges, len(vertices)))].mean(axis=0)
        vertices = unit(np.concatenate([vertices, middles]))
    corners = vertices[triangles]
    following, previous = (unit(np.roll(corners, by, axis=1) - corners) for by in (-1, 1))
    faces = unit(np.cross(following[:, 0], previous[:, 0]))
    angles = np.arccos((following * previous).sum(axis=-1))
    normals = np.zeros_like(vertices)
    np.add.at(normals, triangles, angles[..., None] * faces[:, None])
    return Geom(radius * vertices, triangles, unit(normals), name="ball")


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def wall_scene(distance=10.0, color=(0.5, 0.5, 0.5, 1.0), size=20.0, cells=1, material=None, **lens):
    """The camera at the origin looks along +Y at a wall that fills its view."""
    scene = Scene()
    node = geom_node("wall", wall(size, cells), material or Material("wall", color))
    scene.root.attach_new_node(node).set_pos(0, distance, 0)
    scene.camera.node().lens = PerspectiveLens(**{"vfov": 60.0, "near": 1.0, "far": 100.0} | lens)
    return scene


def orthographic_wall(distance=10.0, film=(16.0, 12.0)):
    scene = wall_scene(distance)
    scene.camera.node().lens = OrthographicLens(film_size=film, near=1.0, far=100.0)
    return scene


def ball_scene(lights=60, seed=0, radius=2.5, ambient=(0.0, 0.0, 0.0)):
    """Three balls on a floor under many lights: curved and flat, near and far, lit from all sides."""
    scene = Scene()
    node = geom_node("ball", ball(), Material("clay", (0.8, 0.5, 0.3, 1)))
    for i in range(3):
        path = scene.root.attach_new_node(f"place {i}")
        path.set_pos(2.5 * i - 2.5, 10, 0)
        path.attach_new_node(node)
    floor = scene.root.attach_new_node(
        geom_node("floor", wall(40.0, 8), Material("earth", (0.4, 0.4, 0.4, 1)))
    )
    floor.set_pos(0, 10, -1.1)
    floor.set_hpr(0, -90, 0)
    rng = np.random.default_rng(seed)
    positions = rng.uniform((-6, 4, -1), (6, 16, 2), (lights, 3))
    scene.root.attach_new_node(PointLights("lights", positions, rng.uniform(0.2, 1, (lights, 3)), radius))
    if any(ambient):
        scene.root.attach_new_node(AmbientLight("sky", ambient))
    scene.camera.set_pos(0, -4, 3)
    scene.camera.set_hpr(3, -12, 2)
    scene.camera.node().lens = PerspectiveLens(vfov=50, near=0.5, far=100)
    return scene


def new_planner():
    """A planner of the package's own passes."""
    return Planner([kind() for kind in PASSES])
