"""The cloud of the scene "smoke": the positions of its puffs, which move between two shapes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.random import uniform
from firefly_sample.scenes.plugin import sphere_directions

Float64 = NDArray[np.float64]

REACH = 1.32
"""Radius of a sphere around the origin that contains the centres of all puffs at any time."""
PERIOD = 24.0
"""Seconds from one shape to the other and back."""
EMBER, GOLD = (0.80, 0.20, 0.07), (0.88, 0.62, 0.24)
"""Linear colours of the two shapes."""

_RADIUS, _SIZES = 0.062, 0.7
"""The mean radius of puffs, and the relative range of their radii."""
LARGEST_PUFF = _RADIUS * (1.0 + 0.5 * _SIZES)
"""The largest radius at a size of 1."""
_LATENESS = 0.35
"""Delay of the last puffs after the first ones, as a fraction of the movement."""
_HEAPS = (
    ((0.0, 0.0, 0.02), 0.58),
    ((-0.46, 0.10, -0.14), 0.42),
    ((0.47, -0.06, -0.10), 0.44),
    ((0.10, 0.38, -0.02), 0.40),
    ((-0.08, -0.42, -0.12), 0.40),
    ((0.20, 0.05, 0.46), 0.40),
    ((-0.26, -0.05, 0.38), 0.34),
    ((0.66, 0.20, -0.26), 0.26),
    ((-0.70, -0.12, -0.28), 0.27),
    ((-0.02, 0.0, 0.74), 0.26),
)
"""Centres and radii of the balls of the first shape."""
_KNOT, _TUBE = 0.34, 0.20
"""Scale of the second shape, a trefoil knot, and the radius of its tube."""


class Cloud:
    """Any number of puffs; adding more never moves the first ones.

    `size` is a factor of the puffs' radii; `alpha` is the opacity of a puff through its centre.
    """

    def __init__(self, seed: int, count: int, size: float, alpha: float) -> None:
        self.size, self.alpha = size, alpha
        u = uniform(seed, np.arange(9)[:, None], np.arange(count)[None, :])
        self._heap, self._knot = _heap(u[:4]), _knot(u[4:7])
        self._radii = _RADIUS * (1.0 - 0.5 * _SIZES + _SIZES * u[7])
        self._late = u[8]

    def at(
        self, time: float, morph: float = 0.0, morphing: bool = True
    ) -> tuple[Float64, Float64, float, Float64]:
        """Return positions, radii, alpha and colours at `time` (seconds).

        `morph` is the least progress of the puffs from the heap (0) to the knot (1); if they are `morphing`,
        they move on to the knot and back over time.
        """
        gone = (1.0 + _LATENESS) * morph - 0.5 * _LATENESS
        if morphing:
            # there and back, with a rest at each
            wave = 0.5 - 0.5 * math.cos(2.0 * math.pi * time / PERIOD)
            gone = max(gone, 1.9 * wave - 0.45)
        # no two puffs set out together
        share = _smooth(np.clip(gone - _LATENESS * (self._late - 0.5), 0.0, 1.0))[:, None]
        middles = (1.0 - share) * self._heap + share * self._knot
        drift = np.sin(2.1 * middles[:, [1, 2, 0]] + 0.31 * time)
        drift = drift * np.cos(2.7 * middles[:, [2, 0, 1]] - 0.23 * time)
        x, y, z = (middles + 0.05 * drift + 0.16 * (share * (1.0 - share)) * drift).T
        turn = 2.0 * math.pi * time / (4.0 * PERIOD)
        c, s = math.cos(turn), math.sin(turn)
        positions = np.stack([c * x - s * y, s * x + c * y, z], axis=1)
        return positions, self.size * self._radii, self.alpha, (1.0 - share) * EMBER + share * GOLD


def _smooth(t: Float64) -> Float64:
    return np.asarray(t * t * (3.0 - 2.0 * t))


def _heap(u: Float64) -> Float64:
    """Return positions in a heap of balls, denser towards their surfaces; shape (n, 3)."""
    centers = np.array([center for center, _ in _HEAPS])
    radii = np.array([radius for _, radius in _HEAPS])
    shares = np.cumsum(radii**2.5)
    which = np.minimum(np.searchsorted(shares / shares[-1], u[3]), len(radii) - 1)
    # a power of 1/3 would fill the balls evenly
    ball = sphere_directions(u[0], u[1]) * u[2][:, None] ** 0.22
    return np.asarray(centers[which] + ball * radii[which, None])


def _knot(u: Float64) -> Float64:
    """Return positions in the tube of an upright trefoil knot; shape (n, 3)."""
    t = 2.0 * math.pi * u[0]
    x = np.sin(t) + 2.0 * np.sin(2.0 * t)
    z = np.cos(t) - 2.0 * np.cos(2.0 * t)
    middle = _KNOT * np.stack([x, -1.1 * np.sin(3.0 * t), z], axis=1)
    dx, dz = np.cos(t) + 4.0 * np.cos(2.0 * t), 4.0 * np.sin(2.0 * t) - np.sin(t)
    along = np.stack([dx, -3.3 * np.cos(3.0 * t), dz], axis=1)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)
    angle, radius = 2.0 * math.pi * u[1], _TUBE * np.sqrt(u[2]) ** 0.8
    across = (radius * np.cos(angle))[:, None] * side
    return np.asarray(middle + across + (radius * np.sin(angle))[:, None] * other)
