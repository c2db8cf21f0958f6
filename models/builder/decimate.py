"""Fewer triangles for the same shape: edges are drawn together where that changes the surface least.

Garland and Heckbert, "Surface simplification using quadric error metrics", 1997. In plain Python floats and
in a fixed order, so that every machine draws the same edges together.
"""

from __future__ import annotations

import heapq
import math
import operator

import numpy as np


def decimate(vertices, triangles, target, weights, evenness=2e-4):
    """At most `target` triangles (vertices, triangles) of a closed mesh.

    `weights` (n,) say how much an error near a vertex counts; `evenness` is the share of an edge's length
    in its cost: more of it makes triangles of more equal size.
    """
    mesh = _Mesh(vertices, triangles, weights, evenness)
    mesh.reduce(target)
    return mesh.arrays()


class _Mesh:
    def __init__(self, vertices, triangles, weights, evenness):
        self.points = [tuple(float(c) for c in v) for v in vertices]
        self.faces = [tuple(int(k) for k in t) for t in triangles]
        self.weights = [float(w) for w in weights]
        self.evenness = evenness
        self.around = [set() for _ in self.points]
        self.quadrics = [[0.0] * 10 for _ in self.points]
        self.stamps = [0] * len(self.points)
        self.count = len(self.faces)
        for k, face in enumerate(self.faces):
            quadric = self._plane(face)
            for v in face:
                self.around[v].add(k)
                self.quadrics[v] = [
                    a + self.weights[v] * b for a, b in zip(self.quadrics[v], quadric, strict=True)
                ]
        self.heap = []
        for a in range(len(self.points)):
            for b in self._neighbours(a):
                if a < b:
                    self._push(a, b)

    def _plane(self, face):
        """The squared distance to a triangle's plane, times its area, as a symmetric form."""
        a, b, c = (self.points[v] for v in face)
        n = _cross(_minus(b, a), _minus(c, a))
        size = math.sqrt(_dot(n, n))
        if size == 0.0:
            return [0.0] * 10
        x, y, z = n[0] / size, n[1] / size, n[2] / size
        d = -(x * a[0] + y * a[1] + z * a[2])
        form = (x * x, x * y, x * z, x * d, y * y, y * z, y * d, z * z, z * d, d * d)
        return [0.5 * size * value for value in form]

    def _neighbours(self, v):
        return sorted({u for k in self.around[v] for u in self.faces[k]} - {v})

    def _push(self, a, b):
        cost, place = self._join(a, b)
        heapq.heappush(self.heap, (cost, a, b, self.stamps[a], self.stamps[b], place))

    def _join(self, a, b):
        """What drawing the edge a-b together costs, and where its one vertex goes."""
        q = list(map(operator.add, self.quadrics[a], self.quadrics[b]))
        p, r = self.points[a], self.points[b]
        middle = (0.5 * (p[0] + r[0]), 0.5 * (p[1] + r[1]), 0.5 * (p[2] + r[2]))
        edge = _minus(r, p)
        span = _dot(edge, edge)
        places = [middle, p, r]
        best = _lowest(q)
        if best is not None:
            off = _minus(best, middle)
            if _dot(off, off) < span:
                places.insert(0, best)
        costs = [_error(q, place) for place in places]
        k = costs.index(min(costs))
        weight = 0.5 * (self.weights[a] + self.weights[b])
        return max(costs[k], 0.0) + self.evenness * weight * span * span, places[k]

    def reduce(self, target):
        while self.count > target and self.heap:
            _, a, b, stamp_a, stamp_b, place = heapq.heappop(self.heap)
            if (self.stamps[a], self.stamps[b]) == (stamp_a, stamp_b) and self._allowed(a, b, place):
                self._collapse(a, b, place)

    def _allowed(self, a, b, place):
        """Whether the surface stays one skin, and none of its triangles turns over or becomes a splinter."""
        shared = self.around[a] & self.around[b]
        if len(shared) != 2 or len(set(self._neighbours(a)) & set(self._neighbours(b))) != 2:
            return False
        for v in (a, b):
            for k in self.around[v] - shared:
                old = [self.points[u] for u in self.faces[k]]
                new = [place if u == v else self.points[u] for u in self.faces[k]]
                n = _cross(_minus(old[1], old[0]), _minus(old[2], old[0]))
                sides = [_minus(new[(j + 1) % 3], new[j]) for j in range(3)]
                m = _cross(sides[0], sides[1])
                size = math.sqrt(_dot(m, m))
                if _dot(n, m) < 0.35 * math.sqrt(_dot(n, n)) * size:
                    return False
                if size < 0.08 * max(_dot(s, s) for s in sides):
                    return False
        return True

    def _collapse(self, a, b, place):
        """Draw b into a."""
        for k in sorted(self.around[a] & self.around[b]):
            for v in self.faces[k]:
                self.around[v].discard(k)
            self.faces[k] = None
            self.count -= 1
        for k in self.around[b]:
            self.faces[k] = tuple(a if v == b else v for v in self.faces[k])
        self.around[a] |= self.around[b]
        self.around[b] = set()
        self.points[a] = place
        self.quadrics[a] = [x + y for x, y in zip(self.quadrics[a], self.quadrics[b], strict=True)]
        self.weights[a] = max(self.weights[a], self.weights[b])
        self.stamps[a] += 1
        self.stamps[b] += 1
        for v in self._neighbours(a):
            self._push(min(a, v), max(a, v))

    def arrays(self):
        kept = [face for face in self.faces if face is not None]
        used = sorted({v for face in kept for v in face})
        number = {v: k for k, v in enumerate(used)}
        triangles = np.array([[number[v] for v in face] for face in kept])
        return np.array([self.points[v] for v in used]), triangles


def _minus(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _error(q, p):
    x, y, z = p
    return (
        x * (q[0] * x + 2.0 * (q[1] * y + q[2] * z + q[3]))
        + y * (q[4] * y + 2.0 * (q[5] * z + q[6]))
        + z * (q[7] * z + 2.0 * q[8])
        + q[9]
    )


def _lowest(q):
    """Where the form is lowest, by Cramer's rule; None where that is anywhere on a line or plane."""
    a, b, c, d, e, f, g, h, i, _ = q
    u, v, w = e * h - f * f, c * f - b * h, b * f - c * e
    whole = a * u + b * v + c * w
    if whole < 1e-4 * max(a, e, h) ** 3:
        return None
    x = -(d * u + g * v + i * w) / whole
    y = -(d * v + g * (a * h - c * c) + i * (b * c - a * f)) / whole
    z = -(d * w + g * (b * c - a * f) + i * (a * e - b * b)) / whole
    return (x, y, z)
