"""The pictures of the lantern: its painted glass, and the bark below it."""

from __future__ import annotations

import math

import numpy as np

from builder.bark import furrowed
from builder.canvas import Canvas, opaque
from builder.noise import cells, spectral
from builder.randomness import Random
from builder.rounding import rounded


def log_bark(seed):
    """Oak's bark, whose texture goes five times around the log."""
    fine = furrowed(seed, (512, 1024), (0.30, 0.23, 0.17), (0.07, 0.05, 0.04), (4, 12))
    return opaque(fine.reshape(128, 4, 256, 4, 3).mean((1, 3)))


def painted_glass(seed, shape=(384, 192)):
    """The light of a flame through amber glass with grasses painted on it, as emission."""
    random, cover = _grasses(seed, shape)
    height, width = shape
    reach = height / width
    y = reach * (height - 0.5 - np.arange(height)[:, None]) / height
    x = (np.arange(width)[None, :] + 0.5) / width
    away = np.hypot((x - 0.5) * 1.1, (y - 0.42 * reach) * 0.72)
    cloud = 1.0 + 0.10 * spectral(shape, seed + 1, (20, 160), 1.1)
    glow = (0.14 + 1.0 * np.exp(-((away / 0.42) ** 2))) * cloud
    flame = np.exp(-(((x - 0.5) / 0.055) ** 2) - ((y - 0.44 * reach) / 0.17) ** 2)
    color = glow[..., None] * np.array((0.95, 0.36, 0.06)) + 0.6 * flame[..., None] * np.array(
        (1.0, 0.8, 0.45)
    )
    color = color * (1.0 - 0.93 * cover[..., None])
    for _ in range(6):
        px, py = random.between(0.12, 0.88), reach * random.between(0.45, 0.85)
        spark = np.exp(-(((x - px) ** 2 + (y - py) ** 2) / 0.016**2))
        color = color + spark[..., None] * np.array((0.75, 1.0, 0.25))
    return opaque(np.clip(color, 0.0, 1.0))


def stained(seed, shape=(384, 192)):
    """The same glass as a base colour: amber that lets through half of the light, and opaque paint."""
    _, cover = _grasses(seed, shape)
    small = cover.reshape(shape[0] // 2, 2, shape[1] // 2, 2).mean((1, 3))[..., None]
    color = np.array((0.30, 0.16, 0.06)) * (1.0 - small) + np.array((0.02, 0.015, 0.01)) * small
    pixels = opaque(color)
    alpha = rounded(255.0 * (0.5 + 0.45 * small))
    return np.concatenate([pixels[..., :3], alpha.astype(np.uint8)], axis=-1)


def hammered(seed, size=128):
    """A normal map of dents that overlap, as a hammer leaves them; it repeats."""
    first, _, depth = cells((size, size), seed, (5, 5), (np.zeros((size, size)),) * 2)
    height = 0.55 * first**2 + 0.25 * depth
    slope_y, slope_x = (0.5 * size * (np.roll(height, -1, k) - np.roll(height, 1, k)) for k in (0, 1))
    # rows go down and y goes up
    normal = np.stack([-0.035 * slope_x, 0.035 * slope_y, np.ones_like(height)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return rounded(255.0 * (0.5 + 0.5 * normal)).astype(np.uint8)


def _grasses(seed, shape):
    """The share of each pixel that painted grasses cover, after the random numbers that follow."""
    random = Random(seed)
    height, width = shape
    canvas = Canvas(2 * width, 2 * height, (0.0, 0.0, 0.0))
    reach = height / width
    for k in range(15):
        x, lean = random.between(0.02, 0.98), random.around(0.0, 0.30)
        tall = reach * random.between(0.16, 0.52)
        s = np.linspace(0.0, 1.0, 9)
        stalk = [np.array((x + lean * t * t * tall, tall * t)) for t in s]
        canvas.twig(stalk, 0.011 * (1.0 - 0.8 * s), (0, 0, 0))
        if k % 3 == 0:
            for j in range(7):
                at = stalk[8] * (1.0 - 0.05 * j) + stalk[5] * 0.05 * j
                side = 1.0 if j % 2 else -1.0
                canvas.leaf(
                    at[0],
                    at[1],
                    math.pi / 2.0 - side * 0.7,
                    0.07,
                    lambda t: 0.22 * np.sin(np.pi * t),
                    (0, 0, 0),
                )
        elif k % 3 == 1:
            for j in range(8):
                at = stalk[j]
                for side in (1.0, -1.0):
                    size = 0.13 * (1.0 - 0.09 * j)
                    outline = _frond
                    canvas.leaf(at[0], at[1], math.pi / 2.0 - lean - side * 1.05, size, outline, (0, 0, 0))
    return random, canvas.alpha.reshape(height, 2, width, 2).mean((1, 3))


def _frond(t):
    """Half the width of a leaflet."""
    return 0.16 * np.sin(np.pi * np.clip(t, 0.0, 1.0) ** 0.8)
