"""Scenes of many objects in front of each other, and what rays say of them, by trimesh and Embree alone."""

from __future__ import annotations

import numpy as np
import trimesh

from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.scene import Scene

SHAPES = (
    lambda: trimesh.creation.icosphere(subdivisions=2),
    lambda: trimesh.creation.box((1.6, 1.2, 0.8)),
    lambda: trimesh.creation.cone(0.9, 1.8, sections=12),
    lambda: trimesh.creation.torus(0.8, 0.3, major_sections=16, minor_sections=8),
)
HAIR = 1 / 64
"""A distance, as a share of a pixel: four times the 1/256 to which drivers round corners."""


def crowd(seed, size, count):
    """A scene of objects, the mesh of each in the camera's space, OpenCV's axes, and the camera's projection.

    Each object is a tagged node with one or two shapes below it, turned and stretched. Some reach out of the
    picture. The camera's lens is one of three kinds.
    """
    rng = np.random.default_rng(seed)
    scene, meshes = Scene(), []
    kind = ("perspective", "off centre", "orthographic")[seed % 3]
    lens, to_pixels = _lens(kind, size)
    scene.camera.node().lens = lens
    scene.camera.set_pos(*rng.uniform(-5, 5, 3))
    scene.camera.set_hpr(*rng.uniform(-180, 180, 3))
    camera = scene.camera.get_net_transform().get_mat()
    for number in range(count):
        top = scene.root.attach_new_node(f"place {number}")
        path = top.attach_new_node(f"thing {number}")
        path.set_tag("category", "round" if number % 2 else "square")
        away = rng.uniform(5, 12)
        reach = 5.0 if kind == "orthographic" else 0.8 * away
        place = np.array([*rng.uniform(-reach, reach, 2), away])[[0, 2, 1]]
        top.set_pos(*(place @ camera[:3, :3] + camera[3, :3]))
        path.set_hpr(*rng.uniform(-180, 180, 3))
        path.set_scale(*(rng.uniform(0.5, 1.5, 3) if number % 3 else [rng.uniform(0.5, 1.5)] * 3))
        parts = []
        for part in range(1 + number % 2):
            mesh = SHAPES[(number + part) % len(SHAPES)]()
            node = GeomNode(f"part {part}")
            node.add_geom(Geom(mesh.vertices, mesh.faces))
            child = path.attach_new_node(node)
            child.set_pos(part, 0, 0)
            net = child.get_net_transform().get_mat()
            points = np.column_stack([mesh.vertices, np.ones(len(mesh.vertices))]) @ net
            points = points @ np.linalg.inv(camera)
            parts.append(trimesh.Trimesh(points[:, [0, 2, 1]] * (1, -1, 1), mesh.faces, process=False))
        meshes.append(trimesh.util.concatenate(parts))
    return scene, meshes, to_pixels


def _lens(kind, size):
    """A lens, and a function from points in OpenCV's camera space to columns and rows."""
    width, height = size
    if kind == "orthographic":
        film = 12.0, 12.0 * height / width

        def flat(points):
            return points[..., :2] * width / film[0] + (width / 2 - 0.5, height / 2 - 0.5)

        return OrthographicLens(film_size=film, near=1, far=100), flat
    shift = (0.1, -0.05) if kind == "off centre" else (0.0, 0.0)
    offset = 2.0 * shift[0], 2.0 * shift[1]
    lens = PerspectiveLens(fov=60.0, film_size=2.0, film_offset=offset, near=0.5, far=100)
    focal = width / 2 / np.tan(np.radians(30))
    # the film's centre is off by a share of its width, right and up
    center = width / 2 - 0.5 - shift[0] * width, height / 2 - 0.5 + shift[1] * width
    return lens, lambda points: points[..., :2] / points[..., 2:] * focal + center


def rays(to_pixels, size, tiles=0):
    """Origins and directions of rays through pixels, on a canvas with `tiles` more pictures to each side.

    Shape (5, n, 3): through the centres, and a hair beside them to four sides.
    """
    width, height = size
    v, u = np.mgrid[-tiles * height : (tiles + 1) * height, -tiles * width : (tiles + 1) * width]
    beside = HAIR * np.array([(0, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)])
    pixels = np.stack([u.ravel(), v.ravel()], axis=1) + beside[:, None]
    ends = np.array([(x, y, z) for z in (1.0, 2.0) for x, y in ((0, 0), (1, 0), (0, 1))])
    at = to_pixels(ends).reshape(2, 3, 2)
    points = []
    for z, (zero, right, down) in zip((1.0, 2.0), at, strict=True):
        xy = (pixels - zero) / (right[0] - zero[0], down[1] - zero[1])
        points.append(np.concatenate([xy, np.full((*xy.shape[:2], 1), z)], axis=-1))
    origin = 2 * points[0] - points[1]  # at z = 0
    return origin, points[1] - points[0]


def sure_hits(mesh, origin, direction):
    """Two masks: pixels whose ray meets a mesh, and pixels where the rays a `HAIR` beside it agree."""
    met = np.zeros(origin.shape[:2], dtype=bool)
    for hits, start, ray in zip(met, origin, direction, strict=True):
        hits[:] = mesh.ray.intersects_any(start, ray)
    return met[0], (met == met[0]).all(axis=0)


def sure_owner(meshes, origin, direction):
    """The index of the first mesh that each pixel's ray meets, -1 for none, and the same certainty."""
    first = np.cumsum([0, *(len(mesh.faces) for mesh in meshes)])
    whole = trimesh.util.concatenate(meshes)
    found = np.array([whole.ray.intersects_first(*ray) for ray in zip(origin, direction, strict=True)])
    owner = np.where(found >= 0, np.searchsorted(first, found, side="right") - 1, -1)
    return owner[0], (owner == owner[0]).all(axis=0)
