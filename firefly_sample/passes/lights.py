"""Lighting passes: each light shades the pixels that it can reach, and adds to what they have."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from firefly_sample.gpu.drawing import draw_clustered, draw_loop, draw_volumes, light_table
from firefly_sample.passes.base import BOTH, Pass, encodings
from firefly_sample.passes.legal import Product, Products, choices
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.lights.light_set import PASS_OF_KIND, LightKind, LightSet
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import (
    AlbedoFormat,
    DrawMethod,
    FalloffChoice,
    LightResolution,
    NormalFormat,
    PositionSource,
    RangeFalloff,
    ShadowTaps,
    SpecularModel,
    Variant,
)

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages

TARGETS = ((True, False), (False, True), (True, True))
"""Radiance and light: at least one is written."""
FORMATS = tuple(product(get_args(NormalFormat)[:5], get_args(AlbedoFormat)))
"""Formats of normals and albedo that frames have together, but for the classic look's."""
FADES: list[tuple[LightKind, FalloffChoice, RangeFalloff]] = [
    ("directional", "ramp_squared", "karis"),
    *((kind, "ramp_squared", "karis") for kind in ("point", "spot")),
    *((kind, "attenuation", end) for kind in ("point", "spot") for end in get_args(RangeFalloff)),
]
"""Kinds of light, and how each may fade and end."""
_SHADER_NAMES = {"half_light": "light", "half_shine": "radiance"}
"""The names in a shader of its targets at half resolution."""


@dataclass(frozen=True)
class LightVariant(Variant):
    """The lighting method, the source of a pixel's position, and the formulas of shading.

    `shadow_taps` is 0 for lights without shadow maps; `particle_shadow` is for light that particles shadow.
    `radiance` and `light` are the targets; at half resolution the first is of highlights alone.
    `metallic_roughness` says that some surfaces are of that model, `pyrender` that they are shaded by
    pyrender's formula, and `tint` that some have vertex colours or occlusion, which multiply their light.
    `panda3d` says that Panda3D's formula shades those of other models, `gloss` that their highlights have a
    target of their own, and `local_viewers` that some of these see the eye where it is.
    """

    light_method: DrawMethod = "sphere"
    falloff: FalloffChoice = "ramp_squared"
    range_falloff: RangeFalloff = "karis"
    specular_model: SpecularModel = "none"
    clamp_light: bool = False
    shadow_taps: ShadowTaps = 0
    position_source: PositionSource = "distance"
    normal_format: NormalFormat = "oct16"
    albedo_format: AlbedoFormat = "sqrt10"
    orthographic: bool = False
    radiance: bool = True
    light: bool = False
    light_resolution: LightResolution = "full"
    particle_shadow: bool = False
    metallic_roughness: bool = False
    pyrender: bool = False
    tint: bool = False
    panda3d: bool = False
    gloss: bool = False
    local_viewers: bool = False

    @property
    def eye_at_origin(self) -> bool:
        """True if highlights see the rays of an orthographic camera meet in its position."""
        return self.orthographic and ((self.pyrender and self.metallic_roughness) or self.local_viewers)


Shines = TypeVar("Shines", bound=Variant)


class LightPass(Pass):
    """Draw the light sets of one kind."""

    kind: LightKind
    methods: tuple[DrawMethod, ...]
    """The methods by which it can be drawn."""
    colors = "radiance", "light", "gloss"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if lights of its kind meet surfaces."""
        kind = self.kind
        if not needs.lit or needs.forward or kind not in needs.lights:
            return None
        lights = [needs.lights_of(kind)]
        reads = {"albedo": lights} if needs.picture and (needs.metals or not needs.half) else {}
        reads["normal"] = lights
        if needs.needs_position(kind):
            source, reasons = needs.tested_source, lights
            if kind == "directional":
                reasons = needs.shadows([kind])
                if needs.eye_at_origin:
                    look = needs.settings.look
                    reasons.append(f"look={look}: the rays of an orthographic camera meet in its position")
                if needs.shadowed_by_particles(kind) and needs.particle_shadow is not None:
                    reasons.append(f"shadows of particles in light {needs.particle_shadow.light!r}")
            reads[source] = [f"{reason} ({needs.position_reason})" for reason in reasons]
            if source == "depth_copy":
                reads[source] = [
                    f"{needs.position_reason} samples the depth that the volumes are tested against"
                ]
        if needs.highlights:
            reads["specular"] = [f"highlights of {needs.looks.shiny}"]
        if needs.metals:
            reads["metallic_roughness"] = [f"metalness and roughness of {needs.looks.metallic}"]
        if needs.tints:
            reads["tint"] = [f"vertex colours and occlusion of {needs.looks.tinted}"]
        if kind in needs.shadowed:
            reads["shadow_atlas"] = needs.shadows([kind])
        if needs.shadowed_by_particles(kind):
            reads["particle_shadow_atlas"] = [needs.particle_shadow_reason]
        tested = needs.tests_volumes and kind != "directional"
        tests = ["half_depth" if needs.half else "depth"] if tested else []
        fills = ["half_light", "half_shine"] if needs.half else ["radiance", "light", "gloss"]
        return Declaration(needs.in_view(kind), reads=reads, fills=fills, tests=tests)

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> LightVariant:
        """Return the frame's variant; `variant_for` makes that of a set of lights."""
        kind, settings = self.kind, needs.settings
        method: Any = "sphere" if needs.method == "volumes" else needs.method  # or each set's shape
        return LightVariant(
            light_method="fullscreen" if kind == "directional" and method != "loop" else method,
            range_falloff=settings.range_falloff if kind != "directional" else "karis",
            specular_model=needs.specular_model if needs.highlights else "none",
            clamp_light=settings.clamp_light,
            shadow_taps=settings.shadow_taps if kind in needs.shadowed else 0,  # type: ignore[arg-type]
            position_source=needs.position_source if needs.needs_position(kind) else "distance",
            orthographic=needs.orthographic,
            radiance="radiance" in targets if not needs.half else "half_shine" in targets,
            light="light" in targets or needs.half,
            light_resolution="half" if needs.half else "full",
            particle_shadow=needs.shadowed_by_particles(kind),
            metallic_roughness=needs.metals,
            pyrender=needs.pyrender,
            tint=needs.tints,
            panda3d=needs.panda3d,
            gloss="gloss" in targets,
            local_viewers=needs.local_viewers,
            **encodings(targets, "normal", "albedo"),
        )

    def legal_variants(self) -> Products:
        """Return every combination that a frame can have, and those of three other looks."""
        placed = self.kind != "directional"
        shared = (
            [{"falloff": falloff, "range_falloff": end} for kind, falloff, end in FADES if kind == self.kind],
            choices(orthographic=BOTH),
        )
        shadows = choices(
            shadow_taps=get_args(ShadowTaps),
            particle_shadow=BOTH if self.kind != "point" else (False,),
            position_source=get_args(PositionSource),
        )
        correct = Product(
            LightVariant,
            choices(light_method=self.methods),
            *shared,
            [chosen for chosen in shadows if _has_use_for_position(chosen, placed)],
            _legal_shine(),
            choices(clamp_light=BOTH),
            [{"normal_format": normal, "albedo_format": albedo} for normal, albedo in FORMATS],
        )
        classic = Product(
            LightVariant,
            choices(light_method=[way for way in self.methods if way in ("sphere", "cone", "fullscreen")]),
            *shared,
            choices(position_source=get_args(PositionSource) if placed else ("distance",)),
            [{"radiance": radiance, "light": light} for radiance, light in TARGETS],
            choices(normal_format=["classic"], albedo_format=["linear"]),
        )
        pyrender = [
            Product(
                LightVariant,
                choices(light_method=self.methods, pyrender=[True], metallic_roughness=[metals]),
                shared[0],
                [
                    chosen | {"orthographic": orthographic}
                    for orthographic in BOTH
                    for chosen in shadows
                    if _has_use_for_position(chosen, placed or (metals and orthographic))
                ],
                [
                    {"specular_model": model, "radiance": radiance, "light": light, "tint": tint}
                    for model in get_args(SpecularModel)
                    for radiance, light in TARGETS
                    for tint in BOTH
                    if radiance or (model == "none" and not metals)
                    if metals or not tint
                ],
                [{"normal_format": normal, "albedo_format": albedo} for normal, albedo in FORMATS],
            )
            for metals in BOTH
        ]
        panda3d = Product(
            LightVariant,
            choices(light_method=self.methods, panda3d=[True]),
            shared[0],
            [
                chosen | {"orthographic": orthographic} | shine
                for orthographic in BOTH
                for shine in _legal_gloss()
                for chosen in shadows
                if _has_use_for_position(chosen, placed or ("local_viewers" in shine and orthographic))
            ],
            [{"normal_format": normal, "albedo_format": albedo} for normal, albedo in FORMATS],
        )
        return Products(correct, classic, *pyrender, panda3d)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert isinstance(step.variant, LightVariant)
        images.draw_into()
        by_cells = step.variant.light_method == "clustered"
        tested = bool({"depth", "half_depth"} & set(step.updates))
        outputs = tuple(_SHADER_NAMES.get(name, name) for name in images.color_names())
        drawn = [cells.lights for cells in plan.clusters] if by_cells else plan.lights
        for index, lights in enumerate(drawn):
            if lights.kind != self.kind:
                continue
            variant = variant_for(step.variant, lights)
            method, key = variant.light_method, f"{self.name} {index}"
            program = gpu.programs.get(self.name, variant, outputs)
            textures = images.samplers(_read_by(variant, lights, step.reads))
            if variant.shadow_taps:
                textures["u_shadow_maps"] = gpu.shadow_table(plan)
            if method == "loop":
                draw_loop(gpu, plan, program, textures, lights, variant, key)
            elif method == "clustered":
                # a record for each bit: to look the light's number up first would cost a tenth of the pass
                cells = plan.clusters[index]
                table = light_table(gpu, plan, lights, variant, key, cells.members)
                draw_clustered(gpu, plan, program, textures | {"u_lights": table}, cells, key)
            else:
                program.use(None, textures)
                draw_volumes(gpu, plan, program, lights, variant, method, key, tested)
            gpu.lights_drawn += len(lights)


def _has_use_for_position(chosen: Mapping[str, Any], placed: bool) -> bool:
    """Return whether a choice is legal: without shadows, directional light needs no surface's position."""
    return bool(
        placed
        or chosen["position_source"] == "distance"
        or chosen["shadow_taps"]
        or chosen["particle_shadow"]
    )


def _legal_shine() -> Iterator[dict[str, Any]]:
    """Yield the targets, their resolution and the model of highlights, which are for radiance alone."""
    for model in get_args(SpecularModel):
        for radiance, light in TARGETS:
            if radiance or model == "none":
                yield {"specular_model": model, "radiance": radiance, "light": light}
            if radiance:
                yield {"specular_model": model, "light": light, "metallic_roughness": True}
        for metals in BOTH:
            yield {
                "specular_model": model,
                "radiance": model != "none" or metals,
                "light": True,
                "light_resolution": "half",
                "metallic_roughness": metals,
            }


def _legal_gloss() -> Iterator[dict[str, Any]]:
    """Yield the same for the look "panda3d"."""
    for radiance, light in TARGETS:
        made = {"radiance": radiance, "light": light}
        yield made
        if radiance:
            yield made | {"metallic_roughness": True}
            for metals, gloss, viewers in product(BOTH, repeat=3):
                shine = {"specular_model": "blinn_phong", "metallic_roughness": metals, "gloss": gloss}
                yield made | shine | ({"local_viewers": True} if viewers else {})


class DirectionalLightsPass(LightPass):
    """Add every directional light: a full-screen triangle each, or one for all."""

    name = "directional_lights"
    kind = "directional"
    methods = ("fullscreen", "loop")


class PointLightsPass(LightPass):
    """Add every point light in view: as spheres, full-screen if one contains the view, or by cells."""

    name = "point_lights"
    kind = "point"
    methods = ("sphere", "fullscreen", "loop", "clustered")


class SpotlightsPass(LightPass):
    """Add every spotlight in view: as cones, as spheres where those are smaller, or by cells."""

    name = "spotlights"
    kind = "spot"
    methods = get_args(DrawMethod)


LIGHT_PASSES = frozenset(PASS_OF_KIND.values())
"""Names of the lighting passes."""


def _read_by(variant: LightVariant, lights: LightSet, reads: Iterable[str]) -> list[str]:
    """Return those of the pass's targets that a set's shader samples."""
    without = set() if variant.shadow_taps else {"shadow_atlas"}
    without |= set() if variant.particle_shadow else {"particle_shadow_atlas"}
    placed = variant.shadow_taps or variant.particle_shadow or variant.eye_at_origin
    if lights.kind == "directional" and not placed:
        without |= {"distance", "position", "depth", "depth_copy"}
    return [name for name in reads if name not in without]


def method_for(chosen: DrawMethod, lights: LightSet) -> DrawMethod:
    """Return how a set is drawn: light volumes are spheres, cones, or the full screen."""
    return lights.proxy if chosen == "sphere" else chosen


def variant_for(frame: LightVariant, lights: LightSet) -> LightVariant:
    """Return the frame's variant for one set of lights."""
    placed = lights.kind != "directional" or lights.shadowed or lights.particle_shadowed
    placed = placed or frame.eye_at_origin
    return shining(
        frame,
        lights,
        light_method=method_for(frame.light_method, lights),
        position_source=frame.position_source if placed else "distance",
    )


def shining(frame: Shines, lights: LightSet, **changes: Any) -> Shines:
    """Return a variant with the falloff and the shadows of a set's lights, and other `changes`."""
    given: Any = frame
    falloff = lights.falloff.value if lights.kind != "directional" else "ramp_squared"
    changes["falloff"] = falloff
    changes["range_falloff"] = given.range_falloff if falloff == "attenuation" else "karis"
    changes["shadow_taps"] = given.shadow_taps if lights.shadowed else 0
    changes["particle_shadow"] = given.particle_shadow and lights.particle_shadowed
    return replace(frame, **changes)
