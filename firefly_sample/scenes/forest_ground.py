"""The shape of the forest's ground: one function that the terrain's mesh and the placement share."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.scene.random import uniform

Float64 = NDArray[np.float64]

X_RANGE = (-260.0, 260.0)
Y_RANGE = (-230.0, 300.0)
CLEARING = (-4.0, 12.0, 58.0, 84.0)
"""Centre x and y, half width and half depth of the clearing, in scene units."""


@lru_cache(maxsize=16)
def _lattice(seed: int) -> Float64:
    table = uniform(seed, np.arange(64)[:, None], np.arange(64)[None, :])
    table.flags.writeable = False
    return table


def ground_noise(x: ArrayLike, y: ArrayLike, seed: int, wavelength: float) -> Float64:
    """Smooth noise in -1..1: random values on a square lattice, blended by a quintic.

    Parameters
    ----------
    x, y : array_like
        World space; they broadcast.
    seed : int
    wavelength : float
        The lattice's spacing, in scene units; the noise repeats after 64 of them.
    """
    u = np.asarray(x, dtype=np.float64) / wavelength
    v = np.asarray(y, dtype=np.float64) / wavelength
    i, j = np.floor(u), np.floor(v)
    a, b = u - i, v - j
    a = a * a * a * (a * (6.0 * a - 15.0) + 10.0)
    b = b * b * b * (b * (6.0 * b - 15.0) + 10.0)
    i, j = i.astype(np.int64) % 64, j.astype(np.int64) % 64
    right, up = (i + 1) % 64, (j + 1) % 64
    table = _lattice(seed)
    low = table[i, j] * (1.0 - a) + table[right, j] * a
    high = table[i, up] * (1.0 - a) + table[right, up] * a
    return np.asarray(2.0 * (low * (1.0 - b) + high * b) - 1.0)


def clearing_distance(x: ArrayLike, y: ArrayLike) -> Float64:
    """0 at the clearing's centre, 1 on its rim, and on outwards; the rim is not quite an ellipse."""
    cx, cy, half_width, half_depth = CLEARING
    u = (np.asarray(x, dtype=np.float64) - cx) / half_width
    v = (np.asarray(y, dtype=np.float64) - cy) / half_depth
    return np.asarray(np.hypot(u, v) * (1.0 + 0.12 * ground_noise(x, y, 11, 46.0)))


def _ramp(t: Float64) -> Float64:
    """0 below 0, 1 above 1, smooth between."""
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def ground_height(x: ArrayLike, y: ArrayLike) -> Float64:
    """Height of the ground, in scene units, at the points (x, y); arrays broadcast.

    A shallow hollow with a few humps, banks on both sides, and a wooded rise at the back that closes the
    view.
    """
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    out = _ramp((clearing_distance(x, y) - 0.75) / 1.1)
    height = 1.1 * ground_noise(x, y, 1, 37.0) + 0.45 * ground_noise(x, y, 2, 15.0)
    height = height + out * (5.0 * ground_noise(x, y, 3, 74.0) + 1.6 * ground_noise(x, y, 4, 29.0) + 2.0)
    height = height + 26.0 * _ramp((y - 120.0) / 190.0) * (1.0 + 0.35 * ground_noise(x, y, 5, 120.0))
    height = height + 14.0 * _ramp((np.abs(x + 10.0) - 70.0) / 170.0)
    return np.asarray(height - 1.5 * (1.0 - out))


def ground_slope(x: ArrayLike, y: ArrayLike) -> tuple[Float64, Float64]:
    """The derivatives of `ground_height` along x and y, by central differences over half a unit."""
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    return (
        np.asarray((ground_height(x + 0.25, y) - ground_height(x - 0.25, y)) / 0.5),
        np.asarray((ground_height(x, y + 0.25) - ground_height(x, y - 0.25)) / 0.5),
    )
