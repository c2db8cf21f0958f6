"""The face of the cat: its mask of stripes, eyes, nose, mouth and ears, as colours by place."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from builder.cat import EAR, EAR_BASE, EAR_TIP, FRAME, to_ear, to_head
from builder.noise import over, smooth
from builder.sculpt import length, mirrored

GROUND = (0.34, 0.25, 0.16)
WARM = (0.40, 0.265, 0.15)
PALE = (0.50, 0.41, 0.30)
DARK = (0.068, 0.048, 0.034)
WHITE = (0.64, 0.59, 0.52)
PINK = (0.50, 0.235, 0.19)


def _strokes(a, b, lines, wobble):
    """1 on polylines of (a, b, half width) in a plane; the widths change along them."""
    dark = np.zeros_like(a)
    for line in lines:
        for (a0, b0, w0), (a1, b1, w1) in pairwise(line):
            da, db = a1 - a0, b1 - b0
            t = np.clip(((a - a0) * da + (b - b0) * db) / (da * da + db * db), 0.0, 1.0)
            off = np.hypot(a - a0 - t * da, b - b0 - t * db) + wobble
            half = w0 + (w1 - w0) * t
            dark = np.maximum(dark, smooth(half + 0.005, half - 0.004, off))
    return dark


_CROWN = (
    # The M: up from above the inner corner of the eye, down to the middle; over the head two lines go on.
    (
        (0.058, 0.60, 0.004),
        (0.050, 0.80, 0.009),
        (0.050, 1.00, 0.011),
        (0.054, 1.4, 0.011),
        (0.064, 2.4, 0.012),
    ),
    ((0.047, 0.93, 0.010), (0.026, 0.78, 0.008), (0.000, 0.66, 0.004)),
    ((0.017, 0.98, 0.003), (0.018, 1.2, 0.008), (0.017, 2.4, 0.010)),
    ((0.106, 0.56, 0.002), (0.100, 0.72, 0.006), (0.090, 0.90, 0.006)),
)
"""Dark strokes over the head: distance from the middle, angle from the front over the top, half width."""
_CHEEKS = (
    ((0.84, 0.022, 0.004), (1.10, 0.005, 0.009), (1.5, -0.022, 0.011), (2.1, -0.05, 0.010)),
    ((0.80, -0.045, 0.003), (1.05, -0.060, 0.008), (1.4, -0.085, 0.009)),
    ((1.75, 0.03, 0.006), (2.2, 0.0, 0.012), (2.7, -0.02, 0.008)),
)
"""The same from the eyes to the sides: angle around the head, height, half width."""


def head_fur(p, n, wave, fur):
    q = to_head(p)
    x, y, z = q.T
    m = np.abs(x)
    rise = np.arctan2(z + 0.03, -y)
    around = np.arctan2(m, -y)
    color = over(np.broadcast_to(GROUND, p.shape), WARM, smooth(-0.6, 0.5, wave))
    front = smooth(-0.04, -0.09, y)
    crown = _strokes(
        m,
        rise * 0.16,
        [[(a, b * 0.16, w) for a, b, w in line] for line in _CROWN],
        0.004 * wave + 0.0015 * fur,
    )
    cheeks = _strokes(
        around * 0.16,
        z,
        [[(a * 0.16, b, w) for a, b, w in line] for line in _CHEEKS],
        0.004 * wave + 0.0015 * fur,
    )
    dark = np.maximum(crown * smooth(0.0, 0.04, z), cheeks)
    color = over(color, PALE, (0.75 * front * smooth(0.065, 0.045, np.hypot(m - 0.080, (z - 0.030) * 1.1))))
    color = over(color, DARK, (0.9 * dark))
    nose = (
        smooth(0.030, 0.018, m + 0.1 * np.maximum(-0.02 - z, 0.0))
        * smooth(0.085, 0.04, z)
        * smooth(-0.03, -0.02, z)
    )
    color = over(color, (0.30, 0.155, 0.085), (0.7 * front * nose))
    pads = np.minimum(
        np.hypot((m - 0.040) / 0.062, (z + 0.062) / 0.047), np.hypot(m / 0.055, (z + 0.10) / 0.04)
    )
    color = over(color, WHITE, (front * smooth(1.12, 0.92, pads + 0.05 * fur)))
    chin = smooth(-0.085, -0.11, z + 0.01 * wave) * smooth(0.02, -0.05, y)
    color = over(color, WHITE, (0.9 * chin))
    color = _mouth(color, m, z, front)
    return _eyes(color, x, z, front)


def _mouth(color, m, z, front):
    """Nose, mouth and the dots that the whiskers grow from."""
    dots = np.zeros_like(m)
    for row in range(3):
        for k in range(3):
            spot = np.hypot(m - 0.040 - 0.013 * k, z + 0.046 + 0.011 * row + 0.002 * k)
            dots = np.maximum(dots, smooth(0.0042, 0.0022, spot))
    color = over(color, (0.14, 0.10, 0.075), (0.7 * dots * front))
    arc = np.hypot(m - 0.024, z + 0.056)
    lip = smooth(0.0050, 0.0022, np.abs(arc - 0.024)) * smooth(-0.058, -0.064, z) * smooth(0.052, 0.044, m)
    cleft = smooth(0.0042, 0.0020, m) * smooth(-0.085, -0.078, z) * smooth(-0.032, -0.040, z)
    color = over(color, (0.075, 0.045, 0.04), (0.9 * front * np.maximum(lip, cleft)))
    # The nose: a rounded triangle that points down.
    wide = 0.027 * smooth(-0.050, -0.022, z) + 0.002
    edge = np.maximum(m - wide, np.maximum(z + 0.012 + 0.25 * m, -0.044 - z))
    color = over(color, (0.10, 0.05, 0.045), (front * smooth(0.006, 0.002, edge)))
    nostril = smooth(0.007, 0.003, np.hypot(m - 0.013, (z + 0.030) * 1.4))
    skin = over(np.array((0.47, 0.17, 0.15)), (0.10, 0.035, 0.035), nostril)
    return over(color, skin, (front * smooth(0.001, -0.002, edge)))


def _eyes(color, x, z, front):
    """Almond eyes: a dark rim, a green iris that is lit from below, a slit and a glint."""
    m = np.abs(x)
    u = m - 0.080
    v = z - 0.030 - 0.13 * u
    # Two circles that meet in the corners; the upper lid is flatter.
    lid = np.maximum(np.hypot(u, v + 0.014) - 0.0520, np.hypot(u, v - 0.015) - 0.0525)
    color = over(color, (0.030, 0.024, 0.020), (front * smooth(0.0095, 0.0065, lid)))
    tear = _strokes(m, z, [[(0.038, 0.020, 0.006), (0.029, 0.004, 0.003)]], 0.0)
    tail_ = _strokes(m, z, [[(0.124, 0.034, 0.006), (0.142, 0.040, 0.003)]], 0.0)
    color = over(color, (0.035, 0.027, 0.022), (0.9 * front * np.maximum(tear, tail_)))
    r = np.hypot(u, v)
    iris = over(np.array((0.50, 0.46, 0.07)), (0.20, 0.34, 0.07), smooth(0.008, 0.032, r))
    iris = over(iris, (0.045, 0.075, 0.02), smooth(0.031, 0.041, r))
    spokes = 0.5 + 0.5 * np.sin(np.arctan2(v, u) * 23.0 + 3.0 * np.sin(np.arctan2(v, u) * 5.0))
    iris = iris * (0.88 + 0.24 * spokes)[:, None] * (1.12 - 0.75 * smooth(-0.005, 0.034, v))[:, None]
    slit = np.abs(u) - 0.0165 * np.sqrt(np.clip(1.0 - (v / 0.034) ** 2, 0.0, 1.0))
    iris = over(iris, (0.012, 0.011, 0.011), smooth(0.0025, -0.0015, slit))
    color = over(color, iris, (front * smooth(0.0012, -0.0018, lid)))
    glint = np.maximum(
        smooth(0.0105, 0.0065, np.hypot(x - np.where(x > 0, 0.068, -0.092), z - 0.044)),
        0.6 * smooth(0.0055, 0.003, np.hypot(x - np.where(x > 0, 0.094, -0.066), z - 0.010)),
    )
    return over(color, (0.85, 0.86, 0.86), (front * glint * smooth(0.0, -0.003, lid)))


def ear_fur(p, n, wave, fur):
    e = to_ear(mirrored(to_head(p)))
    tall = float(length(EAR_TIP - EAR_BASE))
    t = e[:, 1] / tall
    half = 0.086 * (1.0 - t) * (1.0 + 0.55 * t) + 0.012
    side = np.where(to_head(p)[:, 0] > 0.0, 1.0, -1.0)
    q = np.stack(
        [(n * FRAME[0]).sum(axis=1) * side, (n * FRAME[1]).sum(axis=1), (n * FRAME[2]).sum(axis=1)], axis=1
    )
    facing = (q * EAR[2]).sum(axis=1)
    color = over(np.broadcast_to(GROUND, p.shape), DARK, (0.55 + 0.45 * smooth(0.55, 0.8, t)))
    color = over(color, PALE, (0.5 * smooth(0.30, 0.15, np.hypot((t - 0.42), e[:, 0] * 8.0))))
    inside = (
        smooth(0.96, 0.80, np.abs(e[:, 0]) / np.maximum(half, 1e-3))
        * smooth(0.0, 0.35, facing)
        * smooth(0.96, 0.88, t)
    )
    skin = over(np.asarray(PINK), (0.28, 0.10, 0.085), smooth(0.55, 0.05, t))
    # Pale hairs grow in from the inner edge.
    tuft = smooth(0.25, -0.55, e[:, 0] / np.maximum(half, 1e-3) + 0.30 * fur + 0.5 * t) * smooth(0.8, 0.5, t)
    skin = over(skin, WHITE, (0.85 * tuft))
    return over(color, skin, inside)
