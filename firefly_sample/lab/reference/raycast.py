"""Find the triangle that each pixel sees by rays, without rasteriser and depth buffer.

Embree computes in float32: it finds candidates, which are then checked in float64. It cannot distinguish what
differs by about 1e-7 of the distances: which of two triangles that share an edge is met by a ray through that
edge, or which of two surfaces that close is the nearer one. A rasteriser, whose corners snap to 1/256 of a
pixel, has a hundred times that error.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import MissingPackageError
from firefly_sample.extras import install_command
from firefly_sample.lab.reference.chunks import Progress, run_all, tiles_of
from firefly_sample.lab.reference.depth_offset import moved_distance
from firefly_sample.lab.reference.fragments import Fragments
from firefly_sample.lab.reference.rays import Rays, pixel_rays
from firefly_sample.lab.reference.surfaces import numbered_batches
from firefly_sample.lab.reference.texture import Samplers
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.scene.geom import Geom

Float64 = NDArray[np.float64]

TILE = (128, 128)
STEP = 1e-6
"""Relative step by which a ray goes on behind a triangle that is not drawn: float32 has then left it."""


class RayScene:
    """The triangles of some instances in one space, for rays; it needs embreex.

    Parameters
    ----------
    geoms : sequence of Geom
        One for each instance; they may repeat.
    matrices : ndarray of float64, shape (instances, 4, 4)
        From model space to the rays' space, for row vectors.
    stretch : (float, float, float), optional
        Factors of the axes, for Embree only: rays through a very narrow lens keep their digits if its picture
        is made about as wide as it is far away.
    """

    def __init__(
        self, geoms: Sequence[Geom], matrices: Float64, stretch: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ) -> None:
        unique = list({id(geom): geom for geom in geoms}.values())
        order = {id(geom): index for index, geom in enumerate(unique)}
        own = np.array([order[id(geom)] for geom in geoms], dtype=np.intp)
        vertices = np.cumsum([0, *(len(geom.vertices) for geom in unique)])
        triangles = np.cumsum([0, *(len(geom.triangles) for geom in unique)])
        self._vertices = np.concatenate([np.zeros((0, 3)), *(geom.vertices for geom in unique)])
        self._texcoords = [
            np.concatenate([np.zeros((0, 2)), *(_texcoords(geom, number) for geom in unique)])
            for number in (1, 2)
        ]
        self._alphas = np.concatenate([np.zeros(0), *map(_alphas, unique)])
        parts = (geom.triangles + first for geom, first in zip(unique, vertices, strict=False))
        self._triangles = np.concatenate([np.zeros((0, 3), dtype=np.intp), *parts])
        self._matrices = matrices
        self._first_triangle = triangles[own]
        self._first = np.concatenate([[0], np.cumsum(np.diff(triangles)[own])])
        self._stretch = np.array(stretch)
        self._scale = 1.0
        self._scene, self._mesh = _embree(*self._float32(geoms))

    def _float32(self, geoms: Sequence[Geom]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Return corners and triangles of all instances, scaled so that no product leaves float32's range."""
        positions, indices, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int32)], 0
        for geom, matrix in zip(geoms, self._matrices, strict=True):
            positions.append((geom.vertices @ matrix[:3, :3] + matrix[3, :3]) * self._stretch)
            indices.append((geom.triangles + count).astype(np.int32))
            count += len(geom.vertices)
        corners = np.concatenate(positions)
        self._scale = 1.0 / max(float(np.abs(corners).max(initial=0.0)), 1e-300)
        return (corners * self._scale).astype(np.float32), np.concatenate(indices)

    def __len__(self) -> int:
        return int(self._first[-1])

    def nearest(self, origin: Float64, direction: Float64, end: Float64) -> NDArray[np.intp]:
        """Return the number of the first triangle that each ray meets, from either side; -1 if there is none.

        Rays begin at `origin`, shape (n, 3), and end where `end`, shape (n,), says in units of `direction`.
        """
        if not len(self) or not len(origin):
            return np.full(len(origin), -1)
        rays = [
            np.ascontiguousarray(values * (self._stretch * self._scale), dtype=np.float32)
            for values in (origin, direction)
        ]
        limits = np.minimum(end, 1e30).astype(np.float32)
        found = self._scene.run(*rays, dists=limits, query="INTERSECT")
        return np.asarray(found, dtype=np.intp)

    def owner(self, number: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the instances of triangles, and their numbers in their Geoms."""
        instance = np.searchsorted(self._first, number, side="right") - 1
        return instance, number - self._first[instance]

    def corners(self, number: NDArray[np.intp]) -> Float64:
        """Return the positions of the corners of triangles in float64, shape (n, 3, 3)."""
        instance, _ = self.owner(number)
        matrix = self._matrices[instance]
        positions = self._vertices[self._corner_rows(number)]
        return np.asarray(positions @ matrix[:, :3, :3] + matrix[:, None, 3, :3])

    def texcoords(self, number: NDArray[np.intp], coordinates: int = 1) -> Float64:
        """Return the first (1) or the second (2) texture coordinates of triangles' corners, (n, 3, 2)."""
        return np.asarray(self._texcoords[coordinates - 1][self._corner_rows(number)])

    def alphas(self, number: NDArray[np.intp]) -> Float64:
        """Return the vertex alpha of the corners of triangles, shape (n, 3)."""
        return np.asarray(self._alphas[self._corner_rows(number)])

    def _corner_rows(self, number: NDArray[np.intp]) -> NDArray[np.intp]:
        instance, triangle = self.owner(number)
        return np.asarray(self._triangles[self._first_triangle[instance] + triangle])


def _texcoords(geom: Geom, number: int) -> Float64:
    return geom.texcoords if number == 1 or geom.texcoords_1 is None else geom.texcoords_1


def _alphas(geom: Geom) -> Float64:
    return np.ones(len(geom.vertices)) if geom.alphas is None else geom.alphas


def _embree(corners: NDArray[np.float32], triangles: NDArray[np.int32]) -> tuple[Any, Any]:
    """Build Embree's scene, and return it with its mesh, which must live as long."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError as error:
        raise MissingPackageError(
            f"rays need embreex, which is not installed: run {install_command('measure')}"
        ) from error
    scene = EmbreeScene(robust=True)
    if not len(triangles):
        return scene, None
    mesh = TriangleMesh(scene, corners, triangles)
    nowhere = np.zeros((1, 3), dtype=np.float32)
    # Embree builds its tree at the first ray: not in several threads at once
    scene.run(nowhere, np.array([[0, 1, 0]], dtype=np.float32), query="INTERSECT")
    return scene, mesh


def cast_visibility(
    plan: FramePlan, *, threads: int | None = None, progress: Progress | None = None
) -> NDArray[np.int32]:
    """Return the output "visibility" that a rasteriser without any error would draw.

    `threads` and `progress` are as `firefly_sample.lab.reference.chunks.run_all` takes them.

    Returns
    -------
    ndarray of int32, shape (height, width, 2)
        Instance, counted over the plan's batches in order, and triangle of its Geom; -1 where there is none.

    Raises
    ------
    MissingPackageError
        If embreex is not installed.
    """
    width, height = plan.view.size
    rays = pixel_rays(plan.view)
    offsets = sorted({batch.depth_offset for batch in plan.batches})
    casters = [_Caster(plan, offset) for offset in offsets]
    result = np.full((height * width, 2), -1, dtype=np.int32)

    def work(pixels: NDArray[np.intp]) -> None:
        own = rays.take(pixels)
        nearest = np.full(len(pixels), np.inf)
        for caster in casters:
            seen, distance = caster.see(own)
            nearer = distance < nearest
            nearest[nearer] = distance[nearer]
            result[pixels[nearer]] = seen[nearer]

    run_all(work, tiles_of((height, width), TILE), threads, progress)
    return result.reshape(height, width, 2)


class _Caster:
    """A plan's triangles of one depth offset, ready for rays from its camera."""

    def __init__(self, plan: FramePlan, offset: int) -> None:
        self._plan, self._near, self._far = plan, plan.view.near, plan.view.far
        self._batches = [pair for pair in numbered_batches(plan) if pair[1].depth_offset == offset]
        counts = [len(batch.ids) for _, batch in self._batches]
        self._first = np.cumsum([0, *counts[:-1]], dtype=np.intp)  # among this caster's instances
        geoms = [batch.geom for _, batch in self._batches for _ in batch.ids]
        matrices = [np.zeros((0, 4, 4)), *(batch.model_to_view for _, batch in self._batches)]
        lens = plan.view.lens
        self._scene = RayScene(geoms, np.concatenate(matrices), (lens.a, 1.0, lens.c))
        self._samplers = Samplers()

    def see(self, rays: Rays) -> tuple[NDArray[np.int32], Float64]:
        """Return instance and triangle for each ray, shape (n, 2), and the distances that are compared, (n,).

        Where there is none, -1 and infinity.
        """
        result = np.full((len(rays), 2), -1, dtype=np.int32)
        compared = np.full(len(rays), np.inf)
        begin = np.full(len(rays), self._near - STEP * abs(self._near))
        step = np.full(len(rays), STEP)
        before = np.full(len(rays), -1)
        waiting = np.arange(len(rays))
        while len(waiting):
            left = rays.take(waiting)
            start = left.origin + begin[waiting, None] * left.direction
            number = self._scene.nearest(start, left.direction, np.full(len(waiting), np.inf))
            hit = number >= 0
            waiting, number = waiting[hit], number[hit]
            instance, triangle = self._scene.owner(number)
            shown, distance, moved, numbers = self._look(rays.take(waiting), instance, triangle)
            shown &= distance >= self._near
            beyond = distance > self._far
            kept = shown & ~beyond
            result[waiting[kept]] = np.stack([numbers[kept], triangle[kept]], axis=1)
            compared[waiting[kept]] = moved[kept]
            on = ~(kept | beyond)
            waiting, number, distance = waiting[on], number[on], distance[on]
            # the same triangle again: along it, float32 has not left it yet
            step[waiting] = np.where(number == before[waiting], 2.0 * step[waiting], STEP)
            before[waiting] = number
            behind = np.maximum(distance, begin[waiting])
            begin[waiting] = behind + step[waiting] * np.maximum(np.abs(behind), abs(self._near))
        return result, compared

    def _look(
        self, rays: Rays, instance: NDArray[np.intp], triangle: NDArray[np.intp]
    ) -> tuple[NDArray[np.bool_], Float64, Float64, NDArray[np.intp]]:
        """Return whether rays see triangles, their distances and moved ones, and the plan's instances."""
        shown, distance, moved = np.zeros(len(rays), dtype=bool), np.zeros(len(rays)), np.zeros(len(rays))
        numbers = np.zeros(len(rays), dtype=np.intp)
        owner = np.searchsorted(self._first, instance, side="right") - 1
        for index in np.unique(owner):
            chosen = np.flatnonzero(owner == index)
            first, batch = self._batches[index]
            met = rays.take(chosen), instance[chosen] - self._first[index], triangle[chosen]
            found = Fragments(batch, *met, self._samplers)
            distance[chosen] = found.hits.along
            moved[chosen] = moved_distance(self._plan, batch, *met, found.hits.along)
            numbers[chosen] = first + met[1]
            front = found.is_front()
            shown[chosen] = front & found.is_there() if front.any() else False
        return shown, distance, moved, numbers
