"""Forward pass: every fragment is shaded by every light as it is drawn, the baseline of deferred shading."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any, get_args

from firefly_sample.gpu.drawing import Drawable, draw_surface, light_table, make_drawable, shadow_textures
from firefly_sample.passes.base import BOTH, Pass
from firefly_sample.passes.geometry import surface_fields
from firefly_sample.passes.legal import Product, Products, choices
from firefly_sample.passes.legal_surfaces import legal_surfaces
from firefly_sample.passes.lights import FADES, shining
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import (
    FalloffChoice,
    LightKind,
    MapCoordinates,
    RangeFalloff,
    ShadowTaps,
    SpecularModel,
    Variant,
)

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages


@dataclass(frozen=True)
class ForwardVariant(Variant):
    """Surfaces as the geometry pass has them, shaded at once by all lights of one kind.

    `first` is the draw that also brings ambient light, emission and the mark of what is covered.
    """

    light_kind: LightKind = "point"
    falloff: FalloffChoice = "ramp_squared"
    range_falloff: RangeFalloff = "karis"
    specular_model: SpecularModel = "none"
    clamp_light: bool = False
    shadow_taps: ShadowTaps = 0
    first: bool = True
    ambient_albedo: bool = False
    specular: bool = False
    emission: bool = False
    orthographic: bool = False
    textured: bool = False
    vertex_color: bool = False
    cutout: bool = False
    double_sided: bool = False
    vertex_alpha: bool = False
    emission_textured: bool = False
    second_texcoords: bool = False
    particle_shadow: bool = False
    metallic: bool = False
    unlit: bool = False
    metallic_map: MapCoordinates = 0
    normal_map: MapCoordinates = 0
    occlusion_map: MapCoordinates = 0
    modulate_map: MapCoordinates = 0
    pyrender: bool = False
    panda3d: bool = False
    scaled: bool = False
    local_viewer: bool = False
    tint: bool = False
    gloss: bool = False


class ForwardPass(Pass):
    """Draw the batches once for all lights that shine and fade alike; one draw where all do.

    A second kind of light, or more lights than a shader's loop takes, are added by a second draw, which the
    first one's depth spares what is hidden. Where two surfaces have the same depth, both get it.
    """

    name = "forward"
    vertex = "geometry"
    colors = "coverage", "radiance", "tint", "gloss"

    def __init__(self) -> None:
        self._ready: list[tuple[LightSet | None, ForwardVariant, list[Drawable]]] = []

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if surfaces are to be shaded as they are drawn."""
        if not needs.drawn or not needs.forward:
            return None
        reads = {}
        if needs.lit and needs.shadow_maps:
            reads["shadow_atlas"] = needs.shadows()
        if needs.lit and needs.particle_shadowed:
            reads["particle_shadow_atlas"] = [needs.particle_shadow_reason]
        lights = ", ".join(needs.all_lights()) or "no light"
        return Declaration(
            f"{needs.geometry} geometry instances in view, {lights}",
            reads=reads,
            writes=["depth", "coverage", "tint", "gloss"],
            fills=["radiance"],
            keeps={"depth": ["geometry hides what is behind it"]},
        )

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant; a set's lights and a draw's surfaces fill in the rest."""
        settings = needs.settings
        return ForwardVariant(
            range_falloff=settings.range_falloff,
            specular_model=needs.specular_model if needs.highlights else "none",
            clamp_light=settings.clamp_light,
            shadow_taps=settings.shadow_taps if needs.shadowed else 0,  # type: ignore[arg-type]
            ambient_albedo=needs.own_ambient_lit,
            specular=needs.highlights,
            emission=needs.emits,
            orthographic=needs.orthographic,
            particle_shadow=needs.particle_shadowed_kind is not None and needs.particle_shadowed,
            pyrender=needs.pyrender,
            panda3d=needs.panda3d,
            tint="tint" in targets,
            gloss="gloss" in targets,
        )

    def legal_variants(self) -> Products:
        """Return every combination of lights and surfaces."""
        return Products(
            *(
                Product(
                    ForwardVariant,
                    _legal_lights(emission),
                    choices(orthographic=BOTH),
                    [{}, {"pyrender": True}, *_legal_panda3d()],
                    *legal_surfaces(emission),
                )
                for emission in BOTH
            )
        )

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Bring meshes, instances and textures up to date, and keep them for `draw`."""
        assert isinstance(step.variant, ForwardVariant)
        self._ready.clear()
        gpu.uploads.prepare(plan.batches)
        for index, lights in enumerate(LightSet.joined_for_loops(plan.lights) or [None]):
            frame = _variant_for(step.variant, lights, first=index == 0)
            ready = []
            for batch in plan.batches:
                shows = frame.emission, lights is not None, frame.ambient_albedo, lights is not None
                fields = surface_fields(
                    batch.surface, *shows, plan.settings.look, frame.pyrender, frame.specular
                )
                variant = replace(frame, **fields)
                program = self.program(gpu, variant, images)
                ready.append(make_drawable(gpu, plan, batch, program))
            self._ready.append((lights, frame, ready))

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        framebuffer = images.draw_into()
        ready, self._ready = self._ready, []
        for index, (lights, variant, surfaces) in enumerate(ready):
            uniforms: dict[str, object] = {}
            textures = shadow_textures(gpu, plan, images, variant.shadow_taps, variant.particle_shadow)
            if lights is not None:
                textures["u_lights"] = light_table(gpu, plan, lights, variant, f"{self.name} {index}")
                uniforms["u_light_count"] = len(lights)
                gpu.lights_drawn += len(lights)
            flags = gpu.ctx.DEPTH_TEST | (gpu.ctx.NOTHING if variant.first else gpu.ctx.BLEND)
            framebuffer.depth_mask = variant.first
            for drawable in surfaces:
                draw_surface(gpu, drawable, flags, uniforms, textures)


def _legal_panda3d() -> Iterator[dict[str, Any]]:
    """Yield what the look "panda3d" adds; highlights have a target of their own only beside a tint."""
    for scaled, viewer in product(BOTH, repeat=2):
        for tint, gloss in ((False, False), (True, False), (True, True)):
            shown = {"scaled": scaled, "local_viewer": viewer, "tint": tint, "gloss": gloss}
            yield {"panda3d": True} | shown


def _legal_lights(emission: bool) -> Iterator[dict[str, Any]]:
    """Yield the fields of every light, in a frame that writes emission or not."""
    # without a light there is nothing but these
    yield from choices(light_kind=["none"], ambient_albedo=BOTH, emission=[emission])
    for kind, falloff, end in FADES:
        for chosen in choices(
            light_kind=[kind],
            falloff=[falloff],
            range_falloff=[end],
            specular_model=get_args(SpecularModel),
            clamp_light=BOTH,
            shadow_taps=get_args(ShadowTaps),
            particle_shadow=BOTH if kind != "point" else (False,),
            first=BOTH,
            ambient_albedo=BOTH,
            emission=[emission],
        ):
            # a draw that is not the first brings neither
            if chosen["first"] or not (chosen["ambient_albedo"] or emission):
                yield chosen | {"specular": chosen["specular_model"] != "none"}


def _variant_for(frame: ForwardVariant, lights: LightSet | None, first: bool) -> ForwardVariant:
    """Return the frame's variant for one set of lights."""
    if lights is None:
        return ForwardVariant(
            "none",
            ambient_albedo=frame.ambient_albedo,
            emission=frame.emission,
            orthographic=frame.orthographic,
            pyrender=frame.pyrender,
            panda3d=frame.panda3d,
            tint=frame.tint,
            gloss=frame.gloss,
        )
    return shining(
        frame,
        lights,
        light_kind=lights.kind,
        first=first,
        ambient_albedo=frame.ambient_albedo and first,
        emission=frame.emission and first,
    )
