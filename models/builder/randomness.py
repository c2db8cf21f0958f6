"""Random numbers that are the same everywhere: PCG64's raw bits, turned into floats here.

NumPy promises that a bit generator's stream never changes, but not so for its distributions.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np


class Random:
    """A stream of random numbers; each seed is a stream of its own."""

    def __init__(self, seed: int) -> None:
        self._bits = np.random.PCG64(seed)

    def units(self, *shape: int) -> np.ndarray:
        """Floats in [0, 1) of the given shape, on a grid of 2^-53."""
        raw = np.asarray(self._bits.random_raw(math.prod(shape)), dtype=np.uint64)
        return (raw >> np.uint64(11)).astype(np.float64).reshape(shape) * 2.0**-53

    def between(self, low: float, high: float) -> float:
        return low + (high - low) * float(self.units(1)[0])

    def around(self, centre: float, spread: float) -> float:
        """One float within `spread` of `centre`, near ones more often (the sum of two uniforms)."""
        a, b = self.units(2)
        return centre + spread * float(a + b - 1.0)

    def below(self, n: int) -> int:
        """One integer in 0..n-1."""
        return int(self.units(1)[0] * n)

    def direction(self) -> np.ndarray:
        """One unit vector, even over the sphere."""
        z = self.between(-1.0, 1.0)
        angle = self.between(0.0, 2.0 * math.pi)
        r = math.sqrt(1.0 - z * z)
        return np.array([r * math.cos(angle), r * math.sin(angle), z])


@lru_cache(maxsize=64)
def lattice(seed: int, *shape: int) -> np.ndarray:
    """A table of random numbers for noise that looks its lattice values up, modulo the shape."""
    table = Random(seed).units(*shape)
    table.flags.writeable = False
    return table
