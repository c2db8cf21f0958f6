"""Particles pass: particles, and sprites among them, one over the other from back to front."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, get_args

from firefly_sample.passes.base import Pass
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import PositionSource, Variant

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.plan.frame_plan import FramePlan, PassPlan

_SOFT = ["particles end softly where surfaces are"]


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


class ParticlesPass(Pass):
    """Draw squares in the plan's order, instanced, into a layer that resolve puts over all else."""

    name = "particles"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if particles are in view."""
        if not needs.draws_particles:
            return None
        reads = {"particle_light": [needs.particles_in_view]}
        if needs.drawn:
            source = "depth" if needs.forward else needs.position_target_name
            reads[source] = _SOFT
            if source != "depth" and needs.orthographic:
                reads["albedo"] = _SOFT
        return Declaration(needs.particles_in_view, reads=reads, writes=["particles"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
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
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield every combination."""
        both = (False, True)
        for flat in both:
            yield ParticleVariant(False, orthographic=flat)
            for method in get_args(PositionSource):
                for reverse in both if method == "depth" else (False,):
                    for packed in both if flat and method in ("distance", "stored") else (False,):
                        yield ParticleVariant(True, method, flat, reverse, packed)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        import moderngl

        from firefly_sample.gpu.drawing import SQUARE, textures_of
        from firefly_sample.gpu.particle_rows import particle_rows

        images.draw_into()
        gpu.ctx.enable_only(moderngl.BLEND)
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        program = gpu.programs.get(self.name, step.variant, images.color_names())
        program.use(None, textures_of(images, step.reads))
        rows = gpu.stream(self.name, particle_rows(plan.particles, plan.sprites, plan.view))
        names = "in_dot", "in_pixel", "in_per_radius", "in_color", "in_particle"
        array = gpu.array(
            self.name,
            program,
            (gpu.fixed("square", SQUARE), "2f", "in_corner"),
            (rows, "4f 4f 2f 3f 3f/i", *names),
        )
        gpu.render(array, moderngl.TRIANGLE_STRIP, vertices=4, instances=len(plan.particles.order))
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
