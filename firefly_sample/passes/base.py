"""The base of passes: a pass has its condition, what it reads and writes and why, its variants, its drawing.

All of a pass is in one module; passes that are much alike share one. `firefly_sample.pipeline.PASSES` is
their order. Planning needs no OpenGL: modules of passes import neither moderngl nor what imports it, and take
its constants from `Gpu.ctx`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_type_hints

from firefly_sample.gpu.drawing import draw_fullscreen
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import Variant

if TYPE_CHECKING:
    import moderngl

    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.gpu.programs import Program

BOTH = (False, True)

Choices = TypeVar("Choices")


class Pass:
    """One step of the pipeline; a renderer makes one object of each class.

    Attributes
    ----------
    name : str
        Also the stem of its shaders and the key of its time.
    vertex : str or None
        The stem of its vertex shader, if that has another name.
    shaders : Path or None
        The folder of its shaders; the package's own when absent, which their includes are looked up in, too.
    colors : tuple of str or None
        The colour targets that its fragment shader can write, as it calls them; one of its name when absent.
        A variant with a field of such a name says by it whether that target is written.
    """

    name: str
    vertex: str | None = None
    shaders: Path | None = None
    colors: tuple[str, ...] | None = None

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
        return [(self.name, self.vertex or self.name)]

    def outputs(self, variant: Variant) -> tuple[str, ...]:
        """Return the colour targets that a variant's fragment shader writes, as it calls them."""
        colors = (self.name,) if self.colors is None else self.colors
        return tuple(name for name in colors if getattr(variant, name, True))

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Upload what `draw` needs, outside its time."""

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`. The state of OpenGL is that of `Gpu.reset_state`."""
        raise NotImplementedError

    def program(self, gpu: Gpu, variant: Variant, images: BoundImages) -> Program:
        """Return the program of a variant, which draws into `images`."""
        return gpu.programs.get(self.name, variant, images.color_names(), self.vertex, self.shaders)


def combinations(kind: type[Choices]) -> Iterator[Choices]:
    """Yield an object of a dataclass for every combination of its fields' choices: bools and Literals."""
    hints = get_type_hints(kind).values()
    for values in product(*(BOTH if hint is bool else get_args(hint) for hint in hints)):
        yield kind(*values)


def encodings(targets: Mapping[str, Target], *names: str) -> dict[str, Any]:
    """Return how those of the named targets that are there are encoded, as the fields ``<name>_format``."""
    return {f"{name}_format": targets[name].encoding for name in names if name in targets}


class FullscreenPass(Pass):
    """A pass whose fragment shader runs once over every pixel of what it draws into.

    Attributes
    ----------
    adds : bool
        True to add to what the targets hold instead of replacing it.
    textures : mapping of str to Texture, optional
        What its shader samples besides the targets that the pass reads; `prepare` may set it.
    """

    vertex = "fullscreen"
    adds = False
    textures: Mapping[str, moderngl.Texture] | None = None

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        flags = gpu.ctx.BLEND if self.adds else gpu.ctx.NOTHING
        draw_fullscreen(gpu, step, images, flags, self.textures, self.shaders)
