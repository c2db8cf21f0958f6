"""Depth copy: what the light pass samples while it tests against the original."""

from __future__ import annotations

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass
from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class DepthCopyPass(Pass):
    """Copies the depth buffer: in OpenGL 3.3 one that is tested must not be sampled."""

    name = "depth_copy"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        source, copy = images.framebuffer_of("depth"), images.framebuffer_of("depth_copy")
        gpu.device.raw.copy_depth(source.glo, copy.glo, plan.view.size)
