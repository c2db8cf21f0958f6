"""Rows of instances: meshes, casters of shadows, soft dots, and particles with the discs of their shadows.

Positions are computed in float64; only the results, in view space, in a light's space, in texels or in
pixels, are rounded to float32.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frame_plan import Batch, SpriteSet
from firefly_sample.plan.particles.shadow import ParticleShadowPlan, own_contributions, splats
from firefly_sample.plan.particles.visible import ParticleSet
from firefly_sample.plan.shadows.maps import CasterBatch
from firefly_sample.plan.targets import PARTICLE_ROW, particle_texels
from firefly_sample.plan.view import View

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]


def _instance_dtype(normals: int) -> np.dtype[Any]:
    return np.dtype(
        [
            ("in_view_x", np.float32, 4),
            ("in_view_y", np.float32, 4),
            ("in_view_z", np.float32, 4),
            ("in_normal_x", np.float32, normals),
            ("in_normal_y", np.float32, normals),
            ("in_normal_z", np.float32, normals),
            ("in_base_color", np.float32, 4),
            ("in_ambient", np.float32, 3),
            ("in_emission", np.float32, 3),
            ("in_specular", np.float32, 4),
            ("in_id", np.uint32),
        ]
    )


INSTANCE_DTYPE = _instance_dtype(3)
"""One instance: the columns of model-to-view for positions and for normals, its colours, and id + 1."""
SCALED_DTYPE = _instance_dtype(4)
"""The same with a colour scale: its red, green and blue follow the columns for normals."""

_DOT = [
    ("in_dot", np.float32, 4),
    ("in_pixel", np.float32, 4),
    ("in_per_radius", np.float32, 2),
    ("in_color", np.float32, 3),
]
DOT_DTYPE = np.dtype(_DOT)
"""A row of `dot_rows`."""
PARTICLE_DTYPE = np.dtype([*_DOT, ("in_particle", np.float32, 3)])
"""A row of `particle_rows`."""
DISC_DTYPE = np.dtype([("in_disc", np.float32, 4), ("in_strength", np.float32, 3)])
"""A row of `splat_rows`."""

CASTER_DTYPE = np.dtype([*((f"in_clip_{axis}", np.float32, 4) for axis in "xyzw"), ("in_alpha", np.float32)])
"""One caster of a shadow: the columns of model-to-clip, and the factor of its alpha."""

SMALLEST_DOT = 1.0
"""Radius in pixels."""
LARGEST = 3e38
"""Coordinates are clipped to this, because float32 holds little more."""
RECORD_TEXELS = 4
"""Texels per particle: its position and fade; its colour, and 1 if it takes shadows; its position in the
particle shadow; its own share of what a lookup finds there."""


def instance_rows(batches: Sequence[Batch]) -> NDArray[Any]:
    """Return the instances of batches, one batch after the other."""
    scaled = any(batch.surface.scaled for batch in batches)
    dtype = SCALED_DTYPE if scaled else INSTANCE_DTYPE
    rows = np.zeros(sum(len(batch.ids) for batch in batches), dtype=dtype)
    if not len(rows):
        return rows
    matrices = np.concatenate([batch.model_to_view for batch in batches])
    cofactors = normal_columns(matrices)
    for column, axis in enumerate("xyz"):
        rows[f"in_view_{axis}"] = matrices[:, :, column]
        rows[f"in_normal_{axis}"][:, :3] = cofactors[:, :, column]
    factors = [batch.factors for batch in batches]
    if scaled:
        scales = np.concatenate([np.ones((0, 3)), *(own.scales for own in factors if own.scales is not None)])
        for channel, axis in zip(scales.T, "xyz", strict=True):
            rows[f"in_normal_{axis}"][:, 3] = channel
    rows["in_base_color"] = np.concatenate([own.base_colors for own in factors])
    rows["in_ambient"] = np.concatenate([own.ambients for own in factors])
    rows["in_emission"] = np.concatenate([own.emissions for own in factors])
    rows["in_specular"] = np.concatenate([own.speculars for own in factors])
    rows["in_id"] = np.concatenate([batch.ids for batch in batches]).astype(np.uint32) + 1
    return rows


TABLE_ROW, TABLE_TEXELS = 256, 10
"""Instances in a row of their table, and texels of each: ``shaders/include/instance_table.glsl``."""


def instance_texels(batches: Sequence[Batch]) -> Float32:
    """Return the instances of batches as texels, shape (rows, `TABLE_ROW` * `TABLE_TEXELS`, 4)."""
    rows = instance_rows(batches)
    height = -(-max(len(rows), 1) // TABLE_ROW)
    texels = np.zeros((height * TABLE_ROW, TABLE_TEXELS, 4), dtype=np.float32)
    names = "view_x", "view_y", "view_z", "normal_x", "normal_y", "normal_z", "base_color", "ambient"
    for index, name in enumerate((*names, "specular", "emission")):
        values = rows[f"in_{name}"]
        texels[: len(rows), index, : values.shape[1]] = values
    return texels.reshape(height, TABLE_ROW * TABLE_TEXELS, 4)


def normal_columns(model_to_view: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrices that transform normals, for row vectors: shape (n, 3, 3), their largest entries 1.

    They are cofactor matrices, which need no inverse.
    """
    linear = model_to_view[:, :3, :3]
    after, before = linear[:, [1, 2, 0]], linear[:, [2, 0, 1]]
    cofactors = after[:, :, [1, 2, 0]] * before[:, :, [2, 0, 1]]
    cofactors -= after[:, :, [2, 0, 1]] * before[:, :, [1, 2, 0]]
    # a flat matrix has no sides: it keeps the sign of one that is not mirrored
    cofactors *= np.where(np.linalg.det(linear) < 0, -1.0, 1.0)[:, None, None]
    # shaders normalise anyway; this keeps tiny and huge scales inside float32
    largest = np.abs(cofactors).reshape(-1, 9).max(axis=1)[:, None, None]
    return np.asarray(cofactors / np.where(largest > 0, largest, 1.0))


def caster_rows(batch: CasterBatch) -> NDArray[Any]:
    """Return the casters of a batch."""
    rows = np.zeros(len(batch.alphas), dtype=CASTER_DTYPE)
    for column, axis in enumerate("xyzw"):
        rows[f"in_clip_{axis}"] = batch.model_to_clip[:, :, column]
    rows["in_alpha"] = batch.alphas
    return rows


def dot_rows(dots: SpriteSet, view: View) -> Float32:
    """Return rows of soft dots, shape (n, 13).

    Centre and radius in view space; the pixel of the centre, two float32 each across and up; one over the
    radius in pixels, across and up; colour. A dot smaller than a pixel is drawn as large as a pixel, and
    fainter by the same factor, so that it neither vanishes nor flickers.
    """
    rows = np.empty((len(dots), 13), dtype=np.float32)
    grow = _place_dots(rows, dots.positions, dots.radii, view)
    with np.errstate(over="ignore"):
        rows[:, 10:] = dots.colors / grow[:, None] ** 2
    return rows


def _place_dots(rows: Float32, positions: Float64, radii: Float64, view: View) -> Float64:
    """Fill the first ten columns of `dot_rows`, and return by how much each dot's radius was multiplied."""
    lens, half = view.lens, 0.5 * np.array(view.size)
    w = np.maximum(positions[:, 1:2], 1e-30) if lens.perspective else np.ones((len(positions), 1))
    scales = half * (lens.a, lens.c) / w
    grow = np.maximum(SMALLEST_DOT / np.maximum(radii[:, None] * scales[:, 1:], 1e-30), 1.0)
    grown = radii[:, None] * grow
    pixels = positions[:, [0, 2]] * scales + half * (1.0 + np.array([lens.x_offset, lens.z_offset]))
    pixels = np.clip(pixels, -LARGEST, LARGEST)
    with np.errstate(over="ignore"):  # a radius beyond float32 reaches everything, as infinity does
        rows[:, :3], rows[:, 3:4], rows[:, 4:6] = positions, grown, pixels
        rows[:, 6:8], rows[:, 8:10] = pixels - rows[:, 4:6], 1.0 / (grown * scales)
    return np.asarray(grow[:, 0])


def splat_rows(particle_shadow: ParticleShadowPlan) -> Float32:
    """Return discs in slices, shape (n, 7): texels across and up, slice, radius in texels, strengths."""
    radii, factors = splats(particle_shadow)
    slices = np.clip(np.floor(particle_shadow.positions[:, 2:]), 0, particle_shadow.view.slices - 1)
    strengths = particle_shadow.strengths * factors[:, None]
    with np.errstate(over="ignore"):
        columns = particle_shadow.positions[:, :2], slices, radii, strengths
        return np.column_stack(columns).astype(np.float32)


def particle_records(particles: ParticleSet, particle_shadow: ParticleShadowPlan | None) -> Float32:
    """Return what a shader needs to light particles, as texels, shape (rows, width * `RECORD_TEXELS`, 4).

    As wide as the texture of their light, and as many rows of it as they fill.
    """
    width = particle_texels(len(particles))[0]
    height = -(-len(particles) // width)
    rows = np.zeros((width * height, RECORD_TEXELS, 4), dtype=np.float32)
    own = rows[: len(particles)]
    own[:, 0, :3], own[:, 0, 3] = particles.positions, particles.attenuations
    own[:, 1, :3] = particles.colors
    if particle_shadow is not None and len(particle_shadow):
        own[:, 1, 3] = particles.rows >= 0
        own[:, 2, :3] = particle_shadow.positions[particles.rows]
        own[:, 3, :3] = own_contributions(particle_shadow)[particles.rows]
    return rows.reshape(height, width * RECORD_TEXELS, 4)


def particle_rows(particles: ParticleSet, dots: SpriteSet, view: View) -> Float32:
    """Return rows of particles and soft dots in drawing order, shape (n, 16).

    As `dot_rows`, of where they are drawn; then the optical depth through the middle, the particle's number
    (-1 for dots), and the distance of its middle. A particle smaller than a pixel is drawn as large as a
    pixel, and thinner by the same factor.
    """
    count = len(particles)
    rows = np.zeros((count + len(dots), 16), dtype=np.float32)
    grow = _place_dots(rows[:count], particles.drawn, particles.radii, view)
    rows[count:, :13] = dot_rows(dots, view)
    with np.errstate(over="ignore"):
        rows[:count, 13] = particles.optical_depths / grow**2
        rows[:count, 14], rows[count:, 14] = np.arange(count), -1.0
        rows[:count, 15], rows[count:, 15] = particles.positions[:, 1], dots.positions[:, 1]
    return rows[particles.order]


assert PARTICLE_ROW * RECORD_TEXELS <= 4096  # of a texture's side: what every driver has
