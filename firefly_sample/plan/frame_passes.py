"""Choose a frame's passes in drawing order: each exists because something asked for it, and says what."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from firefly_sample.errors import PlanError
from firefly_sample.plan.frame_plan import PassPlan
from firefly_sample.plan.frame_targets import INTERPOLATED
from firefly_sample.plan.lights.light_set import PASS_OF_KIND, LightKind
from firefly_sample.plan.needs import VOLUME_OUTPUTS, Needs, asked
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import (
    PASS_ORDER,
    AmbientVariant,
    ColorPacking,
    DrawMethod,
    ForwardVariant,
    GeometryVariant,
    InterpolationVariant,
    LightVariant,
    LightViewVariant,
    NormalPacking,
    ParticleLightVariant,
    ParticleVariant,
    PlainVariant,
    Position,
    ResolveVariant,
    ShadowVariant,
    Stored,
    UpsampleVariant,
    Variant,
)

GBUFFER = (
    *("depth", "albedo", "normal", "distance", "position", "ambient_albedo", "specular", "emission"),
    *("id", "visibility"),
)
_METHODS: dict[str, DrawMethod] = {
    "volumes": "sphere",
    "clustered": "clustered",
    "fullscreen": "fullscreen",
    "loop": "loop",
}
_STORED: dict[str, Stored] = {"rgba32f": "full", "rgba16f": "half"}


def geometry_variant(needs: Needs, targets: Iterable[Target]) -> GeometryVariant:
    """The geometry pass's variant as far as the frame decides it; batches fill in the rest."""
    made = {target.name: target for target in targets}
    position = made.get("position")
    return GeometryVariant(
        albedo="albedo" in made,
        normal="normal" in made,
        distance="distance" in made,
        ambient="ambient_albedo" in made,
        specular="specular" in made,
        emission="emission" in made,
        id="id" in made,
        visibility="visibility" in made,
        stored=_STORED[position.format] if position else "none",
        normals=_normals(needs) if "normal" in made else "snorm16",
        colors=_colors(needs) if "albedo" in made else "root10",
        float64=needs.float64 and bool(made.keys() & INTERPOLATED),
        orthographic=needs.orthographic,
    )


def _normals(needs: Needs) -> NormalPacking:
    return needs.normal_format[1]  # type: ignore[return-value]


def _colors(needs: Needs) -> ColorPacking:
    return needs.albedo_format[1]  # type: ignore[return-value]


def _position(needs: Needs) -> Position:
    """How a pass of light gets positions."""
    if needs.settings.position == "inverse_matrix":
        return "matrix"
    return {"distance": "distance", "position": "stored", "depth": "depth"}[needs.place_target]  # type: ignore[return-value]


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
    if needs.particle_shadowed:
        _volume(needs, frame)
    if needs.drawn:
        because = f"{needs.geometry} geometry instances in view"
        if needs.forward:
            _forward(needs, frame, because)
        else:
            variant = geometry_variant(needs, targets)
            frame.add("geometry", because, variant, writes=frame.there(*GBUFFER))
            if variant.float64:
                _interpolation(variant, frame)
    if "depth_copy" in frame.names:
        because = f"position={needs.settings.position}: a depth buffer cannot be tested and sampled at once"
        frame.add("depth_copy", because, Variant(), reads=("depth",), writes=("depth_copy",))
    if "half_depth" in frame.names:
        because = "light_resolution=half: the depth of every second pixel, to test volumes against"
        frame.add("half_depth", because, Variant(), reads=("depth",), writes=("half_depth",))
    if (needs.ambient_lit or needs.emits) and not needs.forward:
        _ambient(needs, frame, lights)
    if needs.lit and not needs.forward:
        for kind in PASS_OF_KIND:
            if kind in needs.lights:
                half = frame.there("half_light", "half_shine")
                _lights(needs, frame, kind, half or lights)
    if needs.half:
        _upsample(needs, frame, lights)
    if needs.hazy:
        _particles(needs, frame)
    if needs.dotted:
        tests = frame.there("depth")
        because = f"{needs.sprites} sprites in view"
        frame.add("plain", because, PlainVariant(needs.orthographic), fills=("radiance",), tests=tests)
    for name in frame.there(*VOLUME_OUTPUTS):
        _light_view(needs, frame, name)
    if needs.picture:
        _resolve(needs, frame)
    if needs.textured:
        because = "show_texture: the slices of shadow in the picture's corner"
        frame.add(
            "particle_shadow_texture", because, Variant(), reads=("particle_shadow_atlas",), tests=("color",)
        )
    return tuple(frame.passes)


def _interpolation(variant: GeometryVariant, frame: _Passes) -> None:
    own = InterpolationVariant(
        normal=variant.normal,
        distance=variant.distance,
        stored=variant.stored,
        normals=variant.normals,
        orthographic=variant.orthographic,
    )
    because = "interpolation=float64: what is steep is found again from its triangle's corners"
    frame.add("interpolation", because, own, reads=("visibility",), tests=frame.there(*sorted(INTERPOLATED)))


def _volume(needs: Needs, frame: _Passes) -> None:
    """Fill the slices, sum them as the method does, and blur what came of it."""
    particle_shadow = needs.particle_shadow
    assert particle_shadow is not None
    atlas, scratch = ("particle_shadow_atlas",), ("particle_shadow_scratch",)
    frame.add("particle_shadow_slices", needs.particle_shadow_reason, Variant(), writes=atlas)
    if particle_shadow.method != "loop":
        because = f"particle_shadows={particle_shadow.method} adds each slice to the next"
        frame.add("particle_shadow_sums", because, Variant(), writes=("particle_shadow_sum",), tests=atlas)
    if particle_shadow.blur > 0.0:
        because = f"a {particle_shadow.kernel} blur of {particle_shadow.blur:g} texels"
        frame.add("particle_shadow_blur_x", because, Variant(), reads=atlas, writes=scratch)
        frame.add("particle_shadow_blur_y", because, Variant(), reads=scratch, writes=atlas)


def _particles(needs: Needs, frame: _Passes) -> None:
    """Light each particle once, then draw all of them."""
    settings = needs.settings
    light = ParticleLightVariant(
        range_falloff=settings.range_falloff,
        taps=settings.shadow_taps if needs.shadow_maps else 0,  # type: ignore[arg-type]
        particle_shadow=needs.particle_shadowed,
        orthographic=needs.orthographic,
    )
    reads = frame.there("shadow_atlas", "particle_shadow_atlas")
    writes = ("particle_light",)
    frame.add("particle_light", needs.particles_in_view, light, reads=reads, writes=writes)
    position = _surface_position(needs) if needs.drawn else "distance"
    variant = ParticleVariant(
        surfaces=needs.drawn,
        position=position,
        orthographic=needs.orthographic,
        reverse=needs.reverse and position == "depth",
        packed=needs.drawn and needs.packed and needs.orthographic and position in ("distance", "stored"),
    )
    reads = ("particle_light", *(_soft_place(needs) if needs.drawn else ()))
    frame.add("particles", needs.particles_in_view, variant, reads=reads, writes=("particles",))


def _surface_position(needs: Needs) -> Position:
    """How a pass that needs no more than the surface's distance gets it."""
    return "depth" if needs.forward else _position(needs)


def _soft_place(needs: Needs) -> tuple[str, ...]:
    """The target that tells where surfaces are, and what tells whether there is one."""
    if needs.forward or needs.place_target == "depth":
        return ("depth",)
    return (needs.place_target, *(("albedo",) if needs.orthographic else ()))


def _ambient(needs: Needs, frame: _Passes, lights: tuple[str, ...]) -> None:
    reasons = ["ambient light"] if needs.ambient_lit else []
    reasons += [f"emission of {needs.emissive}"] if needs.emits else []
    variant = AmbientVariant(
        lit=needs.ambient_lit,
        own=needs.own_ambient_lit,
        emission=needs.emits,
        colors=_colors(needs),
        radiance="radiance" in lights,
        light="light" in lights and needs.ambient_lit,
    )
    reads = [name for name, read in (("ambient_albedo", variant.own), ("emission", variant.emission)) if read]
    if variant.lit and variant.radiance and not variant.own:
        reads.insert(0, "albedo")
    fills = tuple(name for name in lights if name != "light" or variant.light)
    frame.add("ambient", "; ".join(reasons), variant, reads=tuple(reads), fills=fills)


def _lights(needs: Needs, frame: _Passes, kind: LightKind, lights: tuple[str, ...]) -> None:
    settings = needs.settings
    clouded = kind in needs.clouded and needs.particle_shadowed
    placed = kind != "directional" or kind in needs.shadowed or clouded
    method = _METHODS[needs.method]
    variant = LightVariant(
        method="loop" if method == "loop" else "fullscreen" if kind == "directional" else method,
        range_falloff=settings.range_falloff if kind != "directional" else "karis",
        highlights=settings.specular_model if needs.highlights else "none",
        clamp_light=settings.clamp_light,
        taps=settings.shadow_taps if kind in needs.shadowed else 0,  # type: ignore[arg-type]
        position=_position(needs) if placed else "distance",
        normals=_normals(needs),
        colors=_colors(needs),
        orthographic=needs.orthographic,
        radiance="radiance" in lights or "half_shine" in lights,
        light="light" in lights or needs.half,
        half=needs.half,
        particle_shadow=clouded,
    )
    reads = ["albedo"] if variant.radiance and not needs.half else []
    reads += ["normal", *(_place(needs, frame) if placed else ())]
    reads += ["specular"] if variant.highlights != "none" else []
    reads += ["shadow_atlas"] if kind in needs.shadowed else []
    reads += ["particle_shadow_atlas"] if clouded else []
    tests = frame.there("half_depth" if needs.half else "depth") if needs.volume_test else ()
    if kind == "directional":
        tests = ()
    frame.add(PASS_OF_KIND[kind], needs.in_view(kind), variant, reads=tuple(reads), fills=lights, tests=tests)


def _place(needs: Needs, frame: _Passes) -> tuple[str, ...]:
    """The target that a pass takes positions from."""
    if needs.place_target != "depth":
        return (needs.place_target,)
    return ("depth_copy",) if "depth_copy" in frame.names else ("depth",)


def _upsample(needs: Needs, frame: _Passes, lights: tuple[str, ...]) -> None:
    variant = UpsampleVariant(
        position=_position(needs),
        normals=_normals(needs),
        colors=_colors(needs),
        orthographic=needs.orthographic,
        radiance="radiance" in lights,
        light="light" in lights,
        shine=needs.highlights and "radiance" in lights,
    )
    because = "light_resolution=half: each pixel takes light from neighbours on its surface"
    albedo = ("albedo",) if variant.radiance else ()
    reads = (*frame.there("half_light", "half_shine"), *albedo, "normal", needs.place_target)
    frame.add("upsample", because, variant, reads=reads, fills=lights)


def _forward(needs: Needs, frame: _Passes, because: str) -> None:
    settings = needs.settings
    variant = ForwardVariant(
        range_falloff=settings.range_falloff,
        highlights=settings.specular_model if needs.highlights else "none",
        clamp_light=settings.clamp_light,
        taps=settings.shadow_taps if needs.shadowed else 0,  # type: ignore[arg-type]
        ambient=needs.own_ambient_lit,
        specular=needs.highlights,
        emission=needs.emits,
        orthographic=needs.orthographic,
        particle_shadow=bool(needs.clouded) and needs.particle_shadowed,
    )
    lights = ", ".join(needs.all_lights()) or "no light"
    reads = frame.there("shadow_atlas", "particle_shadow_atlas") if needs.lit else ()
    writes = ("depth", "coverage")
    frame.add(
        "forward", f"{because}, {lights}", variant, reads=reads, writes=writes, fills=frame.there("radiance")
    )


def _light_view(needs: Needs, frame: _Passes, name: Any) -> None:
    because = f"output {name}: {', '.join(needs.all_lights())}"
    flat = needs.orthographic
    if name == "overdraw" and needs.counts_cells:
        variant = LightViewVariant(name, "clustered", flat, _position(needs))
        frame.add(name, because, variant, reads=_place(needs, frame), writes=(name,))
        return
    tests = ("depth",) if needs.volume_test or name == "wireframe" else ()
    frame.add(name, because, LightViewVariant(name, orthographic=flat), writes=(name,), tests=tests)


def _resolve(needs: Needs, frame: _Passes) -> None:
    settings = needs.settings
    variant = ResolveVariant(
        radiance="radiance" in frame.names,
        masked="albedo" in frame.names or "coverage" in frame.names,
        marked="coverage" in frame.names,
        color="color" in frame.names,
        final_radiance="final_radiance" in frame.names,
        gradient=needs.gradient,
        orthographic=needs.orthographic and needs.gradient,
        classic=needs.classic,
        tone=settings.tone_curve,
        supersample=settings.supersample,  # type: ignore[arg-type]
        particles="particles" in frame.names,
        packed="albedo" in frame.names and needs.packed,
    )
    because = "; ".join(asked(needs.outputs, ("color", "radiance")))
    reads = frame.there("radiance", "particles", "albedo", "coverage")
    writes = frame.there("color", "final_radiance")
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
