"""A thin mist over the forest's ground: wide flat banks of particles that drift."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.random import uniform
from firefly_sample.scenes.forest_ground import ground_height
from firefly_sample.scenes.forest_layout import CAMERA

Float64 = NDArray[np.float64]

MIST_SEED = 1923
_COUNT = 800
_NEAR, _FAR = 70.0, 420.0
"""How far from the camera the mist begins and ends."""
_ALPHA = 0.038
_COLOR = (0.42, 0.46, 0.5)


def mist_at(seed: int, time: float) -> tuple[Float64, Float64, float, tuple[float, float, float]]:
    """Positions, radii, alpha and colour at `time` (seconds)."""
    x, y, height, radii, phase = _banks(seed)
    x = x + 2.5 * np.sin(0.11 * time + phase)
    y = y + 1.5 * np.cos(0.083 * time + 2.0 * phase)
    height = height + 0.35 * np.sin(0.19 * time + 3.0 * phase)
    return np.stack([x, y, ground_height(x, y) + height], axis=1), radii, _ALPHA, _COLOR


@lru_cache(maxsize=1)
def _banks(seed: int) -> tuple[Float64, ...]:
    u = uniform(seed, np.arange(5)[:, None], np.arange(_COUNT)[None, :])
    # as many for each distance as are needed to fill the view: nearer ones are smaller
    away = _NEAR * (_FAR / _NEAR) ** u[1]
    y = CAMERA[1] + away
    x = CAMERA[0] + (0.84 * u[0] - 0.42) * away
    radii = (0.030 + 0.030 * u[3]) * away + 1.5
    return x, y, 0.32 * radii * u[2] + 0.3, radii, 2.0 * np.pi * u[4]
