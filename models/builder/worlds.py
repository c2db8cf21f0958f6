"""Planets with a ground: one of oceans and weather, one of red dust, and a moon."""

from __future__ import annotations

import math

import numpy as np

from builder.noise import fractal, over, smooth, solid
from builder.randomness import Random
from builder.sphere import Atlas, Tiles, lit
from builder.surface import unit


def ocean_planet(seed, pixels=320):
    """Continents, seas that are lighter over the shelves, ice at the poles, and weather."""
    atlas = Atlas(pixels)
    d = atlas.directions
    bent = d + 0.15 * np.stack([fractal(d, seed + 40 * k, 0.5, 4, 0.6) for k in (1, 2, 3)], axis=-1)
    high = fractal(bent, seed, 0.75, 7, 0.52) - 0.12
    rough = fractal(d, seed + 7, 0.11, 4, 0.62)
    north = np.abs(d[..., 2]) + 0.05 * rough
    damp = 1.2 * fractal(bent, seed + 11, 0.42, 5, 0.55) + 0.55 * np.cos(d[..., 2] * 9.0) + 0.15 * rough + 0.1
    sea = over(
        np.broadcast_to((0.008, 0.032, 0.105), d.shape), (0.015, 0.095, 0.19), smooth(-0.30, -0.05, high)
    )
    sea = over(sea, (0.045, 0.25, 0.28), 0.8 * smooth(-0.07, 0.0, high))
    land = over(
        np.broadcast_to((0.43, 0.30, 0.155), d.shape), (0.115, 0.155, 0.040), smooth(-0.45, 0.20, damp)
    )
    land = over(land, (0.025, 0.080, 0.020), smooth(0.15, 0.75, damp))
    land = over(land, (0.16, 0.16, 0.105), smooth(0.66, 0.84, north))
    land = over(land, (0.20, 0.145, 0.095), 0.85 * smooth(0.42, 0.72, high + 0.16 * rough))
    land = over(land, (0.66, 0.67, 0.69), smooth(0.80, 0.95, high + 0.16 * rough))
    land = over(land, (0.46, 0.39, 0.26), 0.5 * smooth(0.025, 0.0, high))
    relief = lit(atlas.slope(high + 0.035 * rough), 0.09)
    color = over(
        sea, land * (np.clip(1.0 + 0.16 * rough, 0.5, 1.5) * relief)[..., None], smooth(-0.006, 0.006, high)
    )
    ice = smooth(0.925, 0.945, np.abs(d[..., 2]) + 0.035 * rough + 0.04 * smooth(-0.05, 0.1, high))
    color = over(color, (0.68, 0.73, 0.78), ice)
    return atlas.image(np.clip(over(color, (0.76, 0.77, 0.79), _clouds(d, seed + 60)), 0.01, 0.85))


def _clouds(d, seed):
    """Cover 0..0.95: belts of cloud along the latitudes, wound up where storms turn."""
    p = d
    for centre, radius, turn in (
        ((-0.45, -0.72, 0.50), 0.26, 3.0),
        ((0.55, -0.68, -0.48), 0.22, -3.0),
        ((0.5, 0.7, 0.5), 0.26, 2.8),
        ((-0.7, 0.5, -0.5), 0.24, -3.0),
        ((0.95, 0.1, 0.28), 0.15, 3.0),
    ):
        axis = np.asarray(centre) / np.linalg.norm(centre)
        r = np.linalg.norm(d - axis, axis=-1) / radius
        angle = turn * np.exp(-1.8 * r)[..., None] * smooth(2.4, 1.4, r)[..., None]
        p = (
            p * np.cos(angle)
            + np.cross(np.broadcast_to(axis, p.shape), p) * np.sin(angle)
            + axis * ((p @ axis)[..., None] * (1.0 - np.cos(angle)))
        )
    warped = p + 0.10 * np.stack([fractal(p, seed + 20 * k, 0.45, 3) for k in (1, 2, 3)], axis=-1)
    dense = fractal(warped * np.array((1.0, 1.0, 1.8)), seed, 0.40, 6, 0.6)
    belts = 0.22 * np.cos(d[..., 2] * 10.5) + 0.12 * smooth(0.35, 0.7, np.abs(d[..., 2]))
    wisps = fractal(warped * np.array((1.0, 1.0, 2.5)), seed + 70, 0.11, 4, 0.6)
    return 0.93 * smooth(0.22, 1.05, dense + belts + 0.28 * wisps)


def craters(d, seed, count, smallest, largest, fresh=0.0):
    """Height (6, n, n) of overlapping craters, and the bright dust that fresh ones threw out."""
    random = Random(seed)
    height, dust = np.zeros(d.shape[:-1]), np.zeros(d.shape[:-1])
    places = [random.direction() for _ in range(count)]
    # Few are large: the number above a size falls with its square.
    share = (np.arange(count) + 0.5) / count
    sizes = smallest / np.sqrt(share + (smallest / largest) ** 2)
    tiles = Tiles(d)
    flat, level, bright = d.reshape(-1, 3), height.reshape(-1), dust.reshape(-1)
    for k, (centre, size) in enumerate(zip(places, sizes, strict=True)):
        near = tiles.within(min(2.6 * size, 3.0), centre)
        q = flat[near]
        r = np.linalg.norm(q - centre, axis=1) / size
        r = r * (1.0 + 0.09 * solid(q, seed + 5, 0.6 * size))
        deep = 0.22 * size
        bowl = np.maximum(-deep + 1.35 * deep * r**2.4, -0.72 * deep)
        if size > 0.12:
            bowl = bowl + 0.22 * deep * np.exp(-((r / 0.22) ** 2))
        rim = 0.35 * deep * np.exp(-(r - 1.0) / 0.28)
        # A new crater wipes out what was there before.
        level[near] = np.where(r < 1.0, 0.25 * level[near] + bowl, level[near] * smooth(0.9, 1.6, r) + rim)
        bright[near] *= smooth(0.6, 1.3, r)
        if fresh and k % 9 == 4 and size > 1.6 * smallest:
            _rays(tiles, flat, bright, centre, size, fresh, random)
    return height, dust


def _rays(tiles, flat, bright, centre, size, fresh, random):
    """Streaks away from a crater."""
    side = unit(np.cross(centre, (0.3, 0.5, 0.81)))
    other = np.cross(centre, side)
    near = tiles.within(min(9.0 * size, 3.0), centre)
    q = flat[near]
    r = np.linalg.norm(q - centre, axis=1) / size
    angle = np.arctan2(q @ other, q @ side)
    streak = np.zeros(len(q))
    for _ in range(13):
        turn, width, reach = random.between(0.0, 6.2832), random.between(0.04, 0.16), random.between(3.0, 8.5)
        off = np.abs((angle - turn + math.pi) % (2.0 * math.pi) - math.pi)
        ray = smooth(width, 0.1 * width, off + 0.03 * solid(q, 77, 0.3 * size)) * smooth(reach, 1.0, r)
        streak = np.maximum(streak, random.between(0.3, 0.85) * ray)
    halo = smooth(2.2, 0.9, r)
    bright[near] = np.maximum(bright[near], fresh * np.maximum(0.9 * halo, streak))


def moon(seed, pixels=256):
    """Grey highlands full of craters, dark plains, and a few young craters with bright rays."""
    atlas = Atlas(pixels)
    d = atlas.directions
    height, dust = craters(d, seed, 700, 0.0135, 0.26, 1.0)
    rough = fractal(d, seed + 20, 0.10, 4, 0.6)
    broad = fractal(d + 0.1 * rough[..., None], seed + 30, 0.9, 4)
    plain = smooth(0.36, 0.56, broad - 0.28 * d[..., 1])
    relief = lit(atlas.slope(height * (1.0 - 0.55 * plain) + 0.0025 * rough), 1.5)
    color = over(np.broadcast_to((0.32, 0.305, 0.285), d.shape), (0.105, 0.103, 0.104), plain)
    color = color * (1.0 + 0.20 * rough + 0.10 * broad)[..., None]
    color = color * np.clip(1.0 + 7.0 * height * (1.0 - 0.5 * plain), 0.6, 1.3)[..., None]
    color = over(color, (0.46, 0.45, 0.43), 0.75 * np.clip(dust, 0.0, 1.0) * (0.8 + 0.3 * rough))
    return atlas.image(np.clip(color * relief[..., None], 0.02, 0.7))


def rocky_planet(seed, pixels=320):
    """Red dust, dark old rock, craters, one long canyon, and small caps of frost."""
    atlas = Atlas(pixels)
    d = atlas.directions
    rough = fractal(d, seed + 20, 0.12, 4, 0.6)
    broad = fractal(d + 0.12 * fractal(d, seed + 24, 0.4, 2)[..., None], seed + 30, 0.95, 5)
    height, _ = craters(d, seed, 330, 0.018, 0.17)
    old = smooth(-0.25, 0.3, broad + 0.9 * -d[..., 2])
    height = height * (0.45 + 0.55 * old)
    depth = _canyon(d, seed + 50)
    color = over(
        np.broadcast_to((0.40, 0.172, 0.070), d.shape),
        (0.295, 0.108, 0.045),
        smooth(-0.3, 0.5, rough + 0.3 * broad),
    )
    color = over(color, (0.115, 0.062, 0.042), 0.8 * smooth(0.25, 0.62, broad + 0.14 * rough))
    color = over(color, (0.50, 0.275, 0.135), 0.7 * smooth(-0.2, -0.6, broad + 0.2 * rough))
    color = color * np.clip(1.0 + 9.0 * height, 0.7, 1.25)[..., None]
    color = over(color, (0.135, 0.052, 0.030), 0.8 * depth)
    layers = 0.5 + 0.5 * np.cos(depth * 26.0)
    color = color * (1.0 + 0.07 * layers * (depth > 0.02) + 0.16 * rough)[..., None]
    relief = lit(atlas.slope(height + 0.004 * rough + 0.02 * broad - 0.030 * depth), 1.4)
    color = color * relief[..., None]
    frost = smooth(
        0.925,
        0.945,
        np.abs(d[..., 2])
        + 0.022 * rough
        + 0.012 * np.sin(6.0 * np.arctan2(d[..., 1], d[..., 0]))
        + 0.015 * np.sign(d[..., 2]),
    )
    return atlas.image(np.clip(over(color, (0.68, 0.64, 0.60), 0.95 * frost), 0.02, 0.8))


def _canyon(d, seed):
    """Depth 0..1 of a rift: troughs side by side along a bent arc, each with a beginning and an end."""
    pole = unit(np.array((0.10, 0.22, 1.0)))
    start = unit(np.cross((1.0, 0.0, 0.0), pole))
    angle = np.arctan2(d @ np.cross(pole, start), d @ start)
    off = d @ pole + 0.10 + 0.045 * fractal(d, seed, 0.4, 3)
    ragged = fractal(d, seed + 4, 0.08, 4, 0.65)
    depth = np.zeros(d.shape[:-1])
    for k, (middle, width, first, last) in enumerate(
        (
            (0.0, 0.036, -0.75, 0.50),
            (0.045, 0.020, -0.35, 0.30),
            (-0.040, 0.018, -0.10, 0.85),
            (0.085, 0.012, -0.05, 0.65),
            (0.010, 0.040, 0.42, 0.72),
            (-0.075, 0.010, -0.62, 0.0),
        )
    ):
        across = np.abs(off - middle - 0.02 * solid(d, seed + 10 + k, 0.22))
        half = (
            width * smooth(first, first + 0.3, angle) * smooth(last, last - 0.3, angle) * (1.0 + 0.5 * ragged)
        )
        depth = np.maximum(
            depth, smooth(1.0, 0.35, across / np.maximum(half, 1e-4)) * smooth(0.003, 0.010, half)
        )
    return depth
