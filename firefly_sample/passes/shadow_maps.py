"""Shadow maps: the depth that each light sees, in one atlas; drawn again only where something changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from firefly_sample.gpu.drawing import texture_of
from firefly_sample.passes.base import Pass, combinations
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.shadows.maps import CasterBatch, ShadowMap, Tile
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import MapCoordinates, Variant

if TYPE_CHECKING:
    import moderngl

    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages

SLOPE_BIAS = 1.0
"""Texels: the slope-scaled bias of casters, so that a surface that faces a light does not shadow half of
itself. The shader's own offsets do the rest."""


@dataclass(frozen=True)
class ShadowVariant(Variant):
    """The alphas that cut casters out: those of up to two textures, and of vertex colours."""

    textured: bool = False
    vertex_alpha: bool = False
    modulate_map: MapCoordinates = 0


class ShadowMapsPass(Pass):
    """Draw the maps whose key has changed into their tiles of the atlas; the others stay."""

    name = "shadow_maps"
    colors = ()

    def __init__(self) -> None:
        self._atlas: object = None
        self._held: dict[Tile, bytes] = {}
        self.drawn = 0
        """Maps drawn in the last frame."""

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if there are shadow maps."""
        if not needs.maps:
            return None
        return Declaration("; ".join(needs.shadows()), writes=["shadow_atlas"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return a variant that stands for those of the maps' batches."""
        return ShadowVariant()

    def legal_variants(self) -> Iterator[Variant]:
        """Yield every combination."""
        return combinations(ShadowVariant)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        texture, framebuffer = images.keep_into()
        atlas = (texture, plan.shadows.layout)
        if atlas != self._atlas:
            self._atlas, self._held = atlas, {}
        self.drawn = 0
        for shadow in plan.shadows.maps:
            if shadow.casters is not None and self._held.get(shadow.tile) != shadow.key:
                self._held[shadow.tile] = shadow.key
                self._draw_map(gpu, plan, framebuffer, shadow)
                self.drawn += 1

    def _draw_map(
        self, gpu: Gpu, plan: FramePlan, framebuffer: moderngl.Framebuffer, shadow: ShadowMap
    ) -> None:
        x, y, size = shadow.tile
        reverse = plan.view.reverse
        framebuffer.viewport = (x, y, size, size)
        framebuffer.clear(depth=0.0 if reverse else 1.0, viewport=(x, y, size, size))
        gpu.ctx.enable_only(gpu.ctx.DEPTH_TEST)
        away = -1.0 if reverse else 1.0
        gpu.ctx.polygon_offset = away * SLOPE_BIAS, away
        for batch in shadow.casters or ():
            self._draw_batch(gpu, plan, batch)

    def _draw_batch(self, gpu: Gpu, plan: FramePlan, batch: CasterBatch) -> None:
        second = batch.modulate
        coordinates = 0 if second is None else second.coordinates
        variant = ShadowVariant(batch.texture is not None, batch.vertex_alpha, coordinates)
        uniforms, textures = {}, {}
        if batch.texture is not None:
            textures["u_texture"] = texture_of(gpu, plan, batch.texture, batch.cutoff)
        if second is not None:
            textures["u_modulate_texture"] = texture_of(gpu, plan, second.texture, None)
        if variant != ShadowVariant():
            uniforms["u_alpha_cutoff"] = batch.cutoff
        program = gpu.programs.get(self.name, variant, ())
        program.use(uniforms, textures)
        gpu.render(gpu.uploads.caster_array(batch, program), gpu.ctx.TRIANGLES)
