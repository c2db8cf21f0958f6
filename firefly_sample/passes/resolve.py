"""Resolve pass: from samples of radiance to the picture."""

from __future__ import annotations

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass, draw_fullscreen
from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class ResolvePass(Pass):
    """Background, average of the samples, exposure, tone curve, sRGB."""

    name = "resolve"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        draw_fullscreen(gpu, step, images)
