"""A cat that sits upright, its tail around its paws: one shape of blended parts, 1 unit high, facing -Y."""

from __future__ import annotations

import numpy as np

from builder.sculpt import along, blend, carve, ellipsoid, length, limb, mirrored, spline

HEAD = np.array((0.0, -0.145, 0.715))
"""Where the head's own coordinates have their origin."""
TAIL = spline(
    (
        (0.02, 0.29, 0.085),
        (0.15, 0.325, 0.058),
        (0.265, 0.265, 0.052),
        (0.322, 0.12, 0.050),
        (0.315, -0.05, 0.050),
        (0.25, -0.20, 0.050),
        (0.13, -0.305, 0.050),
        (0.0, -0.345, 0.052),
        (-0.10, -0.325, 0.066),
    ),
    3,
)
TAIL_RADII = (0.066, 0.050, 0.036)
"""At the root, over most of the length, at the tip."""


def head_frame():
    """Rows: the head's right, back and up; it looks a little to one side and tilts."""
    back = np.array((0.10, 1.0, 0.03))
    back = back / length(back)
    up = np.array((0.07, 0.0, 1.0))
    up = up - back * along(up, back)
    up = up / length(up)
    right = np.array(
        (
            back[1] * up[2] - back[2] * up[1],
            back[2] * up[0] - back[0] * up[2],
            back[0] * up[1] - back[1] * up[0],
        )
    )
    return np.stack([right, back, up])


FRAME = head_frame()


def to_head(p):
    """World points in the head's coordinates."""
    q = p - HEAD
    return np.stack([along(q, FRAME[k]) for k in range(3)], axis=-1)


def body(p):
    """Torso, haunches and legs."""
    m = mirrored(p)
    trunk = ellipsoid(p, (0.0, 0.13, 0.21), (0.195, 0.205, 0.21))
    trunk = blend(trunk, limb(p, (0.0, 0.09, 0.28), (0.0, -0.04, 0.51), 0.175, 0.138)[0], 0.12)
    trunk = blend(trunk, ellipsoid(p, (0.0, -0.115, 0.42), (0.125, 0.115, 0.155)), 0.08)
    trunk = blend(trunk, limb(p, (0.0, -0.035, 0.54), (0.0, -0.10, 0.68), 0.122, 0.108)[0], 0.08)
    trunk = blend(trunk, haunch(p), 0.045)
    foot = limb(m, (0.20, 0.02, 0.05), (0.212, -0.17, 0.046), 0.055, 0.050)[0]
    trunk = blend(trunk, foot, 0.035)
    leg = limb(m, (0.088, -0.12, 0.38), (0.070, -0.19, 0.08), 0.075, 0.047)[0]
    leg = blend(leg, ellipsoid(m, (0.072, -0.225, 0.044), (0.056, 0.073, 0.048)), 0.035)
    return blend(trunk, leg, 0.05)


def haunch(p):
    """Distance to the thighs."""
    return ellipsoid(mirrored(p), (0.168, 0.045, 0.165), (0.095, 0.175, 0.165))


def tail(p):
    """Distance to the tail, and how far along it the nearest point lies, 0 to 1."""
    best = np.full(p.shape[:-1], np.inf)
    place = np.zeros(p.shape[:-1])
    n = len(TAIL) - 1
    for k in range(n):
        distance, t = limb(p, TAIL[k], TAIL[k + 1], _tail_radius(k / n), _tail_radius((k + 1) / n))
        nearer = distance < best
        place = np.where(nearer, (k + t) / n, place)
        best = np.where(nearer, distance, best)
    return best, place


def _tail_radius(t):
    root, middle, tip = TAIL_RADII
    if t < 0.8:
        return root + (middle - root) * min(t / 0.3, 1.0)
    return middle + (tip - middle) * (t - 0.8) / 0.2


EAR_BASE, EAR_TIP = np.array((0.090, 0.005, 0.078)), np.array((0.154, 0.012, 0.278))


def ear_frame():
    """Rows: across the ear, from base to tip, and out of its opening; for the ear at x > 0."""
    up = EAR_TIP - EAR_BASE
    up = up / length(up)
    front = np.array((0.28, -1.0, 0.0))
    front = front - up * along(front, up)
    front = front / length(front)
    across = np.array(
        (
            up[1] * front[2] - up[2] * front[1],
            up[2] * front[0] - up[0] * front[2],
            up[0] * front[1] - up[1] * front[0],
        )
    )
    return np.stack([across, up, front])


EAR = ear_frame()


def to_ear(m):
    """Mirrored head points in the ear's coordinates: across, up and out of its opening."""
    q = m - EAR_BASE
    return np.stack([along(q, EAR[k]) for k in range(3)], axis=-1)


def ears(m):
    """Two hollow triangles with rounded sides."""
    e = to_ear(m)
    tall = length(EAR_TIP - EAR_BASE)
    t = e[..., 1] / tall
    half = 0.086 * (1.0 - t) * (1.0 + 0.55 * t) * np.where(t < 0.0, 1.0 + t, 1.0) + 0.012

    def cone(forward, factor):
        q = (e[..., 2] - forward) / 0.52
        across = np.sqrt(e[..., 0] * e[..., 0] + q * q)
        side = (across - half * factor) * 0.7
        return np.maximum(side, (-t - 0.25) * tall)

    return carve(cone(0.0, 1.0), np.maximum(cone(0.040, 0.84), np.maximum(0.15 - t, t - 0.9) * tall), 0.008)


def head(p):
    """The head, without the ears."""
    q = to_head(p)
    m = mirrored(q)
    shape = ellipsoid(q, (0.0, 0.0, 0.012), (0.170, 0.15, 0.142))
    shape = blend(shape, ellipsoid(m, (0.100, -0.038, -0.050), (0.094, 0.084, 0.075)), 0.06)
    shape = blend(shape, limb(q, (0.0, -0.10, 0.055), (0.0, -0.172, -0.020), 0.05, 0.028)[0], 0.05)
    shape = blend(shape, ellipsoid(m, (0.036, -0.153, -0.060), (0.054, 0.052, 0.043)), 0.025)
    shape = blend(shape, ellipsoid(q, (0.0, -0.136, -0.100), (0.040, 0.038, 0.030)), 0.03)
    return blend(shape, ellipsoid(m, (0.080, -0.108, 0.028), (0.048, 0.036, 0.045)), 0.02)


def cat(p):
    """Distance to the whole cat, cut flat where it sits."""
    shape = blend(body(p), tail(p)[0], 0.02)
    shape = blend(shape, head(p), 0.045)
    shape = blend(shape, ears(mirrored(to_head(p))), 0.035)
    return carve(shape, p[..., 2], 0.012)
