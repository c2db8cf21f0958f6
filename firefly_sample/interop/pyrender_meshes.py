"""Convert Geoms to pyrender's meshes and back, each once, so that they stay shared.

pyrender keeps vertices, normals, texture coordinates and colours as float32. Under a transform that mirrors,
glTF and this package reverse the winding of triangles; pyrender does not and draws the wrong side. Therefore
the triangles of mirrored instances are reversed on the way there and on the way back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError
from firefly_sample.interop.losses import Losses
from firefly_sample.interop.pyrender_materials import MaterialReader, MaterialWriter
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import Color
from firefly_sample.scene.transforms import vectors_from_gltf, vectors_to_gltf

LARGEST_INDEX = 2**24
"""pyrender keeps indices as float32, in which whole numbers are exact up to here."""

_UNREAD_ATTRIBUTES = ("tangents", "texcoord_1", "joints_0", "weights_0", "targets")
_TINTED_EMISSION = "pyrender multiplies emission by vertex colours, this package does not"

Int64 = NDArray[np.int64]


class MeshWriter:
    """Makes pyrender's meshes."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._arrays: dict[int, dict[str, Any]] = {}
        self._materials = MaterialWriter(losses)
        self._meshes: dict[tuple[Any, ...], Any] = {}

    def mesh(
        self, node: GeomNode, material: Material | None, color: Color | None, mirrored: bool, visible: bool
    ) -> Any:
        """Return a pyrender Mesh of a node's Geoms, shared by nodes that look alike; None without vertices.

        Parameters
        ----------
        node : GeomNode
        material : Material or None
            Replaces those of the Geoms.
        color : (r, g, b, a) or None
            Multiplies base colours and replaces vertex colours.
        mirrored : bool
            True if the node's net transform mirrors.
        visible : bool

        Raises
        ------
        SceneError
            If a Geom has more than `LARGEST_INDEX` vertices.
        """
        import pyrender

        parts = []
        for geom, own in node.geoms:
            if len(geom.vertices):
                parts.append((geom, own if material is None else material))
            else:
                self._losses.add("geometry without vertices is left out", f"{node.name}/{geom.name}")
        if not parts:
            return None
        key = (mirrored, visible, color, *((id(geom), id(look)) for geom, look in parts))
        if key not in self._meshes:
            primitives = [self._primitive(geom, look, color, mirrored) for geom, look in parts]
            self._meshes[key] = pyrender.Mesh(primitives, name=parts[0][0].name, is_visible=visible)
        return self._meshes[key]

    def _primitive(self, geom: Geom, material: Material, color: Color | None, mirrored: bool) -> Any:
        import pyrender

        if len(geom.vertices) > LARGEST_INDEX:
            raise SceneError(
                f"geom {geom.name!r}: {len(geom.vertices)} vertices, and pyrender keeps indices as float32: "
                f"split it into parts of {LARGEST_INDEX} at most"
            )
        if color is None and geom.colors is not None and _tints_emission(geom.colors, material):
            self._losses.add(_TINTED_EMISSION, geom.name)
        if id(geom) not in self._arrays:
            self._arrays[id(geom)] = {
                "positions": vectors_to_gltf(geom.vertices).astype(np.float32),
                "normals": vectors_to_gltf(geom.normals).astype(np.float32),
                "texcoord_0": geom.texcoords.astype(np.float32),
            }
        colors = geom.colors if color is None else None
        if colors is not None and geom.alphas is not None:
            colors = np.column_stack([colors, geom.alphas])
        return pyrender.Primitive(
            **self._arrays[id(geom)],
            color_0=colors,
            indices=geom.triangles[:, ::-1] if mirrored else geom.triangles,
            material=self._materials.material(material, color),
        )


class Part(NamedTuple):
    """A Geom of a mesh with its material, and the pyrender transform of an instance, if it is one."""

    geom: Geom
    material: Material
    pose: Any


class MeshReader:
    """Makes Geoms and materials from pyrender's meshes."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._geoms: dict[tuple[Any, ...], Geom] = {}
        self._of_primitives: dict[tuple[int, bool], Geom] = {}
        self._materials = MaterialReader(losses)

    def parts(self, mesh: Any, name: str, net: NDArray[np.float64]) -> Iterable[Part]:
        """Yield a Part for each primitive of triangles, or for each of its instances if it has any.

        Parameters
        ----------
        mesh : pyrender.Mesh
        name : str
            The name of a mesh that has none.
        net : ndarray of float64, shape (4, 4)
            From the mesh's space to the world's.

        Raises
        ------
        SceneError
            If an index, a coordinate or a colour is out of its range.
        """
        name = mesh.name or name
        if mesh.weights is not None:
            self._losses.add("skins and morph weights are left out", name)
        for index, primitive in enumerate(mesh.primitives):
            part_name = f"{name}[{index}]" if len(mesh.primitives) > 1 else name
            if primitive.mode not in _TRIANGLES:
                self._losses.add("points and lines are left out", part_name)
                continue
            material = self._materials.material(primitive.material, part_name)
            self._note_losses(primitive, material, part_name)
            for pose in (None,) if primitive.poses is None else primitive.poses:
                upper = net[:3, :3] if pose is None else pose[:3, :3].astype(np.float64) @ net[:3, :3]
                mirrored = bool(np.linalg.det(upper) < 0)
                key = (id(primitive), mirrored)
                if key not in self._of_primitives:
                    self._of_primitives[key] = self._geom(primitive, mirrored, part_name)
                yield Part(self._of_primitives[key], material, pose)

    def _note_losses(self, primitive: Any, material: Material, name: str) -> None:
        for attribute in _UNREAD_ATTRIBUTES:
            if getattr(primitive, attribute) is not None:
                self._losses.add(f"{attribute} of meshes are left out", name)
        if primitive.normals is None:
            self._losses.add(
                "meshes without normals, which pyrender lights as if they faced the camera, get smooth ones",
                name,
            )
        if primitive.color_0 is not None and _tints_emission(primitive.color_0, material):
            self._losses.add(_TINTED_EMISSION, name)

    def _geom(self, primitive: Any, mirrored: bool, name: str) -> Geom:
        count = len(primitive.positions)
        indices = np.arange(count) if primitive.indices is None else np.asarray(primitive.indices).ravel()
        triangles = _TRIANGLES[primitive.mode](indices.astype(np.int64))
        if mirrored:
            triangles = triangles[:, ::-1]
        colors = primitive.color_0
        # Equal arrays are one Geom under whatever material; pyrender copies indices and colours.
        shared = (primitive.positions, primitive.normals, primitive.texcoord_0)
        key = (*map(id, shared), triangles.tobytes(), None if colors is None else colors.tobytes())
        if key not in self._geoms:
            self._geoms[key] = Geom(
                vectors_from_gltf(primitive.positions),
                triangles,
                normals=None if primitive.normals is None else vectors_from_gltf(primitive.normals),
                texcoords=primitive.texcoord_0,
                colors=colors,
                name=name,
            )
        return self._geoms[key]


def _tints_emission(colors: NDArray[Any], material: Material) -> bool:
    """Return True if vertex colours, multiplied with a material's emission, change it."""
    return bool(material.emission.any() and (colors[:, :3] != 1.0).any())


def _of_list(indices: Int64) -> Int64:
    return indices[: len(indices) // 3 * 3].reshape(-1, 3)


def _of_strip(indices: Int64) -> Int64:
    """Make a triangle of each vertex and the two before it; every second one is reversed."""
    triangles = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
    triangles[1::2] = triangles[1::2, [1, 0, 2]]
    return triangles


def _of_fan(indices: Int64) -> Int64:
    """Make a triangle of each vertex, the one before it and the first of all."""
    first = np.broadcast_to(indices[:1], max(len(indices) - 2, 0))
    return np.stack([first, indices[1:-1], indices[2:]], axis=1)


_TRIANGLES: dict[int, Callable[[Int64], Int64]] = {4: _of_list, 5: _of_strip, 6: _of_fan}
"""By glTF's mode: the function that makes triangles, shape (m, 3), of indices."""
