"""Primitives of a mesh as arrays of vertices and what they make up, with Z up (glTF 2.0, section 3.7.2)."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.model.gltf.accessors import COMPONENTS, normalised, read_accessor, read_layout
from firefly_sample.model.gltf.compression import DracoMesh, decode_draco
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.json_object import JsonObject
from firefly_sample.model.gltf.primitives import (
    POINTS,
    TRIANGLE_FAN,
    TRIANGLES,
    Arrays,
    Indices,
    flat_normals,
    marks_of,
    numbers_in,
    pick,
    triangles_of,
    unit_or_up,
    unit_tangents,
    without_unused,
)
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import GeomMode
from firefly_sample.scene.tangents import TangentGroups, split_at_tangents
from firefly_sample.scene.transforms import vectors_from_gltf

UvSet = tuple[int, Float64 | None]
"""The number of a set of texture coordinates, and the 3x2 matrix that a row (u, v, 1) of it is multiplied
with, both v down as in glTF; None: as they are."""
_TARGETS = {"POSITION": "vertices", "NORMAL": "normals", "TANGENT": "tangents"}
"""Attributes that morph targets displace, and their arrays."""


@dataclass
class Primitive:
    """The arrays, `flat` and `mode` of a primitive's `GeomData`; the arrays are None if nothing is drawn.

    `losses` say what is not drawn, each as a line that can be followed by the name of the mesh.
    """

    arrays: Arrays | None
    flat: bool
    losses: tuple[str, ...] = ()
    mode: GeomMode = "triangles"


def read_primitive(
    document: Document,
    mesh: object,
    primitive: int,
    uv_sets: Sequence[UvSet] = (),
    normal_set: int | None = None,
) -> Primitive:
    """Return a primitive's arrays, with the names, types and conventions of `GeomData`.

    Without normals in the file each triangle gets its own three vertices, and the result is `flat`; lines and
    points then have no normals either. Vertices that nothing uses are left out.

    Parameters
    ----------
    mesh : object
        The index of the mesh, as it is in the JSON.
    primitive : int
        The index of the primitive in the mesh.
    uv_sets : sequence of (int, ndarray or None)
        The sets that become "texcoords" and "texcoords_1", with their transforms: see `UvSet`. A set that the
        primitive does not have is named as a loss.
    normal_set : int, optional
        Which of these, 0 or 1, a normal map uses: the primitive then has "tangents", those of the file or,
        where it has none or no normals, computed ones (section 3.7.2.1). Vertices are copied where triangles
        have different tangents.

    Raises
    ------
    ModelError
        If anything is damaged, or needs a package that is not installed.
    """
    found = document.item("meshes", mesh, "mesh").objects("primitives")[primitive]
    return _Reader(found, uv_sets, normal_set).read()


def kind_of(mode: int) -> GeomMode:
    """Return what a mode of primitives (section 3.7.2.1) draws."""
    if mode >= TRIANGLES:
        return "triangles"
    return "points" if mode == POINTS else "lines"


def count_targets(mesh: JsonObject) -> int:
    """Return the number of morph targets of a mesh, which all its primitives share."""
    counts = [len(primitive.objects("targets")) for primitive in mesh.objects("primitives")]
    for number, count in enumerate(counts):
        if count != counts[0]:
            place = f"primitives[{number}].targets"
            raise mesh.error(place, f"are {count}, but those of the first primitive are {counts[0]}")
    return counts[0] if counts else 0


class _Reader:
    """Reads one primitive; the steps are in the order of `read`."""

    def __init__(self, primitive: JsonObject, uv_sets: Sequence[UvSet], normal_set: int | None) -> None:
        self.primitive = primitive
        self.document = primitive.document
        self.uv_sets = uv_sets
        self.normal_set = normal_set
        self.mode = primitive.whole("mode", TRIANGLES, most=TRIANGLE_FAN)
        self.kind = kind_of(self.mode)
        self.accessors = primitive.required_object("attributes").accessors()
        self.place = f"{primitive.place('attributes')}."
        self.losses: list[str] = []
        self.draco: DracoMesh | None = None
        self.count = 0

    def read(self) -> Primitive:
        if "POSITION" not in self.accessors:
            return Primitive(None, False, (f"{self.kind} without positions are not drawn",))
        self.draco = decode_draco(self.primitive)
        if self.draco is not None and self.kind != "triangles":
            raise self.primitive.error(
                "mode", f"must be one of triangles with Draco, but it is of {self.kind}"
            )
        arrays: Arrays = {"vertices": self._vectors("POSITION")}
        self.count = len(arrays["vertices"])
        triangles = self._triangles()
        if not len(triangles):
            return Primitive(None, False)
        if "NORMAL" in self.accessors:
            arrays["normals"] = self._vectors("NORMAL")
            if self.normal_set is not None and "TANGENT" in self.accessors:
                arrays["tangents"] = self._tangents()
        arrays |= self._texcoords()
        arrays |= self._colors()
        arrays |= self._joints()
        arrays |= self._targets(arrays.keys())
        return self._finished(arrays, triangles)

    def _finished(self, arrays: Arrays, triangles: Indices) -> Primitive:
        """Return the vertices that are used; for flat normals a vertex for each corner of a triangle."""
        flat = "normals" not in arrays and self.kind == "triangles"
        if flat:
            used, triangles = triangles.ravel(), np.arange(triangles.size).reshape(-1, 3)
        else:
            used, triangles = without_unused(triangles, self.count)
        self.document.claim(numbers_in(arrays, len(used)) + triangles.size, self.primitive.where)
        if flat or len(used) < self.count:
            arrays = pick(arrays, used)
        if flat:
            faces = flat_normals(arrays["vertices"].reshape(-1, 3, 3))
            arrays["normals"] = np.repeat(faces, 3, axis=0)
        elif "normals" in arrays:
            arrays["normals"] = unit_or_up(arrays["normals"])
        if "tangents" in arrays:
            arrays["tangents"] = unit_tangents(arrays["tangents"], arrays["normals"])
        elif self.normal_set is not None and self.kind == "triangles":
            arrays, triangles = self._with_tangents(arrays, triangles, flat)
        arrays["triangles"] = triangles.astype(np.int32)
        return Primitive(arrays, flat, tuple(self.losses), self.kind)

    def _with_tangents(self, arrays: Arrays, triangles: Indices, flat: bool) -> tuple[Arrays, Indices]:
        """Return arrays and triangles with computed tangents, also of each morph target unless flat."""
        texcoords = arrays.get("texcoords_1" if self.normal_set == 1 else "texcoords")
        if texcoords is None:  # which is named; the map is one texel
            return arrays, triangles
        vertices, normals = arrays["vertices"], arrays["normals"]
        groups = TangentGroups(vertices, triangles, normals, texcoords)
        corners = groups.corners(vertices, normals)
        chosen, split = split_at_tangents(triangles, corners)
        targets = [] if flat else range(len(arrays.get("morph_vertices", ())))
        self.document.claim(
            numbers_in(arrays, len(chosen) - len(vertices)) + len(chosen) * (4 + 3 * len(targets)),
            self.primitive.where,
        )
        made = pick(arrays, triangles.ravel()[chosen])
        made["tangents"] = corners.reshape(-1, 4)[chosen]
        if targets:
            moved = np.empty((len(targets), len(chosen), 3))
            for target in targets:
                morphed = vertices + arrays["morph_vertices"][target]
                turned = normals
                if "morph_normals" in arrays:
                    turned = unit_or_up(normals + arrays["morph_normals"][target])
                at_target = groups.corners(morphed, turned).reshape(-1, 4)[chosen]
                moved[target] = at_target[:, :3] - made["tangents"][:, :3]
            made["morph_tangents"] = moved
        return made, split

    # attributes

    def _attribute(self, name: str, *types: str) -> NDArray[Any]:
        """Return the numbers of an attribute, with as many rows as there are vertices."""
        where = self.place + name
        if self.draco is not None and name in self.draco.ids:
            accessor = self.document.item("accessors", self.accessors[name], where)
            values = self.draco.attribute(name, accessor, read_layout(accessor, where, types))
        else:
            values = read_accessor(self.document, self.accessors[name], where, types)
        return self._checked(where, values)

    def _checked(self, where: str, values: NDArray[Any]) -> NDArray[Any]:
        if self.count and len(values) != self.count:
            raise self.document.error(where, f"has {len(values)} elements for {self.count} vertices")
        return values

    def _vectors(self, name: str) -> Float64:
        return vectors_from_gltf(self._attribute(name, "VEC3"))

    def _tangents(self) -> Float64:
        given = self._attribute("TANGENT", "VEC4")
        return np.column_stack([vectors_from_gltf(given[:, :3]), np.where(given[:, 3] < 0.0, -1.0, 1.0)])

    def _texcoords(self) -> Iterator[tuple[str, Float64]]:
        """Yield the sets that were asked for, transformed, and with v up."""
        for slot, (number, transform) in zip(("texcoords", "texcoords_1"), self.uv_sets, strict=False):
            name = f"TEXCOORD_{number}"
            if name not in self.accessors:
                self.losses.append(f"a texture is not drawn right, because {name} is missing")
                continue
            uv = self._attribute(name, "VEC2").astype(np.float64)
            if transform is not None:
                uv = uv @ transform[:2] + transform[2]
            yield slot, np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1)

    def _colors(self) -> Iterator[tuple[str, Float64]]:
        """Yield RGBA of 0 to 1. Integers are normalised, as they must be, even where the file forgets it."""
        if "COLOR_0" not in self.accessors:
            return
        stored = self._attribute("COLOR_0", "VEC3", "VEC4")
        colors = normalised(stored, stored.dtype) if stored.dtype.kind in "iu" else stored
        if colors.shape[1] == 3:
            colors = np.column_stack([colors, np.ones(len(colors))])
        clipped = np.clip(colors, 0.0, 1.0)
        if (clipped != colors).any():
            self.losses.append("vertex colours outside 0 to 1 are clipped")
        yield "colors", clipped

    def _joints(self) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield all sets of joints side by side, and their weights, whose sum is 1 for each vertex.

        A vertex whose weights are all zero follows its first joint: the specification has no rule for it, and
        other viewers do the same. A joint without weight becomes 0, since files have anything there.
        """
        sets = 0
        while f"JOINTS_{sets}" in self.accessors and f"WEIGHTS_{sets}" in self.accessors:
            sets += 1
        if not sets:
            return
        joints = np.hstack([self._attribute(f"JOINTS_{i}", "VEC4") for i in range(sets)])
        weights = np.hstack([self._attribute(f"WEIGHTS_{i}", "VEC4") for i in range(sets)]).astype(np.float64)
        if joints.dtype.kind == "f" and (joints != np.floor(joints)).any():
            raise self.document.error(self.place + "JOINTS_0", "must be whole numbers")
        if (weights < 0.0).any():
            raise self.document.error(self.place + "WEIGHTS_0", "must not be negative")
        largest = weights.max(axis=1, keepdims=True)
        weights[largest[:, 0] == 0.0, 0] = 1.0
        weights /= np.where(largest > 0.0, largest, 1.0)  # so that the sum cannot overflow
        joints = np.where(weights > 0.0, joints, 0)
        if joints.size and not 0 <= joints.min() <= joints.max() < 2**16:
            raise self.document.error(self.place + "JOINTS_0", "has a joint outside 0 to 65535")
        yield "joints", joints.astype(np.int32)
        yield "joint_weights", weights / weights.sum(axis=1, keepdims=True)

    def _targets(self, has: Collection[str]) -> Iterator[tuple[str, Float64]]:
        """Yield the displacements of the arrays that there are, zero where a target has none."""
        targets = self.primitive.objects("targets")
        kept = {name: f"morph_{what}" for name, what in _TARGETS.items() if what in has}
        if not targets:
            return
        given = [target.accessors() for target in targets]
        names = {name for each in given for name in each}
        if any(name.startswith(("TEXCOORD_", "COLOR_")) for name in names):
            self.losses.append("morph targets of colours and texture coordinates are not drawn")
        for name, kind in kept.items():
            if name == "POSITION" or name in names:
                self.document.claim(len(targets) * self.count * 3, self.primitive.place("targets"))
                moved = np.zeros((len(targets), self.count, 3))
                for row, target, accessors in zip(moved, targets, given, strict=True):
                    if name in accessors:
                        where = target.place(name)
                        values = read_accessor(self.document, accessors[name], where, ("VEC3",))
                        row[:] = vectors_from_gltf(self._checked(where, values))
                yield kind, moved

    # indices

    def _triangles(self) -> Indices:
        """Return the triangles (m, 3), lines (m, 2) or points (m, 1), whose indices are checked."""
        rows_of = triangles_of if self.kind == "triangles" else marks_of
        if self.draco is not None:
            triangles = self.draco.triangles
            self._check_range(triangles, self.primitive.where)
            return triangles
        if "indices" not in self.primitive:
            return rows_of(self.mode, np.arange(self.count))
        where = self.primitive.place("indices")
        stored = read_accessor(self.document, self.primitive.json["indices"], where, ("SCALAR",))
        if stored.dtype not in (COMPONENTS[5121], COMPONENTS[5123], COMPONENTS[5125]):
            raise self.document.error(where, "must be unsigned integers")
        if stored.size and stored.max() == np.iinfo(stored.dtype).max:
            raise self.document.error(
                where, f"has the index {stored.max()}, which would restart a strip; glTF does not allow it"
            )
        indices = stored.astype(np.int64)
        self._check_range(indices, where)
        return rows_of(self.mode, indices)

    def _check_range(self, indices: Indices, where: str) -> None:
        if indices.size and indices.max() >= self.count:
            raise self.document.error(
                where, f"has the index {indices.max()}, but there are {self.count} vertices"
            )
