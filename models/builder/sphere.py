"""Spheres laid out as the six faces of a cube: no pole, no seam, texels of nearly one size."""

from __future__ import annotations

import math

import numpy as np

from builder.surface import Surface, grid_triangles, unit

_FACES = (
    ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
    ((0, 0, -1), (0, -1, 0), (-1, 0, 0)),
    ((0, -1, 0), (0, 0, 1), (-1, 0, 0)),
    ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
)
"""Axis, right and up of each face; a row of three goes on from face to face: mipmaps then mix neighbours."""
MARGIN = 0.04
"""How far a face's picture goes on beyond its edges, as a share of its cell: room for filters and mipmaps."""


def cube_sphere(steps):
    """A unit sphere of 12 * steps^2 triangles."""
    surface = Surface()
    angle = np.linspace(-1.0, 1.0, steps + 1)
    for k, (axis, right, up) in enumerate(np.asarray(_FACES, float)):
        a, b = np.meshgrid(np.tan(angle * math.pi / 4.0), np.tan(angle * math.pi / 4.0))
        points = unit(axis + a[..., None] * right + b[..., None] * up).reshape(-1, 3)
        u, v = np.meshgrid(angle, angle)
        uv = 0.5 + 0.5 * (1.0 - 2.0 * MARGIN) * np.stack([u, v], axis=-1).reshape(-1, 2)
        uv = (uv + np.array([k % 3, 1 - k // 3])) / [3.0, 2.0]
        surface.add(points, points, uv, grid_triangles(steps + 1, steps + 1))
    return surface


class Atlas:
    """The picture of a sphere: directions of its texels (6, n, n, 3), and a way back to one image."""

    def __init__(self, pixels):
        t = ((np.arange(pixels) + 0.5) / pixels * 2.0 - 1.0) / (1.0 - 2.0 * MARGIN)
        a, b = np.meshgrid(np.tan(t * math.pi / 4.0), np.tan(-t * math.pi / 4.0))
        faces = np.asarray(_FACES, float)
        self.pixels = pixels
        self.directions = np.stack(
            [unit(axis + a[..., None] * right + b[..., None] * up) for axis, right, up in faces]
        )

    def image(self, values):
        """(2n, 3n, ...) from values by face."""
        return np.concatenate([np.concatenate(list(values[k : k + 3]), axis=1) for k in (0, 3)], axis=0)

    def slope(self, height):
        """The gradient (6, n, n, 3) of a field over the sphere, a change for each radian."""
        result = np.empty_like(self.directions)
        for k in range(6):
            d = self.directions[k]
            along_y, along_x = np.gradient(d, axis=0), np.gradient(d, axis=1)
            change_y, change_x = np.gradient(height[k], axis=0), np.gradient(height[k], axis=1)
            # Solve for the tangent vector whose products with both steps are the changes.
            xx, yy = (along_x**2).sum(-1), (along_y**2).sum(-1)
            xy = (along_x * along_y).sum(-1)
            whole = xx * yy - xy * xy
            p = (change_x * yy - change_y * xy) / whole
            q = (change_y * xx - change_x * xy) / whole
            result[k] = p[..., None] * along_x + q[..., None] * along_y
        return result


class Tiles:
    """Finds the texels around a direction by looking only into the tiles of an atlas that reach it."""

    def __init__(self, directions, side=16):
        faces, n = len(directions), directions.shape[1] // side
        texels = np.arange(directions[..., 0].size).reshape(faces, n, side, n, side)
        self._texels = texels.swapaxes(2, 3).reshape(-1, side * side)
        self._directions = directions.reshape(-1, 3)
        tiles = self._directions[self._texels]
        self._middles = unit(tiles.mean(axis=1))
        self._reach = np.arccos((tiles @ self._middles[..., None]).min(axis=(1, 2)))

    def within(self, angle, direction):
        """Indices of the texels less than `angle` (radians, below pi) away from a unit vector."""
        least = np.cos(np.minimum(angle + self._reach, math.pi))
        texels = self._texels[self._middles @ direction >= least - 1e-9].reshape(-1)
        return texels[self._directions[texels] @ direction > math.cos(angle)]


def lit(slope, strength, light=(0.6, -0.5, 0.62)):
    """A factor around 1: a relief lit from one side, where it is lit flat at all."""
    toward = np.asarray(light) / np.linalg.norm(light)
    return np.clip(1.0 - strength * (slope @ toward), 0.35, 1.7)
