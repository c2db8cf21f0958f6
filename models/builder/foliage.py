"""Leaf cards of broadleaved trees and bushes: twigs with leaves, four to a picture."""

from __future__ import annotations

import math

import numpy as np

from builder.canvas import Canvas
from builder.randomness import Random

CELLS = ((0.0, 0.5, 0.5, 1.0), (0.5, 0.5, 1.0, 1.0), (0.0, 0.0, 0.5, 0.5), (0.5, 0.0, 1.0, 0.5))
"""(u0, v0, u1, v1) of the four cards; each stem enters at the middle of the lower edge."""


def oval(width, point=1.0, widest=0.45):
    """An outline that is widest at the given part and tapers to a tip."""

    def outline(s):
        power = math.log(0.5) / math.log(widest)
        return width * np.sin(np.pi * np.clip(s, 0.0, 1.0) ** power) ** point

    return outline


def lobed(width, lobes=3.5, depth=0.30):
    """Round lobes, an oak's."""

    def outline(s):
        body = np.sin(np.pi * np.clip(s, 0.0, 1.0) ** 1.25) ** 0.8
        return width * body * (1.0 - depth * (0.5 + 0.5 * np.cos(2.0 * np.pi * (lobes * s + 0.1))))

    return outline


def toothed(width, point, widest, teeth=9.0):
    """An oval with a saw's edge: birch, hazel."""
    body = oval(width, point, widest)
    return lambda s: body(s) * (1.0 - 0.16 * ((teeth * s) % 1.0))


def leafy_cards(seed, outline, tones, leaf=0.085, count=62, size=1024, twig=(0.07, 0.05, 0.035), spray=0.95):
    """Four cards of twigs with leaves, as uint8 RGBA.

    `tones` are linear colours between which each leaf's own is chosen; `leaf` is a leaf's length in
    widths of the picture (two cards wide); `spray` how far leaves stand off their twig.
    """
    canvas = Canvas(2 * size, 2 * size, tones[0])
    for k, (u0, v0, _, _) in enumerate(CELLS):
        _one_card(canvas, Random(seed + k), (u0 + 0.25, v0 + 0.006), outline, tones, leaf, count, twig, spray)
    return canvas.pixels(2)


def _one_card(canvas, random, stem, outline, tones, leaf, count, color, spray):
    low = (stem[0] - 0.25 + 0.004, stem[1] - 0.002)
    spots = []
    sprigs = 7
    base, reach = np.array(stem), 0.42
    for k in range(sprigs):
        # The middle twig goes up, the others leave it left and right, the lower ones more sideways.
        t = k / (sprigs - 1)
        side = -1.0 if k % 2 else 1.0
        start = base + np.array([random.around(0.0, 0.006), reach * 0.66 * max(t - 0.12, 0.0)])
        angle = math.pi / 2.0 - side * (1.15 - 0.85 * t) + random.around(0.0, 0.15)
        if k == sprigs - 1:
            start, angle = base, math.pi / 2.0 + random.around(0.0, 0.08)
        length = (0.235 - 0.05 * t) * random.between(0.85, 1.1) if k < sprigs - 1 else reach
        points = [start]
        for _ in range(5):
            points.append(points[-1] + length / 5.0 * np.array([math.cos(angle), math.sin(angle)]))
            angle += random.around(0.0, 0.18) + 0.05 * side
        widths = np.linspace(0.0032 if k == sprigs - 1 else 0.002, 0.0009, 6)
        canvas.twig(points, widths, color)
        spots.append((points, k))
    for n in range(count):
        points, _ = spots[n % sprigs]
        s = 5.0 * (0.12 + 0.88 * random.units(1)[0] ** 0.8)
        i = min(int(s), 4)
        at = points[i] + (points[i + 1] - points[i]) * (s - i)
        heading = math.atan2(*(points[i + 1] - points[i])[::-1])
        side = 1.0 if (n // sprigs) % 2 else -1.0
        angle = heading + side * spray * random.between(0.4, 1.5) * (1.25 - 0.16 * s)
        size = leaf * random.between(0.72, 1.12)
        tip = at + size * np.array([math.cos(angle), math.sin(angle)])
        tip_room = np.clip(tip, low, (low[0] + 0.492, low[1] + 0.496))
        if np.abs(tip - tip_room).max() > 0.3 * size:
            continue
        size *= 1.0 - np.abs(tip - tip_room).max() / size
        mixing = random.units(2)
        tone = np.asarray(tones[0]) * (1.0 - mixing[0]) + np.asarray(tones[1]) * mixing[0]
        # Leaves that were drawn first lie behind: they are darker.
        depth = 0.62 + 0.42 * n / count
        canvas.leaf(at[0], at[1], angle, size, outline, tone * depth * (0.9 + 0.2 * mixing[1]))
