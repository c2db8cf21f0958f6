"""Choose a frame's targets: each exists because something asked for it, and says what."""

from __future__ import annotations

from typing import Any

from firefly_sample.plan.needs import NORMAL_OUTPUTS, PLACE_OUTPUTS, Needs, asked
from firefly_sample.plan.targets import (
    COARSE_DEPTH,
    PARTICLE_SHADOW_FORMATS,
    STORED_POSITIONS,
    Target,
    particle_texels,
)

_SOFT = "particles end softly where surfaces are"
INTERPOLATED = frozenset({"normal", "distance", "position"})
"""Targets of what is interpolated between corners, and not sampled."""


class _Targets:
    """The targets of a frame as they come."""

    def __init__(self) -> None:
        self.all: list[Target] = []

    def have(self, names: frozenset[str]) -> bool:
        """Whether one of the names is there."""
        return any(target.name in names for target in self.all)

    def add(self, name: str, form: str, reasons: list[str], clear: float = 0.0, **more: Any) -> None:
        """Add one if there is a reason."""
        if reasons:
            self.all.append(Target(name, form, "; ".join(reasons), (clear, 0.0, 0.0, 0.0), **more))


def choose_targets(needs: Needs) -> tuple[Target, ...]:
    """The targets of a frame, each with its reasons."""
    outputs, targets = needs.outputs, _Targets()
    depth, far = _depth_format(needs)
    if needs.shadow_maps:
        lit = ">=" if needs.reverse else "<="
        shape = {"per_sample": False, "size": needs.atlas, "compare": lit}
        kind = "depth32f" if needs.reverse else "depth24"
        targets.add("shadow_atlas", kind, needs.shadows(), far, **shape)
    if needs.particle_shadowed:
        _add_particle_shadow(needs, targets)
    if needs.drawn:
        targets.add("depth", depth, ["geometry hides what is behind it"], far)
        if needs.forward:
            targets.add("coverage", "r8", ["the background shows where nothing was drawn"])
        else:
            _add_gbuffer(needs, targets)
    reasons = needs.all_lights() if needs.lit else []
    if needs.half:
        _add_half(needs, targets, reasons)
    reasons += ["ambient light"] if needs.ambient_lit else []
    targets.add("light", "rgba32f", asked(outputs, ("light",)) if reasons else [])
    reasons += [f"emission of {needs.emissive}"] if needs.emits else []
    reasons += [f"{needs.sprites} sprites"] if needs.dotted else []
    targets.add("radiance", needs.accumulation_format, reasons if needs.picture else [])
    if needs.hazy:
        _add_particles(needs, targets)
    if needs.geometry and needs.lights:
        targets.add("overdraw", "r32f", asked(outputs, ("overdraw",)))
        for name in ("volumes", "wireframe"):
            targets.add(name, "rgba8", asked(outputs, (name,)))
    targets.add("color", "rgba8", asked(outputs, ("color",)), per_sample=False)
    targets.add("final_radiance", "rgba32f", asked(outputs, ("radiance",)), per_sample=False)
    return tuple(targets.all)


def _depth_format(needs: Needs) -> tuple[str, float]:
    """The depth buffer's format, and its value where nothing is."""
    if needs.reverse:
        return "depth32f", 0.0
    return COARSE_DEPTH.get(needs.settings.position, "depth24"), 1.0


def _add_gbuffer(needs: Needs, targets: _Targets) -> None:
    outputs, settings = needs.outputs, needs.settings
    albedo, colors = needs.albedo_format
    targets.add("albedo", albedo, _albedo_reasons(needs), packing=colors)
    normal, normals = needs.normal_format
    reasons = (needs.all_lights() if needs.lit else []) + asked(outputs, NORMAL_OUTPUTS)
    targets.add("normal", normal, reasons, packing=normals)
    if needs.place_target != "depth":
        form = STORED_POSITIONS.get(settings.position, "r32f")
        reasons = [f"{light} (position={settings.position})" for light in needs.placed_lights()]
        reasons = (reasons if needs.placed else []) + asked(outputs, PLACE_OUTPUTS)
        reasons += [_SOFT] if needs.hazy else []
        reasons += asked(outputs, ("overdraw",)) if needs.counts_cells else []
        reasons += ["light_resolution=half finds neighbours on the same surface"] if needs.half else []
        targets.add(needs.place_target, form, reasons)
    own = [f"ambient colours of {needs.own_ambient}"] if needs.own_ambient_lit else []
    targets.add("ambient_albedo", albedo, own, packing=colors)
    shiny = [f"highlights of {needs.shiny}"] if needs.highlights else []
    targets.add("specular", "rgba16", shiny + asked(outputs, ("specular", "shininess")))
    emissive = [f"emission of {needs.emissive}"] if needs.emits else []
    targets.add("emission", "rgba32f", emissive + asked(outputs, ("emission",)))
    targets.add("id", "r32ui", asked(outputs, ("id",)))
    reasons = asked(outputs, ("visibility",))
    if needs.float64 and targets.have(INTERPOLATED):
        reasons.append("interpolation=float64 looks corners up")
    targets.add("visibility", "rg32ui", reasons)
    if needs.placed and needs.volume_test and needs.place_target == "depth" and not needs.half:
        reason = f"position={settings.position} samples the depth that the volumes are tested against"
        depth, far = _depth_format(needs)
        targets.add("depth_copy", depth, [reason], far)


def _add_particle_shadow(needs: Needs, targets: _Targets) -> None:
    particle_shadow = needs.particle_shadow
    assert particle_shadow is not None
    form = PARTICLE_SHADOW_FORMATS[needs.settings.particle_shadow_format][particle_shadow.tinted]
    shape: dict[str, Any] = {"per_sample": False, "size": particle_shadow.size}
    targets.add("particle_shadow_atlas", form, [needs.particle_shadow_reason], **shape)
    reasons = [f"a blur of {particle_shadow.blur:g} texels"] if particle_shadow.blur > 0.0 else []
    targets.add("particle_shadow_scratch", form, reasons, **shape)
    if particle_shadow.method != "loop":
        tile = (particle_shadow.view.tile, particle_shadow.view.tile)
        reason = f"particle_shadows={particle_shadow.method} adds each slice to the next"
        targets.add("particle_shadow_sum", form, [reason], per_sample=False, size=tile)


def _add_particles(needs: Needs, targets: _Targets) -> None:
    rows = particle_texels(needs.particles)
    targets.add("particle_light", "rgba32f", [needs.particles_in_view], per_sample=False, size=rows)
    reasons = [needs.particles_in_view] + ([f"{needs.sprites} sprites among them"] if needs.sprites else [])
    targets.add("particles", "rgba32f", reasons)


def _add_half(needs: Needs, targets: _Targets, lights: list[str]) -> None:
    """What light of half the resolution is drawn with, and into."""
    depth, far = _depth_format(needs)
    if needs.volume_test and set(needs.lights) != {"directional"}:
        targets.add("half_depth", depth, ["light_resolution=half tests volumes at its own"], far, half=True)
    because = [f"{light} (light_resolution=half)" for light in lights]
    targets.add("half_light", needs.accumulation_format, because, half=True)
    shiny = [f"highlights of {needs.shiny} (light_resolution=half)"] if needs.highlights else []
    targets.add("half_shine", needs.accumulation_format, shiny, half=True)


def _albedo_reasons(needs: Needs) -> list[str]:
    reasons = needs.all_lights() if needs.lit and needs.picture else []
    reasons += ["ambient light"] if needs.ambient_lit and needs.picture else []
    reasons += ["the background shows where its alpha is 0"] if needs.picture else []
    reasons += asked(needs.outputs, ("albedo",))
    marked: tuple[str, ...] = ("light",) if needs.lit or needs.ambient_lit else ()
    if not needs.distance_marks:
        marked += (*PLACE_OUTPUTS, *NORMAL_OUTPUTS, "specular", "shininess", "emission")
    return reasons + [f"{reason} (its alpha marks the background)" for reason in asked(needs.outputs, marked)]
