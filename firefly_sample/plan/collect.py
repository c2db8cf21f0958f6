"""Walk the scene graph once and keep its instances, lights, sprites and particles as arrays, in world space.

A walk is Python and slow; everything after it is vectorised. A `Snapshot` is kept until the graph's
`subtree_revision` changes, so that a still forest is walked once and not once a frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import NodeError
from firefly_sample.memo import Memo
from firefly_sample.plan.surface_maps import Maps, look_of_maps, maps_of
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.light import FadingLight
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import Color
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.render_mode import RenderMode
from firefly_sample.scene.texture import Texture
from firefly_sample.scene.traversal import Visit, iter_visible

SMOOTHEST = 1.0 / 32.0
"""Roughness below which a material is drawn as if it had this one: ``shaders/include/metallic.glsl``."""

LightNode = PointLights | FadingLight | DirectionalLight


@dataclass(frozen=True, eq=False)
class Factors:
    """Linear colours of instances at one moment, from their materials and their nodes' flat colours."""

    base_colors: Float64  # (n, 4)
    ambients: Float64  # (n, 3), of a material without an ambient colour the base colour's
    emissions: Float64  # (n, 3)
    speculars: Float64  # (n, 4), the fourth is the shininess; of metallic ones metalness, roughness, 0, 0

    def take(self, chosen: NDArray[Any] | slice) -> Factors:
        """Return those of the chosen instances."""
        return Factors(*(getattr(self, column.name)[chosen] for column in fields(self)))


@dataclass(eq=False)
class Group:
    """All instances of one Geom that one call can draw: the same textures and cut-out; colours differ."""

    key: tuple[Any, ...]  # hashable; distinguishes groups, and stays while a walk would find the same group
    geom: Geom
    texture: Texture | None
    cutoff: float | None  # the alpha below which nothing is drawn; None for opaque instances
    double_sided: bool
    mirrored: bool  # True if the instances' matrices turn triangles inside out
    materials: tuple[Material, ...]  # each once
    which: NDArray[np.intp]  # (n,), each instance's index into `materials`
    colors: Float64 | None  # (n, 4), flat colours, which replace vertex colours
    model_to_world: Float64  # (n, 4, 4)
    render_mode: RenderMode
    ids: NDArray[np.int32]  # (n,)
    centers: Float64  # (n, 3), of the bounding spheres, world space
    radii: Float64  # (n,)
    _factors: Memo[Factors] = field(default_factory=Memo)

    @property
    def maps(self) -> Maps:
        """The textures of the materials but that of the base colour; they are the same for all of these."""
        return maps_of(self.materials, self.geom)

    @property
    def metallic(self) -> bool:
        """True if these are metallic-roughness materials."""
        return self.materials[0].metallic is not None and not self.unlit

    @property
    def blended(self) -> bool:
        """True if the materials are marked for blending, and something of the instances is not opaque."""
        return self.geom.mode == "triangles" and self.clear

    @property
    def clear(self) -> bool:
        """True where `blended` is, and for points and lines of which the same is true: they stay opaque."""
        if self.materials[0].alpha_mode != "blend":
            return False
        own = self.geom.alphas is not None and self.colors is None
        if own or (self.texture is not None and self.texture.least_alpha() < 1.0):
            return True
        return bool((self.factors().base_colors[:, 3] < 1.0).any())

    @property
    def unlit(self) -> bool:
        """True if no light meets the surfaces."""
        return self.materials[0].unlit

    @property
    def vertex_alpha(self) -> bool:
        """True if the alpha of vertex colours takes part in the cut-out."""
        return self.cutoff is not None and self.geom.alphas is not None and self.colors is None

    def factors(self) -> Factors:
        """Return the factors of all instances, remade when a material has changed."""
        return self._factors.get(tuple(material.revision for material in self.materials), self._gather)

    def _gather(self) -> Factors:
        def column(values: list[Any]) -> Float64:
            return np.array(values, dtype=np.float64)[self.which]

        base = column([material.base_color for material in self.materials])
        ambient = column([m.base_color[:3] if m.ambient is None else m.ambient for m in self.materials])
        if self.colors is not None:
            base, ambient = base * self.colors, ambient * self.colors[:, :3]
        return Factors(
            base,
            ambient,
            column([material.emission for material in self.materials]),
            column([_speculars(material) for material in self.materials]),
        )


def _speculars(material: Material) -> tuple[float, float, float, float]:
    if material.metallic is not None:
        return material.metallic, material.roughness, 0.0, 0.0
    red, green, blue = material.specular.tolist()
    return red, green, blue, material.shininess


class Instances:
    """The instances of some groups as columns, group by group.

    Attributes
    ----------
    groups : tuple of Group
    starts : ndarray of int, shape (groups + 1,)
        Index of each group's first instance.
    which : ndarray of int, shape (n,)
        Each instance's group.
    model_to_world, ids, centers, radii : ndarray
        As of a `Group`, of all n instances.
    """

    def __init__(self, groups: Sequence[Group]) -> None:
        self.groups = tuple(groups)
        counts = [len(group.ids) for group in groups]
        self.starts = np.concatenate([[0], np.cumsum(counts, dtype=np.intp)])
        self.which = np.repeat(np.arange(len(counts)), counts)
        self.model_to_world = _joined([group.model_to_world for group in groups], (4, 4))
        self.ids = _joined([group.ids for group in groups], (), np.int32)
        self.centers = _joined([group.centers for group in groups], (3,))
        self.radii = _joined([group.radii for group in groups], ())
        self._identity = [
            (group.key, group.geom.revision, group.mirrored, *map(id, group.materials)) for group in groups
        ]
        self._materials = tuple(material for group in groups for material in group.materials)
        self._factors: Memo[Factors] = Memo()
        self._highlights: Memo[tuple[bool, float]] = Memo()

    def draws_as(self, other: Instances) -> bool:
        """Return whether the instances of a different walk would be drawn alike."""
        return (
            self._identity == other._identity
            and self.revisions() == other.revisions()
            and np.array_equal(self.model_to_world, other.model_to_world)
            and np.array_equal(self.ids, other.ids)
            and all(
                np.array_equal(getattr(self.factors(), column.name), getattr(other.factors(), column.name))
                for column in fields(Factors)
            )
        )

    def revisions(self) -> tuple[int, ...]:
        """Return the revisions of all groups' materials."""
        return tuple(material.revision for material in self._materials)

    def factors(self) -> Factors:
        """Return the factors of all instances, remade when a material has changed."""
        return self._factors.get(self.revisions(), self._gather)

    def highlights(self) -> tuple[bool, float]:
        """Return whether there are Phong highlights, and the gain of metallic-roughness ones.

        The gain is the most by which they concentrate a light, seen head on: 1/(4 a^2), with a the square of
        the least roughness; 0 without such materials.
        """
        return self._highlights.get(self.revisions(), self._find_highlights)

    def _find_highlights(self) -> tuple[bool, float]:
        metals = [each for each in self._materials if each.metallic is not None and not each.unlit]
        # a texture may make any texel smoother than its factor says
        roughnesses = [0.0 if each.metallic_roughness_texture else each.roughness for each in metals]
        gain = 0.25 / max(min(roughnesses), SMOOTHEST) ** 4 if metals else 0.0
        return any(each.specular.any() for each in self._materials), gain

    def _gather(self) -> Factors:
        parts = [group.factors() for group in self.groups]
        widths = {"base_colors": 4, "ambients": 3, "emissions": 3, "speculars": 4}
        return Factors(
            **{name: _joined([getattr(part, name) for part in parts], (n,)) for name, n in widths.items()}
        )

    @cached_property
    def sphere(self) -> tuple[Float64, float]:
        """Center and radius of a sphere around all instances, world space; radius 0 if there are none."""
        if not len(self.radii):
            return np.zeros(3), 0.0
        low = (self.centers - self.radii[:, None]).min(axis=0)
        high = (self.centers + self.radii[:, None]).max(axis=0)
        return 0.5 * (low + high), float(0.5 * np.linalg.norm(high - low))


def _joined(parts: list[NDArray[Any]], shape: tuple[int, ...], dtype: Any = np.float64) -> NDArray[Any]:
    return np.concatenate([np.zeros((0, *shape), dtype=dtype), *parts])


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
    """Geoms and lenses with their revisions: the graph does not hear of their changes."""
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
        textures = [group.texture.revision for group in cut if group.texture is not None]
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
    names: list[str] = []
    warnings: dict[str, None] = {}
    with np.errstate(over="ignore", invalid="ignore"):  # net transforms that are not finite are refused below
        for visit in iter_visible(root, camera_mask):
            node = visit.node
            if node.warnings:
                warnings.update(dict.fromkeys(f"model {node.name!r}: {line}" for line in node.warnings))
            if isinstance(node, GeomNode):
                _add_geoms(found, looks, node, visit, len(names))
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
    nets: list[Float64] = field(default_factory=list)
    ids: list[int] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    colors: list[Color | None] = field(default_factory=list)


_Looks = dict[int, tuple[Material, tuple[Any, ...]]]  # materials of a walk, with their `_look_of`, by id


def _add_geoms(
    found: dict[tuple[Any, ...], _Found], looks: _Looks, node: GeomNode, visit: Visit, index: int
) -> None:
    for geom, own in node.geoms:
        if not len(geom.indices):
            continue  # nothing to draw must cost nothing
        material = visit.material if visit.material is not None else own
        if id(material) not in looks:
            looks[id(material)] = material, _look_of(material)
        look = looks[id(material)][1]
        lets_through = _lets_through(material, visit.color)
        key = (id(geom), *look, visit.render_mode, visit.color is not None, lets_through)
        entry = found.get(key)
        if entry is None:
            entry = found[key] = _Found(geom, visit.render_mode)
        entry.nets.append(visit.net)
        entry.ids.append(index)
        entry.materials.append(material)
        entry.colors.append(visit.color)


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
        material.alpha_mode == "blend",
        _lets_through(material, None),
    )


def _lets_through(material: Material, color: Color | None) -> bool:
    """Return whether colours alone make an instance of a blended material not opaque."""
    alpha = 1.0 if color is None else color[3]
    return material.alpha_mode == "blend" and bool(material.base_color[3] * alpha < 1.0)


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
            model_to_world=matrices[chosen],
            render_mode=found.render_mode,
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
