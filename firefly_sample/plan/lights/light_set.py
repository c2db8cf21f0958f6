"""Lights as columns: many of one kind that are drawn in one call."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.light import Falloff

Float64 = NDArray[np.float64]

LightKind = Literal["directional", "point", "spot"]
Proxy = Literal["sphere", "cone", "fullscreen"]

MOST_LOOPED = 32768
"""Lights that one draw loops over: llvmpipe silently ends a shader's loops after 65,535 iterations."""
ROUNDING = 2e-6
"""Share of a distance that is added to every reach: more than the float32 rounding of a shader."""

PASS_OF_KIND: dict[LightKind, str] = {
    "directional": "directional_lights",
    "point": "point_lights",
    "spot": "spotlights",
}
"""The pass that draws a kind of light, in drawing order."""


@dataclass(frozen=True, eq=False)
class LightSet:
    """n lights that share kind, falloff and how they are drawn. Columns that a kind does not use are zeros.

    Attributes
    ----------
    kind : {"directional", "point", "spot"}
    falloff : Falloff
        Of point lights and spotlights.
    proxy : {"sphere", "cone", "fullscreen"}
        The mesh that is drawn to find the pixels: the light's volume, or the whole screen where the volume
        would hold the whole view, is infinite, or is too large for floats.
    shadowed : bool
        Whether these lights have shadow maps.
    colors, specular_colors : ndarray of float64, shape (n, 3)
        Linear: of diffuse light and of highlights.
    positions : ndarray of float64, shape (n, 3)
        View space.
    directions : ndarray of float64, shape (n, 3)
        Directions in which directional lights and spotlights shine, unit vectors, view space.
    reaches : ndarray of float64, shape (n,)
        Scene units: the light lights nothing beyond. Infinite if it is not limited.
    ends : ndarray of float64, shape (n,)
        Scene units: the radius of `Falloff.RAMP_SQUARED`, else the max distance where the window ends.
    attenuations : ndarray of float64, shape (n, 3)
        Constant, linear, quadratic.
    cones : ndarray of float64, shape (n, 3)
        Of spotlights: 1 - cos of the inner and of the outer half-angle, and the exponent.
    heights : ndarray of float64, shape (n,)
        Length of a drawn cone along its axis: the reach, or the distance of the view's farthest corner.
    casters : ndarray of int32, shape (n,)
        Index of the first of the light's shadow maps in `FramePlan.shadows`; -1 without shadows.
    maps : ndarray of int32, shape (n,)
        Number of the light's shadow maps: 0, 1 or 6.
    shadowed_by_particles : ndarray of bool, shape (n,)
        Whether particles shadow the light: at most one light of a frame, in a set of its own.
    """

    kind: LightKind
    falloff: Falloff
    proxy: Proxy
    shadowed: bool
    colors: Float64
    specular_colors: Float64
    positions: Float64
    directions: Float64
    reaches: Float64
    ends: Float64
    attenuations: Float64
    cones: Float64
    heights: Float64
    casters: NDArray[np.int32]
    maps: NDArray[np.int32]
    shadowed_by_particles: NDArray[np.bool_]

    @classmethod
    def make(cls, kind: LightKind, falloff: Falloff, colors: Float64, **columns: Any) -> LightSet:
        """Return a set with defaults for the columns that are not given: endless lights without shadows."""
        n = len(colors)
        defaults: dict[str, Any] = {
            "specular_colors": colors,
            "positions": np.zeros((n, 3)),
            "directions": np.zeros((n, 3)),
            "reaches": np.full(n, np.inf),
            "ends": np.full(n, np.inf),
            "attenuations": np.zeros((n, 3)),
            "cones": np.zeros((n, 3)),
            "heights": np.zeros(n),
            "casters": np.full(n, -1, dtype=np.int32),
            "maps": np.zeros(n, dtype=np.int32),
            "shadowed_by_particles": np.zeros(n, dtype=np.bool_),
        }
        return cls(kind, falloff, "fullscreen", False, colors, **(defaults | columns))

    @classmethod
    def joined(cls, sets: list[LightSet]) -> LightSet:
        """Return one set with the lights of several that share kind, falloff, proxy and shadows."""
        if len(sets) == 1:
            return sets[0]
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in sets]) for name in _COLUMNS
        }
        return replace(sets[0], **columns)

    @classmethod
    def walked_together(cls, sets: Iterable[LightSet]) -> list[LightSet]:
        """Return the sets that one draw can loop over: joined whatever their proxies, in pieces if large."""
        found: dict[tuple[object, ...], list[LightSet]] = {}
        for lights in sets:
            key = (lights.kind, lights.falloff, lights.shadowed, lights.particle_shadowed)
            found.setdefault(key, []).append(lights)
        return [part for same in found.values() for part in cls.joined(same).parts()]

    def take(self, chosen: NDArray[Any], **changes: Any) -> LightSet:
        """Return the lights at rising indices without repeats, with some fields changed."""
        if len(chosen) == len(self):
            return replace(self, **changes)
        columns = {name: getattr(self, name).take(chosen, axis=0) for name in _COLUMNS}
        return replace(self, **(columns | changes))

    def parts(self, most: int = MOST_LOOPED) -> list[LightSet]:
        """Return the set in pieces of up to `most` lights each."""
        if len(self) <= most:
            return [self]
        return [self.take(np.arange(len(self))[first : first + most]) for first in range(0, len(self), most)]

    @cached_property
    def safe_reaches(self) -> Float64:
        """The reaches, lengthened by more than float32 rounds; finite. For lights in view space."""
        size = largest_channel(np.abs(self.positions))
        return np.asarray(np.minimum(self.reaches * (1.0 + ROUNDING) + ROUNDING * size, 1e150))

    @cached_property
    def spans(self) -> tuple[Float64, Float64]:
        """The least and largest distance along the view axis that each light may reach, in view space."""
        reach, y = self.safe_reaches, self.positions[:, 1]
        if self.kind != "spot":
            return y - reach, y + reach
        forward = np.array([0.0, 1.0, 0.0])
        high = y + reach * sector_extent(self.directions @ forward, self.cones[:, 1])
        low = y - reach * sector_extent(self.directions @ -forward, self.cones[:, 1])
        return low, high

    @property
    def particle_shadowed(self) -> bool:
        """Whether particles shadow these lights."""
        return bool(self.shadowed_by_particles.any())

    def __len__(self) -> int:
        return len(self.colors)


_COLUMNS = tuple(
    field.name for field in fields(LightSet) if field.name not in ("kind", "falloff", "proxy", "shadowed")
)


def sector_extent(cosine: Float64, opening: Float64) -> Float64:
    """Return how far a spherical sector of radius 1 extends along a unit vector, never too little.

    The extent is 1 if the vector lies within the cone; else that of the rim, the cosine of the angle to the
    cone's side; 0, that of the tip, if this angle is beyond 90 degrees. A margin covers rounded angles.

    Parameters
    ----------
    cosine : ndarray
        Of the angle between the vector and the sector's axis.
    opening : ndarray
        1 - cos of the half-angle.
    """
    within = 1.0 - np.clip(opening, 0.0, 2.0)
    sine = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))
    side = np.sqrt(np.maximum(1.0 - within * within, 0.0))
    rim = np.maximum(cosine * within + sine * side, 0.0)
    return np.asarray(np.where(cosine >= within - 1e-9, 1.0, np.minimum(rim + 1e-6, 1.0)))


# by columns: NumPy is slow along an axis of three
def any_channel(colors: Float64) -> NDArray[np.bool_]:
    """Return which rows, shape (n, 3), have a channel that is not 0."""
    x, y, z = colors.T
    return np.asarray((x != 0.0) | (y != 0.0) | (z != 0.0))


def largest_channel(colors: Float64) -> Float64:
    """Return the largest number of each row, shape (n, 3)."""
    x, y, z = colors.T
    return np.asarray(np.maximum(np.maximum(x, y), z))
