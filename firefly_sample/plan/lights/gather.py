"""Gather the lights of a scene as sets in world space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LightError
from firefly_sample.plan.collect import LightNode, Snapshot
from firefly_sample.plan.lights.light_set import PASS_OF_KIND, LightKind, LightSet
from firefly_sample.scene.light import FadingLight, Falloff, Light
from firefly_sample.scene.lights import DirectionalLight, PointLights, Spotlight

Float64 = NDArray[np.float64]

FARTHEST = 1e30
"""Scene units: the largest coordinate of a light."""


@dataclass(frozen=True)
class LightSource:
    """A light that casts shadows: its node, and its index in the node."""

    node: LightNode
    index: int


def gather_lights(
    snapshot: Snapshot, time: float, particle_light: Light | None = None
) -> tuple[list[LightSet], list[LightSource]]:
    """Return all lights at `time` in world space, a set for each kind and falloff; no reach is limited yet.

    Parameters
    ----------
    particle_light : Light, optional
        The light that particles shadow.

    Returns
    -------
    list of LightSet
        Their `casters` are indices into the second list, -1 for lights without shadows.
    list of LightSource

    Raises
    ------
    LightError
        If a light's position or direction is not finite.
    """
    many: dict[tuple[LightKind, Falloff], list[LightSet]] = {}
    singles: dict[tuple[LightKind, Falloff], list[tuple[Light, Float64, int]]] = {}
    sources: list[LightSource] = []
    for node, net in snapshot.lights:
        falloff = Falloff.ATTENUATION if isinstance(node, DirectionalLight) else node.falloff
        key = (kind_of(node), falloff)
        if isinstance(node, PointLights):
            many.setdefault(key, []).append(_point_lights(node, net, time, sources))
        else:
            caster = len(sources) if node.is_shadow_caster() else -1
            if node.is_shadow_caster():
                sources.append(LightSource(node, 0))
            singles.setdefault(key, []).append((node, net, caster))
    sets = []
    for key in [(kind, falloff) for kind in PASS_OF_KIND for falloff in Falloff]:
        parts = many.get(key, [])
        if key in singles:
            parts.append(_single_lights(*key, singles[key], particle_light))
        if parts:
            sets.append(LightSet.joined(parts))
    return sets, sources


def kind_of(light: LightNode) -> LightKind:
    """Return the kind of a light's node."""
    if isinstance(light, DirectionalLight):
        return "directional"
    return "spot" if isinstance(light, Spotlight) else "point"


def light_direction(light: Light, net: Float64) -> Float64:
    """Return the direction in which a light shines, a unit vector in world space.

    Raises
    ------
    LightError
        If the net transform leaves no direction.
    """
    # a light that is not directional shines along its node's +Y axis
    direction = light.get_direction() @ net[:3, :3] if isinstance(light, DirectionalLight) else net[1, :3]
    length = np.linalg.norm(direction)
    if not (np.isfinite(length) and length > 0.0):
        raise LightError(f"light {light.name!r}: its net transform leaves it no direction to shine in")
    return np.asarray(direction / length)


def one_minus_cos(degrees: float) -> float:
    """Return 1 - cos of an angle, accurate to the last digit for small angles too."""
    return float(2.0 * np.sin(np.radians(degrees) / 2.0) ** 2)


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
    rows = [_columns_of(node, net) for node, net, _ in lights]
    columns = {name: np.array([row[name] for row in rows], dtype=np.float64) for name in rows[0]}
    return LightSet.make(
        kind,
        falloff,
        columns.pop("colors"),
        casters=np.array([caster for _, _, caster in lights], dtype=np.int32),
        shadowed_by_particles=np.array([node is particle_light for node, _, _ in lights]),
        **columns,
    )


def _columns_of(node: Light, net: Float64) -> dict[str, object]:
    columns: dict[str, object] = {
        "colors": node.get_color(),
        "specular_colors": node.get_specular_color(),
    }
    if isinstance(node, FadingLight):
        columns["positions"] = _checked_positions(node.name, net[3, :3])
        columns["ends"] = node.get_max_distance()
        columns["attenuations"] = node.get_attenuation() or (0.0, 0.0, 0.0)
    if isinstance(node, Spotlight):
        inner, outer, exponent = node.get_cone()
        columns["cones"] = (one_minus_cos(inner), one_minus_cos(outer), exponent)
    if isinstance(node, Spotlight | DirectionalLight):
        columns["directions"] = light_direction(node, net)
    return columns


def _checked_positions(name: str, positions: Float64) -> Float64:
    if not np.isfinite(positions).all() or np.abs(positions).max(initial=0.0) > FARTHEST:
        raise LightError(
            f"light {name!r}: its position in the world must be finite and at most {FARTHEST:g} units along "
            "each axis: give it and its parents positions and scales nearer to 1"
        )
    return positions
