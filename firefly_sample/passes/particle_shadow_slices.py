"""Particle shadow slices pass: what particles take of a light, each in the slice in which it lies."""

from __future__ import annotations

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.gpu.particle_rows import splat_rows
from firefly_sample.passes.base import SQUARE, Pass
from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class ParticleShadowSlicesPass(Pass):
    """One instanced draw of discs that add up."""

    name = "particle_shadow_slices"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert plan.particle_shadow is not None
        images.draw_into()
        gpu.ctx.enable_only(moderngl.BLEND)
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        program = gpu.programs.get(self.name, step.variant, images.color_names())
        program.use()
        rows = gpu.stream(self.name, splat_rows(plan.particle_shadow))
        array = gpu.array(
            self.name,
            program,
            (gpu.fixed("square", SQUARE), "2f", "in_corner"),
            (rows, "4f 3f/i", "in_disc", "in_strength"),
        )
        gpu.render(array, moderngl.TRIANGLE_STRIP, vertices=4, instances=len(plan.particle_shadow))
