"""What a pass is: a name and a way to draw its step of a plan into the images that the step declares."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import moderngl
import numpy as np

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.plan.frame_plan import FramePlan, PassPlan

SQUARE = np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)], dtype=np.float32)
"""Corners of a strip of two triangles."""


class Pass:
    """One step of the pipeline."""

    name: str

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Upload what `draw` needs, outside its time: most frames have nothing of it."""

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        raise NotImplementedError


def draw_fullscreen(
    gpu: Gpu,
    step: PassPlan,
    images: BoundImages,
    flags: int = moderngl.NOTHING,
    textures: Mapping[str, moderngl.Texture] | None = None,
) -> None:
    """Run a pass's fragment shader once over every pixel, reading what it declares, and `textures`.

    `flags` are moderngl's.
    """
    images.draw_into()
    gpu.ctx.enable_only(flags)
    program = gpu.programs.get(step.name, step.variant, images.color_names(), vertex="fullscreen")
    program.use(None, textures_of(images, step.reads) | dict(textures or {}))
    gpu.render(gpu.array("fullscreen", program), moderngl.TRIANGLES, vertices=3)


def textures_of(images: BoundImages, names: Iterable[str]) -> dict[str, moderngl.Texture]:
    """The targets that a pass reads, as its shader calls them: ``u_<name>``; a copied depth is u_depth."""
    return {f"u_{'depth' if name == 'depth_copy' else name}": images.read(name) for name in names}
