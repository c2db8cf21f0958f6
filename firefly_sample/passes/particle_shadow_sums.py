"""Particle shadow sums pass: each slice is added to the next, so that each has what all up to it take."""

from __future__ import annotations

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass
from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class ParticleShadowSumsPass(Pass):
    """A copy and a draw for each slice: in OpenGL 3.3 what is drawn into must not be sampled."""

    name = "particle_shadow_sums"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert plan.particle_shadow is not None
        atlas, sums = images.framebuffer_of("particle_shadow_atlas"), images.own("particle_shadow_sum")
        tile, across = plan.particle_shadow.view.tile, plan.particle_shadow.grid[0]
        program = gpu.programs.get(self.name, step.variant, ("particle_shadow_atlas",), vertex="fullscreen")
        array = gpu.array("fullscreen", program)
        atlas.use()
        gpu.ctx.enable_only(moderngl.BLEND)
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        for index in range(1, plan.particle_shadow.view.slices):
            before, corner = (
                (tile * (which % across), tile * (which // across)) for which in (index - 1, index)
            )
            gpu.device.raw.copy_texels(atlas.glo, sums.glo, before, (tile, tile))
            atlas.viewport = (*corner, tile, tile)
            program.use({"u_corner": corner}, {"u_particle_shadow_sum": sums})
            gpu.render(array, moderngl.TRIANGLES, vertices=3)
