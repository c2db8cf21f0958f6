"""Plan blended surfaces: their draws, their lights, and the order of their triangles."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from firefly_sample.memo import Memo
from firefly_sample.plan.blending.order import PaintOrder, order_warnings, paint_order
from firefly_sample.plan.blending.polygons import Discs, discs_on_screen, triangles_on_screen
from firefly_sample.plan.frame_plan import Batch, Blended, DrawOrder, Run, SpriteSet
from firefly_sample.plan.lights.clusters import plan_clusters
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.particles.visible import ParticleSet
from firefly_sample.plan.view import View
from firefly_sample.plan.visible import Visible, blended_batches
from firefly_sample.scene.arrays import Float64


class BlendingPlanner:
    """Plans what is blended, and keeps draws and their order while nothing moves."""

    def __init__(self) -> None:
        self._batches: Memo[tuple[Batch, ...]] = Memo()
        self._order: Memo[DrawOrder] = Memo()

    def plan(
        self,
        needs: Needs,
        seen: Visible,
        chosen: tuple[bool, ...],
        view: View,
        sets: Sequence[LightSet],
        particles: ParticleSet,
        dots: SpriteSet,
    ) -> Blended | None:
        """Return the chosen parts of what is in view as blended ones; None if nothing is blended."""
        if not needs.blends:
            return None
        batches = self._batches.get((seen, chosen), lambda: blended_batches(seen, chosen))
        parts = [part for part, mine in zip(seen.parts, chosen, strict=True) if mine]
        nearest = min(float(part.nearest.min()) for part in parts)
        farthest = max(float(part.farthest.max()) for part in parts)
        order = None
        if needs.transparency == "sorted":
            squares = particles.positions, particles.radii, particles.order, dots.positions, dots.radii
            key = (batches, view.lens, view.near, view.far, *(array.tobytes() for array in squares))
            order = self._order.get(key, lambda: draw_order(batches, view, particles, dots))
        clusters = plan_clusters(sets, view, nearest, farthest)
        # bounding spheres may reach beyond the planes
        return Blended(batches, order, clusters, max(nearest, view.near), min(farthest, view.far))


def draw_order(batches: Sequence[Batch], view: View, particles: ParticleSet, dots: SpriteSet) -> DrawOrder:
    """Return the order in which triangles that face the eye, particles and dots are drawn."""
    corners, rows, groups = [np.zeros((0, 3, 3))], [np.zeros((0, 3), dtype=np.uint32)], []
    for number, batch in enumerate(batches):
        placed, own = _facing_triangles(batch, view.lens.perspective)
        corners.append(placed)
        rows.append(own)
        groups.append(np.full(len(own), number))
    squares = len(batches)  # the group of particles and dots, which share draws
    polygons = triangles_on_screen(
        np.concatenate(corners),
        np.concatenate([*groups, np.zeros(0, dtype=int)]),
        view.lens,
        view.near,
        view.far,
    )
    discs = _discs(view, particles, dots, squares)
    found = paint_order(polygons, discs)
    return _as_draws(found, polygons.sources, polygons.groups, discs, np.concatenate(rows), squares)


def _facing_triangles(batch: Batch, perspective: bool) -> tuple[Float64, NDArray[np.uint32]]:
    """Return corners in view space, (n, 3, 3), of the triangles whose drawn side faces the eye.

    With them come their vertices, (n, 3), as `DrawOrder.corners` numbers them.
    """
    placed = batch.geom.vertices @ batch.model_to_view[:, :3, :3] + batch.model_to_view[:, None, 3, :3]
    corners = placed[:, batch.geom.triangles].reshape(-1, 3, 3)
    count = len(batch.geom.triangles)
    numbers = np.arange(len(corners))
    if not batch.surface.double_sided:
        first = corners[:, 0]
        normals = np.cross(corners[:, 1] - first, corners[:, 2] - first)
        towards = -np.einsum("ij,ij->i", normals, first) if perspective else -normals[:, 1]
        numbers = np.flatnonzero(towards < 0.0 if batch.mirrored else towards > 0.0)
    instance, triangle = np.divmod(numbers, count)
    vertices = batch.geom.triangles[triangle] + (instance * len(batch.geom.vertices))[:, None]
    return corners[numbers], vertices.astype(np.uint32)


def _discs(view: View, particles: ParticleSet, dots: SpriteSet, group: int) -> Discs:
    """Return particles, then dots, as discs."""
    positions = np.concatenate([particles.positions, dots.positions])
    radii = np.concatenate([particles.radii, dots.radii])
    adds = np.arange(len(radii)) >= len(particles)
    return discs_on_screen(positions, radii, adds, group, view.lens, view.near, view.far)


def _as_draws(
    found: PaintOrder,
    sources: NDArray[np.intp],
    groups: NDArray[np.intp],
    discs: Discs,
    vertices: NDArray[np.uint32],
    squares: int,
) -> DrawOrder:
    """Return an order as draws; `sources` are the triangles of polygons, which have these `vertices`."""
    count = len(sources)
    own = np.concatenate([groups, np.full(len(discs.sources), squares)])[found.order]
    is_triangle = found.order < count
    before = np.concatenate([[0], np.cumsum(is_triangle)])
    runs = []
    for first, end in pairwise(found.runs.tolist()):
        batch = int(own[first])
        start = before[first] if batch < squares else first - before[first]
        runs.append(Run(batch if batch < squares else -1, int(start), end - first))
    return DrawOrder(
        tuple(runs),
        vertices[sources[found.order[is_triangle]]],
        discs.sources[found.order[~is_triangle] - count],
        tuple(order_warnings(found)),
    )
