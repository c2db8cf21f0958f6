"""Choose targets and passes: each exists because something asked for it, and says what."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from firefly_sample.errors import PlanError
from firefly_sample.plan.frame_plan import PassPlan
from firefly_sample.plan.light_set import PASS_OF_KIND, LightKind
from firefly_sample.plan.needs import NORMAL_OUTPUTS, PLACE_OUTPUTS, VOLUME_OUTPUTS, Needs, asked
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import (
    PASS_ORDER,
    AmbientVariant,
    DrawMethod,
    GeometryVariant,
    LightVariant,
    LightViewVariant,
    PlainVariant,
    ResolveVariant,
    ShadowVariant,
    Variant,
)

__all__ = ["check_passes", "choose_passes", "choose_targets", "geometry_variant"]

GBUFFER = (
    *("depth", "albedo", "normal", "distance", "ambient_albedo", "specular", "emission"),
    *("id", "visibility"),
)
_METHODS: dict[str, DrawMethod] = {"volumes": "sphere", "fullscreen": "fullscreen", "loop": "loop"}


def choose_targets(needs: Needs) -> tuple[Target, ...]:
    """The targets of a frame, each with its reasons."""
    outputs, targets = needs.outputs, []

    def add(name: str, form: str, reasons: list[str], clear: float = 0.0, **more: object) -> None:
        if reasons:
            targets.append(
                Target(name, form, "; ".join(reasons), (clear, 0.0, 0.0, 0.0), **more)  # type: ignore[arg-type]
            )

    depth, far = ("depth32f", 0.0) if needs.reverse else ("depth24", 1.0)
    if needs.shadow_maps:
        lit = ">=" if needs.reverse else "<="
        add("shadow_atlas", depth, needs.shadows(), far, per_sample=False, size=needs.atlas, compare=lit)
    if needs.drawn:
        add("depth", depth, ["geometry hides what is behind it"], far)
        add("albedo", "rgba8", _albedo_reasons(needs))
        snorm = "rg16_snorm" if needs.capabilities.snorm_targets else "rg16"
        reasons = (needs.all_lights() if needs.lit else []) + asked(outputs, NORMAL_OUTPUTS)
        add("normal", "rgba8" if needs.classic else snorm, reasons)
        if needs.linear_distance:
            reasons = [f"{light} (position=linear32f)" for light in needs.placed_lights()]
            add("distance", "r32f", (reasons if needs.placed else []) + asked(outputs, PLACE_OUTPUTS))
        own = [f"ambient colours of {needs.own_ambient}"] if needs.own_ambient_lit else []
        add("ambient_albedo", "rgba8", own)
        shiny = [f"highlights of {needs.shiny}"] if needs.highlights else []
        add("specular", "rgba16", shiny + asked(outputs, ("specular", "shininess")))
        emissive = [f"emission of {needs.emissive}"] if needs.emits else []
        add("emission", "rgba32f", emissive + asked(outputs, ("emission",)))
        add("id", "r32ui", asked(outputs, ("id",)))
        add("visibility", "rg32ui", asked(outputs, ("visibility",)))
        if needs.placed and not needs.linear_distance:
            reason = (
                f"position={needs.settings.position} samples the depth that the volumes are tested against"
            )
            add("depth_copy", depth, [reason])
    reasons = needs.all_lights() if needs.lit else []
    reasons += ["ambient light"] if needs.ambient_lit else []
    add("light", "rgba32f", asked(outputs, ("light",)) if reasons else [])
    reasons += [f"emission of {needs.emissive}"] if needs.emits else []
    reasons += [f"{needs.sprites} sprites"] if needs.dotted else []
    add("radiance", "rgba8" if needs.classic else "rgba32f", reasons if needs.picture else [])
    if needs.geometry and needs.lights:
        add("overdraw", "r32f", asked(outputs, ("overdraw",)))
        for name in ("volumes", "wireframe"):
            add(name, "rgba8", asked(outputs, (name,)))
    add("color", "rgba8", asked(outputs, ("color",)), per_sample=False)
    add("final_radiance", "rgba32f", asked(outputs, ("radiance",)), per_sample=False)
    return tuple(targets)


def _albedo_reasons(needs: Needs) -> list[str]:
    reasons = needs.all_lights() if needs.lit and needs.picture else []
    reasons += ["ambient light"] if needs.ambient_lit and needs.picture else []
    reasons += ["the background shows where its alpha is 0"] if needs.picture else []
    reasons += asked(needs.outputs, ("albedo",))
    marked: tuple[str, ...] = ("light",) if needs.lit or needs.ambient_lit else ()
    if not needs.distance_marks:
        marked += (*PLACE_OUTPUTS, *NORMAL_OUTPUTS, "specular", "shininess", "emission")
    return reasons + [f"{reason} (its alpha marks the background)" for reason in asked(needs.outputs, marked)]


def geometry_variant(needs: Needs, targets: Iterable[Target]) -> GeometryVariant:
    """The geometry pass's variant as far as the frame decides it; batches fill in the rest."""
    names = {target.name for target in targets}
    return GeometryVariant(
        albedo="albedo" in names,
        normal="normal" in names,
        distance="distance" in names,
        ambient="ambient_albedo" in names,
        specular="specular" in names,
        emission="emission" in names,
        id="id" in names,
        visibility="visibility" in names,
        classic=needs.classic,
        snorm=needs.capabilities.snorm_targets or needs.classic or "normal" not in names,
        orthographic=needs.orthographic,
    )


class _Passes:
    """The passes of a frame as they come; the first that writes a shared target clears it."""

    def __init__(self, targets: Iterable[Target]) -> None:
        self.names = {target.name for target in targets}
        self.passes: list[PassPlan] = []
        self._filled: set[str] = set()

    def there(self, *names: str) -> tuple[str, ...]:
        """Those of the names that this frame has as targets."""
        return tuple(name for name in names if name in self.names)

    def add(
        self,
        name: str,
        because: str,
        variant: Variant,
        *,
        reads: tuple[str, ...] = (),
        writes: tuple[str, ...] = (),
        fills: tuple[str, ...] = (),
        tests: tuple[str, ...] = (),
    ) -> None:
        """Add a pass that clears and `writes`, and blends into what it `fills`; who is first clears it."""
        first = tuple(target for target in fills if target not in self._filled)
        updates = tuple(target for target in fills if target in self._filled)
        self._filled.update(fills)
        self.passes.append(PassPlan(name, reads, (*writes, *first), (*updates, *tests), because, variant))


def choose_passes(needs: Needs, targets: tuple[Target, ...]) -> tuple[PassPlan, ...]:
    """The passes of a frame in drawing order, each with its reason."""
    frame = _Passes(targets)
    lights = frame.there("radiance", "light")
    if needs.shadow_maps:
        frame.add("shadow_maps", "; ".join(needs.shadows()), ShadowVariant(), writes=("shadow_atlas",))
    if needs.drawn:
        because = f"{needs.geometry} geometry instances in view"
        frame.add("geometry", because, geometry_variant(needs, targets), writes=frame.there(*GBUFFER))
    if "depth_copy" in frame.names:
        because = f"position={needs.settings.position}: a depth buffer cannot be tested and sampled at once"
        frame.add("depth_copy", because, Variant(), reads=("depth",), writes=("depth_copy",))
    if needs.ambient_lit or needs.emits:
        _ambient(needs, frame, lights)
    if needs.lit:
        for kind in PASS_OF_KIND:
            if kind in needs.lights:
                _lights(needs, frame, kind, lights)
    if needs.dotted:
        tests = frame.there("depth")
        because = f"{needs.sprites} sprites in view"
        frame.add("plain", because, PlainVariant(needs.orthographic), fills=("radiance",), tests=tests)
    for name in frame.there(*VOLUME_OUTPUTS):
        _light_view(needs, frame, name)
    if needs.picture:
        _resolve(needs, frame)
    return tuple(frame.passes)


def _ambient(needs: Needs, frame: _Passes, lights: tuple[str, ...]) -> None:
    reasons = ["ambient light"] if needs.ambient_lit else []
    reasons += [f"emission of {needs.emissive}"] if needs.emits else []
    variant = AmbientVariant(
        lit=needs.ambient_lit,
        own=needs.own_ambient_lit,
        emission=needs.emits,
        classic=needs.classic,
        radiance="radiance" in lights,
        light="light" in lights and needs.ambient_lit,
    )
    reads = [name for name, read in (("ambient_albedo", variant.own), ("emission", variant.emission)) if read]
    if variant.lit and variant.radiance and not variant.own:
        reads.insert(0, "albedo")
    fills = tuple(name for name in lights if name != "light" or variant.light)
    frame.add("ambient", "; ".join(reasons), variant, reads=tuple(reads), fills=fills)


def _lights(needs: Needs, frame: _Passes, kind: LightKind, lights: tuple[str, ...]) -> None:
    settings, placed = needs.settings, kind != "directional" or kind in needs.shadowed
    method = _METHODS[settings.lights]
    variant = LightVariant(
        method="fullscreen" if kind == "directional" and method == "sphere" else method,
        window=settings.window if kind != "directional" else "karis",
        highlights=settings.specular if needs.highlights else "none",
        clamp_light=settings.clamp_light and not needs.classic,
        taps=settings.shadow_taps if kind in needs.shadowed else 0,  # type: ignore[arg-type]
        from_depth=placed and not needs.linear_distance,
        classic=needs.classic,
        snorm=needs.capabilities.snorm_targets or needs.classic,
        orthographic=needs.orthographic,
        radiance="radiance" in lights,
        light="light" in lights,
    )
    reads = ["albedo"] if variant.radiance else []
    reads += ["normal", *(frame.there("distance", "depth_copy")[:1] if placed else ())]
    reads += ["specular"] if variant.highlights != "none" else []
    reads += ["shadow_atlas"] if kind in needs.shadowed else []
    tests = ("depth",) if needs.volume_test and kind != "directional" else ()
    frame.add(PASS_OF_KIND[kind], needs.in_view(kind), variant, reads=tuple(reads), fills=lights, tests=tests)


def _light_view(needs: Needs, frame: _Passes, name: Any) -> None:
    because = f"output {name}: {', '.join(needs.all_lights())}"
    tests = ("depth",) if needs.volume_test or name == "wireframe" else ()
    frame.add(
        name, because, LightViewVariant(name, orthographic=needs.orthographic), writes=(name,), tests=tests
    )


def _resolve(needs: Needs, frame: _Passes) -> None:
    settings = needs.settings
    variant = ResolveVariant(
        radiance="radiance" in frame.names,
        masked="albedo" in frame.names,
        color="color" in frame.names,
        final_radiance="final_radiance" in frame.names,
        gradient=needs.gradient,
        orthographic=needs.orthographic and needs.gradient,
        classic=needs.classic,
        tone=settings.tone_curve,
        supersample=settings.supersample,  # type: ignore[arg-type]
    )
    because = "; ".join(asked(needs.outputs, ("color", "radiance")))
    reads, writes = frame.there("radiance", "albedo"), frame.there("color", "final_radiance")
    frame.add("resolve", because, variant, reads=reads, writes=writes)


def check_passes(passes: tuple[PassPlan, ...], targets: Iterable[Target]) -> None:
    """Hold the passes against the fixed order and against each other.

    Raises
    ------
    PlanError
        If a pass is out of order, touches a target that does not exist, reads or updates what nobody
        wrote, samples what it also draws into, or if a target is never used.
    """
    positions = [PASS_ORDER.index(step.name) for step in passes]
    if positions != sorted(positions):
        raise PlanError(f"passes are out of order: {', '.join(step.name for step in passes)}")
    names = {target.name for target in targets}
    written: set[str] = set()
    for step in passes:
        for name in (*step.reads, *step.writes, *step.updates):
            if name not in names:
                raise PlanError(f"pass {step.name!r} uses target {name!r}, which this frame does not have")
        for name in (*step.reads, *step.updates):
            if name not in written:
                raise PlanError(f"pass {step.name!r} reads target {name!r}, which no pass wrote before it")
        for name in step.reads:
            if name in step.writes or name in step.updates:
                raise PlanError(f"pass {step.name!r} samples target {name!r} while it draws into it")
        written.update(step.writes)
    for name in sorted(names - written):
        raise PlanError(f"target {name!r} is never written by any pass")
