"""Sprites pass: soft dots that shine by themselves and are not lit, hidden by the geometry before them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from firefly_sample.passes.base import Pass
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import Variant

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.plan.frame_plan import FramePlan, PassPlan


@dataclass(frozen=True)
class SpriteVariant(Variant):
    """Sprites, seen through a lens of one kind or the other."""

    orthographic: bool = False


class SpritesPass(Pass):
    """Draw squares, instanced, that are added to the radiance."""

    name = "sprites"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if sprites are in view, and no particles, which are drawn with them."""
        if not needs.draws_sprites:
            return None
        return Declaration(f"{needs.sprites} sprites in view", fills=["radiance"], tests=["depth"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
        return SpriteVariant(needs.orthographic)

    def legal_variants(self) -> Iterable[Variant]:
        """Return both."""
        return [SpriteVariant(False), SpriteVariant(True)]

    def outputs(self, variant: Variant) -> tuple[str, ...]:
        """Return the radiance."""
        return ("radiance",)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        import moderngl

        from firefly_sample.gpu.drawing import SQUARE
        from firefly_sample.gpu.light_rows import dot_rows

        images.draw_into()
        tested = "depth" in step.updates
        gpu.ctx.enable_only(moderngl.BLEND | (moderngl.DEPTH_TEST if tested else moderngl.NOTHING))
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        gpu.ctx.depth_func = ">=" if plan.view.reverse else "<="
        program = gpu.programs.get(self.name, step.variant, images.color_names())
        program.use()
        rows = gpu.stream(self.name, dot_rows(plan.sprites, plan.view))
        array = gpu.array(
            self.name,
            program,
            (gpu.fixed("square", SQUARE), "2f", "in_corner"),
            (rows, "4f 4f 2f 3f/i", "in_dot", "in_pixel", "in_per_radius", "in_color"),
        )
        gpu.render(array, moderngl.TRIANGLE_STRIP, vertices=4, instances=len(plan.sprites))
        gpu.ctx.depth_func = "<"
