"""Dots and particles in float64: the light on each, and the picture of them in exact order.

The twin of ``shaders/plain.vert`` and ``plain.frag`` (soft round dots, added to the radiance), and of
``particle_light.frag``, ``particles.vert`` and ``particles.frag``. The shadow of particles is summed up one
by one: `firefly_sample.lab.reference.particle_shadow.exact_taken`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.particle_shadow import exact_taken, light_left
from firefly_sample.lab.reference.shade import OneLight, each_light
from firefly_sample.plan.frame_plan import FramePlan, SpriteSet
from firefly_sample.plan.particles.visible import ParticleSet
from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]
Lit = Callable[[Float64, OneLight], Float64]
"""``lit(points, light)``: the share of a light that surfaces let through to points in view space."""

SMALLEST = 1.0
"""Radius in pixels: a smaller dot is drawn in this size and fainter by the same factor."""


@dataclass(frozen=True, eq=False)
class Square:
    """The pixels that a dot may touch.

    Attributes
    ----------
    box : (slice, slice)
        Rows and columns, the first row on top.
    across, up : ndarray of float64
        Offsets of the columns and of the rows from the dot's centre, in radii.
    radius : float
        Scene units: the dot's own, or `SMALLEST` pixels.
    fainter : float
        The factor of its strength.
    """

    box: tuple[slice, slice]
    across: Float64
    up: Float64
    radius: float
    fainter: float

    def profile(self) -> Float64:
        """Return (1 - r^2)^2 of each pixel, 0 outside."""
        squares: Float64 = np.maximum(1.0 - (self.across**2 + self.up[:, None] ** 2), 0.0)
        return squares * squares


def square_of(view: View, position: Float64, radius: float) -> Square | None:
    """Return the square of a dot at a position in view space, or None if the picture has no pixel of it."""
    lens, (width, height) = view.lens, view.size
    x, y, z = position.tolist()
    if not view.near <= y <= view.far:
        return None  # the dot faces the camera: a plane cuts off all of it or nothing
    w = y if lens.perspective else 1.0
    pixels = radius * lens.c * (height / 2) / max(w, 1e-30)
    grow = max(SMALLEST / max(pixels, 1e-30), 1.0)
    size = radius * grow
    columns = _span(lens.a * x / w + lens.x_offset, lens.a * size / w, width)
    rows = _span(-(lens.c * z / w + lens.z_offset), lens.c * size / w, height)
    if not (columns and rows):
        return None
    ndc_x = (np.arange(columns.start, columns.stop) + 0.5) / (width / 2) - 1.0
    ndc_y = 1.0 - (np.arange(rows.start, rows.stop) + 0.5) / (height / 2)
    across = ((ndc_x - lens.x_offset) / lens.a * w - x) / size
    up = ((ndc_y - lens.z_offset) / lens.c * w - z) / size
    box = np.s_[rows.start : rows.stop, columns.start : columns.stop]
    return Square(box, across, up, size, 1.0 / (grow * grow))


def add_sprites(radiance: Float64, dots: SpriteSet, view: View, distance: Float64) -> None:
    """Add all dots to the radiance, one after the other.

    Parameters
    ----------
    radiance : ndarray of float64, shape (height, width, 3)
        Changed in place; the first row on top.
    dots : SpriteSet
        View space.
    view : View
    distance : ndarray of float64, shape (height, width)
        Of the surfaces along the view axis, infinite where there is none. A surface nearer than a dot's
        centre hides the dot.
    """
    for index in range(len(dots)):
        _add_sprite(radiance, dots, index, view, distance)


def _add_sprite(radiance: Float64, dots: SpriteSet, index: int, view: View, distance: Float64) -> None:
    made = light_of_sprite(dots, index, view, distance)
    if made is not None:
        box, light = made
        radiance[box] += light


def light_of_sprite(
    dots: SpriteSet, index: int, view: View, distance: Float64
) -> tuple[tuple[slice, slice], Float64] | None:
    """Return the rows and columns that one dot touches, and the radiance that it adds there."""
    position, color = dots.positions[index], dots.colors[index]
    square = square_of(view, position, float(dots.radii[index]))
    if square is None:
        return None
    strength = np.where(distance[square.box] >= position[1], square.profile(), 0.0)
    return square.box, strength[..., None] * (color * square.fainter)


def _span(middle: float, half: float, count: int) -> range:
    """Return the pixels, of `count`, with centres in an interval of NDC, and at most one more per side."""
    low = max(math.floor((max(middle - half, -2.0) + 1.0) * (count / 2) - 0.5), 0)
    high = min(math.ceil((min(middle + half, 2.0) + 1.0) * (count / 2) - 0.5), count - 1)
    return range(low, high + 1)


def particle_light(plan: FramePlan, lit: Lit | None = None) -> Float64:
    """Return the radiance of each particle in view, shape (n, 3)."""
    particles = plan.particles
    position = particles.positions
    total = np.tile(plan.ambient, (len(position), 1))
    left = np.ones((len(position), 3))
    if plan.particle_shadow is not None and len(position):
        particle_shadow, known = plan.particle_shadow, particles.rows >= 0
        taken = exact_taken(particle_shadow, particle_shadow.positions[particles.rows], particles.rows)
        left = np.where(known[:, None], light_left(particle_shadow, taken), 1.0)
    for one in each_light(plan.lights):
        reached = np.flatnonzero(one.in_reach(position))
        to_light, distance = one.directions(position[reached])
        strength = one.strength(to_light.T, distance, plan.settings)
        if one.lights.shadowed and lit is not None:
            strength = strength * lit(position[reached], one)
        arriving = strength[:, None] * one.lights.colors[one.row]
        if one.lights.particle_shadowed:
            arriving = arriving * left[reached] * particles.attenuations[reached, None]
        total[reached] += arriving
    return np.asarray(total * particles.colors)


def add_particles(
    radiance: Float64,
    plan: FramePlan,
    distance: Float64,
    light: Float64,
    order: NDArray[np.intp] | None = None,
) -> None:
    """Draw particles, and the soft dots among them, over a picture from back to front.

    Parameters
    ----------
    radiance : ndarray of float64, shape (height, width, 3)
        Changed in place; the first row on top.
    distance : ndarray of float64, shape (height, width)
        Of the surfaces along the view axis, infinite where there is none.
    light : ndarray of float64, shape (n, 3)
        Of `particle_light`.
    order : ndarray of int, optional
        As in `firefly_sample.plan.particles.ParticleSet`; by exact distance along the view axis when absent.
    """
    particles, dots, count = plan.particles, plan.sprites, len(plan.particles)
    if order is None:
        depths = np.concatenate([particles.positions[:, 1], dots.positions[:, 1]])
        order = np.argsort(-depths, kind="stable")
    for index in order.tolist():
        if index >= count:
            _add_sprite(radiance, dots, index - count, plan.view, distance)
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
