"""Find what is drawn of pyrender's meshes: a Geom, a material and a transform for each instance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from firefly_sample.interop.pyrender.conversions import Conversions, Treatment
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material


@dataclass(frozen=True, eq=False)
class Part:
    """The part of a picture that a primitive, or one of its instances, draws.

    Attributes
    ----------
    geom : Geom
    material : Material
    wireframe : bool
    pose : ndarray of shape (4, 4) or None
        The instance's transform in pyrender's axes.
    """

    geom: Geom
    material: Material
    wireframe: bool
    pose: NDArray[Any] | None = None

    @cached_property
    def blended(self) -> bool:
        """True if the part lets through what is behind it."""
        if self.material.alpha_mode != "blend":
            return False
        texture = self.material.texture
        clear = texture is not None and texture.least_alpha() < 1.0
        return clear or self.geom.alphas is not None or bool(self.material.base_color[3] < 1.0)

    @property
    def apart(self) -> bool:
        """True if the part needs a node of its own: lines have no part in the size of points."""
        return self.wireframe or self.pose is not None or self.geom.mode == "lines"

    def same_as(self, other: Part) -> bool:
        """Return True if the other part has the same objects, and an equal transform."""
        return (
            self.geom is other.geom
            and self.material is other.material
            and self.wireframe == other.wireframe
            and (
                self.pose is other.pose
                or (
                    self.pose is not None and other.pose is not None and np.array_equal(self.pose, other.pose)
                )
            )
        )


class MeshParts:
    """The parts of pyrender's meshes in one `Treatment`."""

    def __init__(self, treatment: Treatment, conversions: Conversions) -> None:
        self._treatment, self._conversions = treatment, conversions
        self._kept: WeakKeyDictionary[Any, dict[bool, Sequence[Part]]] = WeakKeyDictionary()

    def of(self, mesh: Any, mirrored: bool, name: str) -> Sequence[Part]:
        """Return a mesh's parts, the same object as long as nothing of them has changed.

        `mirrored` is True below a transform that turns triangles inside out; `name` is for what has none.
        """
        kept = self._kept.setdefault(mesh, {})
        parts, before = list(self._find(mesh, mirrored, name)), kept.get(mirrored)
        if before is not None and len(parts) == len(before) and all(map(Part.same_as, parts, before)):
            return before
        kept[mirrored] = parts
        return parts

    def _find(self, mesh: Any, mirrored: bool, name: str) -> Iterator[Part]:
        several = len(mesh.primitives) > 1
        for index, primitive in enumerate(mesh.primitives):
            yield from self._of_primitive(primitive, mirrored, f"{name}[{index}]" if several else name)

    def _of_primitive(self, primitive: Any, mirrored: bool, name: str) -> Iterator[Part]:
        treatment, conversions, source = self._treatment, self._conversions, primitive.material
        material = conversions.material(source, treatment, name)
        asks_wireframe = treatment.draws_wireframe(source)
        if not (treatment.alike or treatment.opaque):
            conversions.note_losses(primitive, name)
        for pose in (None,) if primitive.poses is None else primitive.poses:
            turned = mirrored != (pose is not None and np.linalg.det(pose[:3, :3]) < 0.0)
            geom = conversions.geom(primitive, turned, treatment.facing, name)
            yield Part(geom, material, asks_wireframe and geom.mode == "triangles", pose)
            lines = conversions.normals(primitive, treatment, name)
            if lines is not None:
                yield Part(lines, conversions.normal_material(treatment.look), False, pose)
