"""The shadow maps, and the slices of particles' shadow, as one picture that fits a window."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.shadows.maps import ShadowMap
from firefly_sample.srgb import linear_to_srgb
from firefly_sample.viewer.buffers import DARKEST, codes

Pixels = NDArray[np.uint8]
Float32 = NDArray[np.float32]

EMPTY = (20, 26, 44)
"""Where nothing stands in a light's way: not black, so that a map's edges can be seen."""


def atlas_picture(depth: Float32, plan: FramePlan, size: tuple[int, int]) -> tuple[Pixels, str]:
    """A picture of all shadow maps, as large as fits, and a few words on how to read it.

    Each map is grey from what is nearest to its light (white) to what is farthest from it: by ratio where
    the light shines from a place, evenly where it shines from infinity.

    Parameters
    ----------
    depth : ndarray of float32, shape (height, width)
        The output "shadow_atlas".
    plan : FramePlan
        Of the frame that has it.
    size : (int, int)
        Width and height of the picture; the atlas keeps its shape in it.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        Black around the atlas, and in tiles where nothing was drawn for this frame.
    str
    """
    width, height = size
    picture = np.zeros((height, width, 3), dtype=np.uint8)
    maps = plan.shadows.maps
    if not maps:
        return picture, "no light casts shadows"
    texels = depth.shape
    rows, columns, fitted = _fit(texels, picture)
    seen = depth[rows[:, None], columns]
    clear = np.float32(0.0 if plan.view.reverse else 1.0)
    for shadow in maps:
        if shadow.casters is None:
            continue  # the tile holds what an earlier frame left there
        x, y, side = shadow.tile
        first = texels[0] - y - side  # rows count from the top, tiles from below
        place = (
            slice(*np.searchsorted(rows, (first, first + side))),
            slice(*np.searchsorted(columns, (x, x + side))),
        )
        fitted[place] = _map_picture(seen[place], shadow, clear)
    count = f"{len(maps)} map{'' if len(maps) == 1 else 's'}"
    return picture, f"{count}, {texels[1]} x {texels[0]} texels: white near its light, dark far, blue nothing"


def particle_shadow_picture(taken: Float32, plan: FramePlan, size: tuple[int, int]) -> tuple[Pixels, str]:
    """A picture of all slices of particles' shadow, as large as fits, and how to read it.

    Parameters
    ----------
    taken : ndarray of float32, shape (height, width, 3)
        The output "particle_shadow_atlas".
    plan, size
        As `atlas_picture` takes them.
    """
    picture = np.zeros((size[1], size[0], 3), dtype=np.uint8)
    particle_shadow = plan.particle_shadow
    if particle_shadow is None or not taken.size:
        return picture, "no particles cast shadows"
    rows, columns, fitted = _fit(taken.shape[:2], picture)
    seen = taken[rows[:, None], columns]
    left = np.exp(-seen) if particle_shadow.method == "optical_depth" else 1.0 - seen
    across, tile = particle_shadow.grid[0], particle_shadow.view.tile
    slices = (taken.shape[0] - 1 - rows)[:, None] // tile * across + columns // tile
    fitted[...] = codes(linear_to_srgb(np.clip(left, 0.0, 1.0)))
    fitted[slices >= particle_shadow.view.slices] = EMPTY
    return picture, (
        f"{particle_shadow.view.slices} slices of {particle_shadow.view.tile} texels, the nearest to the light lower left: "
        "white lets all light through"
    )


def _fit(texels: tuple[int, ...], picture: Pixels) -> tuple[NDArray[np.intp], NDArray[np.intp], Pixels]:
    """The nearest texel of each pixel, down and across, of an image in the middle of a picture; that part.

    An average of depths would be the depth of nothing.
    """
    height, width = picture.shape[:2]
    scale = min(height / texels[0], width / texels[1])
    rows, columns = (_nearest(side, max(1, round(side * scale))) for side in texels[:2])
    top, left = (height - len(rows)) // 2, (width - len(columns)) // 2
    return rows, columns, picture[top : top + len(rows), left : left + len(columns)]


def _nearest(texels: int, pixels: int) -> NDArray[np.intp]:
    """The texel at the middle of each pixel."""
    return ((np.arange(pixels) + 0.5) * (texels / pixels)).astype(np.intp)


def _map_picture(depth: Float32, shadow: ShadowMap, clear: np.float32) -> Pixels:
    drawn = depth != clear
    distance = shadow.lens.distance_from_depth(depth[drawn])
    if shadow.lens.perspective:
        distance = np.log(distance)
    low, high = (distance.min(), distance.max()) if distance.size else (0.0, 0.0)
    picture = np.empty((*depth.shape, 3), dtype=np.uint8)
    picture[...] = EMPTY
    picture[drawn] = codes(1.0 - (1.0 - DARKEST) * (distance - low) / max(high - low, 1e-9))[:, None]
    return picture
