"""The slice of a trunk on which the lantern stands, with moss and mushrooms."""

from __future__ import annotations

import numpy as np

from builder.noise import fractal, smooth
from builder.randomness import Random
from builder.solids import Piece, arc, circle, join, lathe, sweep

TOP = 0.55
"""Height of the cut face, in decimetres."""


def log_side():
    bulge = [(2.42, 0.0), (2.50, 0.10), (2.50, 0.38), (2.44, TOP - 0.05), (2.38, TOP)]
    return lathe(bulge, 72).bent(_lobed)


def log_face():
    """The cut face around the lantern's foot; its texture is laid on from above."""
    face = lathe([(r, TOP) for r in (2.38, 1.6, 0.5)], 72)
    flat = 0.5 + 0.5 * face.points[:, :2] / 2.45
    return Piece(face.points, face.triangles, flat, face.colors).bent(_lobed)


def _lobed(points):
    """Not quite round, as trees are."""
    angle = np.arctan2(points[:, 1], points[:, 0])
    grown = 1.0 + 0.035 * np.sin(3.0 * angle + 0.6) + 0.02 * np.sin(7.0 * angle + 2.0)
    return points * np.stack([grown, grown, np.ones_like(grown)], axis=1)


def moss_cushions():
    """Cushions on the face, and one that hangs over the edge."""
    random = Random(860)
    cushions = []
    for x, y, size in (
        (-1.25, -1.25, 0.62),
        (-1.72, -0.75, 0.50),
        (-0.72, -1.62, 0.42),
        (1.62, -0.95, 0.40),
        (1.30, 1.25, 0.60),
        (-1.40, 1.30, 0.55),
        (1.95, -0.45, 0.30),
    ):
        dome = lathe([(1.0, -0.10), (0.97, 0.05), *arc((0.0, 0.0), 1.0, 22.0, 90.0, 4)], 18)
        seed = random.below(1000)

        def swell(points, seed=seed):
            return points * (1.0 + 0.20 * fractal(points, seed, 0.8, 3))[:, None]

        cushion = dome.bent(swell).scaled(size, size * 0.85, size * 0.34)
        cushions.append(cushion.turned((0, 0, 1), 360.0 * random.units(1)[0]).moved(x, y, TOP - 0.01))
    whole = join(*cushions)
    flat = whole.points[:, :2] / 5.0 + 0.5
    deep = whole.painted(lambda points: 0.55 + 0.45 * smooth(TOP - 0.04, TOP + 0.16, points[:, 2]))
    return Piece(deep.points, deep.triangles, np.clip(flat, 0.0, 1.0), deep.colors)


def mushrooms():
    """A family of small ones in the moss."""
    grown = []
    for x, y, height, lean in (
        (-1.42, -1.05, 0.62, 9.0),
        (-1.22, -1.38, 0.44, -12.0),
        (-1.62, -1.22, 0.36, 14.0),
        (1.66, -1.02, 0.40, -8.0),
    ):
        stem = sweep([(0, 0, 0), (0.02, 0, 0.5), (0, 0, 1.0)], circle(0.075, 8), [1.25, 0.9, 0.8])
        stem = stem.painted((0.62, 0.52, 0.38))
        cap = lathe(
            [(0.0, 0.88), (0.20, 0.86), (0.33, 0.80), *arc((0.0, 0.72), 0.36, 14.0, 90.0, 5)], 16
        ).painted(lambda points: _cap_tone(points))
        whole = join(stem, cap).scaled(0.8 * height + 0.1, 0.8 * height + 0.1, height)
        grown.append(whole.turned((1, 0.4, 0), lean).moved(x, y, TOP + 0.06))
    return join(*grown)


def _cap_tone(points):
    """Red-brown above, pale gills below and a pale rim."""
    upper = smooth(0.80, 0.84, points[:, 2])[:, None]
    rim = smooth(0.30, 0.36, np.hypot(points[:, 0], points[:, 1]))[:, None] * 0.5
    top = np.array((0.50, 0.115, 0.035)) * (1.0 - rim) + np.array((0.68, 0.40, 0.20)) * rim
    return np.array((0.50, 0.38, 0.26)) * (1.0 - upper) + top * upper
