"""Normals from a normal map in float64: the twin of ``surface_normal`` in ``shaders/include/material.glsl``.

glTF 2.0, section 3.9.3: a texel is n/2 + 1/2, of a normal n in tangent space, whose x is along the tangent, y
along the bitangent and z along the surface's own normal. A scale multiplies x and y.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]


def mapped_normal(unit: Float64, tangent: Float64, texel: Float64, scale: float, mirrored: bool) -> Float64:
    """Return unit normals, shape (n, 3).

    Without a tangent, or where the texel's normal has the length 0, they are the surface's own.

    Parameters
    ----------
    unit : ndarray of float64, shape (n, 3)
        The surface's unit normals, not turned to the eye.
    tangent : ndarray of float64, shape (n, 4)
        Directions of any length in the same space, and numbers whose sign is that of the bitangent
        cross(normal, tangent).
    texel : ndarray of float64, shape (n, 3)
        0 to 1.
    mirrored : bool
        Whether the matrix to this space mirrors, which turns the cross product.
    """
    along, length = unit_or_zero(tangent[:, :3])
    side = np.where(tangent[:, 3:] < 0.0, -1.0, 1.0) * (-1.0 if mirrored else 1.0)
    x, y, z = np.moveaxis(2.0 * texel - 1.0, 1, 0)[..., None]
    normal = scale * x * along + scale * y * side * np.cross(unit, along) + z * unit
    mapped, steepness = unit_or_zero(normal)
    return np.asarray(np.where((length > 0.0) & (steepness > 0.0), mapped, unit))


def unit_or_zero(vectors: Float64) -> tuple[Float64, Float64]:
    """Return unit vectors (n, 3), 0 for those of length 0, and numbers (n, 1) above 0 for all others.

    Vectors may be so long or short that a float64 does not hold the square of their length.
    """
    largest = np.abs(vectors).max(axis=1, keepdims=True)
    scaled = vectors / np.where(largest > 0.0, largest, 1.0)
    length = np.linalg.norm(scaled, axis=1, keepdims=True)
    return scaled / np.where(length > 0.0, length, 1.0), length
