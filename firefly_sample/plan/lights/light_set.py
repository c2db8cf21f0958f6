"""Lights as columns: many of one kind that are drawn in one call."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.lights.bounds import safe_reaches, spans_of
from firefly_sample.scene.falloff import Falloff

Float64 = NDArray[np.float64]

LightKind = Literal["directional", "point", "spot"]
Proxy = Literal["sphere", "cone", "fullscreen"]

MOST_LOOPED = 32768
"""Lights that one draw walks: llvmpipe ends a shader's loops after 65,535 turns, and says nothing."""

PASS_OF_KIND: dict[LightKind, str] = {
    "directional": "directional_lights",
    "point": "point_lights",
    "spot": "spotlights",
}
"""The pass that draws a kind of light, in drawing order."""


@dataclass(frozen=True, eq=False)
class LightSet:
    """n lights that share how they shine, fade and are drawn. Columns that a kind does not have are zeros.

    Attributes
    ----------
    kind : {"directional", "point", "spot"}
    falloff : Falloff
        Of point lights and spotlights.
    proxy : {"sphere", "cone", "fullscreen"}
        What is drawn to find the pixels: the light's volume, or the whole screen where the volume would hold
        the whole view, has no end, or is too large for floats.
    shadowed : bool
        Whether these lights have shadow maps.
    colors, specular_colors : ndarray of float64, shape (n, 3)
        Linear: of diffuse light and of highlights.
    positions : ndarray of float64, shape (n, 3)
        View space.
    directions : ndarray of float64, shape (n, 3)
        Where directional lights and spotlights shine, unit vectors, view space.
    reaches : ndarray of float64, shape (n,)
        Scene units: nothing is lit from there on. Infinite where a light is cut off nowhere.
    ends : ndarray of float64, shape (n,)
        Scene units: the radius of `Falloff.RAMP_SQUARED`, else the max distance where the window ends.
    attenuations : ndarray of float64, shape (n, 3)
        Constant, linear, quadratic.
    cones : ndarray of float64, shape (n, 3)
        Of spotlights: 1 - cos of the inner and of the outer half-angle, and the exponent.
    heights : ndarray of float64, shape (n,)
        How far a cone that is drawn goes along its axis: the reach, or the farthest corner of the view.
    casters : ndarray of int32, shape (n,)
        Index of the first of the light's shadow maps in `FramePlan.shadows`; -1 without shadows.
    maps : ndarray of int32, shape (n,)
        How many shadow maps it has: 0, 1 or 6.
    dimmed : ndarray of bool, shape (n,)
        Whether particles take some of it: one light of a frame at most, in a set of its own.
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
    dimmed: NDArray[np.bool_]

    @classmethod
    def make(cls, kind: LightKind, falloff: Falloff, colors: Float64, **columns: Any) -> LightSet:
        """A set with zeros for the columns that are not given, -1 for `casters`; nothing drawn yet."""
        n = len(colors)
        empty: dict[str, Any] = {
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
            "dimmed": np.zeros(n, dtype=np.bool_),
        }
        return cls(kind, falloff, "fullscreen", False, colors, **(empty | columns))

    @classmethod
    def joined(cls, sets: list[LightSet]) -> LightSet:
        """One set with the lights of several that share kind, falloff, proxy and shadows."""
        first = sets[0]
        if len(sets) == 1:
            return first
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in sets]) for name in _COLUMNS
        }
        return replace(first, **columns)

    @classmethod
    def walked_together(cls, sets: Iterable[LightSet]) -> list[LightSet]:
        """Sets that differ in their proxies alone joined, very large ones in pieces: what one draw walks."""
        found: dict[tuple[object, ...], list[LightSet]] = {}
        for lights in sets:
            key = (lights.kind, lights.falloff, lights.shadowed, lights.clouded)
            found.setdefault(key, []).append(lights)
        return [part for same in found.values() for part in cls.joined(same).parts()]

    def take(self, chosen: NDArray[Any], **changes: Any) -> LightSet:
        """The lights that rising indices choose, each once at most, with some fields changed."""
        if len(chosen) == len(self):
            return replace(self, **changes)
        columns = {name: getattr(self, name).take(chosen, axis=0) for name in _COLUMNS}
        return replace(self, **(columns | changes))

    def parts(self, most: int = MOST_LOOPED) -> list[LightSet]:
        """The set in pieces of up to `most` lights each."""
        if len(self) <= most:
            return [self]
        return [self.take(np.arange(len(self))[first : first + most]) for first in range(0, len(self), most)]

    @cached_property
    def safe_reaches(self) -> Float64:
        """The reaches, a little longer, so that nothing is missed; of lights in view space, finite."""
        return safe_reaches(self)

    @cached_property
    def spans(self) -> tuple[Float64, Float64]:
        """From where to where along the view axis each light may reach; of lights in view space."""
        return spans_of(self)

    @property
    def clouded(self) -> bool:
        """Whether particles take some of its light."""
        return bool(self.dimmed.any())

    def __len__(self) -> int:
        return len(self.colors)


_COLUMNS = tuple(
    field.name for field in fields(LightSet) if field.name not in ("kind", "falloff", "proxy", "shadowed")
)
