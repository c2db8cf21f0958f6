"""Shadow maps: the depth of what each light sees, in one atlas; drawn again only where something changed."""

from __future__ import annotations

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.shadows.atlas import Tile
from firefly_sample.plan.shadows.maps import CasterBatch, ShadowMap
from firefly_sample.plan.variants import ShadowVariant

SLOPE_BIAS = 1.0
"""Texels: casters are drawn as much farther away as their slope makes of one texel, so that what faces a
light does not hide half of itself. The shader's own offsets do the rest."""


class ShadowMapsPass(Pass):
    """Keeps what each tile of the atlas holds, by the key of its map."""

    name = "shadow_maps"

    def __init__(self) -> None:
        self._atlas: object = None
        self._held: dict[Tile, bytes] = {}
        self.drawn = 0
        """Maps drawn in the last frame."""

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        texture, framebuffer = images.keep_into()
        atlas = (texture, plan.shadows.layout)
        if atlas != self._atlas:
            self._atlas, self._held = atlas, {}
        self.drawn = 0
        for shadow in plan.shadows.maps:
            if shadow.casters is None:
                continue
            if self._held.get(shadow.tile) != shadow.key:
                self._held[shadow.tile] = shadow.key
                self._draw_map(gpu, plan, framebuffer, shadow)
                self.drawn += 1
        gpu.ctx.polygon_offset = 0.0, 0.0
        gpu.ctx.depth_func = "<"

    def _draw_map(
        self, gpu: Gpu, plan: FramePlan, framebuffer: moderngl.Framebuffer, shadow: ShadowMap
    ) -> None:
        x, y, size = shadow.tile
        reverse = plan.view.reverse
        framebuffer.viewport = (x, y, size, size)
        framebuffer.clear(depth=0.0 if reverse else 1.0, viewport=(x, y, size, size))
        gpu.ctx.enable_only(moderngl.DEPTH_TEST)
        gpu.ctx.depth_func = ">=" if reverse else "<="
        away = -1.0 if reverse else 1.0
        gpu.ctx.polygon_offset = away * SLOPE_BIAS, away
        for batch in shadow.casters or ():
            self._draw_batch(gpu, batch)

    def _draw_batch(self, gpu: Gpu, batch: CasterBatch) -> None:
        variant = ShadowVariant(batch.texture is not None, batch.vertex_alpha)
        uniforms, textures = {}, {}
        if batch.texture is not None:
            textures["u_texture"] = gpu.uploads.texture(batch.texture, batch.cutoff)
        if batch.texture is not None or batch.vertex_alpha:
            uniforms["u_alpha_cutoff"] = batch.cutoff
        program = gpu.programs.get(self.name, variant, ())
        program.use(uniforms, textures)
        gpu.render(gpu.uploads.caster_array(batch, program), moderngl.TRIANGLES)
