"""Meshes of light volumes, scaled so that they contain the unit sphere or the unit cone."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]


@cache
def proxy_mesh(name: str) -> NDArray[np.float32]:
    """Return the corners of a proxy's triangles, (n, 3): "cone", "cube", or "icosphere0" to "icosphere3"."""
    if name.startswith("icosphere"):
        mesh = circumscribed_icosphere(int(name.removeprefix("icosphere")))
    else:
        mesh = {"cone": circumscribed_cone, "cube": circumscribed_cube}[name]()
    return mesh.reshape(-1, 3).astype(np.float32)


def circumscribed_cube() -> Float64:
    """Return triangles around the unit sphere, counter-clockwise from outside, shape (12, 3, 3)."""
    faces = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            middle = side * np.eye(3)[axis]
            u = side * u  # so that u, v and the outward axis are right-handed
            a, b, c, d = (middle + s * u + t * v for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
            faces += [(a, b, c), (a, c, d)]
    return np.array(faces) * (1.0 + 1e-6)


def circumscribed_icosphere(subdivisions: int = 1) -> Float64:
    """Return triangles around the unit sphere, counter-clockwise from outside; no face cuts into it.

    Shape (20 * 4**subdivisions, 3, 3). One subdivision (80 triangles) covers 6% more area than the sphere;
    two cost four times the vertices for 1.7%.
    """
    g = (1.0 + np.sqrt(5.0)) / 2.0
    corners = np.array([(s * 1.0, t * g, 0.0) for s in (-1, 1) for t in (-1, 1)])
    points = np.concatenate([np.roll(corners, shift, axis=1) for shift in range(3)])
    # the faces of the icosahedron are the triples of corners at edge length 2 from each other
    near = np.abs(np.linalg.norm(points[:, None] - points[None], axis=2) - 2.0) < 1e-9
    triples = itertools.combinations(range(12), 3)
    faces = [(i, j, k) for i, j, k in triples if near[i, j] and near[j, k] and near[i, k]]
    triangles = points[np.array(faces)]
    outward = np.einsum("ij,ij->i", np.cross(triangles[:, 1], triangles[:, 2]), triangles[:, 0]) > 0
    triangles = np.where(outward[:, None, None], triangles, triangles[:, [0, 2, 1]])
    triangles /= np.linalg.norm(triangles, axis=2, keepdims=True)
    for _ in range(subdivisions):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        ab, bc, ca = (m / np.linalg.norm(m, axis=1, keepdims=True) for m in (a + b, b + c, c + a))
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(quarter, axis=1) for quarter in quarters])
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    inradius = np.einsum("ij,ij->i", normals, triangles[:, 0]).min()
    return np.asarray(triangles * (1.0 + 1e-6) / inradius)


def circumscribed_cone(sides: int = 16) -> Float64:
    """Return triangles around the cone from the origin to a circle of radius 1 at y = 1; no face cuts into
    it.

    Shape (2 * sides - 2, 3, 3), counter-clockwise from outside. Sixteen sides cover 4% more area than the
    cone.
    """
    angles = 2.0 * np.pi * np.arange(sides) / sides
    radius = (1.0 + 1e-6) / np.cos(np.pi / sides)
    ring = np.stack([radius * np.cos(angles), np.ones(sides), radius * np.sin(angles)], axis=1)
    after = np.roll(ring, -1, axis=0)
    mantle = np.stack([np.zeros_like(ring), ring, after], axis=1)
    base = np.stack([np.broadcast_to(ring[0], (sides - 2, 3)), ring[2:], ring[1:-1]], axis=1)
    return np.concatenate([mantle, base])
