"""How far lights may reach: along the view axis, across it, and whether to any sample. Never too little."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.channels import largest_channel
from firefly_sample.plan.view import View

if TYPE_CHECKING:
    from firefly_sample.plan.lights.light_set import LightSet

Float64 = NDArray[np.float64]

ROUNDING = 2e-6
"""Of distances, by which everything is taken larger: what a shader's float32 may be off, with room."""
BETWEEN = 0.05
"""Samples: how far beside its line of sight a surface may be taken to be, by float32 and a rasterizer."""
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
    size = largest_channel(np.abs(lights.positions))
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
        self._near, self._far = near, far
        # one over the distances: a sum is largest in view where its sign says, and dividing is slow
        self._scales = (1.0 / near, 1.0 / far) if perspective else None
        self._x, self._y, self._z = (lights.positions[:, axis][light] for axis in range(3))
        self._reach = lights.safe_reaches[light]
        away = np.maximum(near - self._y, self._y - far)
        np.maximum(away, 0.0, out=away)
        squared = (self._reach - away) * (self._reach + away)
        self._radius = np.sqrt(np.maximum(squared, 0.0, out=squared), out=squared)
        self._cones = (lights.directions[light], lights.cones[light, 1]) if lights.kind == "spot" else None

    def bounds(self, x: float, z: float) -> tuple[Float64, Float64]:
        """The least and the largest value of ``x*X/Y + z*Z/Y``, orthographic ``x*X + z*Z``; not too tight."""
        across = self._across(x, z)
        radius = self._radius * math.hypot(x, z)
        least, most = across - radius, across + radius
        if self._cones is not None:
            least, most = np.maximum(least, -self._cone(-x, -z)), np.minimum(most, self._cone(x, z))
        if self._scales is None:
            return least, most
        near, far = self._scales
        return np.minimum(least * near, least * far), np.maximum(most * near, most * far)

    def _across(self, x: float, z: float) -> Float64:
        """The value of ``x*X + z*Z`` at the lights."""
        if x and z:
            return np.asarray(self._x * x + self._z * z)
        return np.asarray(self._x * x if x else self._z * z)

    def _cone(self, x: float, z: float) -> Float64:
        """The largest value of ``x*X + z*Z`` in a cone's part, by its slopes.

        A sum of half-spaces: for any s, x*X + z*Z = (x*X + s*Y + z*Z) - s*Y, whose first part is the whole
        cone's largest and whose second is known from the slice. The least of some such bounds is one, too.
        """
        assert self._cones is not None
        axes, openings = self._cones
        length, across = math.hypot(x, z), self._across(x, z)
        largest = np.full(len(across), np.inf)
        for slant in SLANTS:
            s = slant * length
            n = np.array([x, s, z])
            size = float(np.linalg.norm(n))
            whole = across + s * self._y + self._reach * size * _share(axes @ n / size, openings)
            np.minimum(largest, whole - s * (self._near if s >= 0.0 else self._far), out=largest)
        return largest


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


def meet_samples(lights: LightSet, view: View) -> NDArray[np.bool_]:
    """Which lights a line of sight through a sample's centre may meet, shape (n,).

    One that is far away, or tiny, may fall between all of them: then it lights nothing that is seen.
    """
    scales = pixel_scales(view)
    nearest = lights.positions[:, 1] - lights.safe_reaches if view.lens.perspective else 1.0
    # what is as wide as a sample holds a centre, if it is in view at all
    small = np.flatnonzero(lights.safe_reaches * max(scale for scale, _ in scales) < np.maximum(nearest, 0.0))
    met = np.ones(len(lights), dtype=bool)
    if len(small):
        positions, reach = lights.positions[small], lights.safe_reaches[small]
        for axis, (scale, center), size in zip((0, 2), scales, view.size, strict=True):
            low, high = _seen_at(positions[:, axis], positions[:, 1], reach, view.lens.perspective)
            first = np.ceil(center + scale * low - 0.5 - BETWEEN)
            last = np.floor(center + scale * high - 0.5 + BETWEEN)
            met[small] &= np.maximum(first, 0.0) <= np.minimum(last, size - 1.0)
    return met


def _seen_at(x: Float64, y: Float64, reach: Float64, perspective: bool) -> tuple[Float64, Float64]:
    """From which to which x/Y, orthographic x, balls are seen that lie before the eye: by their tangents."""
    if not perspective:
        return x - reach, x + reach
    half = reach * np.sqrt(x * x + (y - reach) * (y + reach))
    square = (y - reach) * (y + reach)
    return (x * y - half) / square, (x * y + half) / square
