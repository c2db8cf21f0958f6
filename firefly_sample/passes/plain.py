"""Plain pass: what shines by itself and is not lit, here soft dots, behind and before geometry."""

from __future__ import annotations

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.gpu.light_rows import dot_rows
from firefly_sample.passes.base import SQUARE, Pass
from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class PlainPass(Pass):
    """One instanced draw of squares, added to the radiance, tested against the depth of the geometry."""

    name = "plain"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        images.draw_into()
        tested = "depth" in step.updates
        gpu.ctx.enable_only(moderngl.BLEND | (moderngl.DEPTH_TEST if tested else moderngl.NOTHING))
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        gpu.ctx.depth_func = ">=" if plan.view.reverse else "<="
        dots = plan.sprites
        program = gpu.programs.get(self.name, step.variant, images.color_names())
        program.use()
        corners = gpu.fixed("square", SQUARE)
        rows = gpu.stream("plain dots", dot_rows(dots, plan.view))
        array = gpu.array(
            self.name,
            program,
            (corners, "2f", "in_corner"),
            (rows, "4f 4f 2f 3f/i", "in_dot", "in_pixel", "in_per_radius", "in_color"),
        )
        gpu.render(array, moderngl.TRIANGLE_STRIP, vertices=4, instances=len(dots))
        gpu.ctx.depth_func = "<"
