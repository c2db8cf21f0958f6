"""Shadow maps: their tiles in the atlas, and the draws that fill them.

A map's `key` covers everything that its texels depend on, and nothing else: while the key stays, the map
that was drawn for an earlier frame is the one that this frame needs.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from firefly_sample.plan.frustum import has_wide_caster, spheres_in_frustum
from firefly_sample.plan.instances import Group
from firefly_sample.plan.shadows.views import ShadowView
from firefly_sample.plan.surface_maps import Map
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens_constants import LensConstants
from firefly_sample.scene.texture import Texture

Size = tuple[int, int]


class Tile(NamedTuple):
    """A square of texels: its lower left corner and its side."""

    x: int
    y: int
    size: int


@dataclass(frozen=True, eq=False)
class CasterBatch:
    """One instanced draw into a shadow map; matrices are for row vectors."""

    geom: Geom
    texture: Texture | None  # whose alpha cuts out; None for opaque instances
    cutoff: float  # the alpha below which nothing is drawn
    alphas: Float64  # (n,), factors of the alpha of texture and vertices
    model_to_world: Float64  # (n, 4, 4), for the reference, which traces rays
    model_to_clip: Float64  # (n, 4, 4)
    vertex_alpha: bool = False  # True if the alpha of vertex colours also cuts out
    modulate: Map | None = None  # whose alpha also cuts out

    def textures(self) -> Iterator[Map]:
        """Yield the textures whose alphas cut out."""
        if self.texture is not None:
            yield Map(self.texture, 1)
        if self.modulate is not None:
            yield self.modulate


@dataclass(frozen=True, eq=False)
class ShadowMap:
    """One tile of the atlas, a light's view."""

    name: str  # the light's, with the face for one of six
    tile: Tile
    lens: LensConstants  # for this frame's clip range; its used part leaves a border of texels in the tile
    world_to_light: Float64  # (4, 4), for row vectors; the light looks along +Y
    casters: tuple[CasterBatch, ...] | None  # None if nothing in view can lie in this map: it is not drawn
    key: bytes  # digest of everything that the texels depend on
    light: str = ""  # the light's name
    wide: tuple[str, ...] = ()  # names of Geoms that are too wide to cast a shadow into all of the map


@dataclass(frozen=True, eq=False)
class ShadowPlan:
    """All shadow maps of a frame."""

    size: Size = (0, 0)  # of the atlas in texels; (0, 0) without maps
    layout: tuple[Tile, ...] = ()  # also of lights out of view; while it stays, the tiles keep their contents
    maps: tuple[ShadowMap, ...] = ()


def make_map(
    light: str,
    view: ShadowView,
    tile: Tile,
    lens: LensConstants,
    groups: Iterable[Group] | None,
    reach: float,
) -> ShadowMap:
    """Return a light's shadow map with everything that casts shadows into it.

    `light` is its name, and `groups` are None for a map that is not drawn. Geometry farther from the light
    than `reach` casts no shadow.
    """
    casters = None if groups is None else tuple(_casters(groups, view, lens, reach))
    planes = view.lens.frustum_planes()
    wide = (
        batch.geom.name
        for batch in casters or ()
        if has_wide_caster(batch.geom, batch.model_to_world @ view.world_to_light, planes, view.lens)
    )
    return ShadowMap(
        name=f"{light} {view.name}".rstrip(),
        tile=tile,
        lens=lens,
        world_to_light=view.world_to_light,
        casters=casters,
        key=_digest(tile, lens, casters or ()),
        light=light,
        wide=tuple(dict.fromkeys(wide)),
    )


def _casters(
    groups: Iterable[Group], view: ShadowView, lens: LensConstants, reach: float
) -> Iterator[CasterBatch]:
    """Yield draws of all geometry in a map's view, however near to the light."""
    planes, project = view.lens.frustum_planes(), lens.matrix()
    for group in groups:
        centers = group.centers @ view.world_to_light[:3, :3] + view.world_to_light[3, :3]
        chosen = spheres_in_frustum(planes, centers, group.radii)
        if view.lens.is_perspective():
            chosen &= np.linalg.norm(centers, axis=1) - group.radii < reach
        if not chosen.any():
            continue
        texture, modulate, cutoff, alphas = None, None, 0.0, np.ones(len(chosen))
        if group.cutoff is not None:
            alphas, cutoff, texture = group.factors().base_colors[:, 3], group.cutoff, group.texture
            modulate = group.maps.modulate
            chosen &= alphas >= cutoff
            if not chosen.any():
                continue
        to_world = group.model_to_world[chosen]
        matrices = to_world @ view.world_to_light @ project
        yield CasterBatch(
            group.geom,
            texture,
            cutoff,
            alphas[chosen],
            to_world,
            matrices,
            group.vertex_alpha,
            modulate,
        )


def _digest(tile: Tile, lens: LensConstants, casters: Iterable[CasterBatch]) -> bytes:
    """Return a digest of everything that a map's texels depend on."""
    state = hashlib.blake2b(repr((tile, lens)).encode(), digest_size=16)
    for batch in casters:
        parts = (
            batch.geom.serial,
            batch.geom.revision,
            batch.texture is None,
            *(
                (found.texture.serial, found.texture.revision, found.coordinates)
                for found in batch.textures()
            ),
            batch.cutoff,
            batch.vertex_alpha,
            len(batch.alphas),
        )
        state.update(repr(parts).encode())
        state.update(batch.alphas.tobytes())
        state.update(batch.model_to_clip.tobytes())
    return state.digest()


@lru_cache(maxsize=8)
def pack_atlas(sizes: tuple[int, ...], largest: int) -> tuple[Size, tuple[Tile, ...]] | None:
    """Lay squares out on shelves; return the atlas's size and a tile for each, or None if they do not fit.

    The atlas is the smallest among those as wide as 1, 2, 3 ... of the largest square, and neither wider nor
    higher than `largest`.
    """
    if not sizes:
        return (0, 0), ()
    widest = max(sizes)
    total = sum(size * size for size in sizes)
    best: tuple[Size, tuple[Tile, ...]] | None = None
    for width in range(widest, min(largest, widest * len(sizes)) + 1, widest):
        if best is not None and width * widest > best[0][0] * best[0][1]:
            break
        if width * largest < total:
            continue
        height, tiles = _shelves(sizes, width)
        if height <= largest and (best is None or _badness(width, height) < _badness(*best[0])):
            best = (width, height), tiles
    return best


def _badness(width: int, height: int) -> Size:
    """Return a sort key: fewer texels are better, then the squarer shape."""
    return width * height, abs(width - height)


def _shelves(sizes: Sequence[int], width: int) -> tuple[int, tuple[Tile, ...]]:
    """Return the height that a width needs, and the tiles, laid out from the largest to the smallest."""
    tiles: dict[int, Tile] = {}
    x = y = shelf = 0
    for index in sorted(range(len(sizes)), key=lambda index: -sizes[index]):
        size = sizes[index]
        if x + size > width:
            x, y, shelf = 0, y + shelf, 0
        tiles[index] = Tile(x, y, size)
        x += size
        shelf = max(shelf, size)
    return y + shelf, tuple(tiles[index] for index in range(len(sizes)))
