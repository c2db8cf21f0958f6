"""Gather the lights of a scene as columns: many of one kind that are drawn in one call."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LightError
from firefly_sample.plan.collect import LightNode, Snapshot
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.light import FadingLight, Falloff, Light
from firefly_sample.scene.light import LightKind as LightKind
from firefly_sample.scene.lights import DirectionalLight, PointLights, Spotlight

Proxy = Literal["sphere", "cone", "fullscreen"]

FARTHEST = 1e30
"""Scene units: the largest coordinate of a light."""
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

    Positions and directions are in world space when gathered, in a plan in view space. Lengths are in scene
    units. The proxy is the mesh that is drawn to find the pixels: the light's volume, or the whole screen
    where the volume would hold the whole view, is infinite, or is too large for floats.
    """

    kind: LightKind
    falloff: Falloff  # of point lights and spotlights
    proxy: Proxy
    shadowed: bool  # True if these lights have shadow maps
    colors: Float64  # (n, 3), linear, of diffuse light
    specular_colors: Float64  # (n, 3), linear, of highlights
    positions: Float64  # (n, 3)
    directions: Float64  # (n, 3), in which directional lights and spotlights shine: unit vectors
    reaches: Float64  # (n,), beyond which the light lights nothing; may be infinite
    ends: Float64  # (n,), the radius of `Falloff.RAMP_SQUARED`, else the max distance where the window ends
    attenuations: Float64  # (n, 3): constant, linear, quadratic
    cones: Float64  # (n, 3), of spotlights: 1 - cos of the inner and outer half-angle, and the exponent
    heights: Float64  # (n,), of a drawn cone: the reach, or the distance of the view's farthest corner
    casters: NDArray[np.int32]  # (n,), the first shadow map's index, or a `LightSource`'s; -1 without shadows
    maps: NDArray[np.int32]  # (n,), number of the light's shadow maps: 0, 1 or 6
    shadowed_by_particles: NDArray[np.bool_]  # (n,), at most one light of a frame, in a set of its own

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
    def joined_for_loops(cls, sets: Iterable[LightSet]) -> list[LightSet]:
        """Return sets that one draw can loop over: joined whatever their proxies, in pieces if large."""
        found: dict[tuple[object, ...], list[LightSet]] = {}
        for lights in sets:
            key = (lights.kind, lights.falloff, lights.shadowed, lights.particle_shadowed)
            found.setdefault(key, []).append(lights)
        return [part for same in found.values() for part in cls.joined(same).parts()]

    def parts(self) -> list[LightSet]:
        """Return the set in pieces of up to `MOST_LOOPED` lights each."""
        if len(self) <= MOST_LOOPED:
            return [self]
        indices = np.arange(len(self))
        return [self.take(indices[first : first + MOST_LOOPED]) for first in indices[::MOST_LOOPED]]

    def take(self, chosen: NDArray[Any], **changes: Any) -> LightSet:
        """Return the lights at rising indices without repeats, with some fields changed."""
        if len(chosen) == len(self):
            return replace(self, **changes)
        columns = {name: getattr(self, name).take(chosen, axis=0) for name in _COLUMNS}
        return replace(self, **(columns | changes))

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
        """True if particles shadow these lights."""
        return bool(self.shadowed_by_particles.any())

    def __len__(self) -> int:
        return len(self.colors)


_COLUMNS = tuple(
    field.name for field in fields(LightSet) if field.name not in ("kind", "falloff", "proxy", "shadowed")
)


@dataclass(frozen=True)
class LightSource:
    """A light that casts shadows: its node, and its index in the node."""

    node: LightNode
    index: int


def gather_lights(
    snapshot: Snapshot, time: float, particle_light: Light | None = None
) -> tuple[list[LightSet], list[LightSource]]:
    """Return all lights at `time` in world space, a set for each kind and falloff; no reach is limited yet.

    Particles shadow `particle_light`. The second list has each light that casts shadows: the sets' `casters`
    are indices into it. A `LightError` names a light whose position or direction is not finite.
    """
    many: dict[tuple[LightKind, Falloff], list[LightSet]] = {}
    singles: dict[tuple[LightKind, Falloff], list[tuple[Light, Float64, int]]] = {}
    sources: list[LightSource] = []
    for node, net in snapshot.lights:
        falloff = Falloff.ATTENUATION if isinstance(node, DirectionalLight) else node.falloff
        if isinstance(node, PointLights):
            many.setdefault(("point", falloff), []).append(_point_lights(node, net, time, sources))
            continue
        caster = len(sources) if node.is_shadow_caster() else -1
        if node.is_shadow_caster():
            sources.append(LightSource(node, 0))
        singles.setdefault((node.kind, falloff), []).append((node, net, caster))
    sets = []
    for key in [(kind, falloff) for kind in PASS_OF_KIND for falloff in Falloff]:
        parts = many.get(key, [])
        if key in singles:
            parts.append(_single_lights(*key, singles[key], particle_light))
        if parts:
            sets.append(LightSet.joined(parts))
    return sets, sources


def _point_lights(node: PointLights, net: Float64, time: float, sources: list[LightSource]) -> LightSet:
    arrays = node.evaluate(time)
    casters = np.full(len(arrays), -1, dtype=np.int32)
    if node.is_shadow_caster():
        casters[:] = np.arange(len(sources), len(sources) + len(arrays))
        sources.extend(LightSource(node, index) for index in range(len(arrays)))
    return LightSet.make(
        "point",
        node.falloff,
        arrays.colors,
        specular_colors=node.specular_colors_of(arrays),
        positions=_checked_positions(node.name, arrays.positions @ net[:3, :3] + net[3, :3]),
        ends=arrays.radii,
        attenuations=np.tile(node.get_attenuation() or (0.0, 0.0, 0.0), (len(arrays), 1)),
        casters=casters,
    )


def _single_lights(
    kind: LightKind,
    falloff: Falloff,
    lights: list[tuple[Light, Float64, int]],
    particle_light: Light | None,
) -> LightSet:
    """Return a set of nodes of one light each."""
    nodes = [node for node, _, _ in lights]
    columns: dict[str, Any] = {"specular_colors": [node.get_specular_color() for node in nodes]}
    fading = [node for node in nodes if isinstance(node, FadingLight)]
    if fading:
        columns["positions"] = [_checked_positions(node.name, net[3, :3]) for node, net, _ in lights]
        columns["ends"] = [node.get_max_distance() for node in fading]
        columns["attenuations"] = [node.get_attenuation() or (0.0, 0.0, 0.0) for node in fading]
    if kind == "spot":
        cones = [node.get_cone() for node in nodes if isinstance(node, Spotlight)]
        columns["cones"] = [(one_minus_cos(c.inner), one_minus_cos(c.outer), c.exponent) for c in cones]
    if kind != "point":
        columns["directions"] = [light_direction(node, net) for node, net, _ in lights]
    return LightSet.make(
        kind,
        falloff,
        np.array([node.get_color() for node in nodes]),
        casters=np.array([caster for _, _, caster in lights], dtype=np.int32),
        shadowed_by_particles=np.array([node is particle_light for node in nodes]),
        **{name: np.array(column, dtype=np.float64) for name, column in columns.items()},
    )


def _checked_positions(name: str, positions: Float64) -> Float64:
    if not np.isfinite(positions).all() or np.abs(positions).max(initial=0.0) > FARTHEST:
        raise LightError(
            f"light {name!r}: its position in the world must be finite and at most {FARTHEST:g} units along "
            "each axis: give it and its parents positions and scales nearer to 1"
        )
    return positions


def light_direction(light: Light, net: Float64) -> Float64:
    """Return the direction in which a light shines, a unit vector in world space."""
    # a light that is not directional shines along its node's +Y axis
    direction = light.get_direction() @ net[:3, :3] if isinstance(light, DirectionalLight) else net[1, :3]
    length = np.linalg.norm(direction)
    if not (np.isfinite(length) and length > 0.0):
        raise LightError(f"light {light.name!r}: its net transform leaves it no direction to shine in")
    return np.asarray(direction / length)


def one_minus_cos(degrees: float) -> float:
    """Return 1 - cos of an angle, accurate to the last digit for small angles too."""
    return float(2.0 * np.sin(np.radians(degrees) / 2.0) ** 2)


def sector_extent(cosine: Float64, opening: Float64) -> Float64:
    """Return how far a spherical sector of radius 1 extends along a unit vector, never too little.

    `cosine` is of the angle between the vector and the sector's axis, `opening` is 1 - cos of the half-angle.
    The extent is 1 if the vector lies within the cone; else that of the rim, the cosine of the angle to the
    cone's side; 0, that of the tip, if this angle is beyond 90 degrees. A margin covers rounded angles.
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
