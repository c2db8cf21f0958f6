"""Which instances are in view, and the draws that they make."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.cull import spheres_in_frustum
from firefly_sample.plan.frame_plan import Batch
from firefly_sample.plan.instances import Factors, Group
from firefly_sample.plan.variants import GeometryVariant
from firefly_sample.scene.material import Material

__all__ = ["VisiblePart", "make_batches", "visible_instances", "visible_materials"]

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class VisiblePart:
    """The instances of a group that are in view, nearest first.

    Attributes
    ----------
    group : Group
    chosen : ndarray of int, shape (n,)
        Which of the group's instances.
    nearest, farthest : ndarray of float64, shape (n,)
        Along the view axis, of their bounding spheres.
    model_to_view : ndarray of float64, shape (n, 4, 4)
    ids : ndarray of int32, shape (n,)
    factors : Factors
    """

    group: Group
    chosen: NDArray[Any]
    nearest: Float64
    farthest: Float64
    model_to_view: Float64
    ids: NDArray[np.int32]
    factors: Factors

    def box(self) -> tuple[Float64, Float64]:
        """Least and largest coordinates of all instances' bounding boxes in view space, shape (3,) each."""
        low, high = self.group.geom.bounds
        one, other = (
            low[:, None] * self.model_to_view[:, :3, :3],
            high[:, None] * self.model_to_view[:, :3, :3],
        )
        place = self.model_to_view[:, 3, :3]
        least = np.minimum(one, other).sum(axis=1) + place
        largest = np.maximum(one, other).sum(axis=1) + place
        return least.min(axis=0), largest.max(axis=0)


def visible_instances(groups: Iterable[Group], world_to_view: Float64, planes: Float64) -> list[VisiblePart]:
    """A part for each group of which something is in view."""
    parts = []
    for group in groups:
        centers = group.centers @ world_to_view[:3, :3] + world_to_view[3, :3]
        seen = np.flatnonzero(spheres_in_frustum(planes, centers, group.radii))
        if not len(seen):
            continue
        nearest = centers[seen, 1] - group.radii[seen]
        order = np.argsort(nearest, kind="stable")
        chosen = seen[order]
        parts.append(
            VisiblePart(
                group,
                chosen,
                nearest[order],
                centers[chosen, 1] + group.radii[chosen],
                group.model_to_world[chosen] @ world_to_view,
                group.ids[chosen],
                group.factors().take(chosen),
            )
        )
    return parts


def visible_materials(parts: Iterable[VisiblePart]) -> list[Material]:
    """The materials in view, each once."""
    found: dict[int, Material] = {}
    for part in parts:
        materials = part.group.materials
        indices = (0,) if len(materials) == 1 else np.unique(part.group.which[part.chosen])
        found.update((id(materials[index]), materials[index]) for index in indices)
    return list(found.values())


def make_batches(parts: Iterable[VisiblePart], frame: GeometryVariant) -> tuple[Batch, ...]:
    """Draws, opaque ones first, then cut-outs, each front to back by their nearest instance."""
    keyed = []
    for index, part in enumerate(parts):
        group = part.group
        cutout = group.cutoff is not None
        variant = replace(
            frame,
            textured=group.texture is not None,
            vertex_color=group.geom.colors is not None and group.colors is None,
            cutout=cutout,
            double_sided=group.double_sided,
        )
        batch = Batch(
            key=group.key,
            geom=group.geom,
            texture=group.texture,
            alpha_cutoff=group.cutoff or 0.0,
            mirrored=group.mirrored,
            model_to_view=part.model_to_view,
            ids=part.ids,
            factors=part.factors,
            variant=variant,
        )
        keyed.append(((cutout, part.nearest[0], index), batch))
    return tuple(batch for _, batch in sorted(keyed, key=lambda entry: entry[0]))
