"""The ground: a mesh that is finer near the clearing, under one texture that never repeats."""

from __future__ import annotations

import math

import numpy as np

from builder.canvas import opaque
from builder.noise import mix, smooth, spectral
from builder.randomness import Random
from builder.surface import Surface, grid_triangles
from firefly_sample.scenes.forest_layout import (
    SPECIES,
    X_RANGE,
    Y_RANGE,
    clearing_distance,
    ground_height,
    ground_noise,
    ground_slope,
    place_forest,
)

FOCUS = (-6.0, -42.0)
"""Where mesh and texture are finest: in the clearing, on the camera's side."""
FINENESS = 0.34
"""Spacing at the focus, as a fraction of an even grid's."""
COLUMNS, ROWS = 76, 78


def warp(s, low, high, focus):
    """World coordinate at the fraction `s` of the texture: dense at the focus, low at 0, high at 1."""
    split = (focus - low) / (high - low)
    below = np.clip((split - s) / split, 0.0, 1.0)
    above = np.clip((s - split) / (1.0 - split), 0.0, 1.0)

    def ease(t):
        return FINENESS * t + (1.0 - FINENESS) * t**3

    return focus - (focus - low) * ease(below) + (high - focus) * ease(above)


def terrain():
    """The surface: position and normal from the height function, texture by the warped grid."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, COLUMNS + 1), np.linspace(0.0, 1.0, ROWS + 1))
    x, y = warp(u, *X_RANGE, FOCUS[0]), warp(v, *Y_RANGE, FOCUS[1])
    slope_x, slope_y = ground_slope(x, y)
    surface = Surface()
    surface.add(
        np.stack([x, y, ground_height(x, y)], axis=-1).reshape(-1, 3),
        np.stack([-slope_x, -slope_y, np.ones_like(x)], axis=-1).reshape(-1, 3),
        np.stack([u, v], axis=-1).reshape(-1, 2),
        grid_triangles(ROWS + 1, COLUMNS + 1),
    )
    return surface


def terrain_texture(size=2048):
    """uint8 RGB: soil, moss, grass, fallen leaves, a path, and the dark under whatever stands there."""
    coarse = size // 4
    s = (np.arange(coarse) + 0.5) / coarse
    x = warp(s, *X_RANGE, FOCUS[0])[None, :]
    y = warp(s, *Y_RANGE, FOCUS[1])[::-1, None]
    fields = {name: enlarge(field, 4) for name, field in _covers(x, y).items()}
    fine = spectral((size, size), 300, (2, 14), 0.5)
    grit = spectral((size, size), 301, (3, 60), 0.8)
    clump = spectral((size, size), 302, (12, 90), 0.7)

    color = mix((0.062, 0.045, 0.030), (0.115, 0.085, 0.058), smooth(-1.2, 1.4, grit + 0.4 * clump))
    moss = smooth(0.35, 0.75, fields["moss"] + 0.16 * clump)
    green = mix((0.040, 0.066, 0.014), (0.075, 0.115, 0.028), smooth(-1.2, 1.2, fine + 0.5 * clump))
    color = mix(color, green, 0.9 * moss)
    path = smooth(0.35, 0.8, fields["path"] + 0.12 * clump)
    trodden = mix((0.125, 0.098, 0.068), (0.19, 0.155, 0.11), smooth(-1.0, 1.6, grit + 0.3 * fine))
    color = mix(color, trodden, 0.85 * path)
    turf = smooth(0.30, 0.8, fields["turf"] + 0.22 * clump) * (1.0 - 0.8 * path)
    blades = mix((0.050, 0.084, 0.018), (0.118, 0.150, 0.042), smooth(-1.3, 1.5, fine + 0.7 * grit))
    color = mix(color, blades, 0.88 * turf)
    color = color * np.clip(1.0 + 0.13 * fine + 0.07 * grit, 0.4, 1.7)[..., None]
    _litter(color, np.clip(fields["litter"] * (1.0 - 0.7 * path), 0.0, 1.0), size)
    color = color * np.clip(1.0 + 0.22 * fields["tone"], 0.6, 1.4)[..., None]
    return opaque(color * _contact(size)[..., None])


def _covers(x, y):
    """What grows where, at a quarter of the texture's resolution; around 0..1 each."""
    rim = clearing_distance(x, y)
    open_ = 1.0 - smooth(0.75, 1.25, rim)
    slow, mid, quick = (ground_noise(x, y, k, w) for k, w in ((31, 60.0), (32, 21.0), (33, 8.0)))
    return {
        "moss": 0.42 + 0.30 * slow + 0.26 * mid + 0.12 * quick + 0.10 * (1.0 - open_),
        "turf": 0.62 * open_ + 0.26 * mid - 0.2 * slow + 0.16 * quick + 0.06,
        "litter": 0.25 + 0.6 * (1.0 - open_) + 0.25 * slow - 0.2 * mid,
        "path": _path(x, y),
        "tone": 0.6 * ground_noise(x, y, 34, 95.0) + 0.4 * mid,
    }


def _path(x, y):
    """1 on a trail that winds from the camera's side past the stump into the wood; 0 elsewhere."""
    middle = -9.0 + 13.0 * np.sin((y + 95.0) / 46.0) + 4.0 * np.sin(y / 17.0)
    width = 4.2 + 1.4 * np.sin(y / 23.0)
    fade = 1.0 - smooth(90.0, 190.0, y)
    return np.clip(1.25 - np.abs(x - middle) / width, 0.0, 1.0) * fade * 0.95


def _litter(color, density, size):
    """Fallen leaves: small ovals in browns, each with its own light half."""
    random = Random(310)
    tries = 30000
    at = (random.units(tries, 2) * size).astype(int)
    looks = random.units(tries, 5)
    keep = looks[:, 0] < density[at[:, 1], at[:, 0]]
    tones = np.array([(0.17, 0.085, 0.030), (0.21, 0.125, 0.045), (0.115, 0.065, 0.032), (0.19, 0.155, 0.05)])
    reach = 7
    dy, dx = np.mgrid[-reach : reach + 1, -reach : reach + 1].astype(float)
    for (px, py), (_, turn, long, shape, tone) in zip(at[keep], looks[keep], strict=True):
        if not (reach <= px < size - reach and reach <= py < size - reach):
            continue
        c, s = math.cos(6.2832 * turn), math.sin(6.2832 * turn)
        along, across = (dx * c + dy * s) / (2.4 + 2.6 * long), (dy * c - dx * s) / (0.9 + 1.1 * shape)
        cover = np.clip((1.0 - along**2 - across**2) * 2.5, 0.0, 0.92)[..., None]
        where = (slice(py - reach, py + reach + 1), slice(px - reach, px + reach + 1))
        leaf = tones[int(tone * 4)] * (0.8 + 0.4 * long) * (1.0 + 0.22 * np.sign(across))[..., None]
        color[where] = color[where] * (1.0 - cover) + leaf * cover


def _contact(size):
    """A factor: darker at the foot of everything, and a little under the trees' crowns."""
    coarse = size // 2
    s = (np.arange(coarse) + 0.5) / coarse
    xs, ys = warp(s, *X_RANGE, FOCUS[0]), warp(s, *Y_RANGE, FOCUS[1])[::-1]
    dark = np.ones((coarse, coarse))
    for thing in place_forest():
        species = SPECIES[thing.species]
        if species.foot == 0.0:
            continue
        rings = [(thing.foot * 0.55, thing.foot * 1.9 + 0.6, 0.55)]
        if species.kind == "tree":
            rings.append((0.0, 0.8 * species.crown * thing.scale, 0.22))
        for inner, outer, amount in rings:
            columns = np.flatnonzero(np.abs(xs - thing.x) < outer)
            rows = np.flatnonzero(np.abs(ys - thing.y) < outer)
            if not (len(columns) and len(rows)):
                continue
            r = np.hypot(xs[columns][None, :] - thing.x, ys[rows][:, None] - thing.y)
            dark[np.ix_(rows, columns)] *= 1.0 - amount * smooth(outer, inner, r)
    return enlarge(np.maximum(dark, 0.25), 2)


def enlarge(field, factor):
    """A field at `factor` times the resolution, linearly interpolated between pixel centres."""
    for axis in (0, 1):
        n = field.shape[axis]
        place = (np.arange(n * factor) + 0.5) / factor - 0.5
        low = np.clip(np.floor(place).astype(int), 0, n - 1)
        high = np.minimum(low + 1, n - 1)
        share = np.clip(place - low, 0.0, 1.0)
        shape = (-1, 1) if axis == 0 else (1, -1)
        field = np.take(field, low, axis) * (1.0 - share.reshape(shape)) + np.take(field, high, axis) * (
            share.reshape(shape)
        )
    return field
