"""Particle shadow texture pass: the slices of shadow, drawn into the picture's lower left corner."""

from __future__ import annotations

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass, textures_of
from firefly_sample.plan.frame_plan import FramePlan, PassPlan

SHARE = 0.4
"""Of the picture's shorter side."""


class ParticleShadowTexturePass(Pass):
    """Draws over what is there, in the shape of the texture."""

    name = "particle_shadow_texture"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert plan.particle_shadow is not None
        framebuffer = images.draw_into()
        width, height = plan.particle_shadow.size
        scale = SHARE * min(plan.size) / max(width, height)
        size = max(1, round(scale * width)), max(1, round(scale * height))
        framebuffer.viewport = (0, 0, *size)
        gpu.ctx.enable_only(moderngl.NOTHING)
        program = gpu.programs.get(self.name, step.variant, images.color_names(), vertex="fullscreen")
        program.use({"u_corner_size": size}, textures_of(images, step.reads))
        gpu.render(gpu.array("fullscreen", program), moderngl.TRIANGLES, vertices=3)
