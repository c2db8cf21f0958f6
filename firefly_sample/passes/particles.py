"""Particles pass: particles, and soft dots among them, one over the other from back to front."""

from __future__ import annotations

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.gpu.particle_rows import particle_rows
from firefly_sample.passes.base import SQUARE, Pass, textures_of
from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class ParticlesPass(Pass):
    """One instanced draw of squares in the plan's order, into a layer that resolve puts over all else."""

    name = "particles"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        images.draw_into()
        gpu.ctx.enable_only(moderngl.BLEND)
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        program = gpu.programs.get(self.name, step.variant, images.color_names())
        program.use(None, textures_of(images, step.reads))
        rows = gpu.stream(self.name, particle_rows(plan.particles, plan.sprites, plan.view))
        array = gpu.array(
            self.name,
            program,
            (gpu.fixed("square", SQUARE), "2f", "in_corner"),
            (
                rows,
                "4f 4f 2f 3f 3f/i",
                *("in_dot", "in_pixel", "in_per_radius", "in_color", "in_particle"),
            ),
        )
        gpu.render(array, moderngl.TRIANGLE_STRIP, vertices=4, instances=len(plan.particles.order))
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
