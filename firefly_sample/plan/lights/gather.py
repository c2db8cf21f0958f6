"""From the lights' nodes to the sets that a frame draws: where they end, which are in view, by what proxy."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LightError
from firefly_sample.plan.channels import any_channel, largest_channel
from firefly_sample.plan.collect import LightNode, Snapshot
from firefly_sample.plan.frustum import (
    FULLSCREEN_RADIUS,
    farthest_corner,
    sectors_in_frustum,
    spheres_in_frustum,
)
from firefly_sample.plan.lights.light_set import PASS_OF_KIND, LightKind, LightSet, Proxy
from firefly_sample.plan.lights.reach import budget_thresholds, light_reach
from firefly_sample.scene.falloff import Falloff
from firefly_sample.scene.light import FadingLight, Light
from firefly_sample.scene.lights import DirectionalLight, PointLights
from firefly_sample.scene.spotlight import Spotlight
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

WIDEST_CONE = 53.0
"""Degrees: above this half-angle a sphere is the smaller proxy for what a spotlight can reach."""


@dataclass(frozen=True)
class LightSource:
    """A light that casts shadows: the node, and which of its lights."""

    node: LightNode
    index: int


def world_lights(
    snapshot: Snapshot, time: float, dimmed: Light | None = None
) -> tuple[list[LightSet], list[LightSource]]:
    """All lights at `time` in world space, a set for each way to shine and fade; none has a reach yet.

    Parameters
    ----------
    dimmed : Light, optional
        The one that particles take some of.

    Returns
    -------
    list of LightSet
        Their `casters` are indices into the second list, -1 for lights without shadows.
    list of LightSource
    """
    found: dict[tuple[LightKind, Falloff], list[LightSet]] = {}
    singles: dict[tuple[LightKind, Falloff], list[tuple[Light, Float64, int]]] = {}
    sources: list[LightSource] = []
    for node, net in snapshot.lights:
        if isinstance(node, PointLights):
            many = _point_lights(node, net, time, sources)
            found.setdefault((many.kind, many.falloff), []).append(many)
            continue
        caster = -1
        if node.is_shadow_caster():
            caster = len(sources)
            sources.append(LightSource(node, 0))
        kind: LightKind = "point"
        falloff = Falloff.ATTENUATION
        if isinstance(node, DirectionalLight):
            kind = "directional"
        elif isinstance(node, FadingLight):
            kind, falloff = "spot" if isinstance(node, Spotlight) else "point", node.falloff
        singles.setdefault((kind, falloff), []).append((node, net, caster))
    for (kind, falloff), rows in singles.items():
        found.setdefault((kind, falloff), []).append(_single_lights(kind, falloff, rows, dimmed))
    order = [(kind, falloff) for kind in PASS_OF_KIND for falloff in Falloff]
    return [LightSet.joined(found[key]) for key in order if key in found], sources


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
        positions=_places(node.name, arrays.positions @ net[:3, :3] + net[3, :3]),
        ends=arrays.radii,
        attenuations=np.tile(node.get_attenuation() or (0.0, 0.0, 0.0), (len(arrays), 1)),
        casters=casters,
    )


def _single_lights(
    kind: LightKind, falloff: Falloff, rows: list[tuple[Light, Float64, int]], dimmed: Light | None
) -> LightSet:
    """Nodes of one light each, in one set."""
    columns: dict[str, list[object]] = {}

    def add(name: str, value: object) -> None:
        columns.setdefault(name, []).append(value)

    for node, net, caster in rows:
        add("colors", node.get_color())
        add("specular_colors", node.get_specular_color())
        add("casters", caster)
        add("dimmed", node is dimmed)
        if isinstance(node, FadingLight):
            add("positions", net[3, :3])
            add("ends", node.get_max_distance())
            add("attenuations", node.get_attenuation() or (0.0, 0.0, 0.0))
        if isinstance(node, Spotlight):
            add("directions", _unit(node, net[1, :3]))
            inner, outer, exponent = node.get_cone()
            add("cones", (_one_minus_cos(inner), _one_minus_cos(outer), exponent))
        if isinstance(node, DirectionalLight):
            add("directions", _unit(node, node.get_direction() @ net[:3, :3]))
    arrays = {name: np.array(values, dtype=np.float64) for name, values in columns.items()}
    typed = {"casters": arrays["casters"].astype(np.int32), "dimmed": arrays["dimmed"].astype(np.bool_)}
    if "positions" in arrays:
        for (node, _, _), place in zip(rows, arrays["positions"], strict=True):
            _places(node.name, place)
    colors = arrays.pop("colors")
    return LightSet.make(kind, falloff, colors, **(arrays | typed))


def _one_minus_cos(degrees: float) -> float:
    """1 - cos, to the last digit for small angles too."""
    return float(2.0 * np.sin(np.radians(degrees) / 2.0) ** 2)


def _unit(node: Light, direction: Float64) -> Float64:
    length = np.linalg.norm(direction)
    if not (np.isfinite(length) and length > 0.0):
        raise LightError(f"light {node.name!r}: its net transform leaves it no direction to shine in")
    return np.asarray(direction / length)


def _places(name: str, positions: Float64) -> Float64:
    if not np.isfinite(positions).all() or np.abs(positions).max(initial=0.0) > 1e30:
        raise LightError(f"light {name!r}: its place in the world is not finite, or beyond 1e30")
    return positions


def cut_off(
    sets: Iterable[LightSet], settings: Settings, exposure: Iterable[float], highlights: bool
) -> list[LightSet]:
    """The sets with their reaches: the end of each light, or where it no longer matters if that is nearer.

    With a threshold, a light stops where what a white surface that faces it reflects has fallen to the
    threshold, and so have its highlights if the scene has shiny materials (`highlights`). With a budget, all
    lights together drop no more than the budget at any pixel, light and highlights together, counted in
    exposed radiance, so that 1.5e-4 is half a code of the display's 255 in the dark; the share of each
    light is `firefly_sample.plan.lights.reach.budget_thresholds`'s.
    """
    sets = list(sets)
    fading = [
        lights for lights in sets if lights.kind != "directional" and lights.falloff is Falloff.ATTENUATION
    ]
    colors = [(lights.colors, lights.specular_colors * highlights) for lights in fading]
    thresholds: list[Float64 | float]
    if settings.cutoff_threshold is not None:
        thresholds = [settings.cutoff_threshold] * len(fading)
        intensities = [largest_channel(np.maximum(rgb, specular)) for rgb, specular in colors]
    else:
        factor = np.array(tuple(exposure))
        intensities = [largest_channel((rgb + specular) * factor) for rgb, specular in colors]
        # one that never fades is never cut off: it takes no share
        counted = [
            i * lights.attenuations[:, 1:].any(axis=1) for i, lights in zip(intensities, fading, strict=True)
        ]
        shares = budget_thresholds(np.concatenate([*counted, np.zeros(0)]), settings.cutoff_budget)
        thresholds = list(np.split(shares, np.cumsum([len(i) for i in intensities])[:-1])) if fading else []
    reaches = {
        id(lights): np.minimum(light_reach(lights.attenuations, i, t), lights.ends)
        for lights, i, t in zip(fading, intensities, thresholds, strict=True)
    }
    return [replace(lights, reaches=reaches.get(id(lights), lights.ends)) for lights in sets]


def in_view(lights: LightSet, world_to_view: Float64, planes: Float64) -> LightSet:
    """Those of a set that can change what is seen, in view space."""
    positions = lights.positions @ world_to_view[:3, :3] + world_to_view[3, :3]
    directions = lights.directions @ world_to_view[:3, :3]
    shines = any_channel(lights.colors) | any_channel(lights.specular_colors)
    useful = shines & (lights.reaches > 0.0)
    if lights.kind == "point":
        useful &= spheres_in_frustum(planes, positions, lights.reaches)
    elif lights.kind == "spot":
        useful &= sectors_in_frustum(planes, positions, directions, lights.reaches, lights.cones[:, 1])
    chosen = np.flatnonzero(useful)
    return replace(lights, positions=positions, directions=directions).take(chosen)


def choose_proxies(lights: LightSet, corners: Float64) -> list[LightSet]:
    """A set by proxy, shadow maps, and whether particles dim it; `corners` are those of the view."""
    # of a point anywhere, the farthest corner is at least half as far as two corners are apart
    farthest = np.full(len(lights), np.inf)
    large = lights.reaches >= 0.5 * np.linalg.norm(corners[0] - corners[-1])
    farthest[large] = farthest_corner(corners, lights.positions[large])
    heights = np.minimum(lights.reaches, farthest)
    endless = heights >= FULLSCREEN_RADIUS
    fullscreen = endless | (lights.reaches >= farthest) | (lights.kind == "directional")
    cone = np.zeros(len(lights), dtype=bool)
    if lights.kind == "spot":
        cone = (lights.cones[:, 1] <= _one_minus_cos(WIDEST_CONE)) & ~endless
    lights = replace(lights, heights=heights)
    # a number for each way to be drawn, in drawing order
    drawn = 4 * np.where(cone, 1, 2 * fullscreen) + 2 * (lights.casters >= 0) + lights.dimmed
    proxies: tuple[Proxy, ...] = ("sphere", "cone", "fullscreen")
    return [
        lights.take(np.flatnonzero(drawn == way), proxy=proxies[way // 4], shadowed=bool(way & 2))
        for way in np.flatnonzero(np.bincount(drawn))
    ]
