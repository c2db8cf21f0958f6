"""Overdraw, volumes and wireframe: the lights' proxies themselves, to look at."""

from __future__ import annotations

from dataclasses import replace

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass, textures_of
from firefly_sample.passes.lights import draw_clustered, draw_volumes, method_for
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.lights.light_set import PASS_OF_KIND
from firefly_sample.plan.variants import DrawMethod, LightViewVariant


class _LightViewPass(Pass):
    """Draws all proxies as the passes of light do, with another shader."""

    lines = False

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert isinstance(step.variant, LightViewVariant)
        images.draw_into()
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        by_cells = step.variant.method == "clustered"
        if by_cells:
            gpu.ctx.enable_only(moderngl.BLEND)
            textures = textures_of(images, step.reads)
            program = gpu.programs.get("light_views", step.variant, images.color_names(), "fullscreen")
            for index, clusters in enumerate(plan.clusters):
                draw_clustered(gpu, plan, program, textures, clusters, f"light view {index}")
        chosen: DrawMethod = "sphere" if plan.culling.method in ("volumes", "clustered") else "fullscreen"
        for index, lights in enumerate(plan.lights):
            if by_cells and lights.kind != "directional":
                continue
            variant = replace(step.variant, method=method_for(chosen, lights), position="distance")
            vertex = PASS_OF_KIND[lights.kind]
            program = gpu.programs.get("light_views", variant, images.color_names(), vertex)
            program.use()
            draw_volumes(
                gpu,
                plan,
                program,
                lights,
                variant,
                f"light view {index}",
                "depth" in step.updates,
                self.lines,
            )


class OverdrawPass(_LightViewPass):
    """Counts how often each pixel is shaded."""

    name = "overdraw"


class VolumesPass(_LightViewPass):
    """Adds a faint flat colour for each light that shades a pixel."""

    name = "volumes"


class WireframePass(_LightViewPass):
    """Draws the edges of the volumes that can be seen."""

    name = "wireframe"
    lines = True
