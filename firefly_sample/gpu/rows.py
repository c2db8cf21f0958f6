"""Rows of points for instanced draws and light textures: the cast to float32 of places in view space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["light_texels", "point_rows"]

Float64 = NDArray[np.float64]
Float32 = NDArray[np.float32]


def point_rows(positions: Float64, radii: Float64, colors: Float64) -> Float32:
    """Rows (x, y, z, radius, r, g, b), shape (n, 7)."""
    rows = np.concatenate([positions, radii[:, None], colors], axis=1)
    with np.errstate(over="ignore"):  # a radius beyond float32 reaches everything, as infinity does
        return rows.astype(np.float32)


def light_texels(positions: Float64, radii: Float64, colors: Float64, width: int) -> Float32:
    """Two texels a light, (x, y, z, radius) and (r, g, b, 0), in rows of `width`: shape (rows, width, 4)."""
    n = len(positions)
    texels = np.zeros((max(1, -(-2 * n // width)) * width, 4), dtype=np.float32)
    rows = point_rows(positions, radii, colors)
    texels[0 : 2 * n : 2], texels[1 : 2 * n : 2, :3] = rows[:, :4], rows[:, 4:]
    return texels.reshape(-1, width, 4)
