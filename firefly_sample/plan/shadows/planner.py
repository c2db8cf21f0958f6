"""Shadow maps: which a frame needs, where they lie in the atlas, and what is drawn into them.

A map is described by what its texels depend on and nothing else: it has a `key`, and while that stays, what
was drawn for an earlier frame is what this frame needs.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LightError
from firefly_sample.plan.collect import Snapshot
from firefly_sample.plan.frustum import spheres_in_frustum
from firefly_sample.plan.instances import Group
from firefly_sample.plan.lights.gather import LightSource
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.shadows.atlas import Tile, pack_atlas
from firefly_sample.plan.shadows.views import (
    FACES,
    WIDEST_MAP,
    LightView,
    Sight,
    Spheres,
    cube_views,
    nearest_caster,
    spot_views,
    sun_view,
)
from firefly_sample.plan.wide_triangles import casts_too_wide
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens_constants import LensConstants
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.material import Texture
from firefly_sample.settings import LARGEST_ATLAS, SHADOW_RESOLUTIONS

Float64 = NDArray[np.float64]

MOST_NAMES = 4
"""Of lights in a message."""


@dataclass(frozen=True, eq=False)
class CasterBatch:
    """One instanced draw into a shadow map.

    Attributes
    ----------
    geom : Geom
    texture : Texture or None
        Whose alpha cuts out; None for what is opaque.
    cutoff : float
        The alpha below which nothing is drawn.
    alphas : ndarray of float64, shape (n,)
        Factors of the alpha of texture and vertices.
    model_to_world, model_to_clip : ndarray of float64, shape (n, 4, 4)
        For row vectors; the first is for who follows rays instead.
    vertex_alpha : bool
        Whether the alpha of vertex colours cuts out, too.
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
        Where in the atlas, in texels.
    lens : LensConstants
        For this frame's clip range. What the map is for leaves a border of texels in the tile.
    world_to_light : ndarray of float64, shape (4, 4)
        For row vectors; the light looks along +Y.
    casters : tuple of CasterBatch or None
        None where nothing in view can lie in this map: it is not drawn.
    key : bytes
        Of everything that the texels depend on.
    light : str
        The light's name.
    wide : tuple of str
        Names of Geoms that are too wide to cast a shadow into all of it.
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
        All tiles of the atlas, of lights out of view too. Where it stays, so does what tiles hold.
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


@dataclass(frozen=True, eq=False)
class _Caster:
    """A light that casts shadows, in world space."""

    source: LightSource
    lights: LightSet
    row: int
    resolution: int

    @property
    def name(self) -> str:
        node = self.source.node
        return node.name if self.source.index == 0 else f"{node.name} {self.source.index}"

    @property
    def half_angle(self) -> float:
        """Of a spotlight's cone, degrees."""
        return math.degrees(2.0 * math.asin(math.sqrt(min(self.lights.cones[self.row, 1] / 2.0, 1.0))))

    @property
    def count(self) -> int:
        """How many maps it has."""
        if self.lights.kind == "directional":
            return 1
        return 1 if self.lights.kind == "spot" and self.half_angle <= WIDEST_MAP else len(FACES)

    @property
    def reach(self) -> float:
        """Beyond what it lights, in steps: budgets shift a light's own reach when any other light changes."""
        reach = float(self.lights.reaches[self.row])
        return 2.0 ** math.ceil(math.log2(reach)) if 0.0 < reach < math.inf else reach

    def views(self, sight: Sight, casters: Spheres, reverse: bool) -> list[LightView]:
        """How it looks at the scene."""
        resolution = self.resolution
        direction, place = self.lights.directions[self.row], self.lights.positions[self.row]
        node = self.source.node
        if isinstance(node, DirectionalLight):
            return [sun_view(direction, node.get_shadow_distance(), sight, resolution, casters)]
        near = nearest_caster(place, self.reach, casters, reverse)
        if self.lights.kind == "spot":
            return spot_views(place, direction, self.half_angle, near, resolution)
        return cube_views(place, near, resolution)


class ShadowPlanner:
    """Plans shadow maps, and keeps what did not change between frames."""

    def __init__(self) -> None:
        self._kept: dict[tuple[LightSource, str], tuple[tuple[Any, ...], ShadowMap]] = {}

    def plan(
        self,
        sets: Iterable[LightSet],
        sources: list[LightSource],
        seen: set[int],
        sight: Sight,
        largest: int,
        resolution: int | None,
        reverse: bool,
        snapshot_for: Callable[[int], Snapshot],
    ) -> tuple[ShadowPlan, NDArray[np.int32]]:
        """The maps of the lights in view that cast shadows.

        Parameters
        ----------
        sets : iterable of LightSet
            All lights in world space; `casters` are indices into `sources`.
        sources : list of LightSource
            Every light in the scene that casts shadows, in view or not: each has its place in the atlas, so
            that nothing moves when one comes into view.
        seen : set of int
            Which of them are in view.
        sight : Sight
            What the camera sees.
        largest : int
            Texels along a side of the atlas, at most.
        resolution : int, optional
            Texels along a side of each map; the lights' own when absent.
        reverse : bool
            Whether depth is reversed in the [0, 1] clip range.
        snapshot_for : callable
            Gives what a camera with a mask sees.

        Returns
        -------
        ShadowPlan
        ndarray of int32, shape (number of sources, 2)
            The index of each light's first map and how many it has: -1 and 0 for lights without.

        Raises
        ------
        LightError
            If the maps do not fit the atlas; it says how to make them fit.
        """
        index_of = no_maps(len(sources))
        if not seen:
            return ShadowPlan(), index_of
        lights = [None] * len(sources)  # type: list[_Caster | None]
        for group in sets:
            for row in np.flatnonzero(group.casters >= 0):
                index = int(group.casters[row])
                texels = resolution or sources[index].node.get_shadow_resolution()
                lights[index] = _Caster(sources[index], group, int(row), texels)
        casters = [light for light in lights if light is not None]
        size, tiles = _layout(casters, largest, resolution is not None)
        maps: list[ShadowMap] = []
        position, kept = 0, self._kept
        self._kept = {}
        for index, light in enumerate(casters):
            own = tiles[position : position + light.count]
            position += light.count
            if index in seen:
                snapshot = snapshot_for(light.source.node.camera_mask)
                made = self._maps(light, snapshot, own, sight, reverse, kept)
                if any(shadow.casters for shadow in made):
                    index_of[index] = len(maps), len(made)
                    maps.extend(made)
        return (ShadowPlan(size, tiles, tuple(maps)) if maps else ShadowPlan()), index_of

    def _maps(
        self,
        light: _Caster,
        snapshot: Snapshot,
        tiles: tuple[Tile, ...],
        sight: Sight,
        reverse: bool,
        kept: dict[tuple[LightSource, str], tuple[tuple[Any, ...], ShadowMap]],
    ) -> list[ShadowMap]:
        reach = light.reach
        maps = []
        for view, tile in zip(light.views(sight, snapshot.spheres, reverse), tiles, strict=True):
            lens = view.lens.constants("zero_to_one" if reverse else "gl", reverse)
            needed = _may_meet(view, sight)
            state = (
                snapshot,
                snapshot.alpha_state(),
                tile,
                lens,
                view.world_to_light.tobytes(),
                reach,
                needed,
            )
            key = (light.source, view.name)
            before = kept.get(key)
            if before is not None and before[0] == state:
                self._kept[key] = before
                maps.append(before[1])
                continue
            name = f"{light.name} {view.name}".rstrip()
            casters = _casters(snapshot.groups, view, lens, reach) if needed else None
            made = ShadowMap(
                name=name,
                tile=tile,
                lens=lens,
                world_to_light=view.world_to_light,
                casters=casters,
                key=_digest(tile, lens, casters or ()),
                light=light.name,
                wide=_too_wide(casters or (), view),
            )
            self._kept[key] = state, made
            maps.append(made)
        return maps


def no_maps(lights: int) -> NDArray[np.int32]:
    """Index and count of the maps of lights that have none, shape (lights, 2)."""
    return np.tile(np.array([-1, 0], dtype=np.int32), (lights, 1))


def _layout(lights: list[_Caster], largest: int, forced: bool) -> tuple[tuple[int, int], tuple[Tile, ...]]:
    sizes = tuple(light.resolution for light in lights for _ in range(light.count))
    packed = pack_atlas(sizes, largest)
    if packed is not None:
        return packed
    names = list(dict.fromkeys(light.source.node.name for light in lights))
    shown = ", ".join(map(repr, names[:MOST_NAMES])) + (" and others" if len(names) > MOST_NAMES else "")
    side = largest // math.ceil(math.sqrt(len(sizes)))
    ways = [
        _smaller(2 ** math.floor(math.log2(side)), forced)
        if side >= SHADOW_RESOLUTIONS[0]
        else "let fewer lights cast shadows"
    ]
    if largest < LARGEST_ATLAS:
        ways.append(f"raise the setting shadow_atlas (up to {LARGEST_ATLAS})")
    raise LightError(
        f"lights {shown}: their {len(sizes)} shadow maps of up to {max(sizes)} texels a side do not fit an "
        f"atlas of {largest}x{largest}: {', or '.join(ways)}"
    )


def _smaller(texels: int, forced: bool) -> str:
    if forced:
        return f"lower the setting shadow_resolution to {texels}"
    return f"give each {texels} texels (set_shadow_caster(True, resolution))"


def _may_meet(view: LightView, sight: Sight) -> bool:
    """Whether something that the camera sees may lie in a map: False if all corners are beyond one side."""
    corners = sight.corners @ view.world_to_light[:3, :3] + view.world_to_light[3, :3]
    planes = view.lens.frustum_planes()[:4]
    return bool(((corners @ planes[:, :3].T + planes[:, 3]) >= 0.0).any(axis=0).all())


def _casters(
    groups: list[Group], view: LightView, lens: LensConstants, reach: float
) -> tuple[CasterBatch, ...]:
    """What stands in the light of a map, however near to the light."""
    planes, batches = view.lens.frustum_planes(), []
    project = lens.matrix()
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
        batches.append(
            CasterBatch(group.geom, texture, cutoff, alphas[chosen], to_world, matrices, group.vertex_alpha)
        )
    return tuple(batches)


def _too_wide(casters: tuple[CasterBatch, ...], view: LightView) -> tuple[str, ...]:
    """Return names of Geoms that are too wide for a map."""
    planes = view.lens.frustum_planes()
    return tuple(
        dict.fromkeys(
            batch.geom.name
            for batch in casters
            if casts_too_wide(batch.geom, batch.model_to_world @ view.world_to_light, planes, view.lens)
        )
    )


def _digest(tile: Tile, lens: LensConstants, casters: tuple[CasterBatch, ...]) -> bytes:
    """Of what a map's texels depend on."""
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
