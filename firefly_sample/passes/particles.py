"""Particles and sprites: layers of haze, and soft dots that are hidden by surfaces and not lit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, get_args

from firefly_sample.gpu.instance_rows import dot_rows, particle_rows
from firefly_sample.passes.base import BOTH, Pass
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import PositionMethod, Variant

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages

_SOFT = ["particles end softly where surfaces are"]


@dataclass(frozen=True)
class ParticleVariant(Variant):
    """Particles and the sprites among them; `surfaces` says whether there are any to end at softly.

    `reverse` is for positions from a depth buffer, which is 0 where nothing is, else 1. `packed` is for an
    orthographic lens, whose distance cannot mark where nothing is: the albedo does, and is whole numbers.
    """

    surfaces: bool = True
    position_method: PositionMethod = "distance"
    orthographic: bool = False
    reverse: bool = False
    packed: bool = False


class ParticlesPass(Pass):
    """Draw squares in the plan's order, instanced, into a layer that resolve puts over all else."""

    name = "particles"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if particles are in view."""
        if not needs.hazy:
            return None
        reads = {"particle_light": [needs.particles_in_view]}
        if needs.drawn:
            source = "depth" if needs.forward else needs.position_source
            reads[source] = _SOFT
            if source != "depth" and needs.orthographic:
                reads["albedo"] = _SOFT
        return Declaration(needs.particles_in_view, reads=reads, writes=["particles"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
        method: PositionMethod = "distance"
        if needs.drawn:
            method = "depth" if needs.forward else needs.position_method
        marked = needs.drawn and needs.orthographic and method in ("distance", "stored")
        return ParticleVariant(
            surfaces=needs.drawn,
            position_method=method,
            orthographic=needs.orthographic,
            reverse=needs.reverse and method == "depth",
            packed=marked and targets["albedo"].encoding == "sqrt10",
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield every combination."""
        for flat in BOTH:
            yield ParticleVariant(False, orthographic=flat)
            for method in get_args(PositionMethod):
                for reverse in BOTH if method == "depth" else (False,):
                    for packed in BOTH if flat and method in ("distance", "stored") else (False,):
                        yield ParticleVariant(True, method, flat, reverse, packed)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        images.draw_into()
        ctx = gpu.ctx
        ctx.enable_only(ctx.BLEND)
        ctx.blend_func = ctx.ONE, ctx.ONE_MINUS_SRC_ALPHA
        program = self.program(gpu, step.variant, images)
        program.use(None, images.samplers())
        names = "in_dot", "in_pixel", "in_per_radius", "in_color", "in_particle"
        rows = particle_rows(plan.particles, plan.sprites, plan.view)
        gpu.draw_squares(program, rows, "4f 4f 2f 3f 3f", *names)


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
        if not needs.dotted:
            return None
        return Declaration(f"{needs.sprites} sprites in view", fills=["radiance"], tests=["depth"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
        return SpriteVariant(needs.orthographic)

    def legal_variants(self) -> Iterable[Variant]:
        """Return both."""
        return [SpriteVariant(False), SpriteVariant(True)]

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        images.draw_into()
        tested = "depth" in step.updates
        gpu.ctx.enable_only(gpu.ctx.BLEND | (gpu.ctx.DEPTH_TEST if tested else gpu.ctx.NOTHING))
        program = self.program(gpu, step.variant, images)
        program.use()
        names = "in_dot", "in_pixel", "in_per_radius", "in_color"
        gpu.draw_squares(program, dot_rows(plan.sprites, plan.view), "4f 4f 2f 3f", *names)
