"""Particles in float64: what light each gets, and what the eye sees of them, in exact order.

The twin of ``shaders/particle_light.frag``, ``particles.vert`` and ``particles.frag``. What particles take of
a light is summed up one by one: `firefly_sample.lab.reference.particle_shadow.exact_taken`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.one_light import OneLight
from firefly_sample.lab.reference.particle_shadow import exact_taken, light_left
from firefly_sample.lab.reference.shade import each_light
from firefly_sample.lab.reference.sprites import add_sprite, square_of
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.particles.visible import ParticleSet
from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]
Lit = Callable[[Float64, OneLight], Float64]
"""``lit(points, light)``: the share of a light that surfaces leave at points in view space."""


def particle_light(plan: FramePlan, lit: Lit | None = None) -> Float64:
    """The radiance of each particle in view, shape (n, 3)."""
    particles = plan.particles
    place = particles.positions
    total = np.tile(plan.ambient, (len(place), 1))
    left = np.ones((len(place), 3))
    if plan.particle_shadow is not None and len(place):
        particle_shadow, known = plan.particle_shadow, particles.rows >= 0
        taken = exact_taken(particle_shadow, particle_shadow.places[particles.rows], particles.rows)
        left = np.where(known[:, None], light_left(particle_shadow, taken), 1.0)
    for one in each_light(plan.lights):
        reached = np.flatnonzero(one.in_reach(place))
        to_light, distance = one.ways(place[reached])
        strength = one.strength(to_light.T, distance, plan.settings)
        if one.lights.shadowed and lit is not None:
            strength = strength * lit(place[reached], one)
        arriving = strength[:, None] * one.lights.colors[one.row]
        if one.lights.particle_shadowed:
            arriving = arriving * left[reached] * particles.fades[reached, None]
        total[reached] += arriving
    return np.asarray(total * particles.colors)


def add_particles(
    radiance: Float64,
    plan: FramePlan,
    distance: Float64,
    light: Float64,
    order: NDArray[np.intp] | None = None,
) -> None:
    """Put particles, and the soft dots among them, over a picture from back to front.

    Parameters
    ----------
    radiance : ndarray of float64, shape (height, width, 3)
        Changed in place; the first row on top.
    distance : ndarray of float64, shape (height, width)
        Of the surfaces along the view axis, infinite where there is none.
    light : ndarray of float64, shape (n, 3)
        Of `particle_light`.
    order : ndarray of int, optional
        As in `firefly_sample.plan.particles.visible.ParticleSet`; by exact distance along the view axis when absent.
    """
    particles, dots, count = plan.particles, plan.sprites, len(plan.particles)
    if order is None:
        depths = np.concatenate([particles.positions[:, 1], dots.positions[:, 1]])
        order = np.argsort(-depths, kind="stable")
    for index in order.tolist():
        if index >= count:
            add_sprite(radiance, dots, index - count, plan.view, distance)
        else:
            _add_particle(radiance, particles, index, plan.view, distance, light[index])


def _add_particle(
    radiance: Float64, particles: ParticleSet, index: int, view: View, distance: Float64, light: Float64
) -> None:
    radius = float(particles.radii[index])
    square = square_of(view, particles.drawn[index], radius)
    if square is None:
        return
    gap = distance[square.box] - particles.positions[index, 1]
    before = np.clip(0.5 + 0.5 * gap / square.radius, 0.0, 1.0)
    depth = particles.optical_depths[index] * square.fainter * square.profile() * before
    opacity = -np.expm1(-depth)[..., None]
    radiance[square.box] += opacity * (light - radiance[square.box])
