"""Walk the scene graph once and keep its instances, lights, sprites and particles as arrays, in world space.

A walk is Python and slow; everything after it is vectorised. A `Snapshot` is kept until the graph's
`subtree_revision` changes, so that a still forest is walked once and not once a frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import NodeError
from firefly_sample.plan.instances import Group, Instances
from firefly_sample.plan.surface_maps import look_of_maps
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.color_scale import UNSCALED
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.light import FadingLight
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import Color
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.render_mode import RenderMode
from firefly_sample.scene.surface_overrides import overridden
from firefly_sample.scene.traversal import Visit, iter_visible

LightNode = PointLights | FadingLight | DirectionalLight


@dataclass(eq=False)
class Snapshot:
    """The result of one walk: groups of instances, and nodes with their net matrices."""

    root: NodePath
    revision: int
    camera_mask: int
    groups: list[Group] = field(default_factory=list)
    lights: list[tuple[LightNode, Float64]] = field(default_factory=list)
    ambient: list[AmbientLight] = field(default_factory=list)
    sprites: list[tuple[Sprites, Float64]] = field(default_factory=list)
    particles: list[tuple[ParticleNode, Float64]] = field(default_factory=list)
    id_names: tuple[str, ...] = ()  # path of each geometry instance, by id
    warnings: tuple[str, ...] = ()
    """The warnings of all nodes, each line once."""
    watched: list[tuple[Any, int]] = field(default_factory=list)
    """Geoms, lenses and varied materials with their revisions: the graph does not hear of their changes."""
    looks: list[tuple[Material, tuple[Any, ...]]] = field(default_factory=list)
    """Each material with its `_look_of`."""

    @cached_property
    def instances(self) -> Instances:
        """The instances of all groups."""
        return Instances(self.groups)

    def ambient_color(self) -> Float64:
        """Return the sum of all ambient lights, linear, shape (3,)."""
        return np.asarray(np.sum([np.zeros(3), *(light.get_color() for light in self.ambient)], axis=0))

    def alpha_state(self) -> tuple[int, ...]:
        """Return the revisions of the textures and materials of cut-outs, in the walk's order."""
        cut = [group for group in self.groups if group.cutoff is not None]
        textures = [texture.revision for group in cut for texture in group.base_textures()]
        return (*textures, *(material.revision for group in cut for material in group.materials))

    def is_current(self, root: NodePath, camera_mask: int) -> bool:
        """Return whether nothing under or above `root` has changed since the walk."""
        return (
            self.root == root
            and self.camera_mask == camera_mask
            and self.revision == root.get_top().node().subtree_revision
            and all(thing.revision == revision for thing, revision in self.watched)
            and all(_look_of(material) == look for material, look in self.looks)
        )


def collect(root: NodePath, camera_mask: int) -> Snapshot:
    """Walk everything under `root` that a camera with this mask sees.

    A `NodeError` names a node whose net transform is not finite.
    """
    snapshot = Snapshot(root, root.get_top().node().subtree_revision, camera_mask)
    found: dict[tuple[Any, ...], _Found] = {}
    looks: _Looks = {}
    varied: dict[int, Material] = {}  # materials of which variants are drawn, by id
    names: list[str] = []
    warnings: dict[str, None] = {}
    with np.errstate(over="ignore", invalid="ignore"):  # net transforms that are not finite are refused below
        for visit in iter_visible(root, camera_mask):
            node = visit.node
            if node.warnings:
                warnings.update(dict.fromkeys(f"model {node.name!r}: {line}" for line in node.warnings))
            if isinstance(node, GeomNode):
                _add_geoms(found, looks, varied, node, visit, len(names))
                names.append(visit.path)
            elif isinstance(node, LightNode):
                snapshot.lights.append((node, visit.net))
                if isinstance(node, Spotlight):
                    snapshot.watched.append((node.get_lens(), node.get_lens().revision))
            elif isinstance(node, AmbientLight):
                snapshot.ambient.append(node)
            elif isinstance(node, Sprites):
                snapshot.sprites.append((node, visit.net))
            elif isinstance(node, ParticleNode):
                snapshot.particles.append((node, visit.net))
    snapshot.groups.extend(_make_groups(found, names))
    snapshot.watched.extend((entry.geom, entry.geom.revision) for entry in found.values())
    snapshot.watched.extend((material, material.revision) for material in varied.values())
    for nodes in (snapshot.lights, snapshot.sprites, snapshot.particles):
        for node, net in nodes:
            if not np.isfinite(net).all():
                _refuse(node.name)
    snapshot.looks = list(looks.values())
    snapshot.id_names = tuple(names)
    snapshot.warnings = tuple(warnings)
    return snapshot


@dataclass(eq=False)
class _Found:
    """The instances of one Geom that can be drawn together, in the order of the walk."""

    geom: Geom
    render_mode: RenderMode
    depth_offset: int
    nets: list[Float64] = field(default_factory=list)
    ids: list[int] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    colors: list[Color | None] = field(default_factory=list)
    scales: list[Color] = field(default_factory=list)


_Looks = dict[int, tuple[Material, tuple[Any, ...]]]  # materials of a walk, with their `_look_of`, by id


def _add_geoms(
    found: dict[tuple[Any, ...], _Found],
    looks: _Looks,
    varied: dict[int, Material],
    node: GeomNode,
    visit: Visit,
    index: int,
) -> None:
    _, net, color, replacing, _, render_mode, depth_offset, scale, overrides = visit
    scaled = scale != UNSCALED
    for geom, own in node.geoms:
        if not len(geom.indices):
            continue  # nothing to draw must cost nothing
        material = replacing if replacing is not None else own
        if overrides is not None:
            varied[id(material)] = material
            looks[id(material)] = material, _look_of(material)
            material = overridden(material, overrides)
        if id(material) not in looks:
            looks[id(material)] = material, _look_of(material)
        look = looks[id(material)][1]
        moves = depth_offset and geom.mode == "triangles" and render_mode.mode == "filled"
        offset = depth_offset if moves else 0
        key = (
            id(geom),
            *look,
            render_mode,
            offset,
            color is not None,
            scaled,
            _lets_through(material, color, scale[3]),
        )
        entry = found.get(key)
        if entry is None:
            entry = found[key] = _Found(geom, render_mode, offset)
        entry.nets.append(net)
        entry.ids.append(index)
        entry.materials.append(material)
        entry.colors.append(color)
        if scaled:
            entry.scales.append(scale)


def _look_of(material: Material) -> tuple[Any, ...]:
    """Return the part of a material by which instances are grouped, hashable; the rest is per instance."""
    cutout = material.alpha_mode != "opaque"
    return (
        None if material.texture is None else id(material.texture),
        material.alpha_cutoff if cutout else None,
        material.double_sided,
        *look_of_maps(material),
        material.metallic is not None,
        material.unlit,
        material.local_viewer,
        material.alpha_mode == "blend",
        _lets_through(material, None),
    )


def _lets_through(material: Material, color: Color | None, scale: float = 1.0) -> bool:
    """Return whether colours and a scale alone make an instance of a blended material not opaque."""
    if material.alpha_mode != "blend":
        return False
    alpha = scale if color is None else color[3] * scale
    return bool(material.base_color[3] * alpha < 1.0)


def _make_groups(found: dict[tuple[Any, ...], _Found], names: Sequence[str]) -> Iterator[Group]:
    """Yield the groups of all instances; `names` are those of their nodes, by id.

    The radius of a bounding sphere grows with the matrix's largest singular value.
    """
    if not found:
        return
    matrices = np.array([net for entry in found.values() for net in entry.nets])
    finite = np.isfinite(matrices).all(axis=(1, 2))
    if not finite.all():
        ids = [index for entry in found.values() for index in entry.ids]
        _refuse(names[ids[int(np.argmin(finite))]])
    stretches = np.linalg.norm(matrices[:, :3, :3], ord=2, axis=(1, 2))
    turned = np.linalg.det(matrices[:, :3, :3]) < 0
    first = 0
    for key, entry in found.items():
        own = slice(first, first + len(entry.ids))
        yield from _split_group(key, entry, matrices[own], stretches[own], turned[own])
        first = own.stop


def _split_group(
    key: tuple[Any, ...],
    found: _Found,
    matrices: Float64,
    stretches: Float64,
    turned: NDArray[np.bool_],
) -> list[Group]:
    """Return one group, or two if some instances are mirrored and others are not."""
    geom, first = found.geom, found.materials[0]
    unique = {id(material): material for material in found.materials}
    index = {name: position for position, name in enumerate(unique)}
    center, radius = geom.sphere
    which = np.array([index[id(material)] for material in found.materials], dtype=np.intp)
    colors = None if found.colors[0] is None else np.array(found.colors, dtype=np.float64)
    scales = np.array(found.scales, dtype=np.float64) if found.scales else None
    ids = np.array(found.ids, dtype=np.int32)
    centers = center @ matrices[:, :3, :3] + matrices[:, 3, :3]
    radii = radius * stretches
    cuts = first.alpha_mode == "mask" or (first.alpha_mode == "blend" and geom.mode == "triangles")
    return [
        Group(
            key=(*key, mirrored),
            geom=geom,
            texture=first.texture,
            cutoff=first.alpha_cutoff if cuts else None,
            double_sided=first.double_sided,
            mirrored=mirrored,
            materials=tuple(unique.values()),
            which=which[chosen],
            colors=None if colors is None else colors[chosen],
            scales=None if scales is None else scales[chosen],
            model_to_world=matrices[chosen],
            render_mode=found.render_mode,
            depth_offset=found.depth_offset,
            ids=ids[chosen],
            centers=centers[chosen],
            radii=radii[chosen],
        )
        for mirrored in (False, True)
        if (chosen := turned == mirrored).any()
    ]


def _refuse(name: str) -> NoReturn:
    raise NodeError(
        f"node {name!r}: its net transform has numbers that float64 does not hold: give it and its parents "
        "scales and positions nearer to 1"
    )
