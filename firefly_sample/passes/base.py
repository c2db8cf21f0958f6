"""What a pass is: when a frame needs it, what it reads and writes and why, its variants, and its drawing.

All of a pass is in one module; those that differ in a constant share one. `firefly_sample.pipeline.PASSES` is
their order. Planning needs no OpenGL: modules of passes import moderngl and `firefly_sample.gpu` inside their
drawing functions.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import Variant

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class Pass:
    """One step of the pipeline; a renderer makes one object of each class.

    Attributes
    ----------
    name : str
        Also the stem of its shaders and the key of its time.
    shaders : Path or None
        The folder of its shaders; the package's own when absent, which their includes are looked up in, too.
    """

    name: str
    shaders: Path | None = None

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what the pass would do in a frame, None if the scene has nothing for it."""
        raise NotImplementedError

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the variant of its shader in a frame that has `targets`, by name."""
        return Variant()

    def legal_variants(self) -> Iterable[Variant]:
        """Return every variant that a draw of it can have: what a test compiles."""
        return [Variant()]

    def shader_stems(self, variant: Variant) -> Iterable[tuple[str, str]]:
        """Return the stems of the fragment and the vertex shaders that a variant is drawn with."""
        return [(self.name, self.name)]

    def outputs(self, variant: Variant) -> tuple[str, ...]:
        """Return the colour targets that a variant's fragment shader writes, as it calls them."""
        return (self.name,)

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Upload what `draw` needs, outside its time."""

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        raise NotImplementedError


def encodings(targets: Mapping[str, Target], *names: str) -> dict[str, Any]:
    """Return how those of the named targets that are there are encoded, as the fields ``<name>_format``."""
    return {f"{name}_format": targets[name].encoding for name in names if name in targets}


class FullscreenPass(Pass):
    """A pass whose fragment shader runs once over every pixel of what it draws into.

    Attributes
    ----------
    adds : bool
        True to add to what the targets hold instead of replacing it.
    """

    adds = False

    def shader_stems(self, variant: Variant) -> Iterable[tuple[str, str]]:
        """Return its fragment shader and the vertex shader of all full-screen passes."""
        return [(self.name, "fullscreen")]

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        import moderngl

        from firefly_sample.gpu.drawing import draw_fullscreen

        if self.adds:
            gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        flags = moderngl.BLEND if self.adds else moderngl.NOTHING
        draw_fullscreen(gpu, step, images, flags, folder=self.shaders)
