"""Tileable bark and wood: linear albedo (h, w, 3) with the light of its own relief baked in."""

from __future__ import annotations

import numpy as np

from builder.noise import cells, mix, relief, smooth, spectral


def _moss(color, field, amount, tone=(0.07, 0.11, 0.025)):
    """Moss where `field` is high; its own grain keeps it from looking painted."""
    grain = 1.0 + 0.25 * spectral(field.shape, 77, (2.0, 12.0), 0.3)
    cover = smooth(1.0 - amount, 1.6 - amount, field)
    return mix(color, np.asarray(tone) * np.clip(grain, 0.4, 1.8)[..., None], 0.85 * cover)


def furrowed(
    seed, shape=(1024, 512), tone=(0.20, 0.155, 0.115), cut=(0.045, 0.033, 0.025), counts=(6, 9), moss=0.2
):
    """Long plates between deep furrows: oak and other old broadleaves."""
    warp_x = 11.0 * spectral(shape, seed, (40, 400), 1.1, (0.6, 1.6))
    warp_y = 30.0 * spectral(shape, seed + 1, (60, 400), 1.2)
    first, second, which = cells(shape, seed + 2, counts, (warp_y, warp_x))
    plate = smooth(0.02, 0.34, second - first)
    fine_first, fine_second, _ = cells(
        shape, seed + 3, (counts[0] * 5, counts[1] * 3), (warp_y, warp_x * 0.6)
    )
    cracks = smooth(0.0, 0.22, fine_second - fine_first)
    fibre = spectral(shape, seed + 4, (2, 40), 0.5, (0.22, 1.0))
    blotch = spectral(shape, seed + 5, (60, 500), 1.0)
    height = plate * (0.8 + 0.2 * cracks) + 0.06 * fibre
    color = mix(cut, tone, np.clip(plate * (0.62 + 0.38 * cracks), 0.0, 1.0))
    color = color * np.clip(1.0 + 0.13 * fibre + 0.12 * blotch + 0.35 * (which - 0.5), 0.3, 1.9)[..., None]
    color = mix(color, color * [0.92, 1.0, 0.98], smooth(-0.5, 1.0, blotch))
    color = color * relief(height, 2.2)[..., None]
    return _moss(color, 0.6 * spectral(shape, seed + 6, (20, 400), 1.1) + 0.5 * plate, moss)


def birch(seed, shape=(1024, 512)):
    """White bark with dark dashes, peeled bands and black scars."""
    wander = 10.0 * spectral(shape, seed, (30, 300), 1.0)
    band = spectral(shape, seed + 1, (24, 400), 1.0, (1.0, 0.12))
    grain = spectral(shape, seed + 2, (2, 16), 0.4, (1.0, 0.35))
    color = mix((0.62, 0.59, 0.53), (0.48, 0.42, 0.35), smooth(-0.4, 1.8, band))
    color = color * np.clip(1.0 + 0.05 * grain, 0.7, 1.3)[..., None]
    first, _, which = cells(shape, seed + 3, (48, 5), (wander, 0.0 * wander), 1.0)
    # A dash is the middle of a flat cell: cells are 10 times as wide as high, so scale comes for free.
    dash = (
        smooth(0.34, 0.20, first)
        * (which > 0.45)
        * smooth(-1.4, 0.2, spectral(shape, seed + 8, (8, 60), 0.6))
    )
    color = mix(color, (0.10, 0.075, 0.06), 0.85 * dash)
    scar_first, _, scar = cells(shape, seed + 4, (5, 3), (wander * 1.5, wander), 0.8)
    rough = 0.07 * spectral(shape, seed + 5, (14, 90), 1.0)
    mark = smooth(0.30, 0.16, scar_first + rough) * (scar > 0.55)
    color = mix(color, np.array((0.045, 0.038, 0.033)), 0.95 * mark)
    grey = smooth(0.6, 2.0, spectral(shape, seed + 6, (40, 300), 1.1))
    color = mix(color, color * [0.55, 0.56, 0.5], grey)
    return color * relief(0.15 * band - 0.4 * mark, 1.6)[..., None]


def scaly(
    seed, shape=(1024, 512), tone=(0.165, 0.125, 0.10), cut=(0.06, 0.045, 0.037), counts=(34, 17), red=0.0
):
    """Small scales: spruce; with larger counts of larger plates and `red` towards 1, pine."""
    warp_x = 7.0 * spectral(shape, seed, (20, 200), 1.0)
    warp_y = 9.0 * spectral(shape, seed + 1, (20, 200), 1.0)
    first, second, which = cells(shape, seed + 2, counts, (warp_y, warp_x))
    plate = smooth(0.0, 0.26, second - first)
    fine = spectral(shape, seed + 3, (2, 20), 0.4)
    blotch = spectral(shape, seed + 4, (80, 500), 1.0)
    base = mix(tone, (0.30, 0.15, 0.085), np.clip(red * (0.6 + 0.5 * blotch * 0.5), 0.0, 1.0))
    color = mix(np.broadcast_to(np.asarray(cut, float), (*shape, 3)), base, plate)
    color = color * np.clip(1.0 + 0.55 * (which - 0.5) + 0.12 * fine + 0.10 * blotch, 0.3, 1.9)[..., None]
    # Each scale lifts at its lower end: the height rises downwards inside a cell.
    height = plate * (0.5 + 0.5 * which) + 0.05 * fine
    color = color * relief(height, 1.8)[..., None]
    return _moss(color, 0.8 * spectral(shape, seed + 6, (16, 300), 1.1), 0.12, (0.10, 0.125, 0.07))


def bare(seed, shape=(1024, 512)):
    """Grey weathered wood without bark: long fibres, cracks, knots of shadow."""
    warp = 16.0 * spectral(shape, seed, (60, 500), 1.3)
    fibre = spectral(shape, seed + 1, (2, 64), 0.6, (0.07, 1.0))
    streak = spectral(shape, seed + 2, (20, 300), 0.9, (0.15, 1.0))
    first, second, which = cells(shape, seed + 3, (2, 14), (warp * 2.0, warp))
    crack = smooth(0.10, 0.01, second - first) * (which > 0.3)
    color = mix((0.19, 0.175, 0.155), (0.27, 0.24, 0.20), smooth(-1.0, 1.0, streak))
    color = color * np.clip(1.0 + 0.16 * fibre, 0.4, 1.7)[..., None]
    color = mix(color, (0.03, 0.025, 0.02), 0.85 * crack)
    return color * relief(0.25 * fibre - crack, 1.0)[..., None]


def end_grain(seed, size=512):
    """The cut face of a trunk: rings, cracks and a rim of bark; the centre of the picture is the pith."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * 2.0 - 1.0
    lobes = spectral((size, size), seed, (80, 600), 1.4)
    x, y = x + 0.018 * lobes + 0.05, y + 0.018 * np.roll(lobes, 97, 0) - 0.03
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    pace = (
        r * 26.0
        + 1.2 * np.sin(2.0 * angle + 0.5) * r
        + 0.5 * spectral((size, size), seed + 1, (40, 300), 1.0)
    )
    ring = (pace % 1.0) ** 2.0
    fine = spectral((size, size), seed + 2, (2, 8), 0.2)
    color = mix((0.36, 0.25, 0.14), (0.20, 0.12, 0.06), smooth(0.25, 1.0, ring))
    color = mix(color, color * [0.72, 0.62, 0.55], smooth(0.5, 0.2, r))
    color = color * np.clip(1.0 + 0.07 * fine, 0.6, 1.4)[..., None]
    for k in range(9):
        turn = 2.399963 * k + 0.4
        bend = np.abs((angle - turn - 0.25 * (r - 0.4) + np.pi) % (2.0 * np.pi) - np.pi)
        width = 0.012 + 0.02 * ((k * 7) % 5) / 5.0
        length = 0.45 + 0.4 * ((k * 3) % 4) / 4.0
        crack = (
            smooth(width, 0.2 * width, bend * r)
            * smooth(length + 0.3, length - 0.1, r)
            * smooth(0.03, 0.12, r)
        )
        color = mix(color, (0.05, 0.035, 0.025), 0.8 * crack)
    weather = smooth(-0.4, 1.6, spectral((size, size), seed + 3, (30, 400), 1.1))
    color = mix(color, (0.15, 0.15, 0.12), 0.55 * weather)
    color = mix(
        color, (0.06, 0.10, 0.022), 0.75 * smooth(0.7, 2.0, spectral((size, size), seed + 4, (14, 300), 1.0))
    )
    return mix(color, (0.07, 0.05, 0.037), smooth(0.93, 0.96, r))
