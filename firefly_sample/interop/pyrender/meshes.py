"""Convert Geoms to pyrender's primitives and back, each once, so that they stay shared.

pyrender keeps vertices, normals, tangents, texture coordinates and colours as float32. Under a transform that
mirrors, glTF and this package reverse the winding of triangles; pyrender does not and draws the wrong side.
Therefore the triangles of mirrored instances are reversed, in both directions of the conversion.

pyrender keeps tangents, but its shader takes the directions of a normal map from the texture coordinates, as
if none were mirrored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError
from firefly_sample.interop.pyrender.attributes import usable_attributes
from firefly_sample.interop.pyrender.materials import (
    MaterialReader,
    MaterialWriter,
    has_second_texcoords,
    tints_emission,
)
from firefly_sample.losses import Losses
from firefly_sample.scene.geom import Geom, GeomMode, GeomNode
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import Color
from firefly_sample.scene.surface_overrides import SurfaceOverrides, overridden
from firefly_sample.scene.transforms import vectors_from_gltf, vectors_to_gltf

Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]

LARGEST_INDEX = 2**24
"""pyrender keeps indices as float32, in which whole numbers are exact up to here."""

_LIST, _STRIP, _FAN = 4, 5, 6
"""glTF's modes of triangles."""
_POINTS, _LINES, _LINE_LOOP, _LINE_STRIP = 0, 1, 2, 3

_UNREAD_ATTRIBUTES = ("joints_0", "weights_0", "targets")
_NO_NORMALS = "meshes without normals, which pyrender lights as if they faced the camera, get smooth ones"
_TINTED_EMISSION = "pyrender multiplies emission by vertex colours, this package does not"
_FIRST_TEXCOORDS = "pyrender samples all textures at the first texture coordinates"
_OWN_TANGENTS = "pyrender ignores tangents and takes those of normal maps from texture coordinates"
_WRONG_TANGENTS = "tangents without a handedness of 1 or -1 are left out"


class MeshWriter:
    """Makes pyrender's meshes."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._mesh, self._arrays = cache(self._new_mesh), cache(_arrays)
        self._materials = MaterialWriter(losses)

    def mesh(
        self,
        node: GeomNode,
        material: Material | None,
        overrides: SurfaceOverrides,
        color: Color | None,
        wireframe: bool,
        mirrored: bool,
        visible: bool,
    ) -> Any:
        """Return a pyrender Mesh of a node's Geoms, shared by nodes that look alike; None without vertices.

        A material replaces those of the Geoms, and overrides replace its parts; a colour multiplies base
        colours and replaces vertex colours.
        `mirrored` is True if the node's net transform mirrors.
        """
        for geom, _ in node.geoms:
            if not len(geom.vertices):
                self._losses.add("geometry without vertices is left out", f"{node.name}/{geom.name}")
        parts = tuple(
            (geom, overridden(own if material is None else material, overrides))
            for geom, own in node.geoms
            if len(geom.vertices)
        )
        return self._mesh(parts, color, wireframe, mirrored, visible) if parts else None

    def _new_mesh(
        self,
        parts: tuple[tuple[Geom, Material], ...],
        color: Color | None,
        wireframe: bool,
        mirrored: bool,
        visible: bool,
    ) -> Any:
        import pyrender

        primitives = [self._primitive(geom, look, color, wireframe, mirrored) for geom, look in parts]
        return pyrender.Mesh(primitives, name=parts[0][0].name, is_visible=visible)

    def _primitive(
        self, geom: Geom, material: Material, color: Color | None, wireframe: bool, mirrored: bool
    ) -> Any:
        import pyrender

        if len(geom.vertices) > LARGEST_INDEX:
            raise SceneError(
                f"geom {geom.name!r}: {len(geom.vertices)} vertices, and pyrender keeps indices as float32: "
                f"split it into parts of {LARGEST_INDEX} at most"
            )
        colors = geom.colors if color is None else None
        if colors is not None and tints_emission(colors, material):
            self._losses.add(_TINTED_EMISSION, geom.name)
        if has_second_texcoords(geom, material):
            self._losses.add(_FIRST_TEXCOORDS, geom.name)
        if geom.tangents is not None and material.normal_texture is not None:
            self._losses.add(_OWN_TANGENTS, geom.name)
        if colors is not None and geom.alphas is not None:
            colors = np.column_stack([colors, geom.alphas])
        return pyrender.Primitive(
            **self._arrays(geom),
            color_0=colors,
            indices=geom.indices[:, ::-1] if mirrored and geom.mode == "triangles" else geom.indices,
            mode={"triangles": _LIST, "lines": _LINES, "points": _POINTS}[geom.mode],
            material=self._materials.material(material, color, wireframe),
        )


def _arrays(geom: Geom) -> dict[str, NDArray[np.float32] | None]:
    second, tangents = geom.texcoords_1, geom.tangents
    return {
        "positions": vectors_to_gltf(geom.vertices).astype(np.float32),
        # without normals, pyrender lights what faces the camera, as we do where they are 0
        "normals": vectors_to_gltf(geom.normals).astype(np.float32) if geom.normals.any() else None,
        "tangents": None if tangents is None else _turned(tangents, vectors_to_gltf).astype(np.float32),
        "texcoord_0": geom.texcoords.astype(np.float32),
        "texcoord_1": None if second is None else second.astype(np.float32),
    }


def _turned(tangents: Float64, turn: Callable[[Float64], Float64]) -> Float64:
    """Return tangents with `turn` applied to their directions; a rotation keeps their handedness."""
    return np.column_stack([turn(tangents[:, :3]), tangents[:, 3]])


class MeshReader:
    """Makes Geoms from pyrender's meshes."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._geoms: dict[tuple[Any, ...], Geom] = {}
        self._of_primitives: dict[tuple[int, bool], Geom] = {}
        self._materials = MaterialReader(losses)

    def parts(self, mesh: Any, name: str, net: Float64) -> Iterable[tuple[Geom, Material, Any, bool]]:
        """Yield a Geom, a material, None and True for a wireframe, for each primitive.

        A primitive with instances yields one item for each instance, with its pyrender transform in place of
        None. `name` is for a mesh that has none; `net` goes from the mesh's space to world space.
        """
        name = mesh.name or name
        if mesh.weights is not None:
            self._losses.add("skins and morph weights are left out", name)
        for index, primitive in enumerate(mesh.primitives):
            part_name = f"{name}[{index}]" if len(mesh.primitives) > 1 else name
            material = self._materials.material(primitive.material, part_name)
            note_losses(primitive, part_name, self._losses)
            self._note_differences(primitive, material, part_name)
            asks_wireframe = bool(primitive.material.wireframe)
            for pose in (None,) if primitive.poses is None else primitive.poses:
                upper = net[:3, :3] if pose is None else pose[:3, :3].astype(np.float64) @ net[:3, :3]
                mirrored = bool(np.linalg.det(upper) < 0)
                key = (id(primitive), mirrored)
                if key not in self._of_primitives:
                    self._of_primitives[key] = self.geom(primitive, mirrored, part_name)
                geom = self._of_primitives[key]
                yield geom, material, pose, asks_wireframe and geom.mode == "triangles"

    def _note_differences(self, primitive: Any, material: Material, name: str) -> None:
        """Note what pyrender draws differently of a primitive that is in both libraries."""
        if primitive.color_0 is not None and tints_emission(primitive.color_0, material):
            self._losses.add(_TINTED_EMISSION, name)
        tangents = primitive.tangents
        if tangents is not None and _are_tangents(tangents) and material.normal_texture is not None:
            self._losses.add(_OWN_TANGENTS, name)

    def geom(self, primitive: Any, mirrored: bool, name: str, facing: bool = False) -> Geom:
        """Return a primitive as a Geom; triangles are reversed if `mirrored`.

        With `facing`, triangles without normals are lit as if they faced the camera; else they get smooth
        normals.
        """
        mode, indices = corners_of(primitive)
        solid = mode == "triangles"
        if mirrored and solid:
            indices = indices[:, ::-1]
        colors, tangents = primitive.color_0, primitive.tangents
        # Equal arrays are one Geom under whatever material; pyrender copies indices and colours.
        texcoords = primitive.texcoord_0, primitive.texcoord_1
        shared = (primitive.positions, primitive.normals, tangents, *texcoords)
        key = (*map(id, shared), mode, indices.tobytes(), None if colors is None else colors.tobytes())
        if key not in self._geoms:
            if tangents is not None:
                tangents = _turned(tangents, vectors_from_gltf) if _are_tangents(tangents) else None
            usable = usable_attributes(primitive, indices, name, self._losses)
            normals = None if usable.normals is None else vectors_from_gltf(usable.normals)
            if normals is None and facing:
                normals = np.zeros((len(primitive.positions), 3))
            self._geoms[key] = Geom(
                vectors_from_gltf(usable.positions),
                usable.corners,
                normals=normals,
                texcoords=usable.texcoords,
                colors=usable.colors,
                name=name,
                texcoords_1=usable.texcoords_1,
                tangents=tangents if solid else None,
                mode=mode,
            )
        return self._geoms[key]


def note_losses(primitive: Any, name: str, losses: Losses) -> None:
    """Note what a Geom of a primitive that shall not look as in pyrender lacks, or has in its place."""
    for attribute in _UNREAD_ATTRIBUTES:
        if getattr(primitive, attribute) is not None:
            losses.add(f"{attribute} of meshes are left out", name)
    if primitive.normals is None and primitive.mode in (_LIST, _STRIP, _FAN):
        losses.add(_NO_NORMALS, name)
    if primitive.tangents is not None and not _are_tangents(primitive.tangents):
        losses.add(_WRONG_TANGENTS, name)


def corners_of(primitive: Any) -> tuple[GeomMode, Int64]:
    """Return the mode of a primitive's Geom, and its indices by corners, shape (m, 3), (m, 2) or (m, 1)."""
    given = primitive.indices
    indices = np.arange(len(primitive.positions)) if given is None else np.asarray(given).ravel()
    indices = indices.astype(np.int64)
    if primitive.mode == _POINTS:
        return "points", indices[:, None]
    if primitive.mode == _LINES:
        return "lines", indices[: len(indices) // 2 * 2].reshape(-1, 2)
    if primitive.mode in (_LINE_LOOP, _LINE_STRIP):
        closed = np.append(indices, indices[:1]) if primitive.mode == _LINE_LOOP else indices
        return "lines", np.stack([closed[:-1], closed[1:]], axis=1)
    return "triangles", _triangles(primitive, indices)


def _triangles(primitive: Any, indices: Int64) -> Int64:
    """Return the triangles of a list, a strip or a fan, shape (m, 3)."""
    if primitive.mode == _LIST:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    # each vertex makes a triangle with the one before it, and the one before that or the first of all
    first = indices[:-2] if primitive.mode == _STRIP else np.full_like(indices[2:], indices[:1])
    triangles = np.stack([first, indices[1:-1], indices[2:]], axis=1)
    if primitive.mode == _STRIP:
        triangles[1::2] = triangles[1::2, [1, 0, 2]]
    return triangles


def _are_tangents(tangents: NDArray[np.float32]) -> bool:
    """Return True if each tangent, shape (n, 4), has 1 or -1 as its fourth number."""
    return bool((np.abs(tangents[:, 3]) == 1.0).all())
