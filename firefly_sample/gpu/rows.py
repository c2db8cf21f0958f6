"""Rows of points for instanced draws and light textures: the cast to float32 of places in view space.

A float32 rounds a place 300 units away by up to 1.5e-5, which shows beside a light a quarter of a unit from
a surface. What the rounding took is sent along as a second float32 and added to the difference of light
and surface, where it counts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["TEXELS_PER_LIGHT", "light_rows", "light_texels", "point_rows"]

Float64 = NDArray[np.float64]
Float32 = NDArray[np.float32]

TEXELS_PER_LIGHT = 3


def point_rows(positions: Float64, radii: Float64, colors: Float64) -> Float32:
    """Rows (x, y, z, radius, r, g, b), shape (n, 7)."""
    rows = np.concatenate([positions, radii[:, None], colors], axis=1)
    with np.errstate(over="ignore"):  # a radius beyond float32 reaches everything, as infinity does
        return rows.astype(np.float32)


def light_rows(positions: Float64, radii: Float64, colors: Float64) -> Float32:
    """Rows (x, y, z, radius, r, g, b, and what rounding took from x, y, z), shape (n, 10)."""
    rows = point_rows(positions, radii, colors)
    return np.concatenate([rows, (positions - rows[:, :3]).astype(np.float32)], axis=1)


def light_texels(positions: Float64, radii: Float64, colors: Float64, width: int) -> Float32:
    """Three texels a light, (x, y, z, radius), (r, g, b, 0) and (rest of x, y, z, 0): (rows, width, 4)."""
    n = len(positions)
    rows = light_rows(positions, radii, colors)
    count = max(1, -(-TEXELS_PER_LIGHT * n // width)) * width
    texels = np.zeros((count, 4), dtype=np.float32)
    used = texels[: TEXELS_PER_LIGHT * n].reshape(n, TEXELS_PER_LIGHT, 4)
    used[:, 0], used[:, 1, :3], used[:, 2, :3] = rows[:, :4], rows[:, 4:7], rows[:, 7:]
    return texels.reshape(-1, width, 4)
