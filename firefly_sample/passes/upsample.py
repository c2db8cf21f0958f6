"""Upsample pass: light of every second pixel spread to all, along surfaces."""

from __future__ import annotations

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass, draw_fullscreen
from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class UpsamplePass(Pass):
    """Adds to what ambient light left."""

    name = "upsample"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        draw_fullscreen(gpu, step, images, moderngl.BLEND)
