"""Uniform blocks: one table of fields yields the NumPy dtype and the GLSL text (std140).

All fields are vec4, so that std140 has nothing to pad and both sides agree by construction.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.particles.shadow import ParticleShadowPlan
from firefly_sample.plan.view import View

BLOCKS: dict[str, dict[str, str]] = {
    "View": {
        "projection": "A, B, C, D of the lens, for this frame's clip range",
        "film": "x and z film offset, 1/A, 1/C",
        "unprojection": "y_fold, w_fold: y = y_fold/(depth + w_fold), orthographic y_fold*(depth + w_fold)",
        "size": "samples across and down, and half of each",
        "pixel": "slope of the ray through a pixel, per pixel right and up; least distance of a light",
        "east": "the world's X axis in view space",
        "north": "the world's Y axis in view space",
        "up": "the world's Z axis in view space",
        "origin": "the world's origin in view space",
        "inverse_x": "rows of clip space to world space, for row vectors",
        "inverse_y": "of y",
        "inverse_z": "of z",
        "inverse_w": "of w",
    },
    "ParticleShadow": {
        "particle_shadow_x": "view space to particle_shadow space: its X, rows for column vectors",
        "particle_shadow_y": "its Y, along the light",
        "particle_shadow_z": "its Z",
        "particle_shadow_scale": "texels per unit or slope; start of slices; slices per unit; 1: perspective",
        "particle_shadow_tiles": "texels across a tile; tiles across; slices; slices per lookup, 0 for sums",
        "particle_shadow_sums": "1: exponential; 1: interpolate; half-width of the blur; 1: Gaussian",
    },
    "Shading": {
        "ambient": "sum of the ambient lights",
        "horizon": "background at and below elevation 0",
        "zenith": "background straight up",
        "exposure": "before the tone curve, a channel each",
    },
}
"""Contents of fields by block and name; every field is a vec4, named u_<field> in GLSL."""


def binding(block: str) -> int:
    """Return the uniform buffer binding of a block."""
    return list(BLOCKS).index(block)


@cache
def block_dtype(block: str) -> np.dtype[Any]:
    """Return the NumPy dtype of a block: four float32 per field."""
    return np.dtype([(name, np.float32, 4) for name in BLOCKS[block]])


def block_glsl(block: str) -> str:
    """Return the GLSL declaration of a block."""
    lines = [f"    vec4 u_{name};  // {content}" for name, content in BLOCKS[block].items()]
    return "\n".join([f"layout(std140) uniform {block} {{", *lines, "};"])


def _packed(block: str, *values: Any) -> NDArray[Any]:
    """Return a block of the values of its fields, in their order, each padded to four numbers."""
    packed = np.zeros((), dtype=block_dtype(block))
    for name, value in zip(BLOCKS[block], values, strict=True):
        numbers = np.asarray(value, dtype=np.float64)
        with np.errstate(over="ignore"):  # what float32 cannot hold is infinite
            packed[name][: len(numbers)] = numbers
    return packed


def pixel_slopes(view: View) -> tuple[float, float]:
    """Return how far the ray through a pixel moves across the view with each pixel, right and up.

    In units per unit of distance, or, for an orthographic lens, in units.
    """
    width, height = view.size
    return 2.0 / (width * view.lens.a), 2.0 / (height * view.lens.c)


def view_values(view: View) -> NDArray[Any]:
    """Return the `View` block; all folding of constants is done in float64 before the cast."""
    lens = view.lens
    width, height = view.size
    return _packed(
        "View",
        (lens.a, lens.b, lens.c, lens.d),
        (lens.x_offset, lens.z_offset, 1.0 / lens.a, 1.0 / lens.c),
        (lens.y_fold, lens.w_fold),
        (width, height, width / 2, height / 2),
        (*pixel_slopes(view), view.near),
        *view.world_to_view[:, :3],
        *(lens.inverse_matrix() @ view.view_to_world),
    )


def particle_shadow_values(particle_shadow: ParticleShadowPlan, view: View) -> NDArray[Any]:
    """Return the `ParticleShadow` block."""
    seen, method = particle_shadow.view, particle_shadow.method
    reads = particle_shadow.reads if method == "loop" else 0
    return _packed(
        "ParticleShadow",
        *(view.view_to_world @ seen.world_to_slices).T[:3],
        (seen.scale, seen.first, seen.per_unit, float(seen.perspective)),
        (seen.tile, particle_shadow.grid[0], seen.slices, reads),
        (
            float(method == "optical_depth"),
            float(particle_shadow.interpolate),
            particle_shadow.blur,
            float(particle_shadow.kernel == "gaussian"),
        ),
    )


def shading_values(plan: FramePlan) -> NDArray[Any]:
    """Return the `Shading` block."""
    background = plan.background
    return _packed("Shading", plan.ambient, background.horizon, background.zenith, plan.exposure)
