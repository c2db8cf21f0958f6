"""Particles: lit once each, and drawn from back to front; sprites: soft dots that are not lit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, get_args

from firefly_sample.gpu.drawing import light_table, shadow_textures
from firefly_sample.gpu.instance_rows import (
    DOT_DTYPE,
    PARTICLE_DTYPE,
    dot_rows,
    particle_records,
    particle_rows,
)
from firefly_sample.passes.base import BOTH, Pass, combinations
from firefly_sample.passes.lights import FADES, shining
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import (
    FalloffChoice,
    LightKind,
    PositionSource,
    RangeFalloff,
    ShadowTaps,
    Transparency,
    Variant,
)

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages


@dataclass(frozen=True)
class ParticleLightVariant(Variant):
    """All lights of one kind on all particles.

    `first` is the draw that adds ambient light. `attenuated` is for the light whose attenuation with distance
    is stored with each particle.
    """

    light_kind: LightKind = "point"
    falloff: FalloffChoice = "ramp_squared"
    range_falloff: RangeFalloff = "karis"
    shadow_taps: ShadowTaps = 0
    particle_shadow: bool = False
    attenuated: bool = False
    first: bool = True
    orthographic: bool = False


class ParticleLightPass(Pass):
    """Draw a full-screen triangle over the particles' texels for all lights that shine and fade alike."""

    name = "particle_light"
    vertex = "fullscreen"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if particles are in view."""
        if not needs.draws_particles:
            return None
        reads = {"shadow_atlas": needs.shadows()} if needs.shadow_maps else {}
        if needs.particle_shadowed:
            reads["particle_shadow_atlas"] = [needs.particle_shadow_reason]
        return Declaration(needs.particles_in_view, reads=reads, writes=["particle_light"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant; each set of lights fills in the rest."""
        settings = needs.settings
        return ParticleLightVariant(
            range_falloff=settings.range_falloff,
            shadow_taps=settings.shadow_taps if needs.shadow_maps else 0,  # type: ignore[arg-type]
            particle_shadow=needs.particle_shadowed,
            orthographic=needs.orthographic,
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield every combination; no point light has particle shadows."""
        for flat in BOTH:
            yield ParticleLightVariant("none", orthographic=flat)
            for fade, taps, first in product(FADES, get_args(ShadowTaps), BOTH):
                for by_particles, attenuated in (
                    product(BOTH, repeat=2) if fade[0] != "point" else [(False, False)]
                ):
                    yield ParticleLightVariant(*fade, taps, by_particles, attenuated, first, flat)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert isinstance(step.variant, ParticleLightVariant)
        framebuffer = images.draw_into()
        gpu.ctx.enable_only(gpu.ctx.BLEND)
        records = particle_records(plan.particles, plan.particle_shadow)
        framebuffer.viewport = (0, 0, framebuffer.size[0], len(records))  # what particles fill
        table = gpu.streams.texture(self.name, records)
        for index, lights in enumerate(LightSet.joined_for_loops(plan.lights) or [None]):
            variant = _variant_for(step.variant, plan, lights, first=index == 0)
            program = self.program(gpu, variant, images)
            uniforms = {}
            textures = shadow_textures(gpu, plan, images, variant.shadow_taps, variant.particle_shadow)
            textures["u_particles"] = table
            if lights is not None:
                textures["u_lights"] = light_table(gpu, plan, lights, variant, f"{self.name} {index}")
                uniforms["u_light_count"] = len(lights)
            program.use(uniforms, textures)
            gpu.draw_screen(program)


def _variant_for(
    frame: ParticleLightVariant, plan: FramePlan, lights: LightSet | None, first: bool
) -> ParticleLightVariant:
    """Return the frame's variant for one set of lights."""
    if lights is None:
        return ParticleLightVariant("none", orthographic=frame.orthographic)
    attenuated = lights.particle_shadowed and bool((plan.particles.attenuations != 1.0).any())
    return shining(frame, lights, light_kind=lights.kind, attenuated=attenuated, first=first)


@dataclass(frozen=True)
class ParticleVariant(Variant):
    """Particles and the sprites among them; `surfaces` says whether there are any to end at softly.

    `reverse` is for positions from a depth buffer, which is 0 where nothing is, else 1. `packed` is for an
    orthographic lens, whose distance cannot mark where nothing is: the albedo does, and is whole numbers.
    """

    surfaces: bool = True
    position_source: PositionSource = "distance"
    orthographic: bool = False
    reverse: bool = False
    packed: bool = False
    transparency: Transparency = "none"


def particle_reads(needs: Needs) -> dict[str, list[str]]:
    """Return the targets in which particles find surfaces."""
    if not needs.drawn:
        return {}
    source = needs.particle_source
    reads = {source: ["particles end softly where surfaces are"]}
    if source not in ("depth", "depth_copy") and needs.orthographic:
        reads["albedo"] = reads[source]
    return reads


def particle_variant(needs: Needs, targets: Mapping[str, Target]) -> ParticleVariant:
    """Return the variant of a frame's particles."""
    method: PositionSource = "distance"
    if needs.drawn:
        method = "depth" if needs.forward else needs.position_source
    marked = needs.drawn and needs.orthographic and method in ("distance", "stored")
    return ParticleVariant(
        surfaces=needs.drawn,
        position_source=method,
        orthographic=needs.orthographic,
        reverse=needs.reverse and method == "depth",
        packed=marked and targets["albedo"].encoding == "sqrt10",
        transparency=needs.transparency,
    )


class ParticlesPass(Pass):
    """Draw squares in the plan's order, instanced, into a layer that resolve puts over all else."""

    name = "particles"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if particles are in view."""
        if not needs.draws_particles or needs.blends:
            return None
        reads = {"particle_light": [needs.particles_in_view], **particle_reads(needs)}
        return Declaration(needs.particles_in_view, reads=reads, writes=["particles"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
        return particle_variant(needs, targets)

    def legal_variants(self) -> Iterator[Variant]:
        """Yield the variants whose surfaces are found by a position, and marked where the distance cannot."""
        for made in combinations(ParticleVariant):
            unmarked = not made.orthographic or made.position_source not in ("distance", "stored")
            plain = made.position_source == "distance" and not made.packed
            if (
                (made.surfaces or plain)
                and (made.position_source == "depth" or not made.reverse)
                and not (made.packed and unmarked)
            ):
                yield made

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        images.draw_into()
        ctx = gpu.ctx
        ctx.enable_only(ctx.BLEND)
        ctx.blend_func = ctx.ONE, ctx.ONE_MINUS_SRC_ALPHA
        program = self.program(gpu, step.variant, images)
        program.use(None, images.samplers())
        rows = particle_rows(plan.particles, plan.sprites, plan.view)
        gpu.draw_squares(program, rows, PARTICLE_DTYPE)


@dataclass(frozen=True)
class SpriteVariant(Variant):
    """Sprites, seen through a lens of one kind or the other."""

    orthographic: bool = False


class SpritesPass(Pass):
    """Draw squares, instanced, that are added to the radiance."""

    name = "sprites"
    colors = ("radiance",)

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if sprites are in view, and no particles, which are drawn with them."""
        if not needs.draws_sprites:
            return None
        return Declaration(f"{needs.sprites} sprites in view", fills=["radiance"], tests=["depth"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
        return SpriteVariant(needs.orthographic)

    def legal_variants(self) -> Iterator[Variant]:
        """Yield both."""
        return combinations(SpriteVariant)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        images.draw_into()
        tested = "depth" in step.updates
        gpu.ctx.enable_only(gpu.ctx.BLEND | (gpu.ctx.DEPTH_TEST if tested else gpu.ctx.NOTHING))
        program = self.program(gpu, step.variant, images)
        program.use()
        gpu.draw_squares(program, dot_rows(plan.sprites, plan.view), DOT_DTYPE)
