"""Geometry pass: every surface once, into the G-buffer."""

from __future__ import annotations

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.gpu.programs import Program
from firefly_sample.passes.base import Pass
from firefly_sample.plan.frame_plan import Batch, FramePlan, PassPlan

__all__ = ["GeometryPass"]


class GeometryPass(Pass):
    """Draws the batches in the plan's order: opaque before cut-out, front to back."""

    name = "geometry"

    def __init__(self) -> None:
        self._ready: list[tuple[Batch, Program, dict[str, moderngl.Texture], moderngl.VertexArray]] = []

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Bring meshes, instances and textures up to date, and keep them for `draw`."""
        self._ready.clear()  # a frame before may have failed half-way
        outputs, stored = images.color_names(), plan.settings.look == "classic"
        for batch in plan.batches:
            program = gpu.programs.get(self.name, batch.variant, outputs)
            textures = {}
            if batch.texture is not None:
                cutoff = batch.alpha_cutoff if batch.variant.cutout else None
                textures["u_texture"] = gpu.uploads.texture(batch.texture, cutoff, stored)
            self._ready.append((batch, program, textures, gpu.uploads.drawable(batch, program)))

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        images.draw_into()
        # less-equal: strict less would drop geometry whose depth rounds to the clear value
        gpu.ctx.depth_func = ">=" if plan.view.reverse else "<="
        ready, self._ready = self._ready, []
        first = 0
        for batch, program, textures, array in ready:
            cull = moderngl.NOTHING if batch.variant.double_sided else moderngl.CULL_FACE
            gpu.ctx.enable_only(moderngl.DEPTH_TEST | cull)
            gpu.ctx.cull_face = "back"
            gpu.ctx.front_face = "cw" if batch.mirrored else "ccw"
            uniforms: dict[str, object] = {}
            if batch.variant.cutout:
                uniforms["u_alpha_cutoff"] = batch.alpha_cutoff
            if batch.variant.visibility:
                uniforms["u_first_instance"] = first
            program.use(uniforms, textures)
            array.render(moderngl.TRIANGLES)
            first += len(batch.ids)
        gpu.ctx.front_face = "ccw"
        gpu.ctx.depth_func = "<"
