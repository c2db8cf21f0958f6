"""How far lights may reach: along the view axis, and across it between two distances. Never too little."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.view import View

if TYPE_CHECKING:
    from firefly_sample.plan.light_set import LightSet

__all__ = ["ROUNDING", "Bodies", "pixel_scales", "safe_reaches", "screen_bounds", "spans_of"]

Float64 = NDArray[np.float64]

ROUNDING = 2e-6
"""Of distances, by which everything is taken larger: what a shader's float32 may be off, with room."""
SLANTS = (0.0, 0.3, -0.3, 1.0, -1.0, 3.0, -3.0)
"""How much of the view axis is mixed in where bounds of a cone's part of a slice are looked for."""


def spans_of(lights: LightSet) -> tuple[Float64, Float64]:
    """From where to where along the view axis each light may reach."""
    reach = lights.safe_reaches
    y = lights.positions[:, 1]
    if lights.kind != "spot":
        return y - reach, y + reach
    forward = np.array([0.0, 1.0, 0.0])
    high = y + reach * _share(lights.directions @ forward, lights.cones[:, 1])
    low = y - reach * _share(lights.directions @ -forward, lights.cones[:, 1])
    return low, high


def safe_reaches(lights: LightSet) -> Float64:
    """The reaches, a little longer, as what float32 may be off needs it; finite."""
    x, y, z = np.abs(lights.positions).T  # their largest: max along a short axis is slow
    size = np.maximum(np.maximum(x, y), z)
    return np.asarray(np.minimum(lights.reaches * (1.0 + ROUNDING) + ROUNDING * size, 1e150))


def _share(cosine: Float64, opening: Float64) -> Float64:
    """How far a spherical sector of radius 1 goes along a unit vector with this cosine to its axis.

    1 where the vector lies within the cone; else the rim's, the cosine of the angle to the cone's side; 0,
    the tip's, where even that is beyond a right angle. A little more than that, as angles are rounded.
    """
    within = 1.0 - np.clip(opening, 0.0, 2.0)
    sine = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))
    side = np.sqrt(np.maximum(1.0 - within * within, 0.0))
    rim = np.maximum(cosine * within + sine * side, 0.0)
    return np.asarray(np.where(cosine >= within - 1e-9, 1.0, np.minimum(rim + 1e-6, 1.0)))


class Bodies:
    """Parts of lights' balls, or cones, between two distances."""

    def __init__(self, lights: LightSet, light: NDArray[Any], near: Float64, far: Float64, perspective: bool):
        self._perspective = perspective
        self._near, self._far = near, far
        self._places = lights.positions[light]
        self._reach = lights.safe_reaches[light]
        y = self._places[:, 1]
        away = np.maximum(np.maximum(near - y, y - far), 0.0)
        self._radius = np.sqrt(np.maximum((self._reach - away) * (self._reach + away), 0.0))
        self._axes = lights.directions[light] if lights.kind == "spot" else None
        self._openings = lights.cones[light, 1]

    def bounds(self, x: float, z: float) -> tuple[Float64, Float64]:
        """The least and the largest value of ``x*X/Y + z*Z/Y``, orthographic ``x*X + z*Z``; not too tight."""
        most = self._slope(self._support(x, z))
        least = -self._slope(self._support(-x, -z))
        return np.clip(least, -1e9, 1e9), np.clip(most, -1e9, 1e9)

    def _slope(self, value: Float64) -> Float64:
        if not self._perspective:
            return value
        return value / np.where(value >= 0.0, self._near, self._far)

    def _support(self, x: float, z: float) -> Float64:
        """The largest value of ``x*X + z*Z``."""
        length = math.hypot(x, z)
        across = self._places[:, 0] * x + self._places[:, 2] * z
        largest = across + self._radius * length
        if self._axes is None:
            return np.asarray(largest)
        # A sum of half-spaces: for any s, x*X + z*Z = (x*X + s*Y + z*Z) - s*Y, whose first part is the whole
        # cone's largest and whose second is known from the slice. The least of some such bounds is one, too.
        for slant in SLANTS:
            s = slant * length
            n = np.array([x, s, z])
            size = float(np.linalg.norm(n))
            share = _share(self._axes @ n / size, self._openings)
            whole = across + s * self._places[:, 1] + self._reach * size * share
            largest = np.minimum(largest, whole - s * (self._near if s >= 0.0 else self._far))
        return np.asarray(largest)


def pixel_scales(view: View) -> tuple[tuple[float, float], tuple[float, float]]:
    """Samples a slope (orthographic: a unit), and the sample of 0, across and up."""
    lens, (width, height) = view.lens, view.size
    across = 0.5 * width * lens.a, 0.5 * width * (1.0 + lens.x_offset)
    return across, (0.5 * height * lens.c, 0.5 * height * (1.0 + lens.z_offset))


def screen_bounds(lights: LightSet, view: View) -> tuple[tuple[Float64, Float64], tuple[Float64, Float64]]:
    """From where to where each light may reach on the screen, in samples: across, and up."""
    low, high = lights.spans
    low = np.maximum(low, view.near)
    body = Bodies(lights, np.arange(len(lights)), low, np.maximum(high, low), view.lens.perspective)
    (across, x0), (up, z0) = pixel_scales(view)
    (left, right), (bottom, top) = body.bounds(across, 0.0), body.bounds(0.0, up)
    return (x0 + left, x0 + right), (z0 + bottom, z0 + top)
