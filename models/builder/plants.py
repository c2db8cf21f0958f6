"""Undergrowth: bushes, ferns, grass, mushrooms."""

from __future__ import annotations

import math

import numpy as np

from builder.branching import Branch, curve, taper
from builder.foliage import CELLS
from builder.needles import BOUGHS, CLUMPS
from builder.noise import smooth
from builder.randomness import Random
from builder.surface import Surface, add_card, add_grid, add_tube
from builder.trees import leaf_out


def bush(seed, height=11.0, spread=8.0, stems=11, card=6.0, arch=-0.35):
    """(stems, leaves) of a bush of several stems; `arch` bends them over (below 0) or up."""
    random = Random(seed)
    wood, leaves = Surface(), Surface()
    for k in range(stems):
        angle = 2.399963 * k + random.around(0.0, 0.4)
        out = random.between(0.25, 1.0) ** 0.7
        foot = np.array([math.cos(angle), math.sin(angle), 0.0]) * 0.16 * spread * out + [0.0, 0.0, -0.4]
        heading = np.array([math.cos(angle) * out * spread, math.sin(angle) * out * spread, height])
        length = height * random.between(0.75, 1.1)
        path = curve(random, foot, heading, length, 3, 0.16, arch)
        stem = Branch(path, taper(0.24, 0.05, 3), 1)
        add_tube(wood, path, stem.radii, 3, (4.0, 8.0), offset=random.units(1)[0])
        leaf_out(leaves, stem, (0.30, 0.45, 0.6, 0.75, 0.88, 0.98), card, 0.3, random, CELLS)
    leaves.lift(0.4)
    top = np.concatenate(leaves.vertices)
    centre, radii = np.array([0.0, 0.0, 0.25 * height]), np.abs(top).max(axis=0).clip(1.0)

    def inside(vertices):
        r = np.linalg.norm((vertices - centre) / radii, axis=1)
        return (0.4 + 0.6 * smooth(0.15, 0.8, r)) * (0.5 + 0.5 * smooth(-0.5, 0.55 * height, vertices[:, 2]))

    leaves.bend_normals(centre - [0.0, 0.0, 2.0], radii, 0.75)
    leaves.shade(inside)
    wood.shade(inside)
    return wood, leaves


def fern(seed, fronds=12, length=9.0):
    """Fronds that rise from one root and arch outwards."""
    random = Random(seed)
    leaves = Surface()
    for k in range(fronds):
        angle = 2.399963 * k + random.around(0.0, 0.3)
        pitch = random.between(0.85, 1.2) if k < fronds * 0.6 else random.between(1.2, 1.45)
        out = np.array([math.cos(angle), math.sin(angle), 0.0])
        heading = out * math.cos(pitch) + np.array([0.0, 0.0, math.sin(pitch)])
        size = length * random.between(0.75, 1.1)
        add_card(
            leaves,
            out * 0.25 - [0.0, 0.0, 0.3],
            heading,
            (0.0, 0.0, 1.0),
            (0.36 * size, size),
            BOUGHS[random.below(3)],
            droop=random.between(0.75, 1.15),
            segments=3,
            fold=-0.3,
            color=1.0 - 0.25 * random.units(3) * [1.0, 0.6, 1.0],
        )
    leaves.bend_normals(np.array([0.0, 0.0, -3.0]), np.ones(3), 0.45)
    leaves.shade(lambda v: 0.35 + 0.65 * smooth(0.3, 4.6, np.hypot(v[:, 0], v[:, 1]) + 0.5 * v[:, 2]))
    return leaves


def grass(seed, cards=7, spread=3.2, size=(5.2, 3.6), color=(1.0, 1.0, 1.0)):
    """A tuft: upright cards that cross each other, all lit as the ground is."""
    random = Random(seed)
    blades = Surface()
    for k in range(cards):
        angle = math.pi * (k + random.between(0.0, 0.8)) / cards
        away = 2.0 * math.pi * random.units(1)[0]
        foot = spread * random.between(0.0, 1.0) ** 0.5 * np.array([math.cos(away), math.sin(away), 0.0])
        lean = 0.18 * np.array([math.cos(away), math.sin(away), 0.0])
        scale = random.between(0.7, 1.2)
        add_card(
            blades,
            foot - [0.0, 0.0, 0.25],
            lean + np.array([0.0, 0.0, 1.0]),
            (math.cos(angle), math.sin(angle), 0.0),
            (size[0] * scale, size[1] * scale),
            CLUMPS[random.below(2)],
            color=np.asarray(color) * (1.0 - 0.25 * random.units(3) * [1.0, 0.6, 1.0]),
        )
    blades.bend_normals(np.array([0.0, 0.0, -14.0]), np.ones(3), 0.88)
    blades.shade(lambda v: 0.45 + 0.55 * smooth(0.0, 0.65 * size[1], v[:, 2]))
    return blades


def mushrooms(seed, count, cap, height, dome):
    """A group of mushrooms with caps of about `cap` units across; `dome` is how round they are.

    Texture: cap from above in the left half, seen from its top; gills and stem in the right half.
    """
    random = Random(seed)
    flesh = Surface()
    for k in range(count):
        angle = 2.399963 * k + random.around(0.0, 0.5)
        away = 0.0 if k == 0 else cap * (0.75 + 0.38 * math.sqrt(k)) * random.between(0.85, 1.15)
        grown = random.between(0.85, 1.0) if k == 0 else random.between(0.4, 0.85)
        foot = away * np.array([math.cos(angle), math.sin(angle), 0.0])
        lean = (
            0.16 * np.array([math.cos(angle), math.sin(angle), 0.0]) * min(k, 1) + 0.05 * random.direction()
        )
        _mushroom(flesh, foot, lean, cap * grown, height * grown, dome, random)
    flesh.shade(lambda v: 0.55 + 0.45 * smooth(0.0, 0.6 * height, v[:, 2]))
    return flesh


def _mushroom(flesh, foot, lean, cap, height, dome, random):
    up = np.array([lean[0], lean[1], 1.0])
    stem = np.array([foot + up * height * t for t in (-0.15, 0.05, 0.45, 0.9)])
    start = len(flesh.vertices)
    add_tube(flesh, stem, np.array([0.17, 0.155, 0.11, 0.10]) * cap, 6, (1.0, 1.0))
    u, v = flesh.texcoords[start].T
    flesh.texcoords[start] = np.stack([0.52 + 0.46 * (u - u.min()) / np.ptp(u), 0.02 + 0.44 * v / v.max()], 1)
    turn = random.between(0.0, 2.0 * math.pi)
    angles = np.linspace(0.0, 2.0 * math.pi, 10)
    over = np.array([0.04, 0.45, 0.8, 1.0])
    profile = dome * np.sqrt(np.clip(1.02 - over**2, 0.0, 1.0))
    # From the rim to the top: then the rows run upwards and the normals point outwards.
    _cap(flesh, foot, up, cap, height, over[::-1], profile[::-1], angles + turn, (0.25, 0.5, 0.24))
    under = np.array([0.10, 1.0])
    _cap(flesh, foot, up, cap, height, under, np.array([0.10, 0.02]), angles + turn, (0.75, 0.75, 0.23))


def _cap(flesh, foot, up, cap, height, radii, lifts, angles, disc):
    centre_u, centre_v, size = disc
    c, s = np.cos(angles), np.sin(angles)
    points = np.empty((len(radii), len(angles), 3))
    texcoords = np.empty((len(radii), len(angles), 2))
    for k, (r, lift) in enumerate(zip(radii, lifts, strict=True)):
        middle = foot + up * (height * 0.86 + lift * cap * 0.5)
        points[k] = middle + 0.5 * cap * r * np.stack([c, s, 0.0 * c], axis=1)
        texcoords[k] = np.stack([centre_u + size * r * c, centre_v + size * r * s], axis=1)
    add_grid(flesh, points, texcoords, wrap=True)
