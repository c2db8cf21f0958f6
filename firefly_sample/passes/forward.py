"""Forward pass: every fragment is shaded by every light as it is drawn, the baseline of deferred shading."""

from __future__ import annotations

from dataclasses import replace

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass
from firefly_sample.passes.geometry import Drawable, draw_surface, make_drawable
from firefly_sample.passes.lights import light_table, shadow_textures, shining
from firefly_sample.plan.frame_plan import Batch, FramePlan, PassPlan
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.variants import ForwardVariant


class ForwardPass(Pass):
    """Draws the batches once for all lights that shine and fade alike; one draw where all do.

    A second kind of light, or what is more than a shader's loop takes, is added by a second draw, which the
    first one's depth spares what is hidden. Where two surfaces have the same depth, both get it.
    """

    name = "forward"

    def __init__(self) -> None:
        self._ready: list[tuple[LightSet | None, ForwardVariant, list[Drawable]]] = []

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Bring meshes, instances and textures up to date, and keep them for `draw`."""
        assert isinstance(step.variant, ForwardVariant)
        self._ready.clear()
        gpu.uploads.prepare(plan.batches)
        outputs = images.color_names()
        for index, lights in enumerate(LightSet.walked_together(plan.lights) or [None]):
            frame = _variant_for(step.variant, lights, first=index == 0)
            made = []
            for batch in plan.batches:
                program = gpu.programs.get(self.name, _with_surface(frame, batch), outputs, "geometry")
                made.append(make_drawable(gpu, plan, batch, program))
            self._ready.append((lights, frame, made))

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        framebuffer = images.draw_into()
        gpu.ctx.depth_func = ">=" if plan.view.reverse else "<="
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        ready, self._ready = self._ready, []
        for index, (lights, variant, surfaces) in enumerate(ready):
            uniforms: dict[str, object] = {}
            textures = shadow_textures(gpu, plan, images, variant)
            if lights is not None:
                textures["u_lights"] = light_table(gpu, plan, lights, variant, f"{self.name} {index}")
                uniforms["u_light_count"] = len(lights)
                gpu.lights_drawn += len(lights)
            flags = moderngl.DEPTH_TEST | (moderngl.NOTHING if variant.first else moderngl.BLEND)
            framebuffer.depth_mask = variant.first
            for made in surfaces:
                draw_surface(gpu, made, flags, dict(uniforms), textures)
        gpu.ctx.front_face = "ccw"
        gpu.ctx.depth_func = "<"


def _variant_for(frame: ForwardVariant, lights: LightSet | None, first: bool) -> ForwardVariant:
    """The frame's variant with what is a set's own."""
    if lights is None:
        return replace(
            frame,
            kind="none",
            highlights="none",
            clamp_light=False,
            range_falloff="karis",
            falloff="ramp_squared",
            specular=False,
            taps=0,
            particle_shadow=False,
        )
    return replace(
        shining(frame, lights),
        kind=lights.kind,
        first=first,
        ambient=frame.ambient and first,
        emission=frame.emission and first,
    )


def _with_surface(frame: ForwardVariant, batch: Batch) -> ForwardVariant:
    own = batch.variant
    return replace(
        frame,
        textured=own.textured,
        vertex_color=own.vertex_color,
        cutout=own.cutout,
        double_sided=own.double_sided,
        vertex_alpha=own.vertex_alpha,
    )
