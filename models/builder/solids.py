"""Turned, bent, cut and bevelled pieces, as a smith or a joiner would make them; Z up."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from builder.rounding import rounded
from builder.surface import grid_triangles, perpendicular, unit


@dataclass(frozen=True)
class Piece:
    """Triangles (m, 3) of points (n, 3), each with texture coordinates and a linear colour."""

    points: np.ndarray
    triangles: np.ndarray
    texcoords: np.ndarray
    colors: np.ndarray

    def moved(self, x=0.0, y=0.0, z=0.0):
        return replace(self, points=self.points + np.array((x, y, z)))

    def scaled(self, x, y=None, z=None):
        """Scaled along the axes, alike when only `x` is given; no factor may be negative."""
        return replace(self, points=self.points * (x, x if y is None else y, x if z is None else z))

    def turned(self, axis, degrees):
        """Turned counter-clockwise about an axis through the origin."""
        axis, angle = unit(np.asarray(axis, float)), math.radians(degrees)
        along = (self.points @ axis)[:, None] * axis
        points = along + (self.points - along) * math.cos(angle)
        return replace(self, points=points + np.cross(axis, self.points) * math.sin(angle))

    def painted(self, paint):
        """With a colour, or the colours `paint(points)`, (n, 3) or factors (n,), over its own."""
        tone = np.asarray(paint(self.points) if callable(paint) else paint, float)
        return replace(
            self, colors=self.colors * (tone[:, None] if tone.shape == self.points[:, 0].shape else tone)
        )

    def bent(self, function):
        """With its points moved to `function(points)`."""
        return replace(self, points=np.asarray(function(self.points)))

    def flipped(self):
        """Inside out."""
        return replace(self, triangles=self.triangles[:, ::-1])


def piece(points, triangles, texcoords=None):
    points = np.asarray(points, float).reshape(-1, 3)
    texcoords = (
        np.zeros((len(points), 2)) if texcoords is None else np.asarray(texcoords, float).reshape(-1, 2)
    )
    return Piece(points, np.asarray(triangles, int).reshape(-1, 3), texcoords, np.ones_like(points))


def join(*pieces):
    """One piece of several."""
    starts = np.cumsum([0] + [len(part.points) for part in pieces[:-1]])
    return Piece(
        np.concatenate([part.points for part in pieces]),
        np.concatenate([part.triangles + start for part, start in zip(pieces, starts, strict=True)]),
        np.concatenate([part.texcoords for part in pieces]),
        np.concatenate([part.colors for part in pieces]),
    )


def around(part, count, start=0.0):
    """`count` of a piece, evenly around the Z axis."""
    return join(*(part.turned((0, 0, 1), start + 360.0 * k / count) for k in range(count)))


def grid(points, texcoords=None):
    """A grid of points (rows, columns, 3), seen from where rows go up and columns to the right."""
    rows, columns, _ = np.shape(points)
    if texcoords is None:
        u, v = np.meshgrid(np.linspace(0.0, 1.0, columns), np.linspace(0.0, 1.0, rows))
        texcoords = np.stack([u, v], axis=-1)
    return piece(points, grid_triangles(rows, columns), texcoords)


def lathe(profile, sides, repeat=(1.0, 1.0), turn=0.0):
    """A profile of (radius, height) turned about the Z axis; its outside is to the right of the way along it.

    `repeat` is how often a texture fits around and along; `turn` (degrees) is where the first side begins.
    """
    profile = np.asarray(profile, float)
    angle = np.radians(turn) + np.linspace(0.0, 2.0 * math.pi, sides + 1)
    points = np.empty((len(profile), sides + 1, 3))
    points[..., 0] = profile[:, :1] * np.cos(angle)
    points[..., 1] = profile[:, :1] * np.sin(angle)
    points[..., 2] = profile[:, 1:]
    points[:, -1] = points[:, 0]
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    u, v = np.meshgrid(np.linspace(0.0, repeat[0], sides + 1), along / along[-1] * repeat[1])
    return grid(points, np.stack([u, v], axis=-1))


def arc(centre, radius, start, end, steps):
    """Points (steps + 1, 2) on a circle, from angle `start` to `end` in degrees."""
    angle = np.radians(np.linspace(start, end, steps + 1))
    return np.asarray(centre) + np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius


def ball(radius, rings=12, sides=24):
    return lathe(arc((0.0, 0.0), radius, -90.0, 90.0, rings), sides)


def circle(radius, sides):
    """A section for `sweep`: a closed polygon (sides, 2)."""
    return arc((0.0, 0.0), radius, 0.0, 360.0, sides)[:-1]


def rectangle(width, height, bevel):
    """A section for `sweep` with cut corners."""
    x, y = width / 2.0, height / 2.0
    a, b = x - bevel, y - bevel
    return np.array([(x, -b), (x, b), (a, y), (-a, y), (-x, b), (-x, -b), (-a, -y), (a, -y)])


def sweep(path, section, scale=None, closed=False, repeat=(1.0, 1.0), upright=None):
    """A section (s, 2) carried along a path (n, 3), its ends closed.

    `scale` (n,) makes it thicker and thinner. The section's first axis stays as near as it can to where it
    was, or to `upright`. A closed path leads back to its first point, which is not repeated.
    """
    path, section = np.asarray(path, float), np.asarray(section, float)
    n, s = len(path), len(section)
    if closed:
        tangents = unit(np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0))
    else:
        tangents = unit(np.gradient(path, axis=0))
    scale = np.ones(n) if scale is None else np.asarray(scale, float)
    side = perpendicular(tangents[0], near=(0.0, 0.0, 1.0) if upright is None else upright)
    rings = np.empty((n, s + 1, 3))
    for k in range(n):
        side = perpendicular(tangents[k], near=side if upright is None else upright)
        other = np.cross(tangents[k], side)
        ring = path[k] + scale[k] * (section[:, :1] * side + section[:, 1:] * other)
        rings[k] = np.concatenate([ring, ring[:1]])
    if closed:
        rings = np.concatenate([rings, rings[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rings.mean(axis=1), axis=0), axis=1))])
    girth = np.concatenate([section, section[:1]])
    girth = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(girth, axis=0), axis=1))])
    u, v = np.meshgrid(girth / girth[-1] * repeat[0], way / way[-1] * repeat[1])
    # `grid` is seen from where columns go right and rows up, which is outside here
    tube = grid(rings, np.stack([u, v], axis=-1))
    if closed:
        return tube
    first, last = (fan(ring[:-1]) for ring in (rings[0][::-1], rings[-1]))
    return join(tube, first, last)


def fan(outline):
    """A flat or bulging face from its outline (n, 3), counter-clockwise, with a point in the middle."""
    outline = np.asarray(outline, float)
    n = len(outline)
    k = np.arange(n)
    triangles = np.stack([k, (k + 1) % n, np.full(n, n)], axis=1)
    points = np.concatenate([outline, outline.mean(axis=0)[None]])
    return piece(points, triangles)


def plate(outline, low, high, bevel, hole=None):
    """An outline (n, 2), counter-clockwise, cut from sheet between two heights, with bevelled edges.

    `hole` is an outline of as many points; without it the outline must be a star around the origin.
    """
    walls = [_wall(np.asarray(outline, float), low, high, bevel)]
    if hole is not None:
        walls.append(_wall(np.asarray(hole, float)[::-1], low, high, bevel))
        inner = walls[1][:, ::-1]
        top = np.stack([walls[0][-1], inner[-1]])
        bottom = np.stack([inner[0], walls[0][0]])
        faces = [grid(np.concatenate([face, face[:, :1]], axis=1)) for face in (top, bottom)]
    else:
        faces = [fan(walls[0][-1]), fan(walls[0][0][::-1])]
    sides = [grid(np.concatenate([wall, wall[:, :1]], axis=1)) for wall in walls]
    return join(*sides, *faces)


def _wall(outline, low, high, bevel):
    """Rings (4, n, 3) from the lower to the upper face of a plate."""
    before = unit3(outline - np.roll(outline, 1, axis=0))
    after = unit3(np.roll(outline, -1, axis=0) - outline)
    inwards = np.stack([-before[:, 1] - after[:, 1], before[:, 0] + after[:, 0]], axis=1)
    # the mitre: both edges move in by the bevel
    inwards /= np.maximum(1.0 + (before * after).sum(axis=1), 0.4)[:, None]
    inner = outline + bevel * inwards
    rings = [(inner, low), (outline, low + bevel), (outline, high - bevel), (inner, high)]
    return np.stack([np.concatenate([ring, np.full((len(ring), 1), z)], axis=1) for ring, z in rings])


def unit3(vectors):
    """Vectors of any width, of length 1."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def block(x, y, z, bevel):
    """A box of this size around the origin with cut edges and corners."""
    half = np.array((x, y, z)) / 2.0
    points, number = [], {}
    for sign in np.ndindex(2, 2, 2):
        for axis in range(3):
            corner = half - bevel
            corner[axis] = half[axis]
            number[sign, axis] = len(points)
            points.append(corner * (2 * np.array(sign) - 1))
    points = np.array(points)
    polygons = []
    for axis in range(3):
        one, other = (axis + 1) % 3, (axis + 2) % 3
        for a in (0, 1):
            polygons.append([number[_sign(axis, a, one, b, other, c), axis] for b, c in _SQUARE])
            for b in (0, 1):
                ends = [_sign(one, a, other, b, axis, c) for c in (0, 1)]
                first, second = ([number[end, which] for end in ends] for which in (one, other))
                polygons.append([first[0], first[1], second[1], second[0]])
    polygons += [[number[sign, axis] for axis in range(3)] for sign in np.ndindex(2, 2, 2)]
    triangles = []
    for polygon in polygons:
        corners = points[polygon]
        outside = (
            np.dot(np.cross(corners[1] - corners[0], corners[2] - corners[0]), corners.mean(axis=0)) > 0.0
        )
        polygon = polygon if outside else polygon[::-1]
        triangles += [(polygon[0], polygon[k], polygon[k + 1]) for k in range(1, len(polygon) - 1)]
    return piece(points, triangles, points[:, :2])


_SQUARE = ((0, 0), (1, 0), (1, 1), (0, 1))


def _sign(*pairs):
    """The signs of a corner from (axis, sign, axis, sign, axis, sign)."""
    sign = dict(zip(pairs[::2], pairs[1::2], strict=True))
    return tuple(sign[axis] for axis in range(3))


def shaded(part, angle=50.0):
    """Points, normals, texture coordinates, colours and triangles of a piece.

    Edges between faces that meet at less than `angle` degrees are smooth, all others hard. A face counts by
    its area and its angle at the corner, so that large flat faces stay flat beside small bevels.
    """
    corners = part.points[part.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    kept = length > 1e-12 * max(length.max(), 1e-300)
    triangles, corners, normals = part.triangles[kept], corners[kept], normals[kept]
    flat = unit(normals)
    weights = np.linalg.norm(normals, axis=1)[:, None] * _corner_angles(corners)
    scale = np.ptp(part.points, axis=0).max()
    _, place = np.unique(rounded(part.points / scale, 6), axis=0, return_inverse=True)
    smooth = _smooth_normals(
        place.reshape(-1)[triangles].reshape(-1),
        np.repeat(flat, 3, axis=0),
        weights.reshape(-1),
        math.cos(math.radians(angle)),
    )
    index = triangles.reshape(-1)
    rows = [part.points[index], rounded(smooth, 4), part.texcoords[index], part.colors[index]]
    keys = np.concatenate([place.reshape(-1)[index][:, None], *(rounded(row, 4) for row in rows[1:])], axis=1)
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(np.argsort(first))
    first = np.sort(first)
    points, normals, texcoords, colors = (row[first] for row in rows)
    return points, unit(normals), texcoords, colors, order[number.reshape(-1)].reshape(-1, 3)


def _corner_angles(corners):
    """The angle (m, 3) of each triangle at each corner."""
    angles = []
    for k in range(3):
        one = unit(corners[:, (k + 1) % 3] - corners[:, k])
        other = unit(corners[:, (k + 2) % 3] - corners[:, k])
        angles.append(np.arccos(np.clip((one * other).sum(axis=1), -1.0, 1.0)))
    return np.stack(angles, axis=1)


def _smooth_normals(place, flat, weights, cosine):
    """For each corner, the weighted sum of the normals of all corners at its place that differ little."""
    order = np.argsort(place, kind="stable")
    _, start, size = np.unique(place[order], return_index=True, return_counts=True)
    group = np.repeat(np.arange(len(start)), size)
    rank = np.arange(len(order)) - start[group]
    total = np.zeros_like(flat)
    for step in range(size.max()):
        there = np.flatnonzero(step < size[group])
        mine = order[there]
        theirs = order[start[group[there]] + (rank[there] + step) % size[group[there]]]
        near = rounded((flat[mine] * flat[theirs]).sum(axis=1), 9) > rounded(cosine, 9)
        total[mine[near]] += flat[theirs[near]] * weights[theirs[near], None]
    return unit(total)
