"""What particles are in slices of shadow: discs in texels, and what a blur and a lookup make of them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.particles.shadow import ParticleShadowPlan
from firefly_sample.scene.particles import BlurKernel

Float64 = NDArray[np.float64]

SMALLEST_SPLAT = 1.5
"""Radius in texels of a disc in a slice."""


def splats(particle_shadow: ParticleShadowPlan) -> tuple[Float64, Float64]:
    """Radii in texels of the discs that are drawn into slices, and factors of their strengths, shape (n,).

    A disc that would be smaller than `SMALLEST_SPLAT` is as large, and as much fainter.
    """
    radii = np.maximum(particle_shadow.radii, SMALLEST_SPLAT)
    return radii, (particle_shadow.radii / radii) ** 2


def own_takings(particle_shadow: ParticleShadowPlan) -> Float64:
    """What a lookup between texels at each particle's middle finds of the particle itself, shape (n, 3).

    Its disc, weighed as the blur and the interpolation weigh texels around the middle.
    """
    radii, factors = splats(particle_shadow)
    # texels that the lookup reaches, and no more than the largest disc has
    reach = min(math.ceil(particle_shadow.blur), math.ceil(float(radii.max(initial=1.0)))) + 1
    weights = np.pad(blur_weights(particle_shadow.blur, particle_shadow.kernel), reach + 2)
    middle = len(weights) // 2
    first = np.floor(particle_shadow.places[:, :2] - 0.5)
    part = particle_shadow.places[:, :2] - 0.5 - first
    offsets = np.arange(-reach + 1, reach + 1)  # from the texel below the middle
    near, far = weights[middle + offsets], weights[middle + offsets - 1]
    share = near * (1.0 - part[..., None]) + far * part[..., None]  # (n, 2, taps)
    squares = (offsets - part[..., None]) ** 2 / radii[:, None, None] ** 2
    found = np.zeros(len(particle_shadow))
    for index in range(len(offsets)):
        disc = np.maximum(1.0 - squares[:, 1, index, None] - squares[:, 0], 0.0) ** 2
        found += share[:, 1, index] * (share[:, 0] * disc).sum(axis=1)
    return np.asarray(particle_shadow.strengths * (factors * found)[:, None])


def blur_weights(blur: float, kernel: BlurKernel) -> Float64:
    """Weights of the texels from -ceil(blur) to ceil(blur); they sum to 1."""
    reach = math.ceil(blur)
    offsets = np.abs(np.arange(-reach, reach + 1.0))
    if kernel == "gaussian" and blur > 0.0:
        weights = np.where(offsets <= blur, np.exp(-2.0 * (offsets / blur) ** 2), 0.0)
    else:
        weights = np.clip(blur + 1.0 - offsets, 0.0, 1.0)
    return np.asarray(weights / weights.sum())
