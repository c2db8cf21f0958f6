"""Rows of particles: for the slices of their shadow, for the light on each, and for drawing them in order.

Positions in the slices and in the picture are computed in float64; only what is left of them, texels and
pixels, is rounded to float32.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.light_rows import dot_rows
from firefly_sample.plan.frame_plan import SpriteSet
from firefly_sample.plan.particles.shadow import ParticleShadowPlan, own_contributions, splats
from firefly_sample.plan.particles.visible import ParticleSet
from firefly_sample.plan.targets import PARTICLE_ROW, particle_texels
from firefly_sample.plan.view import View

Float32 = NDArray[np.float32]

RECORD_TEXELS = 4
"""Of a particle: its position and attenuation; its colour, and 1 if it receives shadows; its position in the
particle shadow; its own contribution to a lookup there."""


def splat_rows(particle_shadow: ParticleShadowPlan) -> Float32:
    """Rows of discs in slices, shape (n, 7): texels across and up, slice, radius in texels, strengths."""
    radii, factors = splats(particle_shadow)
    slices = np.clip(np.floor(particle_shadow.positions[:, 2:]), 0, particle_shadow.view.slices - 1)
    columns = [
        particle_shadow.positions[:, :2],
        slices,
        radii[:, None],
        particle_shadow.strengths * factors[:, None],
    ]
    with np.errstate(over="ignore"):
        return np.concatenate(columns, axis=1).astype(np.float32)


def particle_records(particles: ParticleSet, particle_shadow: ParticleShadowPlan | None) -> Float32:
    """What a shader needs to light particles, as texels, shape (rows, width * `RECORD_TEXELS`, 4).

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
    """Rows of particles and soft dots in drawing order, shape (n, 16).

    As `dot_rows`, of where they are drawn; then the optical depth through the middle, the particle's number,
    -1 for dots, and the distance of its middle. A particle that would be smaller than a pixel is as large,
    and as much thinner.
    """
    depths = np.zeros((len(particles), 3))
    depths[:, 0] = particles.optical_depths
    rows = dot_rows(SpriteSet(particles.drawn, depths, particles.radii), view)
    both = np.concatenate([rows, dot_rows(dots, view)])
    more = np.zeros((len(both), 3), dtype=np.float32)
    count = len(particles)
    more[:count, 0], more[:count, 1], more[count:, 1] = both[:count, 10], np.arange(count), -1.0
    more[:count, 2], more[count:, 2] = particles.positions[:, 1], dots.positions[:, 1]
    both[:count, 10:] = 0.0
    return np.concatenate([both, more], axis=1)[particles.order]


assert PARTICLE_ROW * RECORD_TEXELS <= 4096  # of a texture's side: what every driver has
