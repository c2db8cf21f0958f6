"""Interpolation pass: normals and distances in float64, where a rasterizer's float32 does not do."""

from __future__ import annotations

import moderngl

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass, draw_fullscreen
from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class InterpolationPass(Pass):
    """Writes again what the geometry pass marked; everything else keeps what it has."""

    name = "interpolation"

    def __init__(self) -> None:
        self._tables: dict[str, moderngl.Texture] = {}

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Bring the tables of corners up to date."""
        self._tables = gpu.corners.of(plan)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        draw_fullscreen(gpu, step, images, textures=self._tables)
