"""What a painter's sequence of triangles and discs shows, ray by ray in float64: the oracle for orders."""

from __future__ import annotations

import numpy as np

from firefly_sample.scene.lens_constants import LensConstants

SAME = 1e-6
"""Relative difference of distances from which on an order counts."""

NEAR, FAR = 0.5, 100.0
PERSPECTIVE = LensConstants.of(True, (1.2, 1.6), (0.0, 0.0), (NEAR, FAR), "gl", False)
OFF_CENTRE = LensConstants.of(True, (1.5, 0.9), (0.4, -0.3), (NEAR, FAR), "zero_to_one", True)
ORTHOGRAPHIC = LensConstants.of(False, (0.12, 0.16), (0.1, 0.0), (NEAR, FAR), "gl", False)
LENSES = {"perspective": PERSPECTIVE, "off centre": OFF_CENTRE, "orthographic": ORTHOGRAPHIC}


def rays(lens, across=41, up=31):
    """Origins and directions, shape (p, 3), of a view's pixels; a direction's y is 1, so that steps are y."""
    # an odd grid that is not symmetric: pixel centres shall not lie on edges
    x, z = np.meshgrid(np.linspace(-0.987, 0.991, across), np.linspace(-0.993, 0.983, up))
    at_one = lens.view_from_distance(x.ravel(), z.ravel(), np.ones(x.size))
    if lens.perspective:
        return np.zeros_like(at_one), at_one
    at_one[:, 1] = 0.0
    return at_one, np.broadcast_to((0.0, 1.0, 0.0), at_one.shape)


def triangle_distances(triangles, lens):
    """Distances, shape (n, p), at which pixels see triangles; infinite where they do not."""
    origins, directions = rays(lens)
    corners = np.asarray(triangles, dtype=np.float64).reshape(-1, 3, 3)
    moments = np.cross(directions, origins)
    sides = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        # d.((a - o) x (b - o)), which says on which side of the edge a ray passes
        across = np.cross(corners[:, a], corners[:, b]) @ directions.T
        sides.append(across - (corners[:, b] - corners[:, a]) @ moments.T)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        y = ((normals * corners[:, 0]).sum(axis=1)[:, None] - normals @ origins.T) / (normals @ directions.T)
    hit = (np.min(sides, axis=0) > 0.0) | (np.max(sides, axis=0) < 0.0)
    return np.where(hit & (y >= NEAR) & (y <= FAR), y, np.inf)


def disc_distances(positions, radii, lens):
    """Distances, shape (n, p), at which pixels see discs that face the camera."""
    origins, directions = rays(lens)
    result = np.full((len(positions), len(origins)), np.inf)
    for row, (position, radius) in enumerate(
        zip(np.asarray(positions, dtype=np.float64), radii, strict=True)
    ):
        away = np.linalg.norm(origins + position[1] * directions - position, axis=1)
        result[row, (away < radius) & (NEAR <= position[1] <= FAR)] = position[1]
    return result


def wrong_pairs(distances, order, adds=None):
    """Pairs (earlier, later) of things of which the earlier is nearer at some pixel.

    The distances, shape (n, p), are those of all things. The order of two that add light is free.
    """
    adds = np.zeros(len(distances), dtype=bool) if adds is None else np.asarray(adds)
    found = set()
    nearest = {kind: np.full(distances.shape[1], np.inf) for kind in (False, True)}
    for place, thing in enumerate(order):
        own = distances[thing]
        before = nearest[False] if adds[thing] else np.minimum(nearest[False], nearest[True])
        wrong = np.isfinite(own) & (own > before * (1.0 + SAME))
        if wrong.any():
            for other in order[:place]:
                if (
                    not (adds[thing] and adds[other])
                    and (wrong & (own > distances[other] * (1.0 + SAME))).any()
                ):
                    found.add((int(other), int(thing)))
        kind = bool(adds[thing])
        nearest[kind] = np.minimum(nearest[kind], own)
    return found


def crossing_pairs(distances):
    """Pairs of which each is nearer at some pixel where both are seen."""
    found = set()
    for i in range(len(distances)):
        for j in range(i):
            both = np.isfinite(distances[i]) & np.isfinite(distances[j])
            a, b = distances[i][both], distances[j][both]
            if (a > b * (1.0 + SAME)).any() and (b > a * (1.0 + SAME)).any():
                found.add((j, i))
    return found
