"""Uniform blocks: one table of fields yields the NumPy dtype and the GLSL text (std140).

Only vec4 fields are used, so that std140 has nothing to pad and both sides agree by construction. Casts
from float64 to float32 happen here, in `uploads` and in `light_rows`, nowhere else.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.light_rows import pixel_slopes
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.particles.shadow import ParticleShadowPlan
from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]

BLOCKS: dict[str, tuple[tuple[str, str], ...]] = {
    "View": (
        ("projection", "A, B, C, D of the lens, for this frame's clip range"),
        ("film", "x and z film offset, 1/A, 1/C"),
        (
            "unprojection",
            "y_fold and w_fold: y = y_fold/(depth + w_fold), orthographic y_fold*(depth + w_fold)",
        ),
        ("size", "samples across and down, and half of each"),
        ("pixel", "slope of the way through a pixel, per pixel right and up; least distance of a light"),
        ("east", "the world's X axis in view space"),
        ("north", "the world's Y axis in view space"),
        ("up", "the world's Z axis in view space"),
        ("origin", "the world's origin in view space"),
        ("inverse_x", "rows of clip space to world space, for row vectors"),
        ("inverse_y", "of y"),
        ("inverse_z", "of z"),
        ("inverse_w", "of w"),
    ),
    "ParticleShadow": (
        ("particle_shadow_x", "view space to particle_shadow space: its X, rows for column vectors"),
        ("particle_shadow_y", "its Y, along the light"),
        ("particle_shadow_z", "its Z"),
        (
            "particle_shadow_scale",
            "texels a unit (or slope); where slices begin; slices a unit; 1 for perspective",
        ),
        (
            "particle_shadow_tiles",
            "texels across a tile; tiles across; slices; how many a lookup adds up, 0 for sums",
        ),
        (
            "particle_shadow_sums",
            "1 to take the exponential; 1 to interpolate; half-width of the blur; 1 if Gaussian",
        ),
    ),
    "Shading": (
        ("ambient", "sum of the ambient lights"),
        ("horizon", "background at and below elevation 0"),
        ("zenith", "background straight up"),
        ("exposure", "before the tone curve, a channel each"),
    ),
}
"""Blocks by name: (field, what it is); every field is a vec4, named u_<field> in GLSL."""

_BINDINGS = {name: index for index, name in enumerate(BLOCKS)}


def binding(block: str) -> int:
    """The uniform buffer binding of a block."""
    return _BINDINGS[block]


@cache
def block_dtype(block: str) -> np.dtype[Any]:
    """The NumPy dtype of a block: four float32 a field."""
    return np.dtype([(name, np.float32, 4) for name, _ in BLOCKS[block]])


def block_glsl(block: str) -> str:
    """The GLSL declaration of a block."""
    lines = [f"    vec4 u_{name};  // {what}" for name, what in BLOCKS[block]]
    return "\n".join([f"layout(std140) uniform {block} {{", *lines, "};"])


def _packed(block: str, values: dict[str, Any]) -> NDArray[Any]:
    packed = np.zeros((), dtype=block_dtype(block))
    for name, _ in BLOCKS[block]:
        value = np.asarray(values[name], dtype=np.float64)
        with np.errstate(over="ignore"):  # what float32 cannot hold is infinite
            packed[name][: len(value)] = value
    return packed


def view_values(view: View) -> NDArray[Any]:
    """The `View` block; all folding of constants is done in float64 before the cast."""
    lens = view.lens
    width, height = view.size
    return _packed(
        "View",
        {
            "projection": (lens.a, lens.b, lens.c, lens.d),
            "film": (lens.x_offset, lens.z_offset, 1.0 / lens.a, 1.0 / lens.c),
            "unprojection": (lens.y_fold, lens.w_fold),
            "size": (width, height, width / 2, height / 2),
            "pixel": (*pixel_slopes(view), view.near),
            "east": view.world_to_view[0, :3],
            "north": view.world_to_view[1, :3],
            "up": view.world_to_view[2, :3],
            "origin": view.world_to_view[3, :3],
            **dict(zip(("inverse_x", "inverse_y", "inverse_z", "inverse_w"), _inverse(view), strict=True)),
        },
    )


def _inverse(view: View) -> Float64:
    """Clip space to world space."""
    return np.asarray(view.lens.inverse_matrix() @ view.view_to_world)


def particle_shadow_values(particle_shadow: ParticleShadowPlan, view: View) -> NDArray[Any]:
    """The `ParticleShadow` block."""
    seen = particle_shadow.view
    rows = (view.view_to_world @ seen.world_to_slices).T
    loop = particle_shadow.method == "loop"
    return _packed(
        "ParticleShadow",
        {
            **dict(
                zip(("particle_shadow_x", "particle_shadow_y", "particle_shadow_z"), rows[:3], strict=True)
            ),
            "particle_shadow_scale": (seen.scale, seen.first, seen.per_unit, float(seen.perspective)),
            "particle_shadow_tiles": (
                seen.tile,
                particle_shadow.grid[0],
                seen.slices,
                particle_shadow.reads if loop else 0,
            ),
            "particle_shadow_sums": (
                float(particle_shadow.method == "optical_depth"),
                float(particle_shadow.interpolate),
                particle_shadow.blur,
                float(particle_shadow.kernel == "gaussian"),
            ),
        },
    )


def shading_values(plan: FramePlan) -> NDArray[Any]:
    """The `Shading` block."""
    return _packed(
        "Shading",
        {
            "ambient": plan.ambient,
            "horizon": plan.background.horizon,
            "zenith": plan.background.zenith,
            "exposure": plan.exposure,
        },
    )
