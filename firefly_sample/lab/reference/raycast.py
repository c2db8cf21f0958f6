"""Which triangle each pixel sees, by rays: no rasteriser, no depth buffer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.chunks import Progress, run_all, tiles_of
from firefly_sample.lab.reference.fragments import Fragments
from firefly_sample.lab.reference.ray_scene import RayScene
from firefly_sample.lab.reference.rays import Rays, pixel_rays
from firefly_sample.lab.reference.surfaces import numbered_batches
from firefly_sample.lab.reference.texture import Samplers
from firefly_sample.plan.frame_plan import Batch, FramePlan

Float64 = NDArray[np.float64]

TILE = (128, 128)

STEP = 1e-6
"""Of the distance: how far behind a triangle that is not there (its back, what lies before the near plane,
what alpha cuts away) a ray goes on. It is what float32 needs to be sure to have left it."""


def cast_visibility(
    plan: FramePlan, *, threads: int | None = None, progress: Progress | None = None
) -> NDArray[np.int32]:
    """What the output "visibility" would be of a rasteriser without any error.

    Parameters
    ----------
    plan : FramePlan
    threads, progress : optional
        As `firefly_sample.lab.reference.chunks.run_all` takes them.

    Returns
    -------
    ndarray of int32, shape (height, width, 2)
        Instance, counted over the plan's batches in order, and triangle of its Geom; -1 where nothing is.

    Raises
    ------
    MissingPackageError
        If embreex is not installed.
    """
    width, height = plan.view.size
    caster = _Caster(plan)
    result = np.full((height * width, 2), -1, dtype=np.int32)

    def work(pixels: NDArray[np.intp]) -> None:
        result[pixels] = caster.see(caster.rays.take(pixels))

    run_all(work, tiles_of((height, width), TILE), threads, progress)
    return result.reshape(height, width, 2)


class _Caster:
    """A plan's triangles, ready for rays from its camera."""

    def __init__(self, plan: FramePlan) -> None:
        self._near, self._far = plan.view.near, plan.view.far
        self.rays = pixel_rays(plan.view)
        self._batches: list[tuple[int, Batch]] = list(numbered_batches(plan))
        self._first = np.array([first for first, _ in self._batches], dtype=np.intp)
        geoms = [batch.geom for _, batch in self._batches for _ in batch.ids]
        matrices = [np.zeros((0, 4, 4)), *(batch.model_to_view for _, batch in self._batches)]
        lens = plan.view.lens
        self._scene = RayScene(geoms, np.concatenate(matrices), (lens.a, 1.0, lens.c))
        self._samplers = Samplers()

    def see(self, rays: Rays) -> NDArray[np.int32]:
        """Instance and triangle for each ray, shape (n, 2)."""
        result = np.full((len(rays), 2), -1, dtype=np.int32)
        begin = np.full(len(rays), self._near - STEP * abs(self._near))
        step = np.full(len(rays), STEP)
        before = np.full(len(rays), -1)
        waiting = np.arange(len(rays))
        while len(waiting):
            ways = rays.take(waiting)
            start = ways.origin + begin[waiting, None] * ways.direction
            number = self._scene.nearest(start, ways.direction, np.full(len(waiting), np.inf))
            hit = number >= 0
            waiting, number = waiting[hit], number[hit]
            instance, triangle = self._scene.owner(number)
            shown, distance = self._look(rays.take(waiting), instance, triangle)
            shown &= distance >= self._near
            beyond = distance > self._far
            kept = shown & ~beyond
            result[waiting[kept]] = np.stack([instance[kept], triangle[kept]], axis=1)
            on = ~(kept | beyond)
            waiting, number, distance = waiting[on], number[on], distance[on]
            # the same triangle again: float32 has not left it, where it lies along the ray
            step[waiting] = np.where(number == before[waiting], 2.0 * step[waiting], STEP)
            before[waiting] = number
            behind = np.maximum(distance, begin[waiting])
            begin[waiting] = behind + step[waiting] * np.maximum(np.abs(behind), abs(self._near))
        return result

    def _look(
        self, rays: Rays, instance: NDArray[np.intp], triangle: NDArray[np.intp]
    ) -> tuple[NDArray[np.bool_], Float64]:
        """Whether rays see triangles, and how far away these are, in float64."""
        shown, distance = np.zeros(len(rays), dtype=bool), np.zeros(len(rays))
        of = np.searchsorted(self._first, instance, side="right") - 1
        for index in np.unique(of):
            chosen = np.flatnonzero(of == index)
            first, batch = self._batches[index]
            found = Fragments(
                batch, rays.take(chosen), instance[chosen] - first, triangle[chosen], self._samplers
            )
            distance[chosen] = found.meeting.along
            front = found.is_front()
            shown[chosen] = front & found.is_there() if front.any() else False
        return shown, distance
