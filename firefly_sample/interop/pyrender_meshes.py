"""Geoms and materials, and pyrender's meshes, each made once and shared as it was.

pyrender keeps vertices, normals, texture coordinates and colours as float32. It does not turn the winding of
triangles under a transform that mirrors, as glTF and this package do, but draws the wrong side: the triangles
of mirrored instances are turned on the way there and on the way back.

Materials are metallic-roughness ones of metalness 0 and roughness 1. A Phong highlight (specular, shininess)
has no equal among them and is left out, as is, on the way back, what is metallic or glossy.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError
from firefly_sample.interop.losses import Losses
from firefly_sample.scene.axes import vectors_from_gltf, vectors_to_gltf
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import AlphaMode, Material, Texture
from firefly_sample.scene.node import Color

__all__ = ["MeshReader", "MeshWriter", "Part"]

_LARGEST_INDEX = 2**24
"""pyrender keeps indices as float32, which tells whole numbers apart up to here."""

_ALPHA_MODES: dict[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}
_UNREAD_ATTRIBUTES = ("tangents", "texcoord_1", "joints_0", "weights_0", "targets")
_UNREAD_TEXTURES = ("normalTexture", "occlusionTexture", "emissiveTexture", "metallicRoughnessTexture")


class MeshWriter:
    """Makes pyrender's meshes."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._arrays: dict[int, dict[str, Any]] = {}
        self._textures: dict[int, Any] = {}
        self._materials: dict[tuple[int, Color | None], Any] = {}
        self._meshes: dict[tuple[Any, ...], Any] = {}

    def mesh(
        self, node: GeomNode, material: Material | None, color: Color | None, mirrored: bool, visible: bool
    ) -> Any:
        """A pyrender Mesh of a node's Geoms, the same for nodes that look the same; None without vertices.

        Parameters
        ----------
        node : GeomNode
        material : Material or None
            Replaces those of the Geoms.
        color : (r, g, b, a) or None
            Multiplies base colours and replaces vertex colours.
        mirrored : bool
            Whether its net transform mirrors.
        visible : bool

        Raises
        ------
        SceneError
            If a Geom has more than 2^24 vertices.
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

        if len(geom.vertices) > _LARGEST_INDEX:
            raise SceneError(
                f"geom {geom.name!r}: {len(geom.vertices)} vertices, and pyrender keeps indices as float32: "
                f"split it into parts of {_LARGEST_INDEX} at most"
            )
        if id(geom) not in self._arrays:
            self._arrays[id(geom)] = {
                "positions": vectors_to_gltf(geom.vertices).astype(np.float32),
                "normals": vectors_to_gltf(geom.normals).astype(np.float32),
                "texcoord_0": geom.texcoords.astype(np.float32),
            }
        return pyrender.Primitive(
            **self._arrays[id(geom)],
            color_0=_vertex_colors(geom) if color is None else None,
            indices=geom.triangles[:, ::-1] if mirrored else geom.triangles,
            material=self._material(material, color),
        )

    def _material(self, material: Material, color: Color | None) -> Any:
        import pyrender

        key = (id(material), color)
        if key not in self._materials:
            self._note_losses(material)
            self._materials[key] = pyrender.MetallicRoughnessMaterial(
                name=material.name,
                baseColorFactor=material.base_color * (1.0 if color is None else np.array(color)),
                baseColorTexture=self._texture(material.texture),
                alphaMode=material.alpha_mode.upper(),
                alphaCutoff=material.alpha_cutoff,
                doubleSided=bool(material.double_sided),
                emissiveFactor=material.emission,
                metallicFactor=0.0,
                roughnessFactor=1.0,
            )
        return self._materials[key]

    def _note_losses(self, material: Material) -> None:
        for what, there in (
            (
                "highlights (specular, shininess) are left out of pyrender's matt materials",
                material.specular.any(),
            ),
            (
                "ambient colours of materials, which pyrender lacks, are left out",
                material.ambient is not None,
            ),
            ("pyrender draws whole what its alpha should cut out", material.alpha_mode == "mask"),
            (
                "pyrender draws the square of emission",
                (material.emission != material.emission**2).any(),
            ),
        ):
            if there:
                self._losses.add(what, material.name)

    def _texture(self, texture: Texture | None) -> Any:
        import pyrender

        if texture is None:
            return None
        if id(texture) not in self._textures:
            self._textures[id(texture)] = pyrender.Texture(
                name=texture.name, source=texture.pixels, source_channels="RGBA"
            )
        return self._textures[id(texture)]


class Part(NamedTuple):
    """A Geom of a mesh with its material, and the pyrender transforms of its instances if it has any."""

    geom: Geom
    material: Material
    pose: Any


class MeshReader:
    """Makes Geoms and materials of pyrender's meshes."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._geoms: dict[tuple[Any, ...], Geom] = {}
        self._of_primitives: dict[tuple[int, bool], Geom] = {}
        self._materials: dict[int, Material] = {}
        self._textures: dict[int, Texture] = {}

    def parts(self, mesh: Any, name: str, net: NDArray[np.float64]) -> Iterable[Part]:
        """A Part for each primitive of triangles, or for each of its instances if it has such.

        Parameters
        ----------
        mesh : pyrender.Mesh
        name : str
            What to call it if it has no name.
        net : ndarray of float64, shape (4, 4)
            From the mesh's space to the world's.

        Raises
        ------
        SceneError
            If an index, a coordinate or a colour is out of its range.
        """
        import pyrender

        name = mesh.name or name
        several = len(mesh.primitives) > 1
        for index, primitive in enumerate(mesh.primitives):
            called = f"{name}[{index}]" if several else name
            if primitive.mode != pyrender.GLTF.TRIANGLES:
                self._losses.add("points, lines, strips and fans are left out", called)
                continue
            for attribute in _UNREAD_ATTRIBUTES:
                if getattr(primitive, attribute) is not None:
                    self._losses.add(f"{attribute} of meshes are left out", called)
            material = self._material(primitive.material)
            for pose in (None,) if primitive.poses is None else primitive.poses:
                upper = net[:3, :3] if pose is None else pose[:3, :3].astype(np.float64) @ net[:3, :3]
                mirrored = bool(np.linalg.det(upper) < 0)
                key = (id(primitive), mirrored)
                if key not in self._of_primitives:
                    self._of_primitives[key] = self._geom(primitive, mirrored, called)
                yield Part(self._of_primitives[key], material, pose)

    def _geom(self, primitive: Any, mirrored: bool, name: str) -> Geom:
        count = len(primitive.positions)
        indices = np.arange(count) if primitive.indices is None else np.asarray(primitive.indices).ravel()
        triangles = indices[: len(indices) // 3 * 3].astype(np.int64).reshape(-1, 3)
        if mirrored:
            triangles = triangles[:, ::-1]
        colors = primitive.color_0
        # The same arrays are the same Geom under whatever material; pyrender copies indices and colours.
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

    def _material(self, source: Any) -> Material:
        import pyrender

        if id(source) not in self._materials:
            name = source.name or "material"
            color, texture = np.ones(4), None
            if isinstance(source, pyrender.MetallicRoughnessMaterial):
                color, texture = source.baseColorFactor, self._texture(source.baseColorTexture, name)
                if source.metallicFactor != 0.0 or source.roughnessFactor != 1.0:
                    self._losses.add("metalness and gloss are left out, materials made matt", name)
            else:
                self._losses.add(
                    f"colours of {type(source).__name__} are left out, materials made white", name
                )
            for attribute in _UNREAD_TEXTURES:
                if getattr(source, attribute, None) is not None:
                    self._losses.add(f"{attribute} of materials is left out", name)
            if source.wireframe:
                self._losses.add("wireframes are left out, materials made solid", name)
            self._materials[id(source)] = Material(
                name,
                color,
                texture,
                _ALPHA_MODES[source.alphaMode],
                source.alphaCutoff,
                source.doubleSided,
                emission=source.emissiveFactor,
            )
        return self._materials[id(source)]

    def _texture(self, source: Any, name: str) -> Texture | None:
        import pyrender

        if source is None:
            return None
        name = source.name or name
        pixels = source.source
        if pixels is None or pixels.ndim != 3 or pixels.shape[2] < 3:
            self._losses.add("textures without red, green and blue are left out", name)
            return None
        if id(source) not in self._textures:
            gltf, sampler = pyrender.GLTF, source.sampler
            if (
                (sampler.wrapS, sampler.wrapT) != (gltf.REPEAT, gltf.REPEAT)
                or sampler.magFilter not in (None, gltf.LINEAR)
                or sampler.minFilter not in (None, gltf.LINEAR_MIPMAP_LINEAR)
            ):
                self._losses.add("samplers are left out, all textures repeat and are filtered", name)
            if pixels.shape[2] == 3:
                pixels = np.dstack([pixels, np.full(pixels.shape[:2], 255, dtype=np.uint8)])
            self._textures[id(source)] = Texture(pixels, name)
        return self._textures[id(source)]


def _vertex_colors(geom: Geom) -> Any:
    """Vertex colours with their alpha, if it has any."""
    if geom.colors is None or geom.alphas is None:
        return geom.colors
    return np.column_stack([geom.colors, geom.alphas])
