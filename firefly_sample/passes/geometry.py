"""Geometry pass: every surface once, into the G-buffer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.gpu.programs import Program
from firefly_sample.passes.base import Pass
from firefly_sample.plan.frame_plan import Batch, FramePlan, PassPlan

AT_ONCE = 32
"""Draws that a software driver is given before it begins with them: it then shades them on all cores while
the next ones' vertices are placed, which takes a tenth off a forest."""


@dataclass(frozen=True, eq=False)
class Drawable:
    """A batch that is on the GPU, and what draws it."""

    batch: Batch
    program: Program
    textures: dict[str, moderngl.Texture]
    array: moderngl.VertexArray


class GeometryPass(Pass):
    """Draws the batches in the plan's order: opaque before cut-out, front to back.

    What the last frame left is kept where it would be drawn again: the same draws from the same place.
    """

    name = "geometry"

    def __init__(self) -> None:
        self._ready: list[Drawable] = []
        self._state: _State | None = None
        self._drawn: _State | None = None
        self._same = False

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Bring meshes, instances and textures up to date, and keep them for `draw`."""
        self._ready.clear()  # a frame before may have failed half-way
        self._state = _state_of(plan)
        self._same = gpu.reuse and self._state.same_as(self._drawn) and _untouched(step, images)
        if self._same:
            return
        outputs = images.color_names()
        gpu.uploads.prepare(plan.batches)
        programs: dict[int, Program] = {}  # hashing a variant takes longer than the rest
        for batch in plan.batches:
            program = programs.get(id(batch.variant))
            if program is None:
                program = gpu.programs.get(self.name, batch.variant, outputs)
                programs[id(batch.variant)] = program
            self._ready.append(make_drawable(gpu, plan, batch, program))

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        if self._same:
            return
        self._drawn = None
        images.draw_into()
        # less-equal: strict less would drop geometry whose depth rounds to the clear value
        gpu.ctx.depth_func = ">=" if plan.view.reverse else "<="
        ready, self._ready = self._ready, []
        encoded = images.encodes_srgb()
        if encoded:
            gpu.device.set_srgb_encoding(True)
        first = 0
        try:
            for index, made in enumerate(ready):
                if gpu.device.software and index and index % AT_ONCE == 0:
                    gpu.device.flush()
                counted = {"u_first_instance": first} if made.batch.variant.visibility else {}
                draw_surface(gpu, made, moderngl.DEPTH_TEST, dict(counted), {})
                first += len(made.batch.ids)
        finally:
            if encoded:
                gpu.device.set_srgb_encoding(False)
        gpu.ctx.front_face = "ccw"
        gpu.ctx.depth_func = "<"
        self._drawn = self._state


@dataclass(frozen=True, eq=False)
class _State:
    """All that decides what the pass draws, beside the textures that it draws into.

    Batches are compared by identity, and kept so that nothing else takes their place.
    """

    batches: tuple[Batch, ...]
    rest: tuple[Any, ...]

    def same_as(self, other: _State | None) -> bool:
        return other is not None and self.batches is other.batches and self.rest == other.rest


def _state_of(plan: FramePlan) -> _State:
    images = tuple(batch.texture.revision for batch in plan.batches if batch.texture is not None)
    view = (plan.view.lens, plan.view.size, plan.view.reverse, plan.view.near)
    return _State(plan.batches, (images, view, plan.settings.look))


def _untouched(step: PassPlan, images: BoundImages) -> bool:
    """Whether no other pass has written since; interpolation does so each time anew, and the same."""
    return all(images.writer(name) in ("geometry", "interpolation") for name in step.writes)


def make_drawable(gpu: Gpu, plan: FramePlan, batch: Batch, program: Program) -> Drawable:
    """Bring a batch's mesh, instances and texture up to date."""
    textures = {}
    if batch.texture is not None:
        cutoff = batch.alpha_cutoff if batch.variant.cutout else None
        stored = plan.settings.look == "classic"
        textures["u_texture"] = gpu.uploads.texture(batch.texture, cutoff, stored)
    return Drawable(batch, program, textures, gpu.uploads.drawable(batch, program))


def draw_surface(
    gpu: Gpu,
    made: Drawable,
    flags: int,
    uniforms: dict[str, object],
    textures: dict[str, moderngl.Texture],
) -> None:
    """Draw a batch with what it has of its own, and these; `flags` are moderngl's, without culling."""
    batch = made.batch
    cull = moderngl.NOTHING if batch.variant.double_sided else moderngl.CULL_FACE
    gpu.ctx.enable_only(flags | cull)
    gpu.ctx.cull_face = "back"
    gpu.ctx.front_face = "cw" if batch.mirrored else "ccw"
    if batch.variant.cutout:
        uniforms["u_alpha_cutoff"] = batch.alpha_cutoff
    made.program.use(uniforms, made.textures | textures)
    gpu.render(made.array, moderngl.TRIANGLES)
