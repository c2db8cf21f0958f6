"""Conifers: spruces hung with boughs, pines with tufts, and a dead trunk."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from builder.branching import GOLDEN_ANGLE, Habit, grow, streams, trunk
from builder.foliage import CELLS
from builder.needles import BOUGHS
from builder.noise import smooth
from builder.surface import Surface, add_card, add_tube
from builder.trees import add_limbs, add_trunk, leaf_out, shade_crown


@dataclass(frozen=True)
class Spruce:
    """A spruce: `boughs` of up to `reach` units, from the fraction `bare` of its height on."""

    height: float
    radius: float
    reach: float
    boughs: int
    bare: float = 0.08
    segments: int = 2
    sides: int = 9
    dead: int = 10


def spruce(seed, kind):
    """(bark, boughs) of one spruce."""
    shape, hang, sticks = streams(seed, 3)
    stem = trunk(shape, kind.height, kind.radius, 0.03, 0.02, 10, 0.1, 0.85)
    bark, needles = Surface(), Surface()
    add_trunk(bark, stem, kind.radius, kind.sides, 0.6, 3, shape, (7.0, 14.0))
    _dead_sticks(bark, stem, kind, sticks)
    angle = 0.0
    for k in range(kind.boughs):
        share = (k + hang.between(0.1, 0.9)) / kind.boughs
        angle += GOLDEN_ANGLE + hang.around(0.0, 0.5)
        point, _, radius = stem.at(kind.bare + (0.975 - kind.bare) * share)
        # The longest boughs are some way up: the lowest starve in the shade.
        reach = kind.reach * (1.0 - share) ** 0.8 * smooth(-0.22, 0.14, share) + 0.06 * kind.reach
        length = reach * hang.between(0.7, 1.15)
        pitch = math.radians(-16.0 + 62.0 * share**1.3) + hang.around(0.0, 0.2)
        out = np.array([math.cos(angle), math.sin(angle), 0.0])
        add_card(
            needles,
            point - out * radius * 0.5,
            out * math.cos(pitch) + np.array([0.0, 0.0, math.sin(pitch)]),
            (0.0, 0.0, 1.0),
            (0.62 * length + 1.6, length),
            BOUGHS[hang.below(3)],
            droop=0.6 - 0.9 * share,
            segments=kind.segments if length > 0.4 * kind.reach else 1,
            # The twigs of a spruce hang: a steep roof, which also has a height when seen from the side.
            fold=-0.85 + 0.35 * share,
            color=1.0 - 0.25 * hang.units(3) * [1.0, 0.7, 1.0],
        )
    top, _, _ = stem.at(0.97)
    for k in range(3):
        side = np.array([math.cos(2.1 * k), math.sin(2.1 * k), 0.0])
        size = 0.11 * kind.height
        add_card(needles, top - [0, 0, 0.55 * size], (0.02, 0.0, 1.0), side, (0.5 * size, size), BOUGHS[k])
    needles.lift(0.015 * kind.height)
    _shade_cone(bark, needles, kind)
    return bark, needles


def _dead_sticks(bark, stem, kind, random):
    """Thin broken twigs on the bare part of the trunk."""
    for _ in range(kind.dead):
        point, _, radius = stem.at(random.between(0.07, kind.bare + 0.25))
        angle = random.between(0.0, 2.0 * math.pi)
        out = np.array([math.cos(angle), math.sin(angle), random.between(-0.35, 0.1)])
        length = kind.reach * random.between(0.12, 0.45)
        path = np.array(
            [point, point + out * length * 0.5, point + out * length + [0.0, 0.0, -0.12 * length]]
        )
        add_tube(bark, path, (0.14 * radius + 0.08, 0.09, 0.03), 3, (6.0, 12.0), offset=random.units(1)[0])


def _shade_cone(bark, needles, kind):
    """Darker towards the trunk and below; normals lean outwards and up, as those of a cone."""

    def reach_at(z):
        return np.maximum(kind.reach * (1.0 - z / kind.height) ** 0.85, 0.08 * kind.reach)

    def inside(vertices):
        r = np.hypot(vertices[:, 0], vertices[:, 1]) / reach_at(np.clip(vertices[:, 2], 0.0, kind.height))
        return 0.36 + 0.64 * smooth(0.05, 0.85, r)

    needles.shade(inside)
    bark.shade(
        lambda v: (
            0.45 + 0.55 * smooth(kind.bare * kind.height + 10.0, kind.bare * kind.height - 12.0, v[:, 2])
        )
    )
    bark.shade(lambda v: 0.6 + 0.4 * smooth(-1.0, 7.0, v[:, 2]))
    needles.bend_normals(
        np.array([0.0, 0.0, 0.25 * kind.height]), np.array([1.0, 1.0, 2.2]) * kind.reach, 0.6
    )


@dataclass(frozen=True)
class Pine:
    """A pine: a long bare trunk under a flat crown of tufts."""

    height: float
    radius: float
    habits: tuple
    card: float
    cards: tuple = (0.5, 0.98)


def pine(seed, kind):
    """(bark, tufts) of one pine."""
    shape, limbs, tufts = streams(seed, 3)
    stem = trunk(shape, kind.height, kind.radius, 0.07, 0.06, 12, 0.4, 0.6)
    grow(limbs, stem, kind.habits, lambda t: 0.65 + 0.6 * math.sin(math.pi * (0.15 + 0.75 * t)))
    bark, needles = Surface(), Surface()
    add_trunk(bark, stem, kind.radius, 11, 0.5, 3, shape, (9.0, 18.0))
    add_limbs(bark, stem, (11, 4, 3), limbs, (9.0, 18.0))
    for branch in stem.walk():
        places = kind.cards if branch.level == 2 else (0.98,) if branch.level == 0 else (0.7, 0.98)
        leaf_out(needles, branch, places, kind.card, 0.0, tufts, CELLS)
    shade_crown(bark, needles, 0.6, 0.7)
    return bark, needles


def dead_tree(seed, height=58.0, radius=2.7):
    """The bark-less trunk of a tree that lost its top: wood alone."""
    shape, limbs = streams(seed, 2)
    stem = trunk(shape, height, radius, 0.12, 0.07, 11, 1.1, 0.75)
    habits = (
        Habit(9, (0.34, 0.97), (74.0, 42.0), (0.34, 0.16), 0.42, 0.26, 0.3, 5),
        Habit(3, (0.3, 0.95), (58.0, 40.0), (0.5, 0.3), 0.5, 0.3, 0.1, 3),
    )
    grow(limbs, stem, habits, lambda t: limbs.between(0.35, 1.1))
    wood = Surface()
    add_trunk(wood, stem, radius, 12, 0.9, 4, shape, (8.0, 16.0))
    _splinters(wood, stem, shape)
    add_limbs(wood, stem, (12, 5, 3), limbs, (8.0, 16.0))
    wood.shade(lambda v: 0.5 + 0.5 * smooth(-1.0, 8.0, v[:, 2]))
    return wood


def _splinters(wood, stem, random):
    """Broken spikes where the trunk snapped."""
    top, direction, radius = stem.at(0.999)
    for k in range(7):
        angle = 2.0 * math.pi * k / 7.0 + random.around(0.0, 0.3)
        foot = top + 0.6 * radius * np.array([math.cos(angle), math.sin(angle), -0.6])
        tip = foot + direction * random.between(1.2, 5.0) + 0.3 * random.direction()
        path = np.array([foot - direction * 0.8, (foot + tip) / 2.0, tip])
        add_tube(wood, path, (0.55 * radius, 0.34 * radius, 0.02), 4, (8.0, 16.0), offset=random.units(1)[0])


SPRUCE = Spruce(height=104.0, radius=2.5, reach=22.0, boughs=185, bare=0.13)
SPRUCE_SLIM = Spruce(height=86.0, radius=1.8, reach=14.5, boughs=105, bare=0.14, sides=7)
SPRUCE_YOUNG = Spruce(height=26.0, radius=0.6, reach=9.5, boughs=46, bare=0.07, sides=6, dead=0)
PINE = Pine(
    height=86.0,
    radius=2.4,
    habits=(
        Habit(12, (0.56, 1.0), (78.0, 40.0), (0.27, 0.14), 0.45, 0.22, 0.6, 4),
        Habit(4, (0.4, 1.0), (55.0, 40.0), (0.48, 0.36), 0.5, 0.2, 0.5, 1),
    ),
    card=9.5,
)
