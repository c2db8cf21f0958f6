"""Plan blended surfaces: their draws, their lights, and the order of their triangles."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from firefly_sample.memo import Memo
from firefly_sample.plan.frame_plan import Batch, Blended, DrawOrder, Run, SpriteSet
from firefly_sample.plan.lights.clusters import plan_clusters
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.particles.visible import ParticleSet
from firefly_sample.plan.view import View
from firefly_sample.plan.visible import Visible, blended_batches


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
            squares = particles.positions, particles.radii, dots.positions, dots.radii
            key = (batches, view.lens, view.size, view.near, *(array.tobytes() for array in squares))
            order = self._order.get(key, lambda: _draw_order(batches, view, particles, dots))
        clusters = plan_clusters(sets, view, nearest, farthest)
        return Blended(batches, order, clusters, nearest, farthest)


def _draw_order(batches: Sequence[Batch], view: View, particles: ParticleSet, dots: SpriteSet) -> DrawOrder:
    """Return the order by the middles of triangles (to be replaced)."""
    depth, group, rows = [], [], []
    for number, batch in enumerate(batches):
        middles = batch.geom.vertices[batch.geom.triangles].mean(axis=1)
        y = middles @ batch.model_to_view[:, :3, 1].T + batch.model_to_view[:, 3, 1]  # (m, k)
        instance, triangle = np.meshgrid(np.arange(len(batch.ids)), np.arange(len(middles)))
        depth.append(y.reshape(-1))
        group.append(np.full(y.size, number))
        rows.append(np.stack([instance.reshape(-1), triangle.reshape(-1)], axis=1))
    squares = np.concatenate([particles.positions[:, 1], dots.positions[:, 1]])
    count = sum(map(len, depth))
    depths = np.concatenate([*depth, squares])
    groups = np.concatenate([*group, np.full(len(squares), -1)])
    sequence = np.argsort(-depths, kind="stable")
    return as_draws(sequence, groups, np.concatenate(rows), count)


def as_draws(sequence: np.ndarray, groups: np.ndarray, triangles: np.ndarray, count: int) -> DrawOrder:
    """Return a sequence of things, of which the first `count` are triangles, as runs of one group each."""
    own = groups[sequence]
    ends = np.concatenate([[0], np.flatnonzero(np.diff(own)) + 1, [len(own)]])
    is_triangle = sequence < count
    before = np.concatenate([[0], np.cumsum(is_triangle)])
    runs = []
    for first, end in pairwise(ends.tolist()):
        if first < end:
            start = before[first] if own[first] >= 0 else first - before[first]
            runs.append(Run(int(own[first]), int(start), end - first))
    return DrawOrder(tuple(runs), triangles[sequence[is_triangle]], sequence[~is_triangle] - count)
