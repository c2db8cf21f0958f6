"""Broadleaved trees: a skeleton, its bark, and leaf cards on its outer branches."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from builder.branching import Habit, grow, streams, trunk
from builder.foliage import CELLS
from builder.noise import smooth
from builder.surface import Surface, add_card, add_tube, perpendicular, rotate, unit


@dataclass(frozen=True)
class Broadleaf:
    """What makes a broadleaved tree look like its kind.

    Attributes
    ----------
    height, radius : float
        Of the trunk, in scene units.
    habits : tuple of Habit
        Limbs, then branches.
    sides : tuple of int
        Sides of the tubes of trunk, limbs, branches; 0 leaves a level without bark, hidden by leaves.
    card : float
        Size of a leaf card.
    cards : tuple of float
        Where cards sit on a branch of the last level, as fractions of its length.
    droop : float
        Bending of a card towards the ground, in radians.
    outline : callable
        Length of a limb by its place in the crown, 0 low to 1 high.
    flare, lobes : float, int
        Widening of the trunk at its foot, and the number of roots that show.
    lean, wobble : float
        Of the trunk.
    tile : (float, float)
        Scene units that one repeat of the bark covers.
    segments : int
        Rings of the trunk.
    twig : (float, float, float)
        What the bark's colour is multiplied by at the tips of limbs and on all of the thin branches.
    """

    height: float
    radius: float
    habits: tuple
    sides: tuple = (12, 6, 3)
    card: float = 10.0
    cards: tuple = (0.4, 0.72, 1.0)
    droop: float = 0.35
    outline: object = None
    flare: float = 0.9
    lobes: int = 5
    lean: float = 0.05
    wobble: float = 0.05
    tile: tuple = (9.0, 18.0)
    segments: int = 12
    twig: tuple = (0.8, 0.8, 0.8)


_FEET = (0.0, 0.01, 0.024, 0.05)
"""Extra rings at a trunk's foot, as fractions of its height: the flare is steep there."""


def broadleaf(seed, kind):
    """(bark, leaves) of one tree whose foot is at the origin."""
    shape, limbs, leaves_at = streams(seed, 3)
    stem = trunk(shape, kind.height, kind.radius, kind.lean, kind.wobble, kind.segments)
    grow(limbs, stem, kind.habits, kind.outline)
    bark, leaves = Surface(), Surface()
    add_trunk(bark, stem, kind.radius, kind.sides[0], kind.flare, kind.lobes, shape, kind.tile)
    add_limbs(bark, stem, kind.sides, limbs, kind.tile, kind.twig)
    last = len(kind.habits)
    for branch in stem.walk():
        if branch.level == last:
            leaf_out(leaves, branch, kind.cards, kind.card, kind.droop, leaves_at)
        else:
            places = (0.97,) if branch is stem else (0.55, 0.78, 0.97)
            leaf_out(leaves, branch, places, kind.card, kind.droop, leaves_at)
    shade_crown(bark, leaves)
    return bark, leaves


def add_trunk(bark, stem, radius, sides, flare, lobes, random, tile):
    """The trunk from below the ground on, widened into roots at its foot."""
    below = stem.path[0] - np.array([0.0, 0.0, 0.9 * radius])
    feet = [stem.at(t)[0] for t in _FEET]
    path = np.vstack([below, feet, stem.path[1:]])
    heights = path[:, 2]
    radii = np.concatenate([[stem.radii[0]], [stem.at(t)[2] for t in _FEET], stem.radii[1:]])
    phases = random.units(3) * 2.0 * math.pi

    def profile(k, angle):
        near = math.exp(-max(heights[k], -0.3 * radius) / (0.75 * radius))
        waves = 0.5 + 0.5 * np.cos(lobes * angle + phases[0] + 0.5 * np.sin(angle + phases[1]))
        ribs = 1.0 + 0.035 * np.cos(7.0 * angle + phases[2] + 0.05 * heights[k])
        return ribs * (1.0 + flare * near * (0.35 + 0.65 * waves**1.5))

    add_tube(bark, path, radii, sides, tile, profile=profile)


def add_limbs(bark, stem, sides, random, tile, twig=(0.8, 0.8, 0.8)):
    """Tubes for all branches above the trunk that have sides; a collar where each leaves its parent.

    `twig` tints thin wood: limbs towards their tips, branches throughout.
    """
    for branch in stem.walk():
        if branch.level == 0 or branch.level >= len(sides) or sides[branch.level] == 0:
            continue
        radii = branch.radii.copy()
        radii[0] *= 1.25
        thin = np.linspace(0.0, 1.0, len(radii))[:, None] if branch.level == 1 else np.ones((len(radii), 1))
        tints = 1.0 + (np.asarray(twig) - 1.0) * thin
        add_tube(bark, branch.path, radii, sides[branch.level], tile, random.units(1)[0], colors=tints)


def leaf_out(leaves, branch, places, size, droop, random, cells=CELLS):
    """Cards along a branch; each grows outwards, turned about the branch at random."""
    for t in places:
        point, direction, _ = branch.at(min(t, 0.999))
        side = rotate(perpendicular(direction), direction, random.between(0.0, 2.0 * math.pi))
        spread = random.between(0.15, 0.45) if t > 0.95 else random.between(0.5, 1.1)
        heading = unit(direction * math.cos(spread) + side * math.sin(spread) + [0.0, 0.0, 0.12])
        facing = unit(random.direction() + np.array([0.0, 0.0, 0.3]))
        scale = size * random.between(0.8, 1.2)
        tint = 1.0 - 0.22 * random.units(3) * [1.0, 0.6, 1.0]
        add_card(
            leaves,
            point - heading * 0.06 * scale,
            heading,
            facing,
            (scale, scale),
            cells[random.below(len(cells))],
            droop=droop,
            segments=1,
            fold=0.4,
            color=tint,
        )


def shade_crown(bark, leaves, depth=0.55, amount=0.78):
    """Bent normals and baked occlusion: dark inside the crown and at the foot of the trunk."""
    points = np.concatenate(leaves.vertices)
    low, high = np.percentile(points, 3, axis=0), np.percentile(points, 97, axis=0)
    centre, radii = (low + high) / 2.0, np.maximum((high - low) / 2.0, 1.0)
    centre = centre - [0.0, 0.0, 0.25 * radii[2]]
    leaves.bend_normals(centre, radii * [1.0, 1.0, 1.2], amount)

    def inside(vertices):
        r = np.linalg.norm((vertices - centre) / radii, axis=1)
        return 1.0 - depth * smooth(1.0, 0.25, r)

    leaves.shade(inside)
    bark.shade(inside)
    bark.shade(lambda vertices: 0.55 + 0.45 * smooth(-1.0, 9.0, vertices[:, 2]))


OAK = Broadleaf(
    height=64.0,
    radius=3.6,
    habits=(
        Habit(13, (0.30, 1.0), (72.0, 24.0), (0.50, 0.34), 0.50, 0.20, 0.55, 5),
        Habit(7, (0.28, 1.0), (60.0, 38.0), (0.42, 0.30), 0.50, 0.22, 0.25, 1),
    ),
    sides=(14, 5, 3),
    outline=lambda t: 0.80 + 0.5 * math.sin(math.pi * (0.15 + 0.75 * t)),
    card=13.5,
    cards=(0.45, 0.95),
    wobble=0.10,
    lean=0.08,
    flare=0.8,
    lobes=4,
)
OAK_TALL = Broadleaf(
    height=84.0,
    radius=3.3,
    habits=(
        Habit(15, (0.36, 1.0), (66.0, 24.0), (0.38, 0.22), 0.46, 0.18, 0.5, 4),
        Habit(5, (0.30, 1.0), (56.0, 38.0), (0.46, 0.32), 0.50, 0.2, 0.2, 1),
    ),
    sides=(12, 5, 3),
    outline=lambda t: 0.75 + 0.5 * math.sin(math.pi * (0.1 + 0.8 * t)),
    card=13.0,
    cards=(0.45, 0.95),
    lean=0.06,
    wobble=0.06,
    flare=0.8,
    lobes=4,
)
OAK_YOUNG = Broadleaf(
    height=30.0,
    radius=0.8,
    habits=(
        Habit(10, (0.20, 1.0), (58.0, 25.0), (0.40, 0.24), 0.5, 0.16, 0.35, 3),
        Habit(3, (0.35, 1.0), (50.0, 35.0), (0.5, 0.35), 0.5, 0.2, 0.1, 2),
    ),
    sides=(7, 3, 0),
    card=8.0,
    cards=(0.5, 1.0),
    flare=0.4,
    tile=(4.0, 8.0),
    segments=8,
    wobble=0.10,
)
BIRCH = Broadleaf(
    height=88.0,
    radius=2.0,
    habits=(
        Habit(20, (0.34, 1.0), (54.0, 26.0), (0.27, 0.13), 0.40, 0.14, 0.25, 3),
        Habit(4, (0.35, 1.0), (55.0, 45.0), (0.52, 0.40), 0.45, 0.2, -1.1, 1),
    ),
    sides=(9, 4, 3),
    outline=lambda t: 0.65 + 0.55 * math.sin(math.pi * (0.2 + 0.7 * t)),
    card=10.0,
    cards=(0.5, 0.95),
    droop=0.8,
    flare=0.5,
    lean=0.09,
    wobble=0.05,
    tile=(12.0, 24.0),
    twig=(0.26, 0.20, 0.17),
)
BIRCH_SLIM = Broadleaf(
    height=72.0,
    radius=1.4,
    habits=(
        Habit(16, (0.38, 1.0), (50.0, 24.0), (0.25, 0.13), 0.40, 0.16, 0.2, 3),
        Habit(3, (0.4, 1.0), (50.0, 40.0), (0.6, 0.45), 0.45, 0.2, -1.2, 2),
    ),
    sides=(8, 3, 0),
    outline=lambda t: 0.7 + 0.5 * math.sin(math.pi * (0.2 + 0.7 * t)),
    card=10.0,
    cards=(0.5, 1.0),
    droop=0.8,
    flare=0.5,
    lean=0.14,
    wobble=0.06,
    tile=(10.0, 20.0),
    twig=(0.26, 0.20, 0.17),
)
