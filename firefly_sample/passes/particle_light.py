"""Particle light pass: every particle lit once, at its middle, a texel a particle."""

from __future__ import annotations

from dataclasses import replace

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.gpu.particle_rows import particle_records
from firefly_sample.passes.base import Pass
from firefly_sample.passes.lights import light_table, shadow_textures, shining
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.variants import ParticleLightVariant


class ParticleLightPass(Pass):
    """A full-screen triangle over the particles' texels for all lights that shine and fade alike."""

    name = "particle_light"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert isinstance(step.variant, ParticleLightVariant)
        framebuffer = images.draw_into()
        gpu.ctx.enable_only(moderngl.BLEND)
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        records = particle_records(plan.particles, plan.particle_shadow)
        framebuffer.viewport = (0, 0, framebuffer.size[0], len(records))  # what particles fill
        table = gpu.tables.write(self.name, records)
        for index, lights in enumerate(LightSet.walked_together(plan.lights) or [None]):
            variant = _variant_for(step.variant, plan, lights, first=index == 0)
            program = gpu.programs.get(self.name, variant, images.color_names(), vertex="fullscreen")
            textures, uniforms = shadow_textures(gpu, plan, images, variant) | {"u_particles": table}, {}
            if lights is not None:
                textures["u_lights"] = light_table(gpu, plan, lights, variant, f"{self.name} {index}")
                uniforms["u_light_count"] = len(lights)
            program.use(uniforms, textures)
            gpu.render(gpu.array("fullscreen", program), moderngl.TRIANGLES, vertices=3)


def _variant_for(
    frame: ParticleLightVariant, plan: FramePlan, lights: LightSet | None, first: bool
) -> ParticleLightVariant:
    """The frame's variant with what is a set's own."""
    if lights is None:
        return ParticleLightVariant("none", orthographic=frame.orthographic)
    return replace(
        shining(frame, lights),
        kind=lights.kind,
        faded=lights.particle_shadowed and bool((plan.particles.fades != 1.0).any()),
        first=first,
    )
