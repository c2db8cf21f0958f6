"""float64 twin of ``shaders/include/shadow.glsl``: the share of a light that reaches a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.shadows.maps import ShadowMap

Float64 = NDArray[np.float64]

NORMAL_OFFSET, LIFT, ROUNDING = 0.25, 0.05, 1e-6
"""The shader's: texels along the normal where light grazes, texels towards the light, what float32 errs."""


def cube_faces(way: Float64) -> NDArray[np.int64]:
    """Which of six maps world-space directions (n, 3) from a light lie in: +x, -x, +y, -y, +z, -z."""
    axis = np.argmax(np.abs(way), axis=1)
    return np.asarray(2 * axis + (way[np.arange(len(way)), axis] < 0))


def shadow(
    atlas: Float64,
    shadow_map: ShadowMap,
    reverse: bool,
    taps: int,
    place: Float64,
    normal: Float64,
    n_dot_l: Float64,
    y_view: Float64,
) -> Float64:
    """The lit share of each of n places in one map.

    Parameters
    ----------
    atlas : ndarray, shape (height, width)
        Depths; row 0 is the lowest.
    reverse : bool
        Whether near is the larger depth.
    taps : {1, 4, 16}
    place, normal : ndarray of float64, shape (n, 3)
        World space.
    n_dot_l, y_view : ndarray of float64, shape (n,)
        Cosine of the light's angle, and distance along the camera's axis.
    """
    tile, lens = shadow_map.tile, shadow_map.lens
    matrix = shadow_map.world_to_light
    q = place @ matrix[:3, :3] + matrix[3, :3]
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
                weight = np.prod(
                    [
                        1.0 - f[:, axis]
                        if step == span[0]
                        else f[:, axis]
                        if step == span[-1]
                        else np.ones(len(q))
                        for axis, step in enumerate((i, j))
                    ],
                    axis=0,
                )
                share += weight * lit(first + np.array([i, j]))
        share /= 1.0 if taps == 4 else 9.0
    return np.where(behind | beyond, 1.0, share)
