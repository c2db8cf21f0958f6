"""The blended triangles that rays meet, all of them, in float64.

Nothing is left to a search tree of float32 numbers: each triangle is tested against the rays of its bounding
box, so that surfaces in one plane, and those that intersect, are all found. Where a ray meets the edge that
two triangles share, one of them has it, as in a rasteriser.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.chunks import chunks_of
from firefly_sample.lab.reference.depth_offset import moved_distance
from firefly_sample.lab.reference.fragments import Fragments
from firefly_sample.lab.reference.rays import RayCorners, Rays, pixel_rays
from firefly_sample.lab.reference.surfaces import CHUNK, numbered_batches
from firefly_sample.lab.reference.texture import Samplers
from firefly_sample.plan.blending.candidates import ramps
from firefly_sample.plan.frame_plan import Batch, FramePlan
from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]
Index = NDArray[np.intp]

ROUNDING = 1e-12
"""Relative difference from which on one distance is behind another."""
SLACK = 1e-9
"""Share of an edge's largest area below which a pixel is tested exactly."""
SMALL = 64
"""Pixels of a box that are all tested exactly."""
BESIDE = 1.0 / 128.0
"""Share of a pixel by which an edge may be off: a rasteriser moves corners by 1/512 at most, this is more."""


@dataclass(frozen=True, eq=False)
class Layers:
    """The points where n rays meet blended triangles: by pixels, the nearest first.

    Attributes
    ----------
    pixel : ndarray of int, shape (n,)
        Row by row, the first row on top.
    place : ndarray of int, shape (n,)
        0 for the nearest one of a pixel, 1 for the next one, and so on; nearer as depth offsets move them.
    distance : ndarray of float64, shape (n,)
        Along the view axis.
    batch, instance, triangle : ndarray of int, shape (n,)
        Index into `Blended.batches`, instance of the batch and triangle of its Geom.
    """

    pixel: Index
    place: Index
    distance: Float64
    batch: Index
    instance: Index
    triangle: Index

    def __len__(self) -> int:
        return len(self.pixel)

    @property
    def most(self) -> int:
        """The number of layers of the pixel that has most."""
        return int(self.place.max(initial=-1)) + 1

    def same_as(self, other: Layers, pixels: int) -> NDArray[np.bool_]:
        """Return for each pixel whether its layers are those of other rays, in the same order."""
        counts = np.bincount(self.pixel, minlength=pixels)
        same = counts == np.bincount(other.pixel, minlength=pixels)
        mine, its = same[self.pixel], same[other.pixel]
        wrong = np.zeros(int(mine.sum()), dtype=bool)
        for name in ("batch", "instance", "triangle"):
            wrong |= getattr(self, name)[mine] != getattr(other, name)[its]
        same[self.pixel[mine][wrong]] = False
        return np.asarray(same)


def cast_layers(plan: FramePlan, distance: Float64, rays: Rays | None = None) -> Layers:
    """Return all blended triangles that face the eye before the opaque surfaces.

    Parameters
    ----------
    distance : ndarray of float64, shape (height, width)
        Of the opaque surfaces, as `surface_distance` returns it.
    rays : Rays, optional
        Those through the pixels' centres when absent.
    """
    rays = pixel_rays(plan.view) if rays is None else rays
    behind = distance.reshape(-1) + ROUNDING * np.abs(distance.reshape(-1))
    samplers, none = Samplers(), np.zeros(0, dtype=np.intp)
    parts = [(none, np.zeros(0), np.zeros(0), none, none, none)]
    for number, batch in enumerate(plan.blended.batches if plan.blended is not None else ()):
        for pixel, instance, triangle in _candidates(batch, plan.view, rays):
            mine = rays.take(pixel)
            found = Fragments(batch, mine, instance, triangle, samplers)
            y = found.hits.along
            kept = _owns(batch, mine, instance, triangle) & found.is_front()
            moved = moved_distance(plan, batch, mine, instance, triangle, y)
            kept &= (y >= plan.view.near) & (y <= plan.view.far) & (moved <= behind[pixel])
            which = np.full(np.count_nonzero(kept), number)
            parts.append((pixel[kept], y[kept], moved[kept], which, instance[kept], triangle[kept]))
    pixel, y, moved, which, instance, triangle = (np.concatenate(each) for each in zip(*parts, strict=True))
    order = np.lexsort((triangle, instance, which, moved, pixel))
    pixel = pixel[order]
    place = np.arange(len(order)) - np.searchsorted(pixel, pixel)
    return Layers(pixel, place, y[order], which[order], instance[order], triangle[order])


def steady_layers(plan: FramePlan, visibility: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return the pixels all of whose rays meet the same blended triangles, shape (height, width).

    In the others an edge, or a line in which surfaces intersect, passes within `BESIDE` of the centre, so
    that a rasteriser may see something else there. `visibility` is of the opaque surfaces.
    """
    height, width = visibility.shape[:2]
    rays = pixel_rays(plan.view)
    middle = cast_layers(plan, surface_distance(plan, visibility, rays), rays)
    steady = np.ones(height * width, dtype=bool)
    for across in (-BESIDE, BESIDE):
        for down in (-BESIDE, BESIDE):
            beside = _moved(rays, across, down)
            other = cast_layers(plan, surface_distance(plan, visibility, beside), beside)
            steady &= middle.same_as(other, len(steady))
    return steady.reshape(height, width)


def surface_distance(plan: FramePlan, visibility: NDArray[np.int32], rays: Rays) -> Float64:
    """Return the distances at which opaque surfaces are compared along rays, shape (height, width).

    They are distances along the view axis, moved by depth offsets; infinite where there is no surface.
    """
    seen = visibility.reshape(-1, 2)
    result, samplers = np.full(len(seen), np.inf), Samplers()
    for first, batch in numbered_batches(plan):
        chosen = np.flatnonzero((seen[:, 0] >= first) & (seen[:, 0] < first + len(batch.ids)))
        for pixels in chunks_of(chosen, CHUNK):
            instance, triangle = seen[pixels].T
            met = rays.take(pixels), instance - first, triangle
            found = Fragments(batch, *met, samplers)
            result[pixels] = moved_distance(plan, batch, *met, found.position[:, 1])
    return result.reshape(visibility.shape[:2])


def _moved(rays: Rays, across: float, down: float) -> Rays:
    """Return rays moved by parts of a pixel."""
    step = np.array([across * rays.pixel[0], 0.0, down * rays.pixel[1]])
    if rays.perspective:
        return replace(rays, direction=rays.direction + step)
    return replace(rays, origin=rays.origin + step)


def _candidates(batch: Batch, view: View, rays: Rays) -> Iterator[tuple[Index, Index, Index]]:
    """Yield pixels with instances and triangles that their rays may meet, in chunks."""
    for instance, matrix in enumerate(batch.model_to_view):
        placed = batch.geom.vertices @ matrix[:3, :3] + matrix[3, :3]
        corners = placed[batch.geom.triangles]
        low, high = _boxes(corners, view)
        counts = (high - low).prod(axis=1)
        small = np.flatnonzero((counts > 0) & (counts <= SMALL))
        for part in chunks_of(small, CHUNK // SMALL):
            pixels, triangle = _box_pixels(low[part], high[part], view.size[0])
            yield pixels, np.full(len(pixels), instance), part[triangle]
        for large in np.flatnonzero(counts > SMALL).tolist():
            pixels = _pixels_within(corners[large], low[large], high[large], rays, view.size[0])
            yield pixels, np.full(len(pixels), instance), np.full(len(pixels), large)


def _boxes(corners: Float64, view: View) -> tuple[Index, Index]:
    """Return the first and the end of columns and rows that may see triangles (n, 3, 3), shapes (n, 2).

    There are two more pixels per side, and none for triangles that are nearer or farther than all is.
    """
    lens, y = view.lens, corners[..., 1]
    beside_eye = np.asarray((y <= 0.0).any(axis=1)) & lens.perspective
    whole = beside_eye[:, None]
    w = np.where(whole, 1.0, y) if lens.perspective else np.ones_like(y)
    across = (lens.a * corners[..., 0] / w + lens.x_offset + 1.0) * (view.size[0] / 2)
    down = (1.0 - lens.c * corners[..., 2] / w - lens.z_offset) * (view.size[1] / 2)
    places = np.stack([across, down], axis=2)
    low = np.where(whole, 0.0, places.min(axis=1) - 2.0)
    high = np.where(whole, np.inf, places.max(axis=1) + 3.0)
    low, high = (np.clip(ends, 0.0, view.size).astype(np.intp) for ends in (low, high))
    outside = np.asarray((y < view.near).all(axis=1) | (y > view.far).all(axis=1))
    return low, np.where(outside[:, None], low, high)


def _box_pixels(low: Index, high: Index, width: int) -> tuple[Index, Index]:
    """Return all pixels of n boxes, and the box of each."""
    wide, tall = (high - low).T
    box = np.repeat(np.arange(len(low)), wide * tall)
    number = ramps(wide * tall)
    rows, columns = low[box, 1] + number // wide[box], low[box, 0] + number % wide[box]
    return rows * width + columns, box


def _pixels_within(corners: Float64, low: Index, high: Index, rays: Rays, width: int) -> Index:
    """Return the pixels of a box whose rays go through a triangle, and perhaps some beside its edges.

    The area between a ray and an edge is linear in the pixel's place: a column's part plus a row's part.
    """
    x, z = np.arange(low[0], high[0]), np.arange(low[1], high[1]) * width
    least, most = np.full((len(z), len(x)), np.inf), np.full((len(z), len(x)), -np.inf)
    for one, other in ((0, 1), (1, 2), (2, 0)):
        edge = corners[other] - corners[one]
        if rays.perspective:
            normal, places, zero = np.cross(corners[one], corners[other]), rays.direction, np.zeros(3)
        else:
            normal, places, zero = np.array([edge[2], 0.0, -edge[0]]), rays.origin, corners[one]
        across, up = ((places[pixels] - zero) @ normal for pixels in (x + z[0], x[0] + z))
        area = across + (up - up[0])[:, None]
        area /= max(float(np.abs(area).max()), 1e-300)
        least, most = np.minimum(least, area), np.maximum(most, area)
    row, column = np.nonzero((least >= -SLACK) | (most <= SLACK))
    return np.asarray(z[row] + x[column])


def _owns(batch: Batch, rays: Rays, instance: Index, triangle: Index) -> NDArray[np.bool_]:
    """Return whether rays go through triangles; of two that share an edge on the ray, one has it."""
    matrix = batch.model_to_view[instance]
    corners = batch.geom.vertices[batch.geom.triangles[triangle]] @ matrix[:, :3, :3] + matrix[:, None, 3, :3]
    seen = RayCorners.of(corners, rays.origin, rays.direction)
    areas = seen.areas()
    whole = areas.sum(axis=1, keepdims=True)
    turned = np.where(whole < 0.0, -1.0, 1.0)
    after, before = [1, 2, 0], [2, 0, 1]
    # the edge from `after` to `before`, along which the triangle lies on the left
    across = (seen.across[:, before] - seen.across[:, after]) * turned
    up = (seen.up[:, before] - seen.up[:, after]) * turned
    mine = (up < 0.0) | ((up == 0.0) & (across < 0.0))
    inside = (areas * turned > 0.0) | ((areas == 0.0) & mine)
    return np.asarray(inside.all(axis=1) & (whole[:, 0] != 0.0))
