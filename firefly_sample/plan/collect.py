"""Walk the scene graph once and keep what can be drawn as arrays, in world space.

A walk is Python and slow; everything after it is vectorised. A `Snapshot` is kept until the graph's
`subtree_revision` changes, so that a still forest is walked once and not once a frame.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import NodeError
from firefly_sample.plan.instances import Group, Instances, Spheres, look_of, make_groups
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.light import FadingLight
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.traversal import Visit, iter_visible

Float64 = NDArray[np.float64]
LightNode = PointLights | FadingLight | DirectionalLight


@dataclass(eq=False)
class Snapshot:
    """The result of one walk: geometry groups; nodes of lights, sprites, particles with their net matrices.

    Attributes
    ----------
    watched : list of (object, int)
        Geoms and lenses with their revisions: the graph does not hear of their changes.
    looks : list of (Material, tuple)
        Each material with its `look_of`.
    """

    groups: list[Group] = field(default_factory=list)
    lights: list[tuple[LightNode, Float64]] = field(default_factory=list)
    ambient: list[AmbientLight] = field(default_factory=list)
    sprites: list[tuple[Sprites, Float64]] = field(default_factory=list)
    particles: list[tuple[ParticleNode, Float64]] = field(default_factory=list)
    id_names: tuple[str, ...] = ()
    watched: list[tuple[Any, int]] = field(default_factory=list)
    looks: list[tuple[Material, tuple[Any, ...]]] = field(default_factory=list)
    root: NodePath | None = None
    revision: int = -1
    camera_mask: int = 0

    @cached_property
    def instances(self) -> Instances:
        """The instances of all groups."""
        return Instances(self.groups)

    @cached_property
    def spheres(self) -> Spheres:
        """The bounding spheres of all instances."""
        return Spheres(self.instances.centers, self.instances.radii)

    def alpha_state(self) -> tuple[int, ...]:
        """Return the revisions of the textures and materials of cut-outs, in the walk's order."""
        cut = [group for group in self.groups if group.cutoff is not None]
        textures = [group.texture.revision for group in cut if group.texture is not None]
        return (*textures, *(material.revision for group in cut for material in group.materials))

    def is_current(self, root: NodePath, camera_mask: int) -> bool:
        """Return whether nothing under or above `root` has changed since the walk."""
        return (
            self.root == root
            and self.camera_mask == camera_mask
            and self.revision == root.get_top().node().subtree_revision
            and all(thing.revision == revision for thing, revision in self.watched)
            and all(look_of(material) == look for material, look in self.looks)
        )


def collect(root: NodePath, camera_mask: int) -> Snapshot:
    """Walk everything under `root` that a camera with this mask sees.

    Raises
    ------
    NodeError
        If a net transform is not finite; it names the node.
    """
    revision = root.get_top().node().subtree_revision
    snapshot = Snapshot(root=root, revision=revision, camera_mask=camera_mask)
    found: dict[tuple[Any, ...], _Found] = {}
    names: list[str] = []
    with np.errstate(over="ignore", invalid="ignore"):  # net transforms that are not finite are refused below
        for visit in iter_visible(root, camera_mask):
            node = visit.node
            if isinstance(node, GeomNode):
                _add_geoms(found, node, visit, len(names))
                names.append(visit.path)
            elif isinstance(node, PointLights | FadingLight | DirectionalLight):
                snapshot.lights.append((node, visit.net))
                if isinstance(node, Spotlight):
                    snapshot.watched.append((node.get_lens(), node.get_lens().revision))
            elif isinstance(node, AmbientLight):
                snapshot.ambient.append(node)
            elif isinstance(node, Sprites):
                snapshot.sprites.append((node, visit.net))
            elif isinstance(node, ParticleNode):
                snapshot.particles.append((node, visit.net))
    materials: dict[int, Material] = {}
    for key, entry in found.items():
        finite = np.isfinite(entry.nets).all(axis=(1, 2))
        if not finite.all():
            _refuse(names[entry.ids[int(np.argmin(finite))]])
        materials.update((id(material), material) for material in entry.materials)
        snapshot.groups.extend(
            make_groups(key, entry.geom, entry.materials, entry.colors, entry.nets, entry.ids)
        )
        snapshot.watched.append((entry.geom, entry.geom.revision))
    for nodes in (snapshot.lights, snapshot.sprites, snapshot.particles):
        for node, net in nodes:
            if not np.isfinite(net).all():
                _refuse(node.name)
    snapshot.looks = [(material, look_of(material)) for material in materials.values()]
    snapshot.id_names = tuple(names)
    return snapshot


@dataclass(eq=False)
class _Found:
    """The instances of one group, in the order of the walk."""

    geom: Geom
    nets: list[Float64] = field(default_factory=list)
    ids: list[int] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    colors: list[Any] = field(default_factory=list)


def _add_geoms(found: dict[tuple[Any, ...], _Found], node: GeomNode, visit: Visit, index: int) -> None:
    for geom, own in node.geoms:
        if not len(geom.triangles):
            continue  # nothing to draw must cost nothing
        material = visit.material if visit.material is not None else own
        key = (id(geom), *look_of(material), visit.color is not None)
        entry = found.setdefault(key, _Found(geom))
        entry.nets.append(visit.net)
        entry.ids.append(index)
        entry.materials.append(material)
        entry.colors.append(visit.color)


def _refuse(name: str) -> NoReturn:
    raise NodeError(
        f"node {name!r}: its net transform has numbers that float64 does not hold: give it and its parents "
        "scales and positions nearer to 1"
    )
