"""The sun, the planets and their moon, of radius 1 but for the sun, painted by their vertices."""

from __future__ import annotations

import math

import numpy as np

from builder.noise import fractal, smooth, solid
from builder.solids import ball, join, lathe


def sun():
    """A ball with rays, long and short ones, evenly all around."""
    rays, count = [], 40
    for k in range(count):
        height = 1.0 - (2.0 * k + 1.0) / count
        ray = lathe([(0.052, 0.25), (0.0, 0.40 if k % 2 else 0.345)], 6)
        lean = ray.turned((0, 1, 0), math.degrees(math.acos(height)))
        rays.append(lean.turned((0, 0, 1), 137.508 * k))
    collar = lathe([(0.05, -0.29), (0.09, -0.265), (0.05, -0.23)], 14)
    return join(ball(0.27, 14, 28), *rays, collar)


def _globe(paint, rings=18, sides=32):
    return ball(1.0, rings, sides).painted(paint)


def rocky(seed, light, dark):
    def paint(points):
        t = smooth(-0.5, 0.6, fractal(points, seed, 0.9, 4))
        return np.asarray(dark) + (np.asarray(light) - np.asarray(dark)) * t[:, None]

    return _globe(paint, 12, 20)


def _earth():
    def paint(points):
        field = fractal(points, 91, 1.1, 4) + 0.1
        land = smooth(0.02, 0.10, field)[:, None]
        cold = smooth(0.80, 0.90, np.abs(points[:, 2]) + 0.06 * fractal(points, 95, 0.4, 2))[:, None]
        dry = smooth(-0.3, 0.4, solid(points, 97, 0.8))[:, None]
        green = np.array((0.10, 0.24, 0.055)) + (np.array((0.42, 0.30, 0.12)) - (0.10, 0.24, 0.055)) * dry
        sea = np.array((0.015, 0.075, 0.24)) * (1.0 + 0.5 * smooth(-0.4, 0.0, field)[:, None])
        color = sea + (green - sea) * land
        return color + (np.array((0.82, 0.86, 0.88)) - color) * cold

    return _globe(paint, 18, 28)


def _jupiter():
    def paint(points):
        sway = 0.10 * fractal(points * (1.0, 1.0, 2.5), 81, 0.8, 3)
        band = np.sin(15.0 * (points[:, 2] + sway))
        pale, brown, rust = (
            np.array((0.74, 0.62, 0.46)),
            np.array((0.40, 0.22, 0.10)),
            np.array((0.52, 0.15, 0.06)),
        )
        color = pale + (brown - pale) * smooth(-0.1, 0.9, band)[:, None]
        spot = np.linalg.norm((points - np.array((0.35, 0.85, -0.38))) * (1.0, 1.0, 1.7), axis=1)
        return color + (rust - color) * smooth(0.34, 0.22, spot)[:, None]

    return _globe(paint, 18, 28)


def _saturn():
    def paint(points):
        band = np.sin(11.0 * points[:, 2] + 0.4 * solid(points, 71, 0.9))
        pale, dark = np.array((0.76, 0.64, 0.40)), np.array((0.52, 0.38, 0.19))
        return pale + (dark - pale) * smooth(-0.2, 0.9, band)[:, None]

    return _globe(paint, 14, 26)


def saturns_ring():
    """Saturn's ring with its gap, painted on both faces."""
    radii = (1.30, 1.46, 1.70, 1.72, 1.77, 1.79, 1.98, 2.0)
    upper = [(radius, 0.012) for radius in reversed(radii)]
    both = lathe([*[(radius, -0.012) for radius in radii], *upper], 32)

    def paint(points):
        across = np.linalg.norm(points[:, :2], axis=1)
        tones = np.interp(across, radii, (0.35, 0.62, 0.80, 0.10, 0.10, 0.72, 0.62, 0.45))
        return tones[:, None] * np.array((0.92, 0.78, 0.52))

    return both.painted(paint)


PAINTED = {
    "mercury": lambda: rocky(61, (0.42, 0.36, 0.30), (0.20, 0.17, 0.15)),
    "venus": lambda: rocky(63, (0.80, 0.62, 0.32), (0.60, 0.40, 0.16)),
    "earth": _earth,
    "mars": lambda: rocky(65, (0.56, 0.19, 0.075), (0.30, 0.085, 0.04)),
    "jupiter": _jupiter,
    "saturn": _saturn,
}
"""Name -> function that makes a planet."""
