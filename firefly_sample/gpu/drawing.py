"""Draws that passes share: a full-screen triangle, and a batch of surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from firefly_sample.plan.frame_plan import Batch, FramePlan, PassPlan

if TYPE_CHECKING:
    import moderngl

    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.gpu.programs import Program


def draw_fullscreen(
    gpu: Gpu,
    step: PassPlan,
    images: BoundImages,
    flags: int = 0,
    textures: Mapping[str, moderngl.Texture] | None = None,
    folder: Path | None = None,
) -> None:
    """Run a pass's fragment shader once over every pixel, with the targets that it reads and `textures`.

    Parameters
    ----------
    flags : int
        moderngl's, for example moderngl.BLEND.
    folder : Path, optional
        Where the shader is, if not in the package.
    """
    images.draw_into()
    gpu.ctx.enable_only(flags)
    program = gpu.programs.get(step.name, step.variant, images.color_names(), "fullscreen", folder)
    program.use(None, images.samplers() | dict(textures or {}))
    gpu.draw_screen(program)


class Drawable(NamedTuple):
    """A batch that is on the GPU, and the objects that draw it."""

    batch: Batch
    program: Program
    textures: dict[str, moderngl.Texture]
    array: moderngl.VertexArray


def make_drawable(gpu: Gpu, plan: FramePlan, batch: Batch, program: Program) -> Drawable:
    """Bring a batch's mesh, instances and texture up to date."""
    textures = {}
    if batch.texture is not None:
        cutoff = batch.alpha_cutoff if batch.surface.cutout else None
        stored = plan.settings.look == "classic"
        textures["u_texture"] = gpu.uploads.texture(batch.texture, cutoff, stored)
    return Drawable(batch, program, textures, gpu.uploads.drawable(batch, program))


def draw_surface(
    gpu: Gpu,
    drawable: Drawable,
    flags: int,
    uniforms: Mapping[str, object],
    textures: Mapping[str, moderngl.Texture],
) -> None:
    """Draw a batch with its own uniforms and textures and these; `flags` are moderngl's, without culling."""
    batch, ctx = drawable.batch, gpu.ctx
    ctx.enable_only(flags | (ctx.NOTHING if batch.surface.double_sided else ctx.CULL_FACE))
    ctx.front_face = "cw" if batch.mirrored else "ccw"
    cutoff = {"u_alpha_cutoff": batch.alpha_cutoff} if batch.surface.cutout else {}
    drawable.program.use({**uniforms, **cutoff}, {**drawable.textures, **textures})
    gpu.render(drawable.array, ctx.TRIANGLES)
