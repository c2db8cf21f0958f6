"""Find the instances in view, and batch them into draws."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.factors import Factors
from firefly_sample.plan.frame_plan import Batch
from firefly_sample.plan.frustum import spheres_in_frustum
from firefly_sample.plan.instances import Group, Instances
from firefly_sample.plan.surface_maps import Maps
from firefly_sample.plan.variants import SurfaceFeatures
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.material import Material

MOST_NAMES = 4
"""Of materials in a reason."""
ZONES = 4
"""Depth zones into which draws are cut, so that near instances of one draw hide far ones of others."""
SHARE = 32
"""Least number of instances in view per zone. One draw alone is in order without zones."""


@dataclass(frozen=True, eq=False)
class VisiblePart:
    """The n instances of a group that are in view, nearest first."""

    group: Group
    first: int  # index of the part's first instance among all instances in view
    chosen: NDArray[Any]  # (n,), indices into the group's instances
    nearest: Float64  # (n,), along the view axis, of their bounding spheres
    farthest: Float64
    model_to_view: Float64  # (n, 4, 4)
    ids: NDArray[np.int32]  # (n,)

    @cached_property
    def box(self) -> tuple[Float64, Float64]:
        """Least and largest coordinates of all instances' bounding boxes in view space, shape (3,) each."""
        low, high = self.group.geom.bounds
        one, other = (end[:, None] * self.model_to_view[:, :3, :3] for end in (low, high))
        origin = self.model_to_view[:, 3, :3]
        least = np.minimum(one, other).sum(axis=1) + origin
        largest = np.maximum(one, other).sum(axis=1) + origin
        return least.min(axis=0), largest.max(axis=0)


class Looks(NamedTuple):
    """Names of materials in view by what they need more than a colour; empty if none needs it."""

    own_ambient: str = ""  # ambient light is reflected in a colour of its own
    emissive: str = ""
    shiny: str = ""  # Phong highlights
    metallic: str = ""  # metallic-roughness
    tinted: str = ""  # metallic-roughness, with vertex colours or occlusion
    phong_ambient: str = ""  # as own_ambient, without metallic-roughness
    modulated: str = ""  # not metallic-roughness, with a texture or a colour scale
    local_viewer: str = ""  # Phong highlights as the eye sees them, from where it is


NO_LOOKS = Looks()


class Visible:
    """The instances in view of one snapshot from one camera, a part for each group.

    Attributes
    ----------
    nearest, farthest : float
        Of all instances along the view axis; infinity and minus infinity if none is in view.
    factors : Factors
        Of all instances, part by part; colours are multiplied by their scales, or not, with `scales_apart`.
    centers, radii : ndarray of float64, shape (n, 3) and (n,)
        Bounding spheres of all n instances in view, in view space, part by part.
    """

    def __init__(
        self, instances: Instances, world_to_view: Float64, planes: Float64, scales_apart: bool = False
    ) -> None:
        centers = instances.centers @ world_to_view[:3, :3] + world_to_view[3, :3]
        seen = np.flatnonzero(spheres_in_frustum(planes, centers, instances.radii))
        near = centers[seen, 1] - instances.radii[seen]
        order = np.lexsort((near, instances.which[seen]))
        chosen, near = seen[order], near[order]
        self.centers, self.radii = centers[chosen], instances.radii[chosen]
        far = self.centers[:, 1] + self.radii
        matrices = (instances.model_to_world[chosen].reshape(-1, 4) @ world_to_view).reshape(-1, 4, 4)
        indices = chosen - instances.starts[instances.which[chosen]]
        columns: tuple[Any, ...] = indices, near, far, matrices, instances.ids[chosen]
        factors = instances.factors().take(chosen)
        self.factors: Factors = factors if scales_apart else factors.scaled()
        self.nearest, self.farthest = float(near.min(initial=np.inf)), float(far.max(initial=-np.inf))
        bounds = np.searchsorted(instances.which[chosen], np.arange(len(instances.groups) + 1)).tolist()
        self.parts = tuple(
            VisiblePart(group, first, *(column[first:end] for column in columns))
            for group, (first, end) in zip(instances.groups, pairwise(bounds), strict=True)
            if first < end
        )
        self._looks: dict[tuple[bool, ...], Looks] = {}

    def __len__(self) -> int:
        return sum(len(part.ids) for part in self.parts)

    @property
    def blended(self) -> tuple[bool, ...]:
        """Which parts are blended over others."""
        return tuple(part.group.blended for part in self.parts)

    def count(self, chosen: Sequence[bool]) -> int:
        """Return the number of instances of the chosen parts."""
        return sum(len(part.ids) for part, mine in zip(self.parts, chosen, strict=True) if mine)

    def depth_offsets(self, chosen: Iterable[bool]) -> tuple[int, ...]:
        """Return the depth offsets of the chosen parts, each once, but for 0."""
        return tuple(sorted({part.group.depth_offset for part in compress(self.parts, chosen)} - {0}))

    def looks(self, chosen: Iterable[bool]) -> Looks:
        """Return names of materials of the chosen parts that need more than a colour."""
        key = tuple(chosen)
        if key not in self._looks:
            self._looks[key] = self._find_looks(key)
        return self._looks[key]

    def _find_looks(self, chosen: tuple[bool, ...]) -> Looks:
        found: dict[int, Material] = {}
        tinted: dict[int, Material] = {}
        scaled: dict[int, Material] = {}
        for part in compress(self.parts, chosen):
            materials = part.group.materials
            indices = (0,) if len(materials) == 1 else np.unique(part.group.which[part.chosen])
            here = {id(materials[index]): materials[index] for index in indices}
            found |= here
            if part.group.geom.colors is not None and part.group.colors is None:
                tinted |= here
            if part.group.scales is not None:
                scaled |= here
        each = found.values()
        lit = [material for material in each if not material.unlit]
        metals = [material for material in lit if material.metallic is not None]
        return Looks(
            _names(material for material in lit if _has_own_ambient(material)),
            _names(material for material in each if material.unlit or material.emission.any()),
            _names(material for material in lit if material.specular.any()),
            _names(metals),
            _names(each for each in metals if id(each) in tinted or each.occlusion_texture is not None),
            _names(each for each in lit if each.metallic is None and _has_own_ambient(each)),
            _names(
                each
                for each in found.values()
                if (each.unlit or each.metallic is None) and (id(each) in scaled or _is_textured(each))
            ),
            _names(each for each in lit if each.specular.any() and each.local_viewer),
        )


def _has_own_ambient(material: Material) -> bool:
    occluded = material.occlusion_texture is not None
    return material.ambient is not None or material.metallic is not None or occluded


def _is_textured(material: Material) -> bool:
    return material.texture is not None or material.modulate_texture is not None


def _names(materials: Iterable[Material]) -> str:
    """Return names, each once, up to a limit; empty if there are none."""
    names = list(dict.fromkeys(material.name for material in materials))
    shown = ", ".join(names[:MOST_NAMES])
    return shown if len(names) <= MOST_NAMES else f"{shown} and {len(names) - MOST_NAMES} more"


def blended_batches(visible: Visible, blended: Sequence[bool]) -> tuple[Batch, ...]:
    """Return a draw for each part that is blended.

    In one plane, what is drawn first lies under the others: those with the least depth offset come first.
    """
    return tuple(
        Batch(
            key=part.group.key,
            geom=part.group.geom,
            texture=part.group.texture,
            alpha_cutoff=0.0,
            mirrored=part.group.mirrored,
            model_to_view=part.model_to_view,
            ids=part.ids,
            factors=visible.factors.take(slice(part.first, part.first + len(part.ids))),
            surface=_features(part.group, maps, cutout=False, scaled=visible.factors.scales is not None),
            maps=maps,
            render_mode=part.group.render_mode,
            depth_offset=part.group.depth_offset,
        )
        for part in sorted(compress(visible.parts, blended), key=lambda part: part.group.depth_offset)
        for maps in (part.group.maps,)
    )


def _features(group: Group, maps: Maps, cutout: bool, scaled: bool) -> SurfaceFeatures:
    """Return the features that a draw of a group's instances needs."""
    return SurfaceFeatures(
        textured=group.texture is not None,
        vertex_color=group.geom.colors is not None and group.colors is None,
        cutout=cutout,
        double_sided=group.double_sided,
        vertex_alpha=group.vertex_alpha,
        emission_textured=maps.emission is not None,
        second_texcoords=maps.coordinates("emission") == 2,
        metallic=group.metallic,
        unlit=group.unlit,
        metallic_map=maps.coordinates("metallic"),
        normal_map=maps.coordinates("normal"),
        occlusion_map=maps.coordinates("occlusion"),
        modulate_map=maps.coordinates("modulate"),
        scaled=scaled,
        local_viewer=group.local_viewer,
    )


def make_batches(visible: Visible, near: float, blended: Sequence[bool]) -> tuple[Batch, ...]:
    """Return draws: opaque ones first, then cut-outs, each front to back; not of the `blended` parts.

    Groups are cut into depth zones, and nearer zones are drawn first. Geometry that surrounds the eye, like a
    ground, is drawn last among its kind, because everything stands in front of it. `near` is the lens's.
    """
    distances = np.concatenate([np.zeros(0), *(part.nearest for part in visible.parts)])
    many = sum(len(part.ids) >= ZONES for part in visible.parts)
    zones = min(ZONES, len(distances) // SHARE, many // 2)
    edges = np.quantile(distances, np.arange(1, zones) / zones) if zones > 1 else np.zeros(0)
    keyed = []
    for index, part in enumerate(visible.parts):
        if blended[index]:
            continue
        group, around = part.group, bool(part.nearest[0] <= near)
        cutout = group.cutoff is not None
        maps = group.maps
        surface = _features(group, maps, cutout, scaled=visible.factors.scales is not None)
        cuts = [0, *np.searchsorted(part.nearest, edges, side="right").tolist(), len(part.ids)]
        for zone, (first, end) in enumerate(pairwise(cuts)):
            if first == end:
                continue
            cut = slice(first, end)
            batch = Batch(
                key=(group.key, zone),
                geom=group.geom,
                texture=group.texture,
                alpha_cutoff=group.cutoff or 0.0,
                mirrored=group.mirrored,
                model_to_view=part.model_to_view[cut],
                ids=part.ids[cut],
                factors=visible.factors.take(slice(part.first + first, part.first + end)),
                surface=surface,
                maps=maps,
                render_mode=group.render_mode,
                depth_offset=group.depth_offset,
            )
            keyed.append(((cutout, around and zone == 0, zone, float(part.nearest[first]), index), batch))
    return tuple(batch for _, batch in sorted(keyed, key=lambda entry: entry[0]))
