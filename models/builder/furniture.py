"""What stands in a room of lamps: a plinth of stone slabs, and a bulb."""

from __future__ import annotations

import math

import numpy as np

from builder.canvas import opaque
from builder.noise import mix, relief, smooth, spectral
from builder.randomness import Random
from builder.surface import Surface, grid_triangles, unit

PLINTH = np.array((46.0, 46.0, 3.0))
"""The size that the plinth is meant for: at it the bevel is round and the slabs are square."""
BEVEL = 0.14
SLABS = 5
"""Slabs along each side of the texture, which repeats four times along the top."""
REPEAT = 11.5


def plinth(cells=24, courses=2, arc=2):
    """A box from -0.5 to 0.5 in x and y and from -1 to 0 in z, rounded at its upper and upright edges."""
    surface = Surface()
    half = PLINTH[0] / 2.0
    across, spread = _ruler(half, cells, arc, 2)
    down, drop = _ruler(PLINTH[2], courses, arc, 1)
    place, turn = np.meshgrid(across, across), np.meshgrid(spread, spread)
    _add_face(surface, (0, 0, 1), (1, 0, 0), (0, 1, 0), place, turn, 0.0)
    for right, out in (
        ((1, 0, 0), (0, -1, 0)),
        ((0, 1, 0), (1, 0, 0)),
        ((-1, 0, 0), (0, 1, 0)),
        ((0, -1, 0), (-1, 0, 0)),
    ):
        place, turn = np.meshgrid(across, down), np.meshgrid(spread, drop)
        _add_face(surface, out, right, (0, 0, 1), place, turn, half)
    flat = np.linspace(-half, half, 5)
    place = np.meshgrid(flat, flat)
    _add_face(surface, (0, 0, -1), (-1, 0, 0), (0, 1, 0), place, (0.0 * place[0], 0.0 * place[1]), PLINTH[2])
    return surface


def _ruler(size, cells, arc, ends):
    """Places along a face and how far the surface has turned there, in radians: flat, then round at the ends.

    With two `ends` from -size to size; with one from -size, where it is sharp, to 0.
    """
    last = size - BEVEL if ends == 2 else -BEVEL
    flat = np.linspace(-size + BEVEL if ends == 2 else -size, last, cells + 1)
    bend = np.linspace(0.0, math.pi / 4.0, arc + 1)[1:]
    place = np.concatenate([flat, np.full(arc, last)])
    turn = np.concatenate([np.zeros(cells + 1), bend])
    if ends == 2:
        place = np.concatenate([np.full(arc, -last), place])
        turn = np.concatenate([-bend[::-1], turn])
    return place, turn


def _add_face(surface, out, right, up, place, turn, distance):
    """One side of the box in its true size, with half of the rounding at its edges; then made unit-sized."""
    out, right, up = (np.asarray(v, float) for v in (out, right, up))
    (x, y), (turn_x, turn_y) = place, turn
    tilt = out + np.tan(turn_x)[..., None] * right + np.tan(turn_y)[..., None] * up
    normals = unit(tilt)
    core = x[..., None] * right + y[..., None] * up
    rounded = (np.abs(turn_x) + np.abs(turn_y)).max() > 0.0
    level = distance - BEVEL if rounded else distance
    points = core + level * out + (BEVEL * normals if rounded else 0.0)
    u, v = x + BEVEL * turn_x + 23.0, y + BEVEL * turn_y
    v = v + 23.0 if out[2] else v
    surface.add(
        (points / PLINTH).reshape(-1, 3),
        (normals * PLINTH).reshape(-1, 3),
        np.stack([u, v], axis=-1).reshape(-1, 2) / REPEAT,
        grid_triangles(*x.shape),
    )


def slabs(seed, size=1024):
    """Tileable square slabs of honed limestone, a little different from each other, with fine joints."""
    random = Random(seed)
    looks = random.units(SLABS, SLABS, 4)
    row = (np.arange(size) * SLABS // size)[:, None] + np.zeros((1, size), int)
    column = row.T
    look = looks[row, column]
    # Each slab is cut from another place of the same stone.
    y = (np.arange(size)[:, None] + (look[..., 2] * size).astype(int)) % size
    x = (np.arange(size)[None, :] + (look[..., 3] * size).astype(int)) % size
    cloud = spectral((size, size), seed + 1, (6, 260), 1.15, (1.0, 0.6))[y, x]
    vein = np.abs(spectral((size, size), seed + 2, (30, 400), 1.2, (1.0, 0.7)))[y, x]
    grain = spectral((size, size), seed + 3, (2, 14), 0.5)
    pits = spectral((size, size), seed + 4, (3, 9), 0.0)
    color = mix((0.335, 0.310, 0.275), (0.385, 0.360, 0.325), smooth(-1.8, 1.8, cloud))
    color = color * (1.0 + 0.16 * (look[..., 0] - 0.5))[..., None]
    color = color * (1.0 + 0.05 * (look[..., 1:2] - 0.5) * np.array((1.0, 0.1, -1.0)))
    color = mix(color, color * 0.92, smooth(0.06, 0.0, vein))
    color = mix(color, color * 0.80, smooth(2.3, 3.2, pits))
    color = color * (1.0 + 0.030 * grain)[..., None]
    t = (np.arange(size) + 0.5) * SLABS / size
    edge = np.abs(t - np.round(t)) * size / SLABS
    edge = np.minimum(edge[:, None], edge[None, :])
    color = color * (1.0 - 0.10 * smooth(9.0, 1.5, edge))[..., None]
    color = mix(color, (0.135, 0.120, 0.105), 0.9 * smooth(2.1, 0.9, edge))
    return opaque(color * relief(smooth(1.0, 3.0, edge), 0.10)[..., None])


def bulb(radius=0.2, rounds=2):
    """A ball of 20 * 4^rounds triangles, all vertices at `radius` from its middle."""
    golden = (1.0 + math.sqrt(5.0)) / 2.0
    points = []
    for a in (-1.0, 1.0):
        for b in (-golden, golden):
            points += [(0.0, a, b), (a, b, 0.0), (b, 0.0, a)]
    points = unit(np.array(points))
    # The faces are the triples of points that are all next to each other.
    near = [{j for j in range(12) if 0.0 < np.linalg.norm(points[i] - points[j]) < 1.2} for i in range(12)]
    faces = [(i, j, k) for i in range(12) for j in near[i] for k in near[i] & near[j] if i < j < k]
    points = list(points)
    faces = [
        f if np.dot(np.cross(points[f[0]], points[f[1]]), points[f[2]]) > 0 else f[::-1]
        for f in sorted(faces)
    ]
    for _ in range(rounds):
        middle, finer = {}, []
        for face in faces:
            inner = []
            for a, b in zip(face, face[1:] + face[:1], strict=True):
                key = (min(a, b), max(a, b))
                if key not in middle:
                    middle[key] = len(points)
                    points.append(unit(points[a] + points[b]))
                inner.append(middle[key])
            a, b, c = face
            ab, bc, ca = inner
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    points = np.array(points)
    surface = Surface()
    surface.add(radius * points, points, 0.5 + 0.4 * points[:, :2], faces)
    return surface


def plain_texture(level=0.49, size=8):
    """One pale grey all over."""
    return opaque(np.full((size, size, 3), level))
