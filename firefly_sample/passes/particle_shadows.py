"""Particle shadows: slices of a cloud along its light are filled, summed up and blurred, and may be shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firefly_sample.passes.base import FullscreenPass, Pass
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.variants import Variant

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.plan.frame_plan import FramePlan, PassPlan

ATLAS, SCRATCH, SUM = "particle_shadow_atlas", "particle_shadow_scratch", "particle_shadow_sum"
SHARE = 0.4
"""Of the picture's shorter side: how large the picture of the slices is."""


class ParticleShadowSlicesPass(Pass):
    """Draw each particle as a disc into the slice in which it lies.

    One instanced draw of discs that add up.
    """

    name = "particle_shadow_slices"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if particles cast shadows."""
        if not needs.particle_shadowed:
            return None
        return Declaration(needs.particle_shadow_reason, writes=[ATLAS])

    def outputs(self, variant: Variant) -> tuple[str, ...]:
        """Return the atlas."""
        return (ATLAS,)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        import moderngl

        from firefly_sample.gpu.drawing import SQUARE
        from firefly_sample.gpu.particle_rows import splat_rows

        assert plan.particle_shadow is not None
        images.draw_into()
        gpu.ctx.enable_only(moderngl.BLEND)
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        program = gpu.programs.get(self.name, step.variant, images.color_names())
        program.use()
        rows = gpu.stream(self.name, splat_rows(plan.particle_shadow))
        array = gpu.array(
            self.name,
            program,
            (gpu.fixed("square", SQUARE), "2f", "in_corner"),
            (rows, "4f 3f/i", "in_disc", "in_strength"),
        )
        gpu.render(array, moderngl.TRIANGLE_STRIP, vertices=4, instances=len(plan.particle_shadow))


class ParticleShadowSumsPass(Pass):
    """Add each slice to the next: a copy and a draw each, for OpenGL 3.3 cannot sample what it draws into."""

    name = "particle_shadow_sums"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does unless shaders add the slices up themselves."""
        shadow = needs.particle_shadow
        if not needs.particle_shadowed or shadow is None or shadow.method == "loop":
            return None
        because = f"particle_shadows={shadow.method} adds each slice to the next"
        return Declaration(because, writes=[SUM], keeps={SUM: [because]}, updates=[ATLAS])

    def shader_stems(self, variant: Variant) -> list[tuple[str, str]]:
        """Return its fragment shader and the vertex shader of all full-screen passes."""
        return [(self.name, "fullscreen")]

    def outputs(self, variant: Variant) -> tuple[str, ...]:
        """Return the atlas."""
        return (ATLAS,)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        import moderngl

        assert plan.particle_shadow is not None
        atlas, sums = images.framebuffer_of(ATLAS), images.own(SUM)
        tile, across = plan.particle_shadow.view.tile, plan.particle_shadow.grid[0]
        program = gpu.programs.get(self.name, step.variant, (ATLAS,), "fullscreen")
        array = gpu.array("fullscreen", program)
        atlas.use()
        gpu.ctx.enable_only(moderngl.BLEND)
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        for index in range(1, plan.particle_shadow.view.slices):
            before, corner = (
                (tile * (which % across), tile * (which // across)) for which in (index - 1, index)
            )
            gpu.device.raw.copy_texels(atlas.glo, sums.glo, before, (tile, tile))
            atlas.viewport = (*corner, tile, tile)
            program.use({"u_corner": corner}, {"u_particle_shadow_sum": sums})
            gpu.render(array, moderngl.TRIANGLES, vertices=3)


class ParticleShadowBlurXPass(FullscreenPass):
    """Blur all slices horizontally, into a texture of their own."""

    name = "particle_shadow_blur_x"
    source, result = ATLAS, SCRATCH

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if the shadow is blurred."""
        shadow = needs.particle_shadow
        if not needs.particle_shadowed or shadow is None or shadow.blur <= 0.0:
            return None
        blur = f"blur of {shadow.blur:g} texels"
        reason = needs.particle_shadow_reason if self.source == ATLAS else f"a {blur}"
        because = f"a {shadow.kernel} {blur}"
        return Declaration(because, reads={self.source: [reason]}, writes=[self.result])

    def outputs(self, variant: Variant) -> tuple[str, ...]:
        """Return the texture that it writes."""
        return (self.result,)


class ParticleShadowBlurYPass(ParticleShadowBlurXPass):
    """Blur them vertically, back into the atlas."""

    name = "particle_shadow_blur_y"
    source, result = SCRATCH, ATLAS


class ParticleShadowTexturePass(Pass):
    """Draw the slices into the picture's lower left corner, in the shape of their texture."""

    name = "particle_shadow_texture"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if a `ParticleShadow` asks for it."""
        if not needs.shows_slices:
            return None
        because = "show_texture: the slices of shadow in the picture's corner"
        return Declaration(because, reads={ATLAS: [needs.particle_shadow_reason]}, updates=["color"])

    def shader_stems(self, variant: Variant) -> list[tuple[str, str]]:
        """Return its fragment shader and the vertex shader of all full-screen passes."""
        return [(self.name, "fullscreen")]

    def outputs(self, variant: Variant) -> tuple[str, ...]:
        """Return the picture."""
        return ("color",)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        import moderngl

        from firefly_sample.gpu.drawing import textures_of

        assert plan.particle_shadow is not None
        framebuffer = images.draw_into()
        width, height = plan.particle_shadow.size
        scale = SHARE * min(plan.size) / max(width, height)
        size = max(1, round(scale * width)), max(1, round(scale * height))
        framebuffer.viewport = (0, 0, *size)
        gpu.ctx.enable_only(moderngl.NOTHING)
        program = gpu.programs.get(self.name, step.variant, images.color_names(), "fullscreen")
        program.use({"u_corner_size": size}, textures_of(images, step.reads))
        gpu.render(gpu.array("fullscreen", program), moderngl.TRIANGLES, vertices=3)
