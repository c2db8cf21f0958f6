"""The giant planets: bands of cloud carried about by winds, and a ring."""

from __future__ import annotations

import math

import numpy as np

from builder.canvas import spread, to_srgb
from builder.noise import BLOCK, fractal, over, smooth, solid
from builder.randomness import Random
from builder.rounding import rounded
from builder.sphere import Atlas
from builder.surface import Surface, add_grid, unit
from builder.terrain import enlarge


def _bands(latitude, stops):
    """Colours by latitude, from rows (latitude in degrees, red, green, blue)."""
    stops = np.asarray(stops, float)
    degrees = np.degrees(np.arcsin(np.clip(latitude, -1.0, 1.0)))
    return np.stack([np.interp(degrees, stops[:, 0], stops[:, k]) for k in (1, 2, 3)], axis=-1)


def _carried(directions, seed, steps, wavelength, churn, jets, vortices=()):
    """Where the gas at each place came from: carried by winds along the latitudes and by eddies.

    `vortices` are (centre, radius, turn): ovals, twice as long as high, that turn as a whole.
    """
    # a block goes all its way at once: what is in between stays in a processor's cache
    flat = directions.reshape(-1, 3)
    blocks = [flat[first : first + BLOCK] for first in range(0, len(flat), BLOCK)]
    carried = [_drifted(block, seed, steps, wavelength, churn, jets, vortices) for block in blocks]
    return np.concatenate(carried).reshape(directions.shape)


def _drifted(d, seed, steps, wavelength, churn, jets, vortices):
    """`_carried` for directions of shape (n, 3)."""
    for _ in range(steps):
        east = np.stack([-d[..., 1], d[..., 0], 0.0 * d[..., 2]], axis=-1)
        stretched = d * np.array((1.0, 1.0, 2.2))
        at = solid(stretched, seed, wavelength) + 0.5 * solid(stretched, seed + 1, 0.5 * wavelength)
        pull = np.empty_like(d)
        for axis in range(3):
            offset = np.zeros(3)
            offset[axis] = 0.02
            q = stretched + offset
            pull[..., axis] = (
                solid(q, seed, wavelength) + 0.5 * solid(q, seed + 1, 0.5 * wavelength) - at
            ) / 0.02
        # Along the lines of a potential: the flow neither gathers nor thins out.
        flow = churn * np.cross(d, pull)
        flow = flow + (jets * np.sin(d[..., 2] * 21.0 + 0.6))[..., None] * east
        for centre, radius, turn in vortices:
            centre = np.asarray(centre) / np.linalg.norm(centre)
            off = (d - centre) * np.array((1.0, 1.0, 2.0))
            r = np.linalg.norm(off, axis=-1) / radius
            spin = np.cross(np.broadcast_to(centre, d.shape), off)
            flow = flow + (turn * np.exp(-r * r))[..., None] * spin * np.array((1.0, 1.0, 0.5))
        d = unit(d - flow / steps)
    return d


def _finer(field, factor):
    """A field by face at a higher resolution."""
    faces = [
        np.stack([enlarge(face[..., k], factor) for k in range(face.shape[-1])], axis=-1) for face in field
    ]
    return np.stack(faces)


GIANT_BANDS = (
    (-90, 0.17, 0.155, 0.15),
    (-68, 0.23, 0.20, 0.175),
    (-56, 0.34, 0.27, 0.20),
    (-48, 0.24, 0.15, 0.09),
    (-40, 0.52, 0.43, 0.32),
    (-34, 0.36, 0.21, 0.115),
    (-30, 0.62, 0.54, 0.43),
    (-22, 0.60, 0.50, 0.37),
    (-17, 0.31, 0.145, 0.07),
    (-10, 0.24, 0.105, 0.05),
    (-6, 0.44, 0.27, 0.14),
    (-3, 0.66, 0.58, 0.46),
    (4, 0.62, 0.53, 0.40),
    (7, 0.38, 0.20, 0.10),
    (12, 0.21, 0.09, 0.045),
    (18, 0.34, 0.18, 0.09),
    (22, 0.62, 0.54, 0.42),
    (30, 0.52, 0.42, 0.30),
    (35, 0.28, 0.175, 0.105),
    (41, 0.46, 0.37, 0.27),
    (50, 0.26, 0.195, 0.14),
    (60, 0.31, 0.265, 0.215),
    (72, 0.20, 0.18, 0.165),
    (90, 0.15, 0.145, 0.145),
)
"""Latitude in degrees, linear red, green and blue."""
STORM = (-0.28, -0.88, -0.385)


def gas_giant(seed, pixels=320):
    """Bands in shear, eddies between them, and one red storm in a pale collar."""
    atlas = Atlas(pixels)
    vortices = (
        (STORM, 0.24, 5.0),
        ((0.86, -0.3, 0.42), 0.09, 6.0),
        ((-0.8, 0.45, 0.40), 0.08, 6.0),
        ((0.45, 0.7, -0.55), 0.10, -6.0),
        ((0.62, -0.5, -0.60), 0.08, -6.0),
    )
    came = unit(_finer(_carried(Atlas(pixels // 2).directions, seed, 24, 0.34, 0.013, 0.55, vortices), 2))
    fine = fractal(came * np.array((1.0, 1.0, 5.0)), seed + 10, 0.16, 3)
    wisps = solid(came * np.array((1.0, 1.0, 9.0)), seed + 20, 0.05)
    color = _bands(came[..., 2] + 0.018 * fine, GIANT_BANDS)
    color = color * (1.0 + 0.14 * fine + 0.06 * wisps)[..., None]
    centre = np.asarray(STORM) / np.linalg.norm(STORM)
    place = np.linalg.norm((atlas.directions - centre) * np.array((1.0, 1.0, 1.9)), axis=-1)
    place = place + 0.012 * fine
    collar = smooth(0.34, 0.27, place) * smooth(-0.36, -0.30, came[..., 2])
    color = over(color, (0.66, 0.58, 0.47), 0.8 * collar)
    rings = 0.5 + 0.5 * np.cos(place * 75.0 + 5.0 * fine)
    red = np.stack([0.40 + 0.09 * rings, 0.130 + 0.055 * rings, 0.058 + 0.03 * rings], axis=-1)
    color = over(color, red, 0.92 * smooth(0.25, 0.18, place))
    return atlas.image(np.clip(color, 0.02, 0.8))


GOLDEN_BANDS = (
    (-90, 0.30, 0.24, 0.15),
    (-70, 0.40, 0.31, 0.19),
    (-52, 0.46, 0.36, 0.22),
    (-45, 0.40, 0.29, 0.17),
    (-36, 0.52, 0.42, 0.27),
    (-25, 0.57, 0.47, 0.32),
    (-19, 0.45, 0.33, 0.19),
    (-11, 0.49, 0.36, 0.21),
    (-4, 0.64, 0.56, 0.41),
    (5, 0.66, 0.58, 0.43),
    (11, 0.52, 0.39, 0.23),
    (18, 0.44, 0.32, 0.185),
    (24, 0.55, 0.45, 0.30),
    (35, 0.50, 0.41, 0.27),
    (42, 0.40, 0.31, 0.19),
    (52, 0.43, 0.36, 0.24),
    (64, 0.33, 0.30, 0.22),
    (74, 0.25, 0.26, 0.22),
    (80, 0.19, 0.22, 0.21),
    (90, 0.15, 0.19, 0.19),
)


def ringed_planet(seed, pixels=256):
    """Quieter bands, in gold."""
    atlas = Atlas(pixels)
    came = unit(_finer(_carried(Atlas(pixels // 2).directions, seed, 16, 0.34, 0.0035, 0.4), 2))
    fine = fractal(came * np.array((1.0, 1.0, 7.0)), seed + 10, 0.2, 3)
    color = _bands(came[..., 2] + 0.010 * fine, GOLDEN_BANDS)
    threads = np.interp(came[..., 2], np.linspace(-1.0, 1.0, 160), Random(seed + 1).units(160) - 0.5)
    color = color * (1.0 + 0.05 * fine + 0.13 * threads)[..., None]
    return atlas.image(np.clip(color, 0.02, 0.8))


RING = (1.22, 2.36)
"""Inner and outer radius that the ring's picture covers, with clear rims."""
GAPS = ((0.0, 1.36), (1.425, 1.44), (1.52, 1.535), (1.92, 1.985), (2.12, 2.135), (2.22, 9.0))
"""Radii between which the ring is clear."""


def ring(steps=96):
    """A flat ring around Z: u from the inside out, v around."""
    surface = Surface()
    angle = np.linspace(0.0, 2.0 * math.pi, steps + 1)
    r = np.linspace(RING[1], RING[0], 3)[:, None]
    points = np.stack([r * np.cos(angle), r * np.sin(angle), 0.0 * r * angle], axis=-1)
    points[:, -1] = points[:, 0]
    # Each repeat of the picture is one eighth of the way around.
    u, v = np.meshgrid(np.linspace(1.0, 0.0, 3), angle / (2.0 * math.pi) * 8.0, indexing="ij")
    add_grid(surface, points, np.stack([u, v], axis=-1), wrap=True)
    return surface


def ring_texture(seed, width=512, height=32):
    """uint8 RGBA: ringlets and gaps, drawn at four times the width."""
    r = np.linspace(*RING, 4 * width, endpoint=False) + 0.5 * (RING[1] - RING[0]) / (4 * width)
    random = Random(seed)
    tone = np.zeros_like(r)
    for count, size in ((24, 0.6), (70, 0.5), (210, 0.4)):
        tone += size * np.interp(r, np.linspace(*RING, count), random.units(count) - 0.5)
    color = over(
        np.broadcast_to((0.30, 0.235, 0.16), (len(r), 3)), (0.56, 0.47, 0.345), smooth(1.36, 1.66, r)
    )
    color = over(color, (0.36, 0.30, 0.22), smooth(1.98, 2.02, r))
    color = color * np.clip(1.0 + 0.75 * tone, 0.4, 1.5)[:, None]
    there = np.ones_like(r)
    for low, high in GAPS:
        there[(r >= low) & (r <= high)] = 0.0
    grain = 1.0 + 0.05 * (random.units(height, 1) - 0.5)
    alpha = np.broadcast_to(there.reshape(width, 4).mean(axis=1), (height, width)).copy()
    row = (color * there[:, None]).reshape(width, 4, 3).mean(axis=1)
    shown = np.broadcast_to(row, (height, width, 3)) * grain[..., None]
    flat = spread(shown, alpha)
    return np.concatenate([to_srgb(flat), rounded(alpha[..., None] * 255.0)], axis=2).astype(np.uint8)
