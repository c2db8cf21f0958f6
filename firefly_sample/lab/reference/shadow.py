"""The share of a light that reaches surfaces: by shadow maps, and by rays.

`shadow` is the float64 twin of ``shaders/include/shadow.glsl``. `ShadowRays` gives hard, exact shadows, which
shadow maps and their filters approximate: every caster that a light's maps draw blocks its rays, from either
side, inside the camera's view or not.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.raycast import RayScene
from firefly_sample.lab.reference.rays import Intersections, RayCorners, intersect
from firefly_sample.lab.reference.shade import OneLight
from firefly_sample.lab.reference.texture import Sampler, Samplers
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.shadows.maps import ShadowMap

Float64 = NDArray[np.float64]

CONTACT = 4e-6
"""Share of a surface's distance from the eye (its largest coordinate) within which geometry casts no shadow
on it, as its own triangle must not. The float32 error of Embree is about a twentieth of it."""
NORMAL_OFFSET, LIFT, ROUNDING = 0.25, 0.05, 1e-6
"""The shader's constants: texels along the normal at grazing light, texels towards the light, float32
rounding."""


def cube_faces(direction: Float64) -> NDArray[np.int64]:
    """Return the cube faces, in the order +x, -x, +y, -y, +z, -z, of world-space directions (n, 3)."""
    axis = np.argmax(np.abs(direction), axis=1)
    return np.asarray(2 * axis + (direction[np.arange(len(direction)), axis] < 0))


def shadow(
    atlas: Float64,
    shadow_map: ShadowMap,
    reverse: bool,
    taps: int,
    position: Float64,
    normal: Float64,
    n_dot_l: Float64,
    y_view: Float64,
) -> Float64:
    """Return the lit share of each of n positions in one map.

    Parameters
    ----------
    atlas : ndarray, shape (height, width)
        Depths; row 0 is the lowest. With `reverse`, nearer surfaces have the larger depth.
    taps : {1, 4, 16}
    position, normal : ndarray of float64, shape (n, 3)
        World space.
    n_dot_l, y_view : ndarray of float64, shape (n,)
        Cosine of the light's angle, and distance along the camera's axis.
    """
    tile, lens = shadow_map.tile, shadow_map.lens
    matrix = shadow_map.world_to_light
    q = position @ matrix[:3, :3] + matrix[3, :3]
    n = normal @ matrix[:3, :3]
    scale = np.array([lens.a, lens.c]) * tile.size / 2.0
    texel = (q[:, 1] if lens.perspective else np.ones(len(q))) / scale.min()
    behind = lens.perspective & (q[:, 1] <= 0.0)
    q = q + n * (NORMAL_OFFSET * texel * np.sqrt(np.maximum(1.0 - n_dot_l**2, 0.0)))[:, None]
    lift = LIFT * texel + ROUNDING * (np.abs(y_view) + np.abs(q[:, 1]))
    if lens.perspective:
        forward = np.where(behind, 1.0, q[:, 1])
        side = -np.maximum(-np.einsum("ij,ij->i", n, q), 1e-3 * np.linalg.norm(q, axis=1))
        at = q[:, [0, 2]] / forward[:, None] * scale
        depth = lens.y_fold / np.maximum(forward - lift, 1e-6 * forward) - lens.w_fold
        slope = lens.y_fold * n[:, [0, 2]] / side[:, None] / scale
    else:
        side = np.minimum(n[:, 1], -1e-3)
        at = q[:, [0, 2]] * scale
        depth = (q[:, 1] - lift) / lens.y_fold - lens.w_fold
        slope = -n[:, [0, 2]] / side[:, None] / lens.y_fold / scale
    slope = np.where(n_dot_l[:, None] > 0.0, slope, 0.0)
    at = at + (tile.x, tile.y) + 0.5 * np.array(tile.size)
    corner = np.array([tile.x, tile.y])
    beyond = ((at < corner) | (at > corner + tile.size)).any(axis=1)

    def lit(texels: Float64) -> Float64:
        inside = np.clip(texels, (tile.x, tile.y), (tile.x + tile.size - 1, tile.y + tile.size - 1))
        along = np.einsum("ij,ij->i", slope, inside + 0.5 - at)
        here = depth + (np.maximum(along, 0.0) if reverse else np.minimum(along, 0.0))
        column, row = inside.astype(np.int64).T
        stored = atlas[row, column]
        return np.where(here >= stored if reverse else here <= stored, 1.0, 0.0)

    if taps == 1:
        share = lit(np.floor(at))
    else:
        first = np.floor(at - 0.5)
        f = at - 0.5 - first
        span = range(2) if taps == 4 else range(-1, 3)
        share = np.zeros(len(q))
        for j in span:
            for i in span:
                weight = _weights(f[:, 0], i, span) * _weights(f[:, 1], j, span)
                share += weight * lit(first + np.array([i, j]))
        share /= 1.0 if taps == 4 else 9.0
    return np.where(behind | beyond, 1.0, share)


def _weights(fraction: Float64, step: int, span: range) -> Float64:
    """Return a tap's weights along one axis: the outer taps cover only a fraction of a texel."""
    if step == span[0]:
        return 1.0 - fraction
    return fraction if step == span[-1] else np.ones(len(fraction))


class ShadowRays:
    """All shadow casters of a plan, in view space.

    Raises
    ------
    MissingPackageError
        If embreex is not installed.
    """

    def __init__(self, plan: FramePlan) -> None:
        self._maps, self._view_to_world = plan.shadows.maps, plan.view.view_to_world
        samplers = Samplers()
        casters: dict[tuple[object, ...], tuple[Any, ...]] = {}
        drawn: list[set[tuple[object, ...]]] = [set() for _ in self._maps]
        for shadow, keys in zip(self._maps, drawn, strict=True):
            for batch in shadow.casters or ():
                cutoff = batch.cutoff
                own = tuple(
                    (samplers.of(found.texture, cutoff), found.coordinates) for found in batch.textures()
                )
                for matrix, alpha in zip(batch.model_to_world, batch.alphas.tolist(), strict=True):
                    key = (batch.geom.serial, own, cutoff, batch.vertex_alpha, alpha, matrix.tobytes())
                    keys.add(key)
                    if key not in casters:
                        moved = matrix @ plan.view.world_to_view
                        casters[key] = batch.geom, moved, own, alpha, cutoff, batch.vertex_alpha
        drawn_rows = [[key in keys for key in casters] for keys in drawn]
        self._drawn = np.array(drawn_rows, dtype=bool).reshape(len(drawn), len(casters))
        columns = zip(*casters.values(), strict=True) if casters else [()] * 6
        geoms, matrices, sampled, alphas, cutoffs, vertex_alpha = columns
        self._sampled: dict[tuple[Sampler, int], NDArray[np.bool_]] = {
            one: np.array([one in own for own in sampled]) for own in sampled for one in own
        }
        self._alphas, self._cutoffs = np.array(alphas), np.array(cutoffs)
        self._vertex_alpha = np.array(vertex_alpha, dtype=bool)
        self._scene = RayScene(geoms, np.array(matrices).reshape(-1, 4, 4))
        corners = self._scene.corners(np.arange(len(self._scene)))
        self._extent = float(np.linalg.norm(corners, axis=2).max(initial=0.0))

    def lit(self, points: Float64, one: OneLight) -> Float64:
        """Return 1 where a light that has shadow maps reaches surfaces, 0 where a caster blocks it.

        The points (n, 3) are on surfaces, in view space. The result (n,) is also 1 beyond the shadow distance
        of a directional light, where its map ends.
        """
        first, count = int(one.lights.casters[one.row]), int(one.lights.maps[one.row])
        drawn = np.asarray(self._drawn[first : first + count].any(axis=0))
        result = np.ones(len(points))
        waiting = np.arange(len(points))
        if count == 1:
            waiting = waiting[self._within(points, self._maps[first])]
        to_light = self._to_light(points, one)
        length = np.linalg.norm(to_light, axis=1)
        contact = CONTACT * np.abs(points).max(axis=1, initial=0.0) / np.maximum(length, 1e-300)
        begin, step, before = contact.copy(), contact.copy(), np.full(len(points), -1)
        while len(waiting):
            origin = points[waiting] + begin[waiting, None] * to_light[waiting]
            number = self._scene.nearest(origin, to_light[waiting], 1.0 - begin[waiting])
            hit = number >= 0
            waiting, number = waiting[hit], number[hit]
            hits = _intersect(self._scene.corners(number), points[waiting], to_light[waiting])
            beyond = hits.along >= 1.0
            stops = (hits.along > contact[waiting]) & ~beyond
            stops &= self._stops(number, hits, drawn)
            result[waiting[stops]] = 0.0
            on = ~(stops | beyond)
            waiting, number, along = waiting[on], number[on], hits.along[on]
            # the same triangle again: along it, float32 has not left it yet
            step[waiting] = np.where(number == before[waiting], 2.0, 1.0) * step[waiting]
            before[waiting] = number
            begin[waiting] = np.maximum(along, begin[waiting]) + step[waiting]
            waiting = waiting[begin[waiting] < 1.0]
        return result

    def _within(self, points: Float64, shadow: ShadowMap) -> NDArray[np.bool_]:
        """Return which points lie in a map; the others get no shadow from it."""
        matrix, lens = self._view_to_world @ shadow.world_to_light, shadow.lens
        q = points @ matrix[:3, :3] + matrix[3, :3]
        w = q[:, 1] if lens.perspective else np.ones(len(q))
        return np.asarray((w > 0.0) & (np.abs(lens.a * q[:, 0]) <= w) & (np.abs(lens.c * q[:, 2]) <= w))

    def _to_light(self, points: Float64, one: OneLight) -> Float64:
        """Return vectors to the light; to a directional one, vectors that end outside the scene."""
        if one.lights.kind != "directional":
            return np.asarray(one.lights.positions[one.row] - points)
        farthest = self._extent + np.linalg.norm(points, axis=1, keepdims=True)
        return np.asarray(-one.lights.directions[one.row] * farthest)

    def _stops(
        self, number: NDArray[np.intp], hits: Intersections, drawn: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Return whether triangles block the light: its maps draw them, and they pass the alpha test."""
        instance, _ = self._scene.owner(number)
        stops = np.asarray(drawn[instance])
        alpha = self._alphas[instance]
        rows = np.flatnonzero(stops & self._vertex_alpha[instance])
        alpha[rows] *= np.einsum("ni,ni->n", hits.shares[rows], self._scene.alphas(number[rows]))
        for (sampler, coordinates), casters in self._sampled.items():
            rows = np.flatnonzero(stops & casters[instance])
            corners = self._scene.texcoords(number[rows], coordinates)
            texcoords = np.einsum("ni,nik->nk", hits.shares[rows], corners)
            alpha[rows] *= sampler.sample(texcoords, np.zeros(len(rows)))[:, 3]
        return np.asarray(stops & (alpha >= self._cutoffs[instance]))


def _intersect(corners: Float64, origin: Float64, direction: Float64) -> Intersections:
    """Intersect as `intersect` does, for rays of any direction: the largest coordinate is used as Y."""
    main = np.argmax(np.abs(direction), axis=1)
    order = (main[:, None] + np.array([2, 0, 1])) % 3
    corners = np.take_along_axis(corners, order[:, None, :], axis=2)
    origin, direction = (np.take_along_axis(values, order, axis=1) for values in (origin, direction))
    return intersect(RayCorners.of(corners, origin, direction))
