"""Refuse pictures and textures that are above the driver's limit of pixels a side."""

from __future__ import annotations

from firefly_sample.errors import GpuError
from firefly_sample.plan.frame_plan import FramePlan


def check_size_limit(size: tuple[int, int], samples: int, limit: int) -> None:
    """Refuse a picture with more than `limit` samples a side; a pixel has `samples` across and down.

    Raises
    ------
    GpuError
    """
    if max(size) * samples > limit:
        scaled = f" at supersample {samples}" if samples > 1 else ""
        raise GpuError(
            f"size {size[0]}x{size[1]}{scaled} is above this driver's limit of {limit} pixels a side: "
            "choose a smaller one"
        )


def check_plan_limits(plan: FramePlan, limit: int) -> None:
    """Refuse a plan whose picture, shadow maps or particle shadow slices are above `limit` a side.

    Raises
    ------
    GpuError
    """
    check_size_limit(plan.size, plan.settings.supersample, limit)
    if max(plan.shadows.size) > limit:
        raise GpuError(
            f"the shadow maps need {plan.shadows.size[0]}x{plan.shadows.size[1]} texels, above this "
            f"driver's limit of {limit} a side: set shadow_atlas to that"
        )
    if plan.particle_shadow is not None and max(plan.particle_shadow.size) > limit:
        width, height = plan.particle_shadow.size
        raise GpuError(
            f"the particle shadow slices need {width}x{height} texels, above this driver's limit of "
            f"{limit} a side: choose a smaller particle_shadow_tile, or fewer particle_shadow_slices"
        )
