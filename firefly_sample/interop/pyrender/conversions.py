"""Keep what pyrender's meshes, materials and textures were converted to, for as long as they exist.

Like pyrender, which uploads a mesh once, a conversion takes an array as it is at its first use: a change
inside an array that is already converted is not seen. An array, a texture or a factor that is replaced is.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import cache
from itertools import chain
from operator import attrgetter, is_
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from firefly_sample.interop.pyrender.materials import MaterialReader
from firefly_sample.interop.pyrender.meshes import MeshReader, note_losses
from firefly_sample.interop.pyrender.normals import normal_lines, normal_material
from firefly_sample.losses import Losses
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material


@dataclass(frozen=True)
class Treatment:
    """The ways in which the flags of a render change what is drawn of a scene.

    Attributes
    ----------
    opaque : bool
        Let no surface be blended: for depth and segmentation.
    both_sides : bool
        Draw back faces, too.
    wireframe : {"material", "flipped", "all", "none"}
        The primitives that are drawn as lines: those whose material says so, all others, all, or none.
    shadows : frozenset of str
        The kinds of lights that cast shadows: "directional", "point", "spot".
    map_size : int or None
        Texels along a side of all shadow maps, where the setting `shadow_resolution` gives them.
    vertex_normals, face_normals : bool
        Draw normals as lines.
    look : str
        The setting `look` of the picture; data, which do not depend on it, have the default.
    facing : bool
        Light primitives without normals as if they faced the camera; else they get smooth ones. It is the
        renderer's, also of data and of flat pictures, so that these do not convert a mesh again.
    """

    opaque: bool = False
    both_sides: bool = False
    wireframe: str = "material"
    shadows: frozenset[str] = frozenset()
    map_size: int | None = None
    vertex_normals: bool = False
    face_normals: bool = False
    look: str = "pyrender"
    facing: bool = True

    @property
    def alike(self) -> bool:
        """True if pictures are as pyrender's; else what it ignores or draws otherwise counts, or is named."""
        return self.look in ("pyrender", "flat")

    def draws_wireframe(self, material: Any) -> bool:
        """Return whether a primitive with a pyrender Material is drawn as lines."""
        own = bool(material.wireframe)
        return {"material": own, "flipped": not own, "all": True, "none": False}[self.wireframe]

    @property
    def for_depth(self) -> Treatment:
        """The same scene for the depth of its picture."""
        return self._of_data(self.wireframe)

    @property
    def for_data(self) -> Treatment:
        """The same scene for depth alone and for segmentation: as in pyrender, wireframes are filled."""
        return self._of_data("none")

    def _of_data(self, wireframe: str) -> Treatment:
        return Treatment(opaque=True, both_sides=self.both_sides, wireframe=wireframe, facing=self.facing)


class _Kept(NamedTuple):
    """Conversions of one object, by use, and what they were made of."""

    objects: tuple[Any, ...]
    """Compared by identity."""
    values: tuple[Any, ...]
    """Compared by equality."""
    made: dict[Any, Any]


class Conversions:
    """The conversions of a renderer's scenes.

    Attributes
    ----------
    losses : Losses
        What conversions left out, since it was last replaced.
    meshes : int
        The number of primitives converted so far.
    """

    def __init__(self) -> None:
        self.losses = Losses()
        self.meshes = 0
        self._geoms: WeakKeyDictionary[Any, _Kept] = WeakKeyDictionary()
        self._materials: WeakKeyDictionary[Any, _Kept] = WeakKeyDictionary()
        self._normals: WeakKeyDictionary[Any, _Kept] = WeakKeyDictionary()
        self._noted: WeakKeyDictionary[Any, _Kept] = WeakKeyDictionary()
        self._normal_materials: dict[str, Material] = {}
        self._textures: WeakKeyDictionary[Any, _Kept] = WeakKeyDictionary()

    def geom(self, primitive: Any, mirrored: bool, facing: bool, name: str) -> Geom:
        """Return a primitive as a Geom, reversed if `mirrored`; `facing` as in `Treatment`."""

        def make() -> Geom:
            self.meshes += 1
            return MeshReader(self.losses).geom(primitive, mirrored, name, facing)

        arrays, mode = _ARRAYS(primitive), (primitive.mode,)
        use = mirrored, facing and primitive.normals is None  # with normals, both are the same
        made: Geom = self._keep(self._geoms, primitive, arrays, mode, use, make)
        return made

    def note_losses(self, primitive: Any, name: str) -> None:
        """Note once what a picture that is not as pyrender's lacks of a primitive."""
        objects, mode = _NOTED(primitive), (primitive.mode,)
        self._keep(
            self._noted, primitive, objects, mode, None, lambda: note_losses(primitive, name, self.losses)
        )

    def normals(self, primitive: Any, treatment: Treatment, name: str) -> Geom | None:
        """Return the lines along a primitive's normals that a treatment asks for."""
        if not (treatment.vertex_normals or treatment.face_normals):
            return None
        use = treatment.vertex_normals, treatment.face_normals
        objects, mode = (*_ARRAYS(primitive), primitive.poses), (primitive.mode,)

        def make() -> Geom | None:
            return normal_lines(primitive, *use, name, self.losses)

        made: Geom | None = self._keep(self._normals, primitive, objects, mode, use, make)
        return made

    def normal_material(self, look: str) -> Material:
        """Return the material of normals in a look."""
        if look not in self._normal_materials:
            self._normal_materials[look] = normal_material(look)
        return self._normal_materials[look]

    def material(self, source: Any, treatment: Treatment, name: str) -> Material:
        """Return a material in a treatment."""
        factors, textures = (names(source) for names in _names(source.__class__))
        # an array as bytes, so that a change inside it is seen
        values = tuple([each.tobytes() if isinstance(each, np.ndarray) else each for each in factors])
        images = [(each.source, each.sampler) for each in textures if each is not None]
        objects = (*textures, *chain.from_iterable(images))
        use = treatment.opaque, treatment.both_sides

        def read() -> Material:
            return MaterialReader(self.losses, self.texture, compare=False).material(source, name)

        def make() -> Material:
            material: Material = copy(self._keep(self._materials, source, objects, values, None, read))
            if treatment.both_sides:
                material.double_sided = True
            if treatment.opaque and material.alpha_mode == "blend":
                material.alpha_mode = "opaque"
            return material

        made: Material = self._keep(self._materials, source, objects, values, use, make)
        return made

    def texture(self, source: Any, use: bool, make: Callable[[], Any]) -> Any:
        """Return what `make` makes of a texture, once for each use."""
        return self._keep(self._textures, source, (source.source, source.sampler), (), use, make)

    @staticmethod
    def _keep(
        table: WeakKeyDictionary[Any, _Kept],
        key: Any,
        objects: tuple[Any, ...],
        values: tuple[Any, ...],
        use: Any,
        make: Callable[[], Any],
    ) -> Any:
        kept = table.get(key)
        if (
            kept is None
            or kept.values != values
            or len(kept.objects) != len(objects)
            or not all(map(is_, kept.objects, objects))
        ):
            kept = table[key] = _Kept(objects, values, {})
        if use not in kept.made:
            kept.made[use] = make()
        return kept.made[use]


_ARRAYS = attrgetter("positions", "normals", "tangents", "texcoord_0", "color_0", "indices")
_NOTED = attrgetter("normals", "tangents", "joints_0", "weights_0", "targets")
_FACTORS = (
    "alphaMode",
    "alphaCutoff",
    "doubleSided",
    "emissiveFactor",
    "baseColorFactor",
    "metallicFactor",
    "roughnessFactor",
    "diffuseFactor",
    "specularFactor",
    "_glossinessFactor",  # pyrender's property of this name without "_" calls itself for ever
)
_TEXTURES = (
    "normalTexture",
    "occlusionTexture",
    "emissiveTexture",
    "baseColorTexture",
    "metallicRoughnessTexture",
    "diffuseTexture",
    "specularGlossinessTexture",
)


@cache
def _names(kind: Any) -> tuple[attrgetter[Any], attrgetter[Any]]:
    """Return what reads the factors and the textures of a class of materials, as tuples."""
    factors = [name for name in _FACTORS if hasattr(kind, name.lstrip("_"))]
    return attrgetter(*factors), attrgetter(*(name for name in _TEXTURES if hasattr(kind, name)))
