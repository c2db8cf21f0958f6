"""The settings that a trade compares: each choice alone, some together, and only what a frame can show."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields
from typing import Any, Literal

from firefly_sample.errors import SettingsError
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.scene.falloff import Falloff
from firefly_sample.settings import CHOICES, NOT_FORWARD, PRESETS, Settings

Group = Literal["default", "alone", "baseline", "preset", "combination", "look"]

FORMATS = ("position", "normals", "albedo", "interpolation", "accumulation")
BUDGETS = (1e-6, 1.5e-4, 1.5e-3)
THRESHOLDS = (1e-3, 1e-2, 5.0 / 256.0)
RESOLUTIONS = (256, 512, 1024, 2048, 4096)
SLICES, TILES, DEPTHS = (16, 32, 64, 128, 256), (32, 64, 128, 256), (64, None)
LOOKS = (
    "look",
    "range_falloff",
    "specular_model",
    "clamp_light",
    "exposure",
    "tone",
    "supersample",
    "shadow_atlas",
)
"""Settings that a preset or a combination leaves as the base has them."""

COMBINATIONS: dict[str, dict[str, Any]] = {
    "thin buffer": {
        "position": "depth24",
        "normals": "oct8",
        "albedo": "sqrt8",
        "accumulation": "r11g11b10f",
    },
    "half floats": {
        "position": "stored16f",
        "normals": "rgba16f",
        "albedo": "rgba16f",
        "accumulation": "rgba16f",
    },
    "as the slides": {
        "position": "stored32f",
        "normals": "rgba32f",
        "albedo": "rgba8",
        "cutoff_threshold": 5.0 / 256.0,
        "light_method": "volumes",
        "volume_depth_test": False,
    },
    "as the assignment": {
        "position": "inverse_matrix",
        "normals": "rgba16f",
        "albedo": "rgba8",
        "light_method": "loop",
    },
    "as the original": {
        "position": "depth24",
        "normals": "rgba8",
        "albedo": "rgba8",
        "accumulation": "rgba8",
        "light_method": "volumes",
        "volume_depth_test": False,
    },
    "half, else accurate": {"light_resolution": "half", "normals": "rgba32f", "albedo": "rgba32f"},
    "half, thin buffer": {
        "light_resolution": "half",
        "position": "depth24",
        "normals": "oct8",
        "albedo": "sqrt8",
        "accumulation": "r11g11b10f",
    },
    "cube, depth24": {"volume_proxy": "cube", "position": "depth24"},
    "icosphere0, depth32f": {"volume_proxy": "icosphere0", "position": "depth32f"},
    "rgba32f normals, rgba16f albedo": {"normals": "rgba32f", "albedo": "rgba16f"},
}
"""Choices that meet in practice: those of the documents that the sample follows, thin ones, and fine ones."""


EIGHT_BITS = {"particle_shadows": "blend", "particle_shadow_format": "unorm8"}
NEAREST_TEN = {"particle_shadows": "loop", "particle_shadow_reads": 10}
"""Shadows of particles as the document that they follow has them."""


@dataclass(frozen=True)
class Variation:
    """Settings that differ from the base.

    Attributes
    ----------
    name : str
    group : {"default", "alone", "baseline", "preset", "combination", "look"}
        "look" is of what changes the picture and not its accuracy: another model of highlights.
    changes : dict
        Setting to value.
    """

    name: str
    group: Group
    changes: dict[str, Any]


def single_choices(plan: FramePlan) -> list[Variation]:
    """Each choice of accuracy alone, as far as it can change this frame or what it costs."""
    base, found = plan.settings, []
    for name, value in _choices(plan):
        changes = {name: value}
        if name == "cutoff_budget" and base.cutoff_threshold is not None:
            changes["cutoff_threshold"] = None  # which would win
        with suppress(SettingsError):  # a choice may contradict the base's
            if base.with_changes(**changes) != base:
                found.append(Variation(f"{name}={_shown(value)}", "alone", changes))
    return found


def _from_default(changes: Mapping[str, Any], base: Settings) -> dict[str, Any]:
    """What makes the base the default with some changes, but for how the picture looks."""
    target = Settings().with_changes(**changes)
    return {
        field.name: getattr(target, field.name)
        for field in fields(Settings)
        if field.name not in LOOKS and getattr(target, field.name) != getattr(base, field.name)
    }


def variations(plan: FramePlan, base: Settings) -> list[Variation]:
    """All that a trade compares, the default first; each combination of settings once.

    Parameters
    ----------
    plan : FramePlan
        Of the base, for the output "color".
    base : Settings
    """
    found = [Variation("default", "default", {}), *single_choices(plan)]
    if any(step.name == "geometry" for step in plan.passes) and plan.lights:
        own = {name: value for name, value in NOT_FORWARD.items() if getattr(base, name) != value}
        found += [Variation("forward shading", "baseline", {"light_method": "forward", **own})]
        found += [
            Variation(f"light_method={name}", "baseline", {"light_method": name})
            for name in ("volumes", "clustered", "loop", "fullscreen")
            if name != plan.culling.method
        ]
        if any(lights.proxy == "sphere" for lights in plan.lights):
            untested = {"light_method": "volumes", "volume_depth_test": False}
            found.append(Variation("volumes without depth test", "baseline", untested))
    if _clouded(plan):
        found.append(Variation("blend, 8 bits", "baseline", EIGHT_BITS))
        found.append(Variation("loop, nearest ten", "baseline", NEAREST_TEN))
    for name, changes in PRESETS.items():
        found.append(Variation(f"preset {name}", "preset", _from_default(changes, base)))
    for name, changes in COMBINATIONS.items():
        found.append(Variation(name, "combination", _from_default(changes, base)))
    if plan.target("specular") is not None:
        other = "phong" if base.specular_model == "blinn_phong" else "blinn_phong"
        found.append(Variation(f"specular_model={other}", "look", {"specular_model": other}))
    if _attenuated(plan, ending=True):
        other = "karis" if base.range_falloff == "gltf" else "gltf"
        found.append(Variation(f"range_falloff={other}", "look", {"range_falloff": other}))
    unique: dict[Settings, Variation] = {}
    for variation in found:
        with suppress(SettingsError):  # a combination may contradict the base
            unique.setdefault(base.with_changes(**variation.changes), variation)
    return list(unique.values())


def signature(plan: FramePlan) -> tuple[Any, ...]:
    """What tells frames of one scene apart: those that have the same are drawn in the same way."""
    return (
        tuple((target.name, target.format, plan.target_size(target.name)) for target in plan.targets),
        tuple((step.name, step.variant, step.updates) for step in plan.passes),
        tuple((lights.kind, lights.proxy, lights.reaches.tobytes()) for lights in plan.lights),
        plan.shadows.layout,
        plan.settings.volume_proxy if _proxied(plan) else None,
        _particle_shadow_signature(plan),
        plan.particles.order.tobytes(),
    )


def _particle_shadow_signature(plan: FramePlan) -> tuple[Any, ...]:
    particle_shadow = plan.particle_shadow
    if particle_shadow is None:
        return ()
    return (
        particle_shadow.method,
        particle_shadow.reads,
        particle_shadow.interpolate,
        particle_shadow.view.slices,
        particle_shadow.view.tile,
    )


def _choices(plan: FramePlan) -> Iterator[tuple[str, Any]]:
    deferred = bool(plan.lights) and plan.settings.light_method != "forward"
    placed = any(lights.kind != "directional" or lights.shadowed for lights in plan.lights)
    there = {
        "interpolation": deferred,
        "position": placed and deferred,
        "normals": deferred,
        "albedo": plan.target("albedo") is not None,
        "accumulation": plan.target("radiance") is not None,
    }
    for name in FORMATS:
        if there[name]:
            yield from ((name, value) for value in CHOICES[name])
    if _attenuated(plan):
        yield from (("cutoff_budget", value) for value in BUDGETS)
        yield from (("cutoff_threshold", value) for value in THRESHOLDS)
    if _proxied(plan):
        yield from (("volume_proxy", value) for value in CHOICES["volume_proxy"])
    if deferred:
        yield from (("light_resolution", value) for value in CHOICES["light_resolution"])
    if plan.shadows.maps:
        yield from (("shadow_taps", value) for value in CHOICES["shadow_taps"])
        yield from (("shadow_resolution", value) for value in RESOLUTIONS)
    if _clouded(plan):
        yield from (("particle_shadows", value) for value in CHOICES["particle_shadows"])
        yield from (("particle_shadow_format", value) for value in ("float32", "float16"))
        yield from (("particle_shadow_slices", value) for value in SLICES)
        yield from (("particle_shadow_tile", value) for value in TILES)
        yield from (
            ("particle_shadow_interpolation", value) for value in CHOICES["particle_shadow_interpolation"]
        )
    if len(plan.particles):
        yield from (("particle_order", value) for value in CHOICES["particle_order"])
        yield from (("particle_order_depths", value) for value in DEPTHS)


def _attenuated(plan: FramePlan, ending: bool = False) -> bool:
    """Whether a light fades by distance without an end, or, with `ending`, with one."""
    return any(
        lights.kind != "directional"
        and lights.falloff is Falloff.ATTENUATION
        and (not ending or (lights.ends < 1e30).any())
        for lights in plan.lights
    )


def _clouded(plan: FramePlan) -> bool:
    """Whether particles take some of a light, or would."""
    return any(lights.particle_shadowed for lights in plan.lights)


def _proxied(plan: FramePlan) -> bool:
    volumes = plan.culling.method == "volumes"
    return volumes and any(lights.proxy == "sphere" for lights in plan.lights)


def _shown(value: Any) -> str:
    if value == 5.0 / 256.0:
        return "5/256"
    return f"{value:g}" if isinstance(value, float) else str(value)
