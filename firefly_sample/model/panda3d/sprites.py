"""Points of Panda3D with a size in the scene's units, such as its particles: squares that face the camera."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64

SPRITE = "*point sprite*"
"""Stands for a column of texture coordinates: those of each square, 0 to 1 to the right and downwards."""

_CORNERS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
_TEXCOORDS = np.array([(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)])


class Facing(NamedTuple):
    """The way in which squares face the camera; hashable.

    Attributes
    ----------
    right, up : tuple of three floats
        In the space of the points. They are as long as half a square of size 1 is wide.
    size : float
        Of points without a size of their own.
    """

    right: tuple[float, ...]
    up: tuple[float, ...]
    size: float


def facing(net: Float64, eye: Float64 | None, size: float) -> Facing:
    """Return how squares face the camera.

    Parameters
    ----------
    net, eye : ndarray of shape (4, 4)
        From the points and from the camera to the world. Without a camera's, it looks along y.
    size : float
    """
    to_eye = (net if eye is None else net @ np.linalg.inv(eye))[:3, :3]
    volume = abs(float(np.linalg.det(to_eye)))
    if volume == 0.0:  # nothing of the points is seen
        return Facing((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), size)
    back = np.linalg.inv(to_eye) * volume ** (1 / 3)
    return Facing(tuple(back[0].tolist()), tuple(back[2].tolist()), size)


def squares(
    positions: Float64, how: Facing, sizes: Float64 | None, ratios: Float64 | None, turns: Float64 | None
) -> tuple[Float64, NDArray[np.int64]]:
    """Return the corners of squares around points, four for each, and their triangles.

    Parameters
    ----------
    positions : ndarray of shape (n, 3)
    how : Facing
    sizes, ratios, turns : ndarray of shape (n, 1) or None
        Half of the height of each square, its width by its height, and degrees.
    """
    count = len(positions)
    half = np.full((count, 1), how.size) if sizes is None else sizes
    offsets = (
        _CORNERS[None] * np.concatenate([half if ratios is None else half * ratios, half], axis=1)[:, None]
    )
    if turns is not None:
        cosine, sine = np.cos(np.radians(turns)), np.sin(np.radians(turns))
        x, z = offsets[..., 0], offsets[..., 1]
        offsets = np.stack([x * cosine - z * sine, x * sine + z * cosine], axis=-1)
    corners = positions[:, None] + offsets @ np.array([how.right, how.up])
    first = 4 * np.arange(count)[:, None]
    return corners.reshape(-1, 3), (first + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3)


def square_texcoords(count: int) -> Float64:
    """Return the texture coordinates of the corners of squares, shape (4 * count, 2)."""
    return np.tile(_TEXCOORDS, (count, 1))
