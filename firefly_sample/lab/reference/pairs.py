"""How many (pixel, light) pairs are nearer than the light's reach, without measuring each of them.

Pixels are taken by small tiles. The box around a tile's positions mostly tells whether a light reaches all of
them or none. What is left is a product of matrices: d^2 = p.p + l.l - 2 p.l. Where its rounding could decide,
the distance is measured as `OneLight.in_reach` does, so the count is that of measuring every pair.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.chunks import tiles_of
from firefly_sample.lab.reference.one_light import OneLight, lengths
from firefly_sample.plan.lights.light_set import LightSet

Float64 = NDArray[np.float64]

TILE = (16, 16)
"""Pixels down and across: so few that most lights are decided by the tile's box."""
ROUNDING = 1e-13
"""Far more than rounding changes a squared distance by, over the square of the largest numbers in it: a dozen
operations, each off by 2^-53 of that."""
LIGHTS = 4096
"""Whose products with a tile are formed at once: 8 MB."""


def pairs_in_reach(position: Float64, lights: LightSet) -> int:
    """The number of pairs with d < R, of pixels whose position is finite.

    Parameters
    ----------
    position : ndarray of float64, shape (..., 3)
        View space.
    lights : LightSet
        Point lights or spotlights, whose cones are not asked.
    """
    flat = position.reshape(-1, 3)
    known = np.asarray(np.isfinite(flat).all(axis=1))
    tiles = (tile[known[tile]] for tile in tiles_of(position.shape[:-1], TILE))
    return sum(_of_tile(flat[pixels], lights) for pixels in tiles if len(pixels))


def _of_tile(place: Float64, lights: LightSet) -> int:
    """Of one tile's positions, shape (n, 3)."""
    low, high = place.min(axis=0), place.max(axis=0)
    to_low, to_high = low - lights.positions, lights.positions - high
    nearest = lengths(np.maximum(np.maximum(to_low, to_high), 0.0))
    farthest = lengths(np.maximum(np.abs(to_low), np.abs(to_high)))
    whole = farthest * (1.0 + ROUNDING) < lights.reaches
    partly = np.flatnonzero(~whole & (nearest * (1.0 - ROUNDING) < lights.reaches))
    total = int(np.count_nonzero(whole)) * len(place)
    for first in range(0, len(partly), LIGHTS):
        total += _measured(place, lights, partly[first : first + LIGHTS])
    return total


def _measured(place: Float64, lights: LightSet, rows: NDArray[np.intp]) -> int:
    """Of positions (n, 3) and some rows of a set, by their squared distances."""
    middle = place.mean(axis=0)
    own, reaches = lights.positions[rows], lights.reaches[rows]
    largest = max(np.abs(place).max(), np.abs(own).max(), reaches.max())
    unsure = 16.0 * ROUNDING * largest**2
    near, light = place - middle, own - middle
    square = near @ (-2.0 * light.T)
    square += np.einsum("ij,ij->i", near, near)[:, None]
    square += np.einsum("ij,ij->i", light, light) - reaches**2
    total = int(np.count_nonzero(square < -unsure))
    pixels, columns = np.nonzero(np.abs(square, out=square) <= unsure)
    for column in np.unique(columns):
        chosen = place[pixels[columns == column]]
        total += int(np.count_nonzero(OneLight(lights, int(rows[column])).in_reach(chosen)))
    return total
