"""The pictures of the bonsai: leaves with alpha, bark, moss and a crackled glaze; all but the leaves tile."""

from __future__ import annotations

import math

import numpy as np

from builder.bark import scaly
from builder.canvas import Canvas, opaque
from builder.foliage import CELLS, oval
from builder.noise import cells, mix, relief, smooth, spectral
from builder.randomness import Random

LOBES = ((0.0, 1.0), (0.68, 0.88), (-0.68, 0.88), (1.36, 0.62), (-1.36, 0.62), (2.05, 0.34), (-2.05, 0.34))
"""Angle to the stem and length of each lobe of a maple leaf."""
TONES = ((0.50, 0.055, 0.014), (0.78, 0.200, 0.030))
"""Linear colours between which each leaf's own is chosen."""
LAST = 3
"""The cell that holds a single leaf; the others hold sprays."""


def maple_leaves(seed, size=512):
    """Three sprays and a single leaf, uint8 RGBA."""
    canvas = Canvas(2 * size, 2 * size, TONES[0])
    for k, (u0, v0, _, _) in enumerate(CELLS):
        random = Random(seed + k)
        middle = np.array((u0 + 0.25, v0 + 0.25))
        if k == LAST:
            _maple_leaf(canvas, (middle[0], v0 + 0.15), math.pi / 2.0, 0.28, TONES[1])
        else:
            _spray(canvas, random, middle)
    return canvas.pixels(2)


def _spray(canvas, random, middle):
    """A twig with leaves in pairs, the lower ones behind."""
    stem = middle - np.array((0.0, 0.235))
    canvas.twig([stem, middle], [0.004, 0.002], (0.12, 0.045, 0.03))
    spots = [(0.34, 1.0), (0.34, -1.0), (0.62, 1.0), (0.62, -1.0), (0.86, 0.75), (0.86, -0.75), (0.98, 0.0)]
    for k, (along, side) in enumerate(spots):
        start = stem + np.array((0.0, 0.235 * along))
        angle = math.pi / 2.0 - side * random.between(0.85, 1.25)
        end = start + random.between(0.035, 0.07) * np.array([math.cos(angle), math.sin(angle)])
        canvas.twig([start, end], [0.0022, 0.0016], (0.20, 0.05, 0.03))
        share = random.units(2)
        tone = np.asarray(TONES[0]) + (np.asarray(TONES[1]) - TONES[0]) * share[0]
        shade = 0.66 + 0.40 * k / len(spots)
        _maple_leaf(canvas, end, angle + random.around(0.0, 0.25), random.between(0.125, 0.15), tone * shade)


def _maple_leaf(canvas, at, angle, length, color):
    """Lobes from one point, the smallest drawn first."""
    for turn, share in reversed(LOBES):
        outline = oval(0.155 + 0.03 * share, 1.15, 0.40)
        canvas.leaf(at[0], at[1], angle + turn, length * share, outline, color, vein=0.6)


def bark(seed):
    """Grey-brown bark in small plates."""
    return opaque(scaly(seed, (256, 128), (0.20, 0.155, 0.12), (0.055, 0.042, 0.034), (14, 6)))


def moss(seed, size=128):
    """Cushions of moss."""
    shape = (size, size)
    first, _, which = cells(shape, seed, (9, 9), (5.0 * spectral(shape, seed + 1, (16, 64)),) * 2)
    fine = spectral(shape, seed + 2, (2, 7), 0.2)
    height = smooth(0.9, 0.0, first)
    color = mix((0.035, 0.060, 0.012), (0.125, 0.190, 0.035), np.clip(height + 0.18 * fine, 0.0, 1.0))
    color = color * (0.8 + 0.4 * which)[..., None]
    return opaque(color * relief(height + 0.1 * fine, 1.2)[..., None])


def glaze(seed, shape=(256, 256)):
    """A celadon glaze that runs down from the rim, with a net of fine cracks; v goes from foot to rim."""
    y = 1.0 - (np.arange(shape[0])[:, None] + 0.5) / shape[0] + np.zeros(shape)
    # what runs down is the same at both sides, so that it tiles around
    run = spectral((64, shape[1]), seed, (26, 128), 0.9)[20][None, :]
    pool = spectral(shape, seed + 1, (30, 200), 1.1)
    edge = 0.30 + 0.13 * run
    thick = smooth(edge - 0.015, edge + 0.05, y)
    deep, pale, clay = (0.050, 0.185, 0.175), (0.235, 0.44, 0.375), (0.115, 0.058, 0.036)
    color = mix(deep, pale, smooth(-0.3, 1.0, 1.7 * y - 0.9 + 0.22 * pool))
    # thickest, and darkest, where it stopped
    bead = smooth(0.10, 0.02, np.abs(y - edge - 0.05))
    color = mix(color, np.array((0.022, 0.105, 0.115)), 0.8 * bead)
    warp = (4.0 * spectral(shape, seed + 2, (30, 120)), 4.0 * spectral(shape, seed + 3, (30, 120)))
    first, second, _ = cells(shape, seed + 4, (9, 9), warp)
    color = mix(color, color * 0.62, smooth(0.045, 0.008, second - first))
    speck = spectral(shape, seed + 5, (2, 8), 0.2)
    body = np.asarray(clay) * (1.0 + 0.14 * speck)[..., None]
    return opaque(mix(body, color, thick))
