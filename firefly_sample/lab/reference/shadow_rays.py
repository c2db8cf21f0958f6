"""Shadows by rays, hard and exact: what shadow maps and their filters approximate.

What stands in a light's way is what its shadow maps draw, from either side, out of the camera's view or not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.one_light import OneLight
from firefly_sample.lab.reference.ray_scene import RayScene
from firefly_sample.lab.reference.texture import Sampler, Samplers
from firefly_sample.lab.reference.triangles import Beside, Meeting, meet
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.shadows.maps import ShadowMap
from firefly_sample.scene.geom import Geom

Float64 = NDArray[np.float64]

CONTACT = 4e-6
"""Of a surface's distance from the eye (its largest coordinate): what is nearer to it casts no shadow on it,
as its own triangle does not. Embree's float32 errs by about a twentieth of it."""


class ShadowRays:
    """Everything that casts shadows in a plan, in view space.

    Raises
    ------
    MissingPackageError
        If embreex is not installed.
    """

    def __init__(self, plan: FramePlan) -> None:
        self._maps, self._view_to_world = plan.shadows.maps, plan.view.view_to_world
        samplers = Samplers()
        numbers: dict[tuple[object, ...], int] = {}
        geoms: list[Geom] = []
        matrices: list[Float64] = []
        looks: list[tuple[Sampler | None, float, float, bool]] = []
        drawn: list[set[int]] = []
        for shadow in self._maps:
            drawn.append(set())
            for batch in shadow.casters or ():
                texture = batch.texture
                look = (
                    batch.geom.serial,
                    None if texture is None else texture.serial,
                    batch.cutoff,
                    batch.vertex_alpha,
                )
                sampler = None if texture is None else samplers.of(texture, batch.cutoff)
                for matrix, alpha in zip(batch.model_to_world, batch.alphas.tolist(), strict=True):
                    key = (*look, alpha, matrix.tobytes())
                    if key not in numbers:
                        numbers[key] = len(geoms)
                        geoms.append(batch.geom)
                        matrices.append(matrix @ plan.view.world_to_view)
                        looks.append((sampler, alpha, batch.cutoff, batch.vertex_alpha))
                    drawn[-1].add(numbers[key])
        self._drawn = np.zeros((len(self._maps), len(geoms)), dtype=bool)
        for row, chosen in zip(self._drawn, drawn, strict=True):
            row[list(chosen)] = True
        self._samplers = list({id(sampler): sampler for sampler, *_ in looks if sampler}.values())
        self._sampler_of = np.array(
            [-1 if sampler is None else self._samplers.index(sampler) for sampler, *_ in looks],
            dtype=np.intp,
        )
        self._alphas = np.array([alpha for _, alpha, _, _ in looks])
        self._cutoffs = np.array([cutoff for _, _, cutoff, _ in looks])
        self._vertex_alpha = np.array([own for *_, own in looks], dtype=bool)
        places = np.array(matrices).reshape(-1, 4, 4)
        self._scene = RayScene(geoms, places)
        corners = self._scene.corners(np.arange(len(self._scene)))
        self._extent = float(np.linalg.norm(corners, axis=2).max(initial=0.0))

    def lit(self, points: Float64, one: OneLight) -> Float64:
        """1 where a light reaches surfaces, 0 where something stands in its way.

        Parameters
        ----------
        points : ndarray of float64, shape (n, 3)
            On surfaces, view space.
        one : OneLight
            A light that has shadow maps.

        Returns
        -------
        ndarray of float64, shape (n,)
            1, too, where a directional light's map ends: beyond its shadow distance.
        """
        first, count = int(one.lights.casters[one.row]), int(one.lights.maps[one.row])
        drawn = np.asarray(self._drawn[first : first + count].any(axis=0))
        result = np.ones(len(points))
        waiting = np.flatnonzero(self._within(points, self._maps[first])) if count == 1 else None
        waiting = np.arange(len(points)) if waiting is None else waiting
        way = self._ways(points, one)
        length = np.linalg.norm(way, axis=1)
        contact = CONTACT * np.abs(points).max(axis=1, initial=0.0) / np.maximum(length, 1e-300)
        begin, step, before = contact.copy(), contact.copy(), np.full(len(points), -1)
        while len(waiting):
            origin = points[waiting] + begin[waiting, None] * way[waiting]
            number = self._scene.nearest(origin, way[waiting], 1.0 - begin[waiting])
            hit = number >= 0
            waiting, number = waiting[hit], number[hit]
            met = _meet(self._scene.corners(number), points[waiting], way[waiting])
            beyond = met.along >= 1.0
            stops = (met.along > contact[waiting]) & ~beyond
            stops &= self._stops(number, met, drawn)
            result[waiting[stops]] = 0.0
            on = ~(stops | beyond)
            waiting, number, along = waiting[on], number[on], met.along[on]
            # the same triangle again: float32 has not left it, where it lies along the ray
            step[waiting] = np.where(number == before[waiting], 2.0, 1.0) * step[waiting]
            before[waiting] = number
            begin[waiting] = np.maximum(along, begin[waiting]) + step[waiting]
            waiting = waiting[begin[waiting] < 1.0]
        return result

    def _within(self, points: Float64, shadow: ShadowMap) -> NDArray[np.bool_]:
        """Which points lie in a map: the others have no shadow of it."""
        matrix = self._view_to_world @ shadow.world_to_light
        q = points @ matrix[:3, :3] + matrix[3, :3]
        lens = shadow.lens
        w = q[:, 1] if lens.perspective else np.ones(len(q))
        return np.asarray((w > 0.0) & (np.abs(lens.a * q[:, 0]) <= w) & (np.abs(lens.c * q[:, 2]) <= w))

    def _ways(self, points: Float64, one: OneLight) -> Float64:
        """All the way to the light; to one without a place, out of everything."""
        if one.lights.kind != "directional":
            return np.asarray(one.lights.positions[one.row] - points)
        farthest = self._extent + np.linalg.norm(points, axis=1, keepdims=True)
        return np.asarray(-one.lights.directions[one.row] * farthest)

    def _stops(self, number: NDArray[np.intp], met: Meeting, drawn: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whether triangles are drawn into the light's maps, and alpha leaves them, at full size."""
        instance, _ = self._scene.owner(number)
        stops = np.asarray(drawn[instance])
        alpha = self._alphas[instance]
        rows = np.flatnonzero(stops & self._vertex_alpha[instance])
        alpha[rows] *= np.einsum("ni,ni->n", met.shares[rows], self._scene.alphas(number[rows]))
        for index, sampler in enumerate(self._samplers):
            rows = np.flatnonzero(stops & (self._sampler_of[instance] == index))
            places = np.einsum("ni,nik->nk", met.shares[rows], self._scene.texcoords(number[rows]))
            alpha[rows] *= sampler.sample(places, np.zeros(len(rows)))[:, 3]
        return np.asarray(stops & (alpha >= self._cutoffs[instance]))


def _meet(corners: Float64, origin: Float64, direction: Float64) -> Meeting:
    """As `meet`, for rays of any direction: its largest coordinate takes the place of Y."""
    main = np.argmax(np.abs(direction), axis=1)
    order = (main[:, None] + np.array([2, 0, 1])) % 3
    return meet(
        Beside.of(
            np.take_along_axis(corners, order[:, None, :], axis=2),
            np.take_along_axis(origin, order, axis=1),
            np.take_along_axis(direction, order, axis=1),
        )
    )
