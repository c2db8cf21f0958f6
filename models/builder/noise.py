"""Noise for textures and rocks: tileable spectral noise, tileable cells, and solid noise."""

from __future__ import annotations

from functools import wraps

import numpy as np

from builder.randomness import Random, lattice
from builder.rounding import rounded


def smooth(low, high, value):
    """0 below `low`, 1 above `high`, a cubic between; `low` may lie above `high`."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def mix(a, b, t):
    """From `a` to `b`; a scalar field `t` of shape (h, w) mixes colours of shape (3,) into (h, w, 3)."""
    a, b, t = np.asarray(a, float), np.asarray(b, float), np.asarray(t, float)
    if t.ndim == 2 and (a.ndim in (1, 3) or b.ndim in (1, 3)):
        t = t[..., None]
    return a + (b - a) * t


def spectral(shape, seed, wavelengths=(8.0, 256.0), exponent=1.0, stretch=(1.0, 1.0)):
    """Tileable noise of mean 0 and deviation 1.

    Its amplitude falls as frequency^-exponent between two wavelengths in pixels; `stretch` makes it
    longer along y or x.
    """
    height, width = shape
    white = Random(seed).units(height, width) - 0.5
    fy = np.fft.fftfreq(height)[:, None] * stretch[0]
    fx = np.fft.rfftfreq(width)[None, :] * stretch[1]
    frequency = rounded(np.hypot(fy, fx), 9)
    short, long = wavelengths
    keep = (frequency <= rounded(1.0 / short, 9)) & (frequency >= rounded(1.0 / long, 9))
    gain = np.where(keep, np.maximum(frequency, 1e-9) ** -exponent, 0.0)
    field = np.fft.irfft2(np.fft.rfft2(white) * gain, s=shape)
    return (field - field.mean()) / field.std()


def cells(shape, seed, counts, warp=(0.0, 0.0), jitter=0.9):
    """Tileable Worley cells: distances to the nearest and next point, and a random number per cell.

    Distances are in units of the lattice of `counts` = (rows, columns); `warp` moves the sampled
    positions, in pixels. (Worley, "A cellular texture basis function", 1996.)
    """
    height, width = shape
    rows, columns = counts
    y = (np.arange(height)[:, None] + warp[0] + np.zeros((1, width))) * rows / height
    x = (np.arange(width)[None, :] + warp[1] + np.zeros((height, 1))) * columns / width
    j, i = np.floor(y).astype(int), np.floor(x).astype(int)
    first = np.full(shape, np.inf)
    second = np.full(shape, np.inf)
    which = np.zeros(shape)
    table = lattice(seed, rows, columns, 3)
    for dj in (-1, 0, 1):
        for di in (-1, 0, 1):
            row, column = (j + dj) % rows, (i + di) % columns
            px = i + di + 0.5 + jitter * (table[row, column, 0] - 0.5)
            py = j + dj + 0.5 + jitter * (table[row, column, 1] - 0.5)
            distance = np.hypot(px - x, py - y)
            nearer = distance < first
            second = np.where(nearer, first, np.minimum(second, distance))
            which = np.where(nearer, table[row, column, 2], which)
            first = np.where(nearer, distance, first)
    return first, second, which


def over(color, tone, share):
    """`tone` over `color`, both with channels last, where the field `share` is 1."""
    return color + (np.asarray(tone) - color) * share[..., None]


BLOCK = 8192
"""Points whose noise is computed at once: what is in between stays in a processor's cache."""


def in_blocks(noise):
    """`noise(points, ...)` computed for a block of points at a time; points have shape (..., 3)."""

    @wraps(noise)
    def blockwise(points, *arguments, **options):
        points = np.asarray(points, float)
        flat = points.reshape(-1, 3)
        values = np.empty(len(flat))
        for first in range(0, len(flat), BLOCK):
            block = slice(first, first + BLOCK)
            values[block] = noise(flat[block], *arguments, **options)
        return values.reshape(points.shape[:-1])

    return blockwise


@in_blocks
def solid(points, seed, wavelength):
    """Smooth noise in -1..1 at points of shape (..., 3)."""
    # NumPy is fastest on whole rows: one for each coordinate
    p = np.ascontiguousarray(points.T) / wavelength
    base = np.floor(p)
    t = p - base
    t = t * t * t * (t * (6.0 * t - 15.0) + 10.0)
    i, j, k = base.astype(np.intp) & 31
    # The lattice's planes on both sides of each point, as steps into the flat table.
    x_steps = (i << 10, (i + 1 & 31) << 10)
    y_steps = (j << 5, (j + 1 & 31) << 5)
    z_steps = (k, k + 1 & 31)
    x_shares, y_shares, z_shares = ((1.0 - share, share) for share in t)
    columns = [(x_shares[a] * y_shares[b], x_steps[a] + y_steps[b]) for b in (0, 1) for a in (0, 1)]
    table = lattice(seed, 32, 32, 32).reshape(-1)
    total = np.zeros(len(points))
    for z_share, z_step in zip(z_shares, z_steps, strict=True):
        for share, step in columns:
            total += share * z_share * table.take(step + z_step)
    return 2.0 * total - 1.0


@in_blocks
def fractal(points, seed, wavelength, octaves, gain=0.5):
    """Solid noise of several wavelengths, each half the one before, `gain` times as strong."""
    total, size = 0.0, 1.0
    for k in range(octaves):
        total = total + size * solid(points, seed + k, wavelength * 0.5**k)
        size *= gain
    return total


def relief(height, strength):
    """Baked light from the upper left on a tileable height field: a factor around 1."""
    dx = np.roll(height, -1, 1) - np.roll(height, 1, 1)
    dy = np.roll(height, -1, 0) - np.roll(height, 1, 0)
    return np.clip(1.0 + strength * (dx + 0.5 * dy), 0.35, 1.7)
