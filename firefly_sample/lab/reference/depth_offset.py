"""Depth offsets in float64: the distances at which surfaces are compared, moved as OpenGL moves depths.

An offset of n moves a depth by n slopes and n of the least steps of the depth buffer. A triangle's slope is
the most by which its depth changes from one pixel to the next, to the right or down; it is the same in all of
a triangle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.rays import Rays
from firefly_sample.plan.frame_plan import Batch, FramePlan

Float64 = NDArray[np.float64]

STEPS = {"depth16": 2.0**-16, "depth24": 2.0**-24}
"""The least step of each format of depth buffers whose numbers are fractions."""


def moved_distance(
    plan: FramePlan,
    batch: Batch,
    rays: Rays,
    instance: NDArray[np.integer],
    triangle: NDArray[np.integer],
    distance: Float64,
) -> Float64:
    """Return the distances at which n points of triangles are compared, shape (n,), along the view axis.

    A point that would be moved behind the eye is compared at distance 0.
    """
    if not batch.depth_offset:
        return distance
    lens = plan.view.lens
    depth = lens.depth_from_distance(distance)
    target = plan.target("depth")
    form = "depth24" if target is None else target.format
    step = STEPS[form] if form in STEPS else np.spacing(depth.astype(np.float32)).astype(np.float64)
    moved = batch.depth_offset * (_slopes(plan, batch, rays, instance, triangle) + np.abs(step))
    result = lens.distance_from_depth(depth + moved if plan.view.reverse else depth - moved)
    return np.where(result > 0.0, result, 0.0) if lens.perspective else result


def _slopes(
    plan: FramePlan, batch: Batch, rays: Rays, instance: NDArray[np.integer], triangle: NDArray[np.integer]
) -> Float64:
    """Return the most by which triangles' depths change from one pixel to the next, shape (n,).

    On a plane n.p = d, the inverse of a distance is n.r/d on a ray r; without perspective, the distance
    itself changes by n_x/n_y.
    """
    lens = plan.view.lens
    matrix = batch.model_to_view[instance]
    corners = batch.geom.vertices[batch.geom.triangles[triangle]]
    placed = corners @ matrix[:, :3, :3] + matrix[:, None, 3, :3]
    normal = np.cross(placed[:, 1] - placed[:, 0], placed[:, 2] - placed[:, 0])
    below = np.einsum("ni,ni->n", normal, placed[:, 0]) if lens.perspective else normal[:, 1]
    per_step = np.abs(lens.y_fold) if lens.perspective else 1.0 / np.abs(lens.y_fold)
    across = np.abs(normal[:, [0, 2]] * np.array(rays.pixel)).max(axis=1)
    edge_on = below == 0.0
    return np.asarray(per_step * across / np.abs(np.where(edge_on, np.inf, below)))
