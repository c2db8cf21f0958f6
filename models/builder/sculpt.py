"""Shapes as signed distances, blended like clay, and a fine mesh of their surface.

Only sums, products, quotients and square roots are used, one array operation each: these are rounded the
same on every machine, so a mesh that is simplified afterwards comes out the same everywhere.
"""

from __future__ import annotations

import numpy as np


def length(v):
    """Lengths of vectors (..., 3), summed in a fixed order."""
    return _length(v[..., 0], v[..., 1], v[..., 2])


def _length(x, y, z):
    return np.sqrt(x * x + y * y + z * z)


def along(v, axis):
    """Dot products of vectors (..., 3) with one vector, summed in a fixed order."""
    return v[..., 0] * axis[0] + v[..., 1] * axis[1] + v[..., 2] * axis[2]


def ellipsoid(p, centre, radii):
    """Distance to an ellipsoid, exact on its surface and close to it near there."""
    q = [p[..., k] - centre[k] for k in range(3)]
    k0 = _length(*(q[k] / radii[k] for k in range(3)))
    k1 = _length(*(q[k] / (radii[k] * radii[k]) for k in range(3)))
    return k0 * (k0 - 1.0) / np.maximum(k1, 1e-9)


def limb(p, start, end, thick, thin):
    """Distance to a tapered capsule; also how far along it the nearest point lies, 0 to 1."""
    axis = np.asarray(end, float) - np.asarray(start, float)
    x, y, z = (p[..., k] - start[k] for k in range(3))
    t = np.clip((x * axis[0] + y * axis[1] + z * axis[2]) / along(axis, axis), 0.0, 1.0)
    distance = _length(x - t * axis[0], y - t * axis[1], z - t * axis[2])
    return distance - (thick + (thin - thick) * t), t


def blend(a, b, reach):
    """The union of two shapes with a fillet where they are within `reach` of each other."""
    h = np.maximum(reach - np.abs(a - b), 0.0)
    return np.minimum(a, b) - h * h / (4.0 * reach)


def carve(a, b, reach):
    """`a` without `b`, with a rounded edge."""
    return -blend(-a, b, reach)


def mirrored(p):
    """Points folded onto the side x >= 0, so that one limb there is two."""
    return np.stack([np.abs(p[..., 0]), p[..., 1], p[..., 2]], axis=-1)


def spline(points, pieces):
    """A Catmull-Rom curve through `points`, each span cut into `pieces`."""
    p = np.asarray(points, float)
    p = np.concatenate([2.0 * p[:1] - p[1:2], p, 2.0 * p[-1:] - p[-2:-1]])
    t = (np.arange(pieces) / pieces)[None, :, None]
    a, b, c, d = (p[k : len(p) - 3 + k, None, :] for k in range(4))
    cubic = (3.0 * (b - c) + d - a) * t + 2.0 * a - 5.0 * b + 4.0 * c - d
    curve = b + 0.5 * t * (c - a + t * cubic)
    return np.concatenate([curve.reshape(-1, 3), p[-2:-1]])


def gradient(shape, p, step):
    """Unit outward directions of the distance `shape` at points (n, 3)."""
    result = np.empty_like(p)
    for axis in range(3):
        offset = np.zeros(3)
        offset[axis] = step
        result[..., axis] = shape(p + offset) - shape(p - offset)
    return result / np.maximum(length(result), 1e-12)[..., None]


def settle(shape, p, rounds=4, step=0.002):
    """Points moved onto the surface of `shape` along its gradient."""
    for _ in range(rounds):
        slope = np.empty_like(p)
        for axis in range(3):
            offset = np.zeros(3)
            offset[axis] = step
            slope[..., axis] = (shape(p + offset) - shape(p - offset)) / (2.0 * step)
        size = np.maximum(length(slope), 0.2)
        p = p - slope * (shape(p) / (size * size))[..., None]
    return p


def skin(shape, low, high, cell):
    """A fine mesh (vertices, triangles) of a distance's surface, facing outwards.

    A vertex for each cell of a grid that the surface passes (Gibson, "Constrained elastic surface nets",
    1998), a square for each grid edge that it cuts.
    """
    low = np.asarray(low, float)
    n = np.ceil((np.asarray(high, float) - low) / cell).astype(int) + 1
    axes = [low[k] + cell * np.arange(n[k]) for k in range(3)]
    value = np.stack([shape(_plane(axes, i)) for i in range(n[0])])
    inside = value < 0.0
    total = np.zeros((*(n - 1), 3))
    count = np.zeros(n - 1)
    edges = []
    for axis in range(3):
        a, b = _ends(value, axis)
        cut = (a < 0.0) != (b < 0.0)
        at = np.argwhere(cut)
        share = a[cut] / (a[cut] - b[cut])
        point = at.astype(float)
        point[:, axis] += share
        edges.append((axis, at, inside[tuple(at.T)]))
        others = [k for k in range(3) if k != axis]
        for da in (0, 1):
            for db in (0, 1):
                home = at.copy()
                home[:, others[0]] -= da
                home[:, others[1]] -= db
                ok = ((home >= 0) & (home < n - 1)).all(axis=1)
                # Of the edges of one direction no two of a batch share a cell: plain indexing adds them all.
                index = tuple(home[ok].T)
                total[index] += point[ok]
                count[index] += 1.0
    used = count > 0
    number = np.full(used.shape, -1)
    number[used] = np.arange(used.sum())
    vertices = low + cell * (total[used] / count[used][:, None])
    triangles = np.concatenate([_squares(number, axis, at, out) for axis, at, out in edges])
    return settle(shape, vertices), triangles


def _plane(axes, i):
    y, z = np.meshgrid(axes[1], axes[2], indexing="ij")
    return np.stack([np.full_like(y, axes[0][i]), y, z], axis=-1)


def _ends(value, axis):
    """The values at both ends of all edges along `axis`."""
    front = [slice(None)] * 3
    back = [slice(None)] * 3
    front[axis], back[axis] = slice(None, -1), slice(1, None)
    return value[tuple(front)], value[tuple(back)]


def _squares(number, axis, at, starts_inside):
    """Two triangles around each cut edge, counter-clockwise from outside."""
    b, c = (axis + 1) % 3, (axis + 2) % 3
    corners = []
    for db, dc in ((1, 1), (0, 1), (0, 0), (1, 0)):
        home = at.copy()
        home[:, b] -= db
        home[:, c] -= dc
        corners.append(number[tuple(home.T)])
    q = np.stack(corners, axis=1)
    q = np.where(starts_inside[:, None], q, q[:, ::-1])
    return np.concatenate([q[:, [0, 1, 2]], q[:, [0, 2, 3]]])
