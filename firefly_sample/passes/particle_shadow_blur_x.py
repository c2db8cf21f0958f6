"""Particle shadow blur x pass: slices blurred across."""

from __future__ import annotations

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.passes.base import Pass, draw_fullscreen
from firefly_sample.plan.frame_plan import FramePlan, PassPlan


class ParticleShadowBlurXPass(Pass):
    """Once over every texel of all slices."""

    name = "particle_shadow_blur_x"

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        draw_fullscreen(gpu, step, images)
