"""A pass from outside the package: this module, and shaders/vignette.frag beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from firefly_sample.passes.base import FullscreenPass
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.variants import Variant


@dataclass(frozen=True)
class VignetteVariant(Variant):
    """How dark the corners become: 2 is black."""

    strength: int = 1
    supersample: int = 1


class Vignette(FullscreenPass):
    """Darken the picture towards its corners."""

    name = "vignette"
    shaders = Path(__file__).parent / "shaders"

    def declare(self, needs):
        if "color" not in needs.outputs:
            return None
        return Declaration("the picture is darkened towards its corners", updates=["color"])

    def variant(self, needs, targets):
        return VignetteVariant(supersample=needs.settings.supersample)

    def outputs(self, variant):
        return ("color",)

    def draw(self, gpu, plan, step, images):
        import moderngl

        from firefly_sample.gpu.drawing import draw_fullscreen

        gpu.ctx.blend_func = moderngl.ZERO, moderngl.SRC_COLOR
        draw_fullscreen(gpu, step, images, moderngl.BLEND, folder=self.shaders)
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
