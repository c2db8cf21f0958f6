"""Copies of the depth buffer: one to sample while the original is tested, one of half the resolution."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firefly_sample.gpu.drawing import draw_fullscreen
from firefly_sample.passes.base import FullscreenPass, Pass
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.variants import Variant

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages

_REASON = ["geometry hides what is behind it"]


class DepthCopyPass(Pass):
    """Copy the depth buffer: in OpenGL 3.3 one that is tested against must not be sampled."""

    name = "depth_copy"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if lighting passes both sample and test depth."""
        if not needs.drawn or needs.tested_source != "depth_copy":
            return None
        because = f"position={needs.settings.position}: a depth buffer cannot be tested and sampled at once"
        return Declaration(because, reads={"depth": _REASON}, writes=["depth_copy"])

    def shader_stems(self, variant: Variant) -> list[tuple[str, str]]:
        """Return nothing: it has no shader."""
        return []

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        source, copy = images.framebuffer_of("depth"), images.framebuffer_of("depth_copy")
        gpu.device.raw.copy_depth(source.glo, copy.glo, plan.view.size)


class HalfDepthPass(FullscreenPass):
    """Take the depth of every second pixel, not a mean, which would be the depth of no surface."""

    name = "half_depth"
    colors = ()

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if light volumes are drawn at half the resolution."""
        if not (needs.half and needs.tests_volumes and set(needs.lights) != {"directional"}):
            return None
        because = "light_resolution=half: the depth of every second pixel, to test volumes against"
        keeps = {"half_depth": ["light_resolution=half tests volumes at its own"]}
        return Declaration(because, reads={"depth": _REASON}, writes=["half_depth"], keeps=keeps)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        gpu.ctx.depth_func = "1"  # always: without the test, nothing is written either
        draw_fullscreen(gpu, step, images, gpu.ctx.DEPTH_TEST)
