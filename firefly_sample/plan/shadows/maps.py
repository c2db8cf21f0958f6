"""Shadow maps, and the draws that fill them.

A map's `key` covers everything that its texels depend on, and nothing else: while the key stays, the map
that was drawn for an earlier frame is the one that this frame needs.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frustum import has_wide_caster, spheres_in_frustum
from firefly_sample.plan.instances import Group
from firefly_sample.plan.shadows.atlas import Tile
from firefly_sample.plan.shadows.views import ShadowView
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens_constants import LensConstants
from firefly_sample.scene.material import Texture

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CasterBatch:
    """One instanced draw into a shadow map.

    Attributes
    ----------
    geom : Geom
    texture : Texture or None
        The texture whose alpha cuts out; None for opaque instances.
    cutoff : float
        The alpha below which nothing is drawn.
    alphas : ndarray of float64, shape (n,)
        Factors of the alpha of texture and vertices.
    model_to_world, model_to_clip : ndarray of float64, shape (n, 4, 4)
        For row vectors; the first is for the reference, which traces rays instead.
    vertex_alpha : bool
        Whether the alpha of vertex colours also cuts out.
    """

    geom: Geom
    texture: Texture | None
    cutoff: float
    alphas: Float64
    model_to_world: Float64
    model_to_clip: Float64
    vertex_alpha: bool = False


@dataclass(frozen=True, eq=False)
class ShadowMap:
    """One tile of the atlas, a light's view.

    Attributes
    ----------
    name : str
        The light's, with the face for one of six.
    tile : Tile
        Position in the atlas, in texels.
    lens : LensConstants
        For this frame's clip range. Its used part leaves a border of texels in the tile.
    world_to_light : ndarray of float64, shape (4, 4)
        For row vectors; the light looks along +Y.
    casters : tuple of CasterBatch or None
        None if nothing in view can lie in this map: it is not drawn.
    key : bytes
        Digest of everything that the texels depend on.
    light : str
        The light's name.
    wide : tuple of str
        Names of Geoms that are too wide to cast a shadow into all of the map.
    """

    name: str
    tile: Tile
    lens: LensConstants
    world_to_light: Float64
    casters: tuple[CasterBatch, ...] | None
    key: bytes
    light: str = ""
    wide: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class ShadowPlan:
    """All shadow maps of a frame.

    Attributes
    ----------
    size : (int, int)
        Of the atlas in texels; (0, 0) without maps.
    layout : tuple of Tile
        All tiles of the atlas, also those of lights out of view. While it stays, tiles keep their contents.
    maps : tuple of ShadowMap
    """

    size: tuple[int, int] = (0, 0)
    layout: tuple[Tile, ...] = ()
    maps: tuple[ShadowMap, ...] = ()

    def too_wide(self) -> dict[str, tuple[str, ...]]:
        """Return names of Geoms that are too wide for a map, by the lights' names."""
        found: dict[str, dict[str, None]] = {}
        for shadow in self.maps:
            if shadow.wide:
                found.setdefault(shadow.light, {}).update(dict.fromkeys(shadow.wide))
        return {light: tuple(names) for light, names in found.items()}


def make_map(
    light: str,
    view: ShadowView,
    tile: Tile,
    lens: LensConstants,
    groups: Iterable[Group] | None,
    reach: float,
) -> ShadowMap:
    """Return a light's shadow map with everything that casts shadows into it.

    Parameters
    ----------
    light : str
        The light's name.
    groups : iterable of Group or None
        Instances that may cast shadows; None for a map that is not drawn.
    reach : float
        Scene units: geometry farther from the light casts no shadow.
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
        texture, cutoff, alphas = None, 0.0, np.ones(len(chosen))
        if group.cutoff is not None:
            alphas, cutoff, texture = group.factors().base_colors[:, 3], group.cutoff, group.texture
            chosen &= alphas >= cutoff
            if not chosen.any():
                continue
        to_world = group.model_to_world[chosen]
        matrices = to_world @ view.world_to_light @ project
        yield CasterBatch(group.geom, texture, cutoff, alphas[chosen], to_world, matrices, group.vertex_alpha)


def _digest(tile: Tile, lens: LensConstants, casters: Iterable[CasterBatch]) -> bytes:
    """Return a digest of everything that a map's texels depend on."""
    state = hashlib.blake2b(repr((tile, lens)).encode(), digest_size=16)
    for batch in casters:
        texture = batch.texture
        parts = (
            batch.geom.serial,
            batch.geom.revision,
            None if texture is None else (texture.serial, texture.revision),
            batch.cutoff,
            batch.vertex_alpha,
            len(batch.alphas),
        )
        state.update(repr(parts).encode())
        state.update(batch.alphas.tobytes())
        state.update(batch.model_to_clip.tobytes())
    return state.digest()
