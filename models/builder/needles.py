"""Cards of narrow things: spruce boughs, pine tufts, fern fronds, blades of grass."""

from __future__ import annotations

import math

import numpy as np

from builder.canvas import Canvas
from builder.noise import smooth
from builder.randomness import Random


def _comb(canvas, start, end, length, color, pitch, slant, tips, random):
    """Needles on both sides of the line from `start` to `end`, in one stroke.

    Across the line a needle is a band that slants forwards; `length` shrinks to `tips` of itself at the
    end. Coordinates are those of `Canvas.leaf`.
    """
    dx, dy = end[0] - start[0], end[1] - start[1]
    reach = math.hypot(dx, dy)
    centre = ((start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0 * canvas.width / canvas.height)
    found = canvas.window(*centre, 0.5 * reach + 1.3 * length)
    if found is None:
        return
    where, px, py = found
    ux, uy = dx / reach, dy / reach
    along = (px - start[0]) * ux + (py - start[1]) * uy
    across = -(px - start[0]) * uy + (py - start[1]) * ux
    side = np.abs(across)
    root = along - side * slant
    shift = np.where(across > 0, 0.5, 0.0) + random.units(1)[0]
    phase = root / pitch + shift
    k = np.floor(phase)
    ragged = 0.75 + 0.25 * np.sin(k * 12.9898) * np.cos(k * 4.37)
    t = np.clip(root / reach, 0.0, 1.0)
    limit = length * (1.0 - (1.0 - tips) * t**1.5) * ragged * smooth(-0.01, 0.12, t)
    spine = np.abs(phase - k - 0.5) * 2.0
    thin = np.clip(1.0 - side / np.maximum(limit, 1e-6), 0.0, 1.0)
    band = smooth(0.25 + 0.75 * thin**0.5, 0.05, spine)
    inside = (root > 0.0) & (root < reach) & (side < limit)
    cover = np.where(inside, np.clip(band * 1.8, 0.0, 1.0), 0.0)
    tint = np.asarray(color) * (0.72 + 0.45 * side / length + 0.14 * np.sin(k * 7.1))[..., None]
    canvas.paint(where, np.clip(tint, 0.0, 1.0), cover)


def spruce_boughs(
    seed, tones=((0.035, 0.075, 0.03), (0.07, 0.125, 0.05)), size=1024, wood=(0.06, 0.042, 0.03)
):
    """Three boughs side by side, each a third of the picture wide and all of it high, stems below."""
    canvas = Canvas(2 * size, 2 * size, tones[0])
    for k in range(3):
        random = Random(seed + k)
        x = (k + 0.5) / 3.0
        rows = 17
        order = sorted(range(rows), key=lambda n: (n * 7) % rows)
        for n in order:
            t = (n + 0.3) / rows
            for side in (-1.0, 1.0):
                reach = 0.155 * (1.0 - t) ** 0.75 * random.between(0.78, 1.05) + 0.018
                angle = math.pi / 2.0 - side * (1.0 - 0.25 * t + random.around(0.0, 0.12))
                start = (x, 0.01 + 0.93 * t + random.around(0.0, 0.01))
                bend = angle + side * 0.15
                middle = (start[0] + 0.5 * reach * math.cos(angle), start[1] + 0.5 * reach * math.sin(angle))
                end = (middle[0] + 0.5 * reach * math.cos(bend), middle[1] + 0.5 * reach * math.sin(bend))
                shade = random.between(0.75, 1.15)
                tone = np.asarray(tones[0]) * shade + (np.asarray(tones[1]) - tones[0]) * random.between(
                    0.1, 0.9
                )
                for a, b, tip in ((start, middle, 0.9), (middle, end, 0.35)):
                    canvas.twig((a, b), (0.0022, 0.0014), wood)
                    _comb(canvas, a, b, 0.029, tone, 0.0062, 0.75, tip, random)
                if reach > 0.06:
                    for fork in (-0.75, 0.75):
                        out = (
                            middle[0] + 0.42 * reach * math.cos(angle + fork),
                            middle[1] + 0.42 * reach * math.sin(angle + fork),
                        )
                        _comb(canvas, middle, out, 0.022, tone * 0.9, 0.0062, 0.75, 0.3, random)
        canvas.twig(((x, 0.0), (x, 0.5), (x, 0.93)), (0.006, 0.004, 0.0015), wood)
        _comb(canvas, (x, 0.06), (x, 0.985), 0.026, np.asarray(tones[1]) * 0.85, 0.0062, 0.75, 0.3, random)
    return canvas.pixels(2)


BOUGHS = ((0.0, 0.0, 1.0 / 3.0, 1.0), (1.0 / 3.0, 0.0, 2.0 / 3.0, 1.0), (2.0 / 3.0, 0.0, 1.0, 1.0))


def pine_tufts(seed, tones=((0.045, 0.085, 0.035), (0.10, 0.16, 0.07)), size=1024, wood=(0.09, 0.06, 0.045)):
    """Four sprays of long needles in the cells of `foliage.CELLS`."""
    from builder.foliage import CELLS

    canvas = Canvas(2 * size, 2 * size, tones[0])
    for k, (u0, v0, _, _) in enumerate(CELLS):
        random = Random(seed + k)
        base = np.array([u0 + 0.25, v0 + 0.005])
        tufts = []
        for n in range(9):
            t = (n + 0.5) / 9.0
            side = -1.0 if n % 2 else 1.0
            angle = math.pi / 2.0 - side * (1.05 - 0.75 * t) + random.around(0.0, 0.15)
            start = base + np.array([0.0, 0.26 * t])
            end = start + (0.17 - 0.06 * t) * np.array([math.cos(angle), math.sin(angle)])
            canvas.twig((tuple(start), tuple(end)), (0.003, 0.0018), wood)
            tufts.append((end, angle))
        canvas.twig((tuple(base), tuple(base + np.array([0.0, 0.32]))), (0.005, 0.002), wood)
        tufts.append((base + np.array([0.0, 0.33]), math.pi / 2.0))
        for end, angle in tufts:
            shade = random.between(0.75, 1.15)
            for _ in range(75):
                spread = random.around(0.0, 1.35)
                length = 0.085 * random.between(0.65, 1.1) * (1.0 - 0.22 * abs(spread))
                back = random.between(0.0, 0.055)
                a = end - back * np.array([math.cos(angle), math.sin(angle)])
                b = a + length * np.array([math.cos(angle + spread), math.sin(angle + spread)])
                b = np.clip(b, (u0 + 0.004, v0 + 0.004), (u0 + 0.496, v0 + 0.496))
                mixing = random.units(1)[0]
                tone = (np.asarray(tones[0]) * (1.0 - mixing) + np.asarray(tones[1]) * mixing) * shade
                canvas.twig((tuple(a), tuple(b)), (0.0016, 0.0006), tone)
    return canvas.pixels(2)


def fern_fronds(seed, tones=((0.035, 0.10, 0.025), (0.10, 0.21, 0.055)), size=1024):
    """Three fronds side by side, each a third of the picture wide, stems below."""
    canvas = Canvas(2 * size, 2 * size, tones[0])
    for k in range(3):
        random = Random(seed + k)
        x = (k + 0.5) / 3.0
        rows = 26
        for n in range(rows):
            t = n / rows
            y = 0.10 + 0.88 * t
            reach = 0.158 * math.sin(math.pi * (0.16 + 0.84 * t) ** 0.75) ** 0.9 + 0.008
            for side in (-1.0, 1.0):
                angle = math.pi / 2.0 - side * (1.22 - 0.35 * t + random.around(0.0, 0.06))
                end = (x + reach * math.cos(angle), min(y + reach * math.sin(angle), 0.995))
                mixing = random.between(0.0, 0.9)
                tone = np.asarray(tones[0]) * (1.0 - mixing) + np.asarray(tones[1]) * mixing
                canvas.leaf(x, y, angle, reach * 1.02, _pinna, tone * random.between(0.85, 1.1), vein=0.5)
                canvas.twig(((x, y), end), (0.0012, 0.0005), tone * 0.7)
        canvas.twig(((x, 0.0), (x, 0.55), (x, 0.985)), (0.0042, 0.0028, 0.0008), (0.10, 0.10, 0.035))
    return canvas.pixels(2)


def _pinna(s):
    """A fern's leaflet: a long taper with round teeth."""
    return 0.125 * (1.0 - s) ** 0.7 * (0.45 + 0.55 * np.abs(np.sin(np.pi * (9.0 * s + 0.35))) ** 0.6)


def grass_blades(seed, tones=((0.06, 0.12, 0.02), (0.17, 0.23, 0.06)), width=1024, height=512, blades=64):
    """Two clumps side by side; blades rise from the lower edge and bend over."""
    canvas = Canvas(2 * width, 2 * height, tones[0])
    for k in range(2):
        random = Random(seed + k)
        for n in range(blades):
            side = random.around(0.0, 1.0)
            x = 0.25 + 0.5 * k + 0.15 * side
            tall = 0.49 * random.between(0.35, 1.0) * (1.0 - 0.35 * abs(side))
            lean = 0.09 * side + random.around(0.0, 0.10)
            s = np.linspace(0.0, 1.0, 8)
            px = np.clip(x + lean * s**2.2, 0.5 * k + 0.006, 0.5 * k + 0.494)
            py = tall * (s - 0.18 * abs(lean) / 0.1 * s**3)
            mixing = random.units(1)[0]
            tone = np.asarray(tones[0]) * (1.0 - mixing) + np.asarray(tones[1]) * mixing
            if random.units(1)[0] < 0.10:
                tone = np.array((0.26, 0.20, 0.09)) * random.between(0.7, 1.0)
            wide = 0.0052 * random.between(0.7, 1.25)
            half = wide * (1.0 - s**1.8) + 0.0004
            for i in range(7):
                shade = 0.5 + 0.5 * (0.35 + 0.65 * s[i]) * (0.8 + 0.4 * n / blades)
                canvas.twig(
                    ((px[i], py[i]), (px[i + 1], py[i + 1])), (half[i], half[i + 1]), tone * shade * 1.15
                )
    return canvas.pixels(2)


CLUMPS = ((0.0, 0.0, 0.5, 1.0), (0.5, 0.0, 1.0, 1.0))
