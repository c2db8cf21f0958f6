"""Blended surfaces in float64: the light of each layer, and the picture of them, particles and dots.

Along a ray, each layer hides a share of what is behind it, its alpha, and adds its alpha times its radiance.
Between two layers lie the parts of particles that are there, and the dots whose centres are.

The twin of ``shaders/transparent.frag``, of ``particles.frag`` among blended surfaces, and, by
`weighted_layers`, of ``include/weight.glsl``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.lab.reference.chunks import chunks_of, run_all
from firefly_sample.lab.reference.fragments import Fragments
from firefly_sample.lab.reference.layer_rays import Layers
from firefly_sample.lab.reference.particles import add_particles, share_before, square_of
from firefly_sample.lab.reference.rays import pixel_rays
from firefly_sample.lab.reference.shade import Shadows, shade_apart
from firefly_sample.lab.reference.shading import power_decoded, power_encoded
from firefly_sample.lab.reference.surfaces import CHUNK, Surfaces
from firefly_sample.lab.reference.texture import Samplers
from firefly_sample.plan.frame_plan import FramePlan

Float64 = NDArray[np.float64]

SMALLEST_WEIGHT, LARGEST_WEIGHT = 1e-2, 3e3


@dataclass(frozen=True, eq=False)
class Shown:
    """Radiance (n, 3) of n layers, and alpha (n,), the share of the light behind that each hides."""

    radiance: Float64
    alpha: Float64


def shade_layers(
    plan: FramePlan,
    layers: Layers,
    shadows: Callable[[Float64], Shadows | None],
    *,
    threads: int | None = None,
) -> Shown:
    """Return what layers show in all of a plan's lights.

    Parameters
    ----------
    shadows : callable
        ``shadows(positions)`` returns a lookup of the lit share at positions (m, 3) in view space.
    threads : optional
        As `firefly_sample.lab.reference.chunks.run_all` takes them.
    """
    look = plan.settings.look
    blended, rays, samplers = plan.blended, pixel_rays(plan.view), Samplers(look)
    shown = Shown(np.zeros((len(layers), 3)), np.zeros(len(layers)))
    if blended is None:
        return shown
    parts = [
        (number, chunk)
        for number in range(len(blended.batches))
        for chunk in chunks_of(np.flatnonzero(layers.batch == number), CHUNK)
    ]

    def work(part: tuple[int, NDArray[np.intp]]) -> None:
        number, chosen = part
        own = rays.take(layers.pixel[chosen])
        instance, triangle = layers.instance[chosen], layers.triangle[chosen]
        found = Fragments(blended.batches[number], own, instance, triangle, samplers)
        surfaces = Surfaces.none(own.to_eye())
        surfaces.fill(slice(None), found, look=look)
        gbuffer = surfaces.gbuffer
        matt, gloss, _ = shade_apart(gbuffer, plan.lights, plan.settings, shadows(gbuffer.position))
        shown.radiance[chosen] = surfaces.radiance(matt, gloss, plan.ambient, look)
        shown.alpha[chosen] = np.clip(found.alpha(), 0.0, 1.0)

    run_all(work, parts, threads)
    return shown


def add_layers(
    radiance: Float64, plan: FramePlan, distance: Float64, layers: Layers, shown: Shown, light: Float64
) -> None:
    """Draw layers, and the particles and dots between them, over a picture from back to front.

    Parameters
    ----------
    radiance, distance : ndarray of float64, shapes (height, width, 3) and (height, width)
        Of the opaque surfaces; the distance is infinite where there is none.
    light : ndarray of float64, shape (particles, 3)
        Of `firefly_sample.lab.reference.particles.particle_light`.
    """
    shape = distance.shape
    flat = radiance.reshape(-1, 3)
    counts = np.bincount(layers.pixel, minlength=distance.size)
    begin = np.cumsum(counts) - counts
    end = distance.reshape(-1).copy()  # of the segment in hand
    for step in range(layers.most + 1):
        # the segment that has as many layers behind it, where there is one
        there = np.flatnonzero(counts >= step)
        first = there[counts[there] == step]
        inner = there[counts[there] > step]
        rows = begin[inner] + counts[inner] - 1 - step
        start = np.full(distance.size, np.inf)  # nothing lies behind infinity
        start[first] = -np.inf
        start[inner] = layers.distance[rows]
        add_particles(radiance, plan, end.reshape(shape), light, start=start.reshape(shape))
        alpha = shown.alpha[rows, None]
        flat[inner] += alpha * (shown.radiance[rows] - flat[inner])
        end[inner] = layers.distance[rows]


def add_layers_as_codes(
    radiance: Float64, plan: FramePlan, distance: Float64, layers: Layers, shown: Shown, light: Float64
) -> None:
    """Draw layers as `add_layers`, but mix display values, as the look "pyrender" does.

    Where there is a layer, radiance becomes that of the mixed values.
    """
    mixed = power_encoded(radiance * plan.exposure)
    encoded = Shown(power_encoded(shown.radiance * plan.exposure), shown.alpha)
    add_layers(mixed, plan, distance, layers, encoded, light)
    there = np.bincount(layers.pixel, minlength=distance.size).reshape(distance.shape) > 0
    radiance[there] = (power_decoded(mixed) / plan.exposure)[there]


def weight_at(distance: ArrayLike, nearest: float, farthest: float) -> Float64:
    """Return the weight of what is blended at a distance with transparency=weighted."""
    y = np.asarray(distance, dtype=np.float64)
    left = 1.0 - np.clip((y - nearest) / max(farthest - nearest, 1e-30), 0.0, 1.0)
    return np.asarray(np.maximum(SMALLEST_WEIGHT, LARGEST_WEIGHT * left**3))


def weighted_layers(
    radiance: Float64, plan: FramePlan, distance: Float64, layers: Layers, shown: Shown, light: Float64
) -> Float64:
    """Return what transparency=weighted makes of layers and particles, in float64.

    The arguments are those of `add_layers`, but the picture is not changed; dots are part of it.
    """
    blended, particles = plan.blended, plan.particles
    if blended is None:
        return radiance.copy()
    ends = blended.nearest, blended.farthest
    total, weights, left = np.zeros((distance.size, 3)), np.zeros(distance.size), np.ones(distance.size)
    weight = shown.alpha * weight_at(layers.distance, *ends)
    np.add.at(total, layers.pixel, weight[:, None] * shown.radiance)
    np.add.at(weights, layers.pixel, weight)
    np.multiply.at(left, layers.pixel, 1.0 - shown.alpha)
    total, weights, left = (part.reshape(*distance.shape, *part.shape[1:]) for part in (total, weights, left))
    for index in range(len(particles)):
        square = square_of(plan.view, particles.drawn[index], float(particles.radii[index]))
        if square is None:
            continue
        middle = float(particles.positions[index, 1])
        before = share_before(distance[square.box], middle, square.radius)
        depth = particles.optical_depths[index] * square.fainter * square.profile * before
        weight = -np.expm1(-depth) * weight_at(middle, *ends)
        total[square.box] += weight[..., None] * light[index]
        weights[square.box] += weight
        left[square.box] *= np.exp(-depth)
    mean = total / np.where(weights > 0.0, weights, 1.0)[..., None]
    return np.asarray(radiance * left[..., None] + mean * (1.0 - left[..., None]))
