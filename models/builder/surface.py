"""Geometry being put together: patches of triangles, tubes along curves, and cards."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Surface:
    """Triangles of one material, Z up; grows by `add`."""

    vertices: list = field(default_factory=list)
    normals: list = field(default_factory=list)
    texcoords: list = field(default_factory=list)
    colors: list = field(default_factory=list)
    triangles: list = field(default_factory=list)
    count: int = 0

    def add(self, vertices, normals, texcoords, triangles, colors=None):
        """Append a patch; `colors` (n, 3) are linear multipliers in 0..1."""
        vertices = np.asarray(vertices, float)
        n = len(vertices)
        self.vertices.append(vertices)
        self.normals.append(unit(np.asarray(normals, float)))
        self.texcoords.append(np.asarray(texcoords, float))
        self.colors.append(np.ones((n, 3)) if colors is None else np.broadcast_to(colors, (n, 3)))
        self.triangles.append(np.asarray(triangles, int).reshape(-1, 3) + self.count)
        self.count += n

    def arrays(self):
        """Vertices, normals, texcoords, colours, triangles."""
        return tuple(
            np.concatenate(part)
            for part in (self.vertices, self.normals, self.texcoords, self.colors, self.triangles)
        )

    def shade(self, function):
        """Multiply the colours by `function(vertices) -> (n,)` or (n, 3), for baked occlusion."""
        for k, vertices in enumerate(self.vertices):
            factor = np.asarray(function(vertices))
            self.colors[k] = self.colors[k] * (factor[:, None] if factor.ndim == 1 else factor)

    def lift(self, floor):
        """Raise what hangs below the height `floor` to it, so that leaves lie on the ground, not in it."""
        for vertices in self.vertices:
            vertices[:, 2] = np.maximum(vertices[:, 2], floor)

    def bend_normals(self, centre, radii, amount):
        """Turn the normals towards those of an ellipsoid: a crown of flat cards then shades like a volume."""
        for k, vertices in enumerate(self.vertices):
            outward = unit((vertices - centre) / np.square(np.asarray(radii, float)))
            self.normals[k] = unit(self.normals[k] * (1.0 - amount) + outward * amount)


def unit(vectors):
    """Vectors of length 1; a zero vector becomes +Z."""
    vectors = np.asarray(vectors, float)
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 1e-12, vectors / np.maximum(length, 1e-12), [0.0, 0.0, 1.0])


def rotate(vector, axis, angle):
    """`vector` turned about the unit `axis` (Rodrigues)."""
    c, s = math.cos(angle), math.sin(angle)
    return vector * c + np.cross(axis, vector) * s + axis * np.dot(axis, vector) * (1.0 - c)


def perpendicular(direction, near=(0.0, 0.0, 1.0)):
    """A unit vector at a right angle to `direction`, as close to `near` as can be."""
    near = np.asarray(near, float)
    flat = near - direction * np.dot(near, direction)
    if np.linalg.norm(flat) < 1e-6:
        flat = np.cross(direction, [1.0, 0.0, 0.0] if abs(direction[0]) < 0.9 else [0.0, 1.0, 0.0])
    return unit(flat)


def grid_triangles(rows, columns):
    """Two triangles for each square of a (rows, columns) grid of vertices in row-major order."""
    k = np.arange((rows - 1) * columns).reshape(rows - 1, columns)[:, :-1].ravel()
    up = k + columns
    return np.concatenate([np.stack([k, k + 1, up + 1], 1), np.stack([k, up + 1, up], 1)])


def add_grid(surface, points, texcoords, colors=None, wrap=False):
    """A grid of points (rows, columns, 3) with smooth normals; `wrap`: first and last column coincide."""
    rows, columns, _ = points.shape
    along = np.gradient(points, axis=0)
    across = np.gradient(points, axis=1)
    if wrap:
        across[:, 0] = across[:, -1] = (points[:, 1] - points[:, -2]) / 2.0
    normals = np.cross(across, along).reshape(-1, 3)
    if colors is not None:
        colors = np.broadcast_to(colors, (rows, columns, 3)).reshape(-1, 3)
    surface.add(
        points.reshape(-1, 3), normals, texcoords.reshape(-1, 2), grid_triangles(rows, columns), colors
    )


def add_tube(surface, path, radii, sides, tile=(8.0, 16.0), offset=0.0, profile=None, colors=None):
    """A tube along `path` (n, 3) with radii (n,).

    `tile` is the size that one repeat of the texture covers; the number of repeats around is whole, so
    there is no seam. `profile(t, angle)` multiplies the radius, for root flare and ribs; t counts rings.
    `colors` (n, 3) are given per ring.
    """
    path, radii = np.asarray(path, float), np.asarray(radii, float)
    n = len(path)
    tangents = unit(np.gradient(path, axis=0))
    side = perpendicular(tangents[0], near=(1.0, 0.0, 0.0))
    angles = np.linspace(0.0, 2.0 * math.pi, sides + 1)
    rings = np.empty((n, sides + 1, 3))
    for k in range(n):
        side = perpendicular(tangents[k], near=side)
        other = np.cross(tangents[k], side)
        r = radii[k] * (np.ones(sides + 1) if profile is None else profile(k, angles))
        rings[k] = path[k] + r[:, None] * (np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * other)
    rings[:, -1] = rings[:, 0]
    repeats = max(1, round(2.0 * math.pi * radii[: max(2, n // 2)].mean() / tile[0]))
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    texcoords = np.stack(
        np.broadcast_arrays(
            angles[None, :] / (2.0 * math.pi) * repeats + offset, along[:, None] / tile[1] + offset * 0.73
        ),
        axis=-1,
    )
    ring_colors = None if colors is None else np.repeat(np.asarray(colors)[:, None, :], sides + 1, axis=1)
    add_grid(surface, rings, texcoords, ring_colors, wrap=True)


def add_card(surface, root, direction, facing, size, cell, droop=0.0, segments=1, fold=0.0, color=None):
    """A leaf card that grows from `root` along `direction`, `facing` its front.

    `size` = (width, length); `cell` = (u0, v0, u1, v1) of the texture, v up, stem at the bottom. `droop`
    bends the card down along its length, in radians; `fold` bends its two halves towards each other.
    """
    width, length = size
    direction = unit(np.asarray(direction, float))
    front = perpendicular(direction, near=facing)
    across = np.cross(direction, front)
    u0, v0, u1, v1 = cell
    columns = np.array([0.0, 0.5, 1.0]) if fold else np.array([0.0, 1.0])
    points, texcoords = [], []
    centre, step = np.asarray(root, float), length / segments
    for row in range(segments + 1):
        for s in columns:
            lift = (abs(s - 0.5) * width * math.tan(fold)) if fold else 0.0
            points.append(centre + across * (s - 0.5) * width + front * lift)
            texcoords.append((u0 + (u1 - u0) * s, v0 + (v1 - v0) * row / segments))
        direction = _droop(direction, droop / segments)
        front = perpendicular(direction, near=front)
        centre = centre + direction * step
    rows = segments + 1
    points = np.array(points).reshape(rows, len(columns), 3)
    colors = None if color is None else np.broadcast_to(color, points.shape)
    add_grid(surface, points, np.array(texcoords).reshape(rows, len(columns), 2), colors)


def _droop(direction, angle):
    """`direction` turned towards straight down by at most `angle` (up, where it is negative)."""
    target = np.array([0.0, 0.0, -1.0 if angle > 0 else 1.0])
    axis = np.cross(direction, target)
    size = np.linalg.norm(axis)
    if size < 1e-6 or angle == 0.0:
        return direction
    reach = math.atan2(size, float(np.dot(direction, target)))
    return rotate(direction, axis / size, min(abs(angle), reach))
