"""Instances that one call can draw: one Geom, one texture, one cut-out; colours differ freely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.memo import Memo
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material, Texture
from firefly_sample.scene.node import Color

Float64 = NDArray[np.float64]


def look_of(material: Material) -> tuple[Any, ...]:
    """Return the part of a material by which instances are grouped, hashable; the rest is per instance."""
    cutout = material.alpha_mode != "opaque"
    return (
        None if material.texture is None else id(material.texture),
        material.alpha_cutoff if cutout else None,
        material.double_sided,
    )


@dataclass(frozen=True, eq=False)
class Factors:
    """Colours of instances at one moment, from their materials and their nodes' flat colours.

    Attributes
    ----------
    base_colors : ndarray of float64, shape (n, 4)
    ambients, emissions : ndarray of float64, shape (n, 3)
        Linear. A material without an ambient colour has its base colour's.
    speculars : ndarray of float64, shape (n, 4)
        Linear colour, and shininess.
    """

    base_colors: Float64
    ambients: Float64
    emissions: Float64
    speculars: Float64

    def take(self, chosen: NDArray[Any] | slice) -> Factors:
        """Return those of the chosen instances."""
        return Factors(*(getattr(self, column.name)[chosen] for column in fields(self)))


@dataclass(eq=False)
class Group:
    """All instances of one Geom that can be drawn together.

    Attributes
    ----------
    key : tuple
        Hashable; distinguishes groups, and stays as long as a walk would find the same group.
    geom : Geom
    texture : Texture or None
    cutoff : float or None
        The alpha below which nothing is drawn; None for opaque instances.
    double_sided, mirrored : bool
        See `firefly_sample.plan.frame_plan.Batch`.
    materials : tuple of Material
        Each once.
    which : ndarray of int, shape (n,)
        Each instance's index into `materials`.
    colors : ndarray of float64, shape (n, 4), or None
        Flat colours, which replace vertex colours; None where no instance has one.
    model_to_world : ndarray of float64, shape (n, 4, 4)
    ids : ndarray of int32, shape (n,)
    centers, radii : ndarray of float64, shapes (n, 3) and (n,)
        Of the bounding spheres, world space.
    """

    key: tuple[Any, ...]
    geom: Geom
    texture: Texture | None
    cutoff: float | None
    double_sided: bool
    mirrored: bool
    materials: tuple[Material, ...]
    which: NDArray[np.intp]
    colors: Float64 | None
    model_to_world: Float64
    ids: NDArray[np.int32]
    centers: Float64
    radii: Float64

    _factors: Memo[Factors] = field(default_factory=Memo)

    @property
    def vertex_alpha(self) -> bool:
        """Whether the alpha of vertex colours takes part in the cut-out."""
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
            column([(*material.specular, material.shininess) for material in self.materials]),
        )


class Instances:
    """The instances of some groups as columns, group by group.

    Attributes
    ----------
    groups : tuple of Group
    starts : ndarray of int, shape (groups + 1,)
        Index of each group's first instance.
    which : ndarray of int, shape (n,)
        Each instance's group.
    model_to_world : ndarray of float64, shape (n, 4, 4)
    ids : ndarray of int32, shape (n,)
    centers, radii : ndarray of float64, shapes (n, 3) and (n,)
        Of the bounding spheres, world space.
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

    def _gather(self) -> Factors:
        parts = [group.factors() for group in self.groups]
        return Factors(
            _joined([part.base_colors for part in parts], (4,)),
            _joined([part.ambients for part in parts], (3,)),
            _joined([part.emissions for part in parts], (3,)),
            _joined([part.speculars for part in parts], (4,)),
        )


@dataclass(frozen=True, eq=False)
class Spheres:
    """Bounding spheres: centers (n, 3) in world space, radii (n,)."""

    centers: Float64
    radii: Float64

    @cached_property
    def around(self) -> tuple[Float64, float]:
        """Center and radius of a sphere around all of them; radius 0 if there are none."""
        if not len(self.radii):
            return np.zeros(3), 0.0
        low = (self.centers - self.radii[:, None]).min(axis=0)
        high = (self.centers + self.radii[:, None]).max(axis=0)
        return 0.5 * (low + high), float(0.5 * np.linalg.norm(high - low))


def _joined(parts: list[NDArray[Any]], shape: tuple[int, ...], dtype: Any = np.float64) -> NDArray[Any]:
    return np.concatenate([np.zeros((0, *shape), dtype=dtype), *parts])


def make_groups(
    key: tuple[Any, ...],
    geom: Geom,
    materials: Sequence[Material],
    colors: Sequence[Color | None],
    nets: Sequence[Float64],
    ids: Sequence[int],
) -> list[Group]:
    """Return one group, or two if some instances are mirrored and others are not.

    The radius of a bounding sphere grows with the matrix's largest singular value.
    """
    unique = {id(material): material for material in materials}
    index = {name: position for position, name in enumerate(unique)}
    first, matrices = materials[0], np.array(nets)
    low, high = geom.bounds
    center = 0.5 * (low + high)
    radius = float(np.linalg.norm(geom.vertices - center, axis=1).max()) if len(geom.vertices) else 0.0
    which = np.array([index[id(material)] for material in materials], dtype=np.intp)
    flat = None if colors[0] is None else np.array(colors, dtype=np.float64)
    numbers = np.array(ids, dtype=np.int32)
    centers = center @ matrices[:, :3, :3] + matrices[:, 3, :3]
    radii = radius * np.linalg.norm(matrices[:, :3, :3], ord=2, axis=(1, 2))
    turned = np.linalg.det(matrices[:, :3, :3]) < 0
    return [
        Group(
            key=(*key, mirrored),
            geom=geom,
            texture=first.texture,
            cutoff=first.alpha_cutoff if first.alpha_mode != "opaque" else None,
            double_sided=first.double_sided,
            mirrored=mirrored,
            materials=tuple(unique.values()),
            which=which[chosen],
            colors=None if flat is None else flat[chosen],
            model_to_world=matrices[chosen],
            ids=numbers[chosen],
            centers=centers[chosen],
            radii=radii[chosen],
        )
        for mirrored in (False, True)
        if (chosen := turned == mirrored).any()
    ]
