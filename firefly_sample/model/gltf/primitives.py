"""Triangles, lines and points of each mode of primitive, and arrays of vertices that fit them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.tangents import perpendicular

Indices = NDArray[np.int64]
Arrays = dict[str, NDArray[Any]]

POINTS, LINES, LINE_LOOP, LINE_STRIP, TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = range(7)

_PER_TARGET = ("morph_vertices", "morph_normals", "morph_tangents")
"""Arrays of shape (targets, vertices, 3); those of the others begin with the vertices."""


def triangles_of(mode: int, indices: Indices) -> Indices:
    """Return the triangles (m, 3) of a list, strip or fan of indices, counter-clockwise seen from the front.

    The formulas are those of glTF 2.0, section 3.7.2.1; an incomplete last triangle is left out.
    """
    if mode == TRIANGLES:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    first = np.arange(max(len(indices) - 2, 0))
    if mode == TRIANGLE_STRIP:
        odd = first % 2  # the winding of every second triangle of a strip is turned
        corners = np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)
    else:
        corners = np.stack([first + 1, first + 2, np.zeros_like(first)], axis=1)
    return indices[corners]


def marks_of(mode: int, indices: Indices) -> Indices:
    """Return the points (m, 1) or the lines (m, 2) of indices; an incomplete last line is left out."""
    if mode == POINTS:
        return indices[:, None]
    if mode == LINES:
        return indices[: len(indices) // 2 * 2].reshape(-1, 2)
    steps = np.stack([indices, np.roll(indices, -1)], axis=1)
    closed = mode == LINE_LOOP and len(indices) > 2  # a loop of two is a line
    return steps if closed else steps[:-1]


def pick(arrays: Arrays, vertices: Indices) -> Arrays:
    """Return arrays that hold only these vertices, in this order."""
    return {
        name: array[:, vertices] if name in _PER_TARGET else array[vertices]
        for name, array in arrays.items()
        if name != "triangles"
    }


def numbers_in(arrays: Arrays, vertices: int) -> int:
    """Return how many numbers arrays hold after `pick` has taken this many vertices."""
    return sum(
        vertices * (array[:, :1] if name in _PER_TARGET else array[:1]).size
        for name, array in arrays.items()
        if name != "triangles"
    )


def without_unused(triangles: Indices, count: int) -> tuple[Indices, Indices]:
    """Return the vertices that triangles, lines or points use, ascending, and these as indices into those."""
    used = np.zeros(count, bool)
    used[triangles] = True
    places = np.cumsum(used) - 1
    return np.flatnonzero(used), places[triangles]


def flat_normals(corners: Float64) -> Float64:
    """Return the unit normals (m, 3) of triangles (m, 3, 3); Z where a triangle has no area."""
    # scaled by powers of two, which is exact, so that products of edges neither overflow nor vanish
    edges = corners[:, 1:] - corners[:, :1]
    _, exponents = np.frexp(_largest(edges))
    edges = np.ldexp(edges, -exponents[..., None])
    return unit_or_up(np.cross(edges[:, 0], edges[:, 1]))


def unit_or_up(vectors: Float64) -> Float64:
    """Return vectors (n, 3) scaled to length 1; Z in place of those that are zero."""
    largest = _largest(vectors)
    none = largest == 0.0
    scaled = vectors / np.where(none, 1.0, largest)[:, None]  # whose squares neither overflow nor vanish
    scaled[none] = (0.0, 0.0, 1.0)
    return np.asarray(scaled / np.sqrt(np.einsum("ij,ij->i", scaled, scaled))[:, None])


def unit_tangents(tangents: Float64, normals: Float64) -> Float64:
    """Return tangents (n, 4) of length 1; in place of zeros, any at a right angle to the normal."""
    none = _largest(tangents[:, :3]) == 0.0
    directions = np.where(none[:, None], perpendicular(normals), tangents[:, :3])
    return np.column_stack([unit_or_up(directions), tangents[:, 3]])


def _largest(vectors: Float64) -> Float64:
    """Return the largest magnitude in each vector (..., 3); much faster than a maximum along an axis."""
    x, y, z = np.abs(np.moveaxis(vectors, -1, 0))
    return np.asarray(np.maximum(np.maximum(x, y), z))
