"""Plan the shadow maps of a frame, and keep those that did not change since the one before."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LightError
from firefly_sample.memo import Memo
from firefly_sample.plan.collect import Snapshot
from firefly_sample.plan.instances import Instances
from firefly_sample.plan.lights.light_set import LightSet, LightSource
from firefly_sample.plan.shadows.maps import ShadowMap, ShadowPlan, Tile, make_map, pack_atlas
from firefly_sample.plan.shadows.views import (
    FACES,
    WIDEST_MAP,
    ShadowView,
    Sight,
    cube_views,
    near_plane,
    spot_views,
    sun_view,
)
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.settings import LARGEST_ATLAS, SHADOW_RESOLUTIONS, Settings

MOST_NAMES = 4
"""Of lights in a message."""


@dataclass(frozen=True, eq=False)
class _Caster:
    """A light that casts shadows, in world space: one row of a set."""

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
        """Half-angle of a spotlight's cone, degrees."""
        return math.degrees(2.0 * math.asin(math.sqrt(min(self.lights.cones[self.row, 1] / 2.0, 1.0))))

    @property
    def count(self) -> int:
        """The number of its maps."""
        kind = self.lights.kind
        one = kind == "directional" or (kind == "spot" and self.half_angle <= WIDEST_MAP)
        return 1 if one else len(FACES)

    @property
    def reach(self) -> float:
        """Its reach, rounded up to a power of two: a budget shifts it when any other light changes."""
        reach = float(self.lights.reaches[self.row])
        return 2.0 ** math.ceil(math.log2(reach)) if 0.0 < reach < math.inf else reach

    def views(self, sight: Sight, casters: Instances, reverse: bool) -> list[ShadowView]:
        """Return the views of its maps."""
        resolution = self.resolution
        direction, position = self.lights.directions[self.row], self.lights.positions[self.row]
        node = self.source.node
        if isinstance(node, DirectionalLight):
            return [sun_view(direction, node.get_shadow_distance(), sight, resolution, casters)]
        near = near_plane(position, self.reach, casters, reverse)
        if self.lights.kind == "spot":
            return spot_views(position, direction, self.half_angle, near, resolution)
        return cube_views(position, near, resolution)


class ShadowPlanner:
    """Plans shadow maps, and keeps those that do not change between frames."""

    def __init__(self) -> None:
        self._kept: dict[tuple[LightSource, str], Memo[ShadowMap]] = {}  # by light and face

    def plan(
        self,
        sets: Iterable[LightSet],
        sources: list[LightSource],
        seen: set[int],
        sight: Sight,
        settings: Settings,
        reverse: bool,
        snapshot_for: Callable[[int], Snapshot],
    ) -> tuple[ShadowPlan, NDArray[np.int32]]:
        """Return the maps of the lights in view that cast shadows, and which of them are each light's.

        The array, int32, has a row for each source: the index of its first map, and its number of
        maps; -1 and 0 for lights without.

        The sets have all lights, in world space. The sources are every light in the scene that casts shadows,
        in view or not: each has tiles in the atlas, so that no tile moves when a light comes into view.
        `seen` has the indices of those in view. `snapshot_for` returns the nodes that a camera with a mask
        sees.
        """
        index_of = no_maps(len(sources))
        if not seen:
            return ShadowPlan(), index_of
        casters: dict[int, _Caster] = {}
        for lights in sets:
            for row in np.flatnonzero(lights.casters >= 0):
                index = int(lights.casters[row])
                texels = settings.shadow_resolution or sources[index].node.get_shadow_resolution()
                casters[index] = _Caster(sources[index], lights, int(row), texels)
        ordered = [casters[index] for index in range(len(sources))]
        size, tiles = _layout(ordered, settings)
        maps: list[ShadowMap] = []
        free, kept = iter(tiles), self._kept
        self._kept = {}
        for index, caster in enumerate(ordered):
            own = list(islice(free, caster.count))
            if index in seen:
                snapshot = snapshot_for(caster.source.node.camera_mask)
                made = self._maps(caster, snapshot, own, sight, reverse, kept)
                if any(shadow.casters for shadow in made):
                    index_of[index] = len(maps), len(made)
                    maps.extend(made)
        return (ShadowPlan(size, tiles, tuple(maps)) if maps else ShadowPlan()), index_of

    def _maps(
        self,
        caster: _Caster,
        snapshot: Snapshot,
        tiles: Iterable[Tile],
        sight: Sight,
        reverse: bool,
        kept: dict[tuple[LightSource, str], Memo[ShadowMap]],
    ) -> list[ShadowMap]:
        reach, alpha_state = caster.reach, snapshot.alpha_state()
        solid = [group for group in snapshot.groups if group.geom.mode == "triangles"]
        maps = []
        for view, tile in zip(caster.views(sight, snapshot.instances, reverse), tiles, strict=True):
            lens = view.lens.constants("zero_to_one" if reverse else "gl", reverse)
            groups = solid if _may_meet(view, sight) else None
            matrix = view.world_to_light.tobytes()
            state = snapshot, alpha_state, tile, lens, matrix, reach, groups is None
            key = (caster.source, view.name)
            memo = self._kept[key] = kept.get(key) or Memo()
            maps.append(memo.get(state, partial(make_map, caster.name, view, tile, lens, groups, reach)))
        return maps


def no_maps(lights: int) -> NDArray[np.int32]:
    """Return index and count of the maps of lights that have none, shape (lights, 2)."""
    return np.tile(np.array([-1, 0], dtype=np.int32), (lights, 1))


def _layout(casters: list[_Caster], settings: Settings) -> tuple[tuple[int, int], tuple[Tile, ...]]:
    """Return the atlas's size and the tiles of all maps."""
    sizes = tuple(caster.resolution for caster in casters for _ in range(caster.count))
    largest = settings.shadow_atlas
    packed = pack_atlas(sizes, largest)
    if packed is not None:
        return packed
    names = list(dict.fromkeys(caster.source.node.name for caster in casters))
    shown = ", ".join(map(repr, names[:MOST_NAMES])) + (" and others" if len(names) > MOST_NAMES else "")
    side = largest // math.ceil(math.sqrt(len(sizes)))
    texels = 2 ** math.floor(math.log2(max(side, 1)))
    if side < SHADOW_RESOLUTIONS[0]:
        remedies = ["let fewer lights cast shadows"]
    elif settings.shadow_resolution is not None:
        remedies = [f"lower the setting shadow_resolution to {texels}"]
    else:
        remedies = [f"give each {texels} texels (set_shadow_caster(True, resolution))"]
    if largest < LARGEST_ATLAS:
        remedies.append(f"raise the setting shadow_atlas (up to {LARGEST_ATLAS})")
    raise LightError(
        f"lights {shown}: their {len(sizes)} shadow maps of up to {max(sizes)} texels a side do not fit an "
        f"atlas of {largest}x{largest}: {', or '.join(remedies)}"
    )


def _may_meet(view: ShadowView, sight: Sight) -> bool:
    """Return whether anything that the camera sees may lie in a map's view."""
    corners = sight.corners @ view.world_to_light[:3, :3] + view.world_to_light[3, :3]
    planes = view.lens.frustum_planes()[:4]
    # it may not if all corners are beyond one side
    return bool(((corners @ planes[:, :3].T + planes[:, 3]) >= 0.0).any(axis=0).all())
