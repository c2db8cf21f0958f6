"""Half-depth pass: what volumes are tested against where light is computed for every second pixel."""

from __future__ import annotations

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass, draw_fullscreen
from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class HalfDepthPass(Pass):
    """Takes the depth of every second pixel, not a mean: that of no surface would be of no use."""

    name = "half_depth"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        gpu.ctx.depth_func = "1"
        draw_fullscreen(gpu, step, images, moderngl.DEPTH_TEST)  # without the test, nothing is written either
        gpu.ctx.depth_func = "<"
