"""The way through the centre of each pixel, in view space and float64."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rays:
    """The way through n pixels: a place on it is origin + y * direction, y the distance along the view axis.

    Attributes
    ----------
    origin, direction : ndarray of float64, shape (n, 3)
        View space; the direction's Y is 1, the origin's 0.
    perspective : bool
        Whether neighbours have other directions; under an orthographic lens they have other origins.
    pixel : (float, float)
        How far apart neighbours are, to the right and down, at distance 1.
    """

    origin: Float64
    direction: Float64
    perspective: bool
    pixel: tuple[float, float]

    def take(self, chosen: NDArray[Any]) -> Rays:
        """Those of the chosen pixels."""
        return Rays(self.origin[chosen], self.direction[chosen], self.perspective, self.pixel)

    def to_eye(self) -> Float64:
        """Unit vectors back to the eye, shape (n, 3)."""
        return np.asarray(-self.direction / np.linalg.norm(self.direction, axis=1, keepdims=True))

    def __len__(self) -> int:
        return len(self.direction)


def pixel_rays(view: View) -> Rays:
    """All pixels of a view, row by row, the first row on top."""
    width, height = view.size
    ndc_x = (np.arange(width) + 0.5) / (width / 2) - 1.0
    ndc_y = 1.0 - (np.arange(height) + 0.5) / (height / 2)
    lens = view.lens
    distance = 1.0 if lens.perspective else 0.0
    place = lens.view_from_distance(ndc_x[None], ndc_y[:, None], distance).reshape(-1, 3)
    pixel = 2.0 / (width * lens.a), -2.0 / (height * lens.c)
    if lens.perspective:
        return Rays(np.zeros_like(place), place, True, pixel)
    return Rays(place, np.tile([0.0, 1.0, 0.0], (len(place), 1)), False, pixel)
