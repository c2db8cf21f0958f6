"""Point-light pass: each light shades the pixels that it can reach, and blends them together."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import moderngl
import numpy as np

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.gpu.proxies import circumscribed_icosphere
from firefly_sample.gpu.rows import TEXELS_PER_LIGHT, light_rows, light_texels
from firefly_sample.passes.base import Pass
from firefly_sample.plan.frame_plan import FramePlan, LightSet, PassPlan
from firefly_sample.plan.variants import PointLightsVariant

__all__ = ["PointLightsPass"]

_TEXTURE_WIDTH = 682 * TEXELS_PER_LIGHT  # so that a light never wraps into the next row


class PointLightsPass(Pass):
    """Spheres with back faces, depth test greater-equal and depth clamp; or full-screen, to compare."""

    name = "point_lights"

    def __init__(self) -> None:
        self._sphere = circumscribed_icosphere(1).reshape(-1, 3).astype(np.float32)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        images.draw_into()
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        assert isinstance(step.variant, PointLightsVariant)
        for index, lights in enumerate(plan.lights):
            if step.variant.method == "loop":
                self._loop(gpu, step, images, lights)
            elif step.variant.method == "fullscreen" or lights.fullscreen:
                self._instanced(gpu, plan, step, images, lights, f"{self.name} {index}", fullscreen=True)
            else:
                self._instanced(gpu, plan, step, images, lights, f"{self.name} {index}", fullscreen=False)

    def _instanced(
        self,
        gpu: Gpu,
        plan: FramePlan,
        step: PassPlan,
        images: BoundImages,
        lights: LightSet,
        key: str,
        fullscreen: bool,
    ) -> None:
        """One draw for all lights: a sphere each, or a full-screen triangle each."""
        assert isinstance(step.variant, PointLightsVariant)
        method: Literal["fullscreen", "volumes"] = "fullscreen" if fullscreen else "volumes"
        variant = replace(step.variant, method=method, falloff=lights.falloff.value)
        program = gpu.programs.get(self.name, variant, images.color_names())
        program.use(None, {f"u_{name}": images.read(name) for name in step.reads})
        rows = gpu.stream(key, light_rows(lights.positions, lights.radii, lights.colors))
        content = [(rows, "4f 3f 3f/i", "in_light", "in_color", "in_rest")]
        if fullscreen:
            gpu.ctx.enable_only(moderngl.BLEND)
            array = gpu.array(key, program, *content)
            array.render(moderngl.TRIANGLES, vertices=3, instances=len(lights))
            gpu.lights_drawn += len(lights)
            return
        tested = "depth" in step.updates
        sphere = gpu.fixed("unit sphere", self._sphere)
        # back faces, so that the camera may stand inside; clamped, so that no plane cuts a volume open
        gpu.ctx.enable_only(
            moderngl.BLEND | moderngl.CULL_FACE | (moderngl.DEPTH_TEST if tested else moderngl.NOTHING)
        )
        gpu.ctx.cull_face = "front"
        gpu.ctx.depth_func = "<=" if plan.view.reverse else ">="
        gpu.device.set_depth_clamp(True)
        array = gpu.array(key, program, (sphere, "3f", "in_position"), *content)
        array.render(moderngl.TRIANGLES, vertices=len(self._sphere), instances=len(lights))
        gpu.lights_drawn += len(lights)
        gpu.device.set_depth_clamp(False)
        gpu.ctx.cull_face = "back"
        gpu.ctx.depth_func = "<"

    def _loop(self, gpu: Gpu, step: PassPlan, images: BoundImages, lights: LightSet) -> None:
        """One full-screen triangle whose shader walks all lights, read from a texture."""
        assert isinstance(step.variant, PointLightsVariant)
        variant = replace(step.variant, falloff=lights.falloff.value)
        program = gpu.programs.get(self.name, variant, images.color_names())
        texels = light_texels(lights.positions, lights.radii, lights.colors, _TEXTURE_WIDTH)
        height, width = texels.shape[:2]
        texture = gpu.ctx.texture((width, height), 4, texels.tobytes(), dtype="f4")
        texture.filter = moderngl.NEAREST, moderngl.NEAREST
        textures = {f"u_{name}": images.read(name) for name in step.reads} | {"u_lights": texture}
        program.use({"u_light_count": len(lights)}, textures)
        gpu.ctx.enable_only(moderngl.BLEND)
        gpu.array(self.name, program).render(moderngl.TRIANGLES, vertices=3)
        texture.release()
        gpu.lights_drawn += len(lights)
