"""The settings that a trade compares: each choice alone, and combinations, as far as they affect a frame."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, fields
from typing import Any, Literal

from firefly_sample.errors import SettingsError
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.scene.light import Falloff
from firefly_sample.settings import CHOICES, HALF_CODE, NOT_FORWARD, PRESETS, Settings

Group = Literal["default", "alone", "baseline", "preset", "combination", "look"]

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
"""Settings that presets and combinations leave as they are in the base."""

_THIN = {
    "position_method": "depth24",
    "normal_format": "oct8",
    "albedo_format": "sqrt8",
    "accumulation_format": "r11g11b10f",
}
COMBINATIONS: dict[str, dict[str, Any]] = {
    "thin buffer": _THIN,
    "half floats": {
        "position_method": "stored16f",
        "normal_format": "rgba16f",
        "albedo_format": "rgba16f",
        "accumulation_format": "rgba16f",
    },
    "as the slides": {
        "position_method": "stored32f",
        "normal_format": "rgba32f",
        "albedo_format": "rgba8",
        "cutoff_threshold": 5.0 / 256.0,
        "light_method": "volumes",
        "volume_depth_test": False,
    },
    "as the assignment": {
        "position_method": "inverse_matrix",
        "normal_format": "rgba16f",
        "albedo_format": "rgba8",
        "light_method": "loop",
    },
    "as the original": {
        "position_method": "depth24",
        "normal_format": "rgba8",
        "albedo_format": "rgba8",
        "accumulation_format": "rgba8",
        "light_method": "volumes",
        "volume_depth_test": False,
    },
    "half, else accurate": {
        "light_resolution": "half",
        "normal_format": "rgba32f",
        "albedo_format": "rgba32f",
    },
    "half, thin buffer": {"light_resolution": "half", **_THIN},
    "cube, depth24": {"volume_proxy": "cube", "position_method": "depth24"},
    "icosphere0, depth32f": {"volume_proxy": "icosphere0", "position_method": "depth32f"},
    "rgba32f normals, rgba16f albedo": {"normal_format": "rgba32f", "albedo_format": "rgba16f"},
}
"""Choices that are used together: those of the documents that the sample follows, small and accurate ones."""


@dataclass(frozen=True)
class Variation:
    """A named set of changes to the base settings.

    The group "look" changes the picture, not its accuracy, for example the model of highlights.
    """

    name: str
    group: Group
    changes: dict[str, Any]


def single_choices(plan: FramePlan) -> list[Variation]:
    """Return each choice of accuracy alone, if this frame or its cost depends on it."""
    base, found = plan.settings, []
    deferred = bool(plan.lights) and base.light_method != "forward"
    positioned = any(lights.kind != "directional" or lights.shadowed for lights in plan.lights)
    attenuated, clouded = _attenuated(plan), _particle_shadowed(plan)
    budgets = [
        value
        for value in (1e-6, HALF_CODE, 1.5e-3)
        if value != base.budget or base.cutoff_threshold is not None
    ]
    table: tuple[tuple[Any, ...], ...] = (
        (positioned and deferred, "position_method"),
        (deferred, "normal_format"),
        (plan.target("albedo") is not None, "albedo_format"),
        (deferred, "interpolation"),
        (plan.target("radiance") is not None, "accumulation_format"),
        (attenuated, "cutoff_budget", *budgets),
        (attenuated, "cutoff_threshold", 1e-3, 1e-2, 5.0 / 256.0),
        (_proxied(plan), "volume_proxy"),
        (deferred, "light_resolution"),
        (bool(plan.shadows.maps), "shadow_taps"),
        (bool(plan.shadows.maps), "shadow_resolution", 256, 512, 1024, 2048, 4096),
        (clouded, "particle_shadows"),
        (clouded, "particle_shadow_format", "float32", "float16"),
        (clouded, "particle_shadow_slices", 16, 32, 64, 128, 256),
        (clouded, "particle_shadow_tile", 32, 64, 128, 256),
        (clouded, "particle_shadow_interpolation"),
        (len(plan.particles) > 0, "particle_order"),
        (len(plan.particles) > 0, "particle_order_depths", 64, None),
        (plan.blended is not None, "transparency"),
    )
    for wanted, name, *values in table:
        for value in (values or CHOICES[name]) if wanted else ():
            changes = {name: value}
            if name == "cutoff_budget" and base.cutoff_threshold is not None:
                changes["cutoff_threshold"] = None  # it would override the budget
            with suppress(SettingsError):  # a choice may contradict the base's
                if base.with_changes(**changes) != base:
                    found.append(Variation(f"{name}={_shown(value)}", "alone", changes))
    return found


def _from_default(changes: Mapping[str, Any], base: Settings) -> dict[str, Any]:
    """Return the changes that turn the base into the default plus `changes`, except for its look."""
    target = Settings().with_changes(**changes)
    return {
        field.name: getattr(target, field.name)
        for field in fields(Settings)
        if field.name not in LOOKS and getattr(target, field.name) != getattr(base, field.name)
    }


def variations(plan: FramePlan, base: Settings) -> list[Variation]:
    """Return everything that a trade compares, the default first; each combination of settings once.

    `plan` is the base's plan for the output "color".
    """
    found = [Variation("default", "default", {}), *single_choices(plan)]
    if any(step.name == "geometry" for step in plan.passes) and plan.lights:
        own = {name: value for name, value in NOT_FORWARD.items() if getattr(base, name) != value}
        found += [Variation("forward shading", "baseline", {"light_method": "forward", **own})]
        found += [
            Variation(f"light_method={name}", "baseline", {"light_method": name})
            for name in ("volumes", "clustered", "loop", "fullscreen")
            if name != plan.light_method.name
        ]
        if any(lights.proxy == "sphere" for lights in plan.lights):
            untested = {"light_method": "volumes", "volume_depth_test": False}
            found.append(Variation("volumes without depth test", "baseline", untested))
    if _particle_shadowed(plan):
        # as in the document that they follow
        eight_bits = {"particle_shadows": "blend", "particle_shadow_format": "unorm8"}
        nearest_ten = {"particle_shadows": "loop", "particle_shadow_reads": 10}
        found.append(Variation("blend, 8 bits", "baseline", eight_bits))
        found.append(Variation("loop, nearest ten", "baseline", nearest_ten))
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
    """Return a key for frames of one scene: frames with equal keys are drawn in the same way."""
    cloud = plan.particle_shadow
    return (
        tuple((target.name, target.format, plan.target_size(target.name)) for target in plan.targets),
        tuple((step.name, step.variant, step.updates) for step in plan.passes),
        tuple((lights.kind, lights.proxy, lights.reaches.tobytes()) for lights in plan.lights),
        plan.shadows.layout,
        plan.settings.volume_proxy if _proxied(plan) else None,
        None
        if cloud is None
        else (cloud.method, cloud.reads, cloud.interpolate, cloud.view.slices, cloud.view.tile),
        plan.particles.order.tobytes(),
        plan.settings.transparency if plan.blended is not None else None,
    )


def _attenuated(plan: FramePlan, ending: bool = False) -> bool:
    """Return whether a light has an attenuation; with `ending`, whether one also has a max distance."""
    return any(
        lights.kind != "directional"
        and lights.falloff is Falloff.ATTENUATION
        and (not ending or (lights.ends < 1e30).any())
        for lights in plan.lights
    )


def _particle_shadowed(plan: FramePlan) -> bool:
    """Return whether particles cast shadows in a light, or would if the settings let them."""
    return any(lights.particle_shadowed for lights in plan.lights)


def _proxied(plan: FramePlan) -> bool:
    volumes = plan.light_method.name == "volumes"
    return volumes and any(lights.proxy == "sphere" for lights in plan.lights)


def _shown(value: Any) -> str:
    if value == 5.0 / 256.0:
        return "5/256"
    return f"{value:g}" if isinstance(value, float) else str(value)
