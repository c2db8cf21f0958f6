"""Particle shadows: slices of a cloud along its light are filled, summed up and blurred, and may be shown."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

from firefly_sample.gpu.instance_rows import DISC_DTYPE, splat_rows
from firefly_sample.passes.base import FullscreenPass, Pass
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.needs import Needs

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages

ATLAS, SCRATCH, SUM = "particle_shadow_atlas", "particle_shadow_scratch", "particle_shadow_sum"
SHARE = 0.4
"""Of the picture's shorter side: how large the picture of the slices is."""


class ParticleShadowSlicesPass(Pass):
    """Draw each particle as a disc into the slice that it is in: one instanced draw of discs that add up."""

    name = "particle_shadow_slices"
    colors = (ATLAS,)

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if particles cast shadows."""
        if not needs.particle_shadowed:
            return None
        return Declaration(needs.particle_shadow_reason, writes=[ATLAS])

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert plan.particle_shadow is not None
        images.draw_into()
        gpu.ctx.enable_only(gpu.ctx.BLEND)
        program = self.program(gpu, step.variant, images)
        program.use()
        gpu.draw_squares(program, splat_rows(plan.particle_shadow), DISC_DTYPE)


class ParticleShadowSumsPass(Pass):
    """Add each slice to the next: a copy and a draw each, for OpenGL 3.3 cannot sample what it draws into."""

    name = "particle_shadow_sums"
    vertex = "fullscreen"
    colors = (ATLAS,)

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does unless shaders add the slices up themselves."""
        shadow = needs.particle_shadow
        if shadow is None or not needs.particle_shadowed or shadow.method == "loop":
            return None
        because = f"particle_shadows={shadow.method} adds each slice to the next"
        return Declaration(because, writes=[SUM], keeps={SUM: [because]}, updates=[ATLAS])

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert plan.particle_shadow is not None
        atlas, sums = images.framebuffer_of(ATLAS), images.own(SUM)
        shadow, across = plan.particle_shadow.view, plan.particle_shadow.grid[0]
        tile = shadow.tile
        program = gpu.programs.get(self.name, step.variant, self.colors, self.vertex)
        atlas.use()
        gpu.ctx.enable_only(gpu.ctx.BLEND)
        corners = [(tile * (index % across), tile * (index // across)) for index in range(shadow.slices)]
        for before, corner in itertools.pairwise(corners):
            gpu.device.raw.copy_texels(atlas.glo, sums.glo, before, (tile, tile))
            atlas.viewport = (*corner, tile, tile)
            program.use({"u_corner": corner}, {"u_particle_shadow_sum": sums})
            gpu.draw_screen(program)


class ParticleShadowBlurXPass(FullscreenPass):
    """Blur all slices horizontally, into a texture of their own."""

    name = "particle_shadow_blur_x"
    source = ATLAS
    colors = (SCRATCH,)

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if the shadow is blurred."""
        shadow = needs.particle_shadow
        if not needs.particle_shadowed or shadow is None or shadow.blur <= 0.0:
            return None
        blur = f"blur of {shadow.blur:g} texels"
        reason = needs.particle_shadow_reason if self.source == ATLAS else f"a {blur}"
        because = f"a {shadow.kernel} {blur}"
        return Declaration(because, reads={self.source: [reason]}, writes=self.colors)


class ParticleShadowBlurYPass(ParticleShadowBlurXPass):
    """Blur them vertically, back into the atlas."""

    name = "particle_shadow_blur_y"
    source = SCRATCH
    colors = (ATLAS,)


class ParticleShadowTexturePass(Pass):
    """Draw the slices into the picture's lower left corner, in the shape of their texture."""

    name = "particle_shadow_texture"
    vertex = "fullscreen"
    colors = ("color",)

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if a `ParticleShadow` asks for it."""
        if not needs.shows_slices:
            return None
        because = "show_texture: the slices of shadow in the picture's corner"
        return Declaration(because, reads={ATLAS: [needs.particle_shadow_reason]}, updates=["color"])

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert plan.particle_shadow is not None
        framebuffer = images.draw_into()
        width, height = plan.particle_shadow.size
        scale = SHARE * min(plan.size) / max(width, height)
        size = max(1, round(scale * width)), max(1, round(scale * height))
        framebuffer.viewport = (0, 0, *size)
        gpu.ctx.enable_only(gpu.ctx.NOTHING)
        program = self.program(gpu, step.variant, images)
        program.use({"u_corner_size": size}, images.samplers())
        gpu.draw_screen(program)
