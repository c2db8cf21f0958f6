"""Overdraw, volumes and wireframe: pictures of the light volumes themselves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, get_args

from firefly_sample.gpu.drawing import draw_clustered, draw_volumes
from firefly_sample.passes.base import BOTH, Pass
from firefly_sample.passes.lights import method_for
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.lights.light_set import PASS_OF_KIND
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import DrawMethod, LightView, PositionSource, Variant

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages


@dataclass(frozen=True)
class LightViewVariant(Variant):
    """The picture that is drawn in place of light.

    `position_source` is the source of the distance by which a pixel's cell is found.
    """

    light_view: LightView = "overdraw"
    light_method: DrawMethod = "sphere"
    orthographic: bool = False
    position_source: PositionSource = "distance"


class LightViewPass(Pass):
    """Draw all light volumes as the lighting passes do, with a different shader."""

    view: LightView

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if there is geometry and light."""
        if not needs.geometry or not needs.lights:
            return None
        reason = f"output {self.view}"
        because = f"{reason}: {', '.join(needs.all_lights())}"
        if self.view == "overdraw" and needs.counts_cells:
            return Declaration(because, reads={needs.tested_source: [reason]}, writes=[self.view])
        tests = ["depth"] if needs.tests_volumes or self.view == "wireframe" else []
        return Declaration(because, writes=[self.view], tests=tests)

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
        flat = needs.orthographic
        if self.view == "overdraw" and needs.counts_cells:
            return LightViewVariant(self.view, "clustered", flat, needs.position_source)
        return LightViewVariant(self.view, orthographic=flat)

    def legal_variants(self) -> Iterator[Variant]:
        """Yield a variant for each shape of volume, and those that count a cell's lights."""
        for flat in BOTH:
            for method in get_args(DrawMethod)[:3]:
                yield LightViewVariant(self.view, method, flat)
            if self.view == "overdraw":
                for position in get_args(PositionSource):
                    yield LightViewVariant(self.view, "clustered", flat, position)

    def shader_stems(self, variant: Variant) -> list[tuple[str, str]]:
        """Return the fragment shader of all three, and the vertex shaders of the lighting passes."""
        assert isinstance(variant, LightViewVariant)
        kinds = ["spotlights"] if variant.light_method == "cone" else list(PASS_OF_KIND.values())
        vertices = ["fullscreen"] if variant.light_method == "clustered" else kinds
        return [("light_views", vertex) for vertex in vertices]

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert isinstance(step.variant, LightViewVariant)
        images.draw_into()
        by_cells = step.variant.light_method == "clustered"
        if by_cells:
            program = gpu.programs.get("light_views", step.variant, images.color_names(), "fullscreen")
            for index, clusters in enumerate(plan.clusters):
                draw_clustered(gpu, plan, program, images.samplers(), clusters, f"light view {index}")
        chosen: DrawMethod = "sphere" if plan.light_method.name in ("volumes", "clustered") else "fullscreen"
        tested = "depth" in step.updates
        for index, lights in enumerate(plan.lights):
            if by_cells and lights.kind != "directional":
                continue
            method = method_for(chosen, lights)
            variant = replace(step.variant, light_method=method, position_source="distance")
            vertex, key = PASS_OF_KIND[lights.kind], f"light view {index}"
            program = gpu.programs.get("light_views", variant, images.color_names(), vertex)
            program.use()
            lines = self.view == "wireframe"
            draw_volumes(gpu, plan, program, lights, variant, method, key, tested, lines)


class OverdrawPass(LightViewPass):
    """Count how often each pixel is shaded."""

    name = view = "overdraw"


class VolumesPass(LightViewPass):
    """Add a faint flat colour for each light that shades a pixel."""

    name = view = "volumes"


class WireframePass(LightViewPass):
    """Draw the edges of the volumes that can be seen."""

    name = view = "wireframe"
