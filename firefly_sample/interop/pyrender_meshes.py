"""Convert Geoms, materials and textures to pyrender's and back, each once, so that they stay shared.

pyrender keeps vertices, normals, texture coordinates and colours as float32. Under a transform that mirrors,
glTF and this package reverse the winding of triangles; pyrender does not and draws the wrong side. Therefore
the triangles of mirrored instances are reversed, in both directions of the conversion.

Materials become metallic-roughness ones of metalness 0 and roughness 1, without their Phong highlight
(specular, shininess). pyrender's materials lose metalness, gloss and bumps. Textures of base colour and
emission keep their samplers.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError
from firefly_sample.interop.pyrender_textures import pyrender_texture, sampling_options
from firefly_sample.losses import Losses
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import AlphaMode, Material, Texture
from firefly_sample.scene.node import Color
from firefly_sample.scene.transforms import vectors_from_gltf, vectors_to_gltf

Float64 = NDArray[np.float64]
Int64 = NDArray[np.int64]

LARGEST_INDEX = 2**24
"""pyrender keeps indices as float32, in which whole numbers are exact up to here."""

_LIST, _STRIP, _FAN = 4, 5, 6
"""glTF's modes of triangles."""
_BYTES = (0x0DE1, 0x1401)
"""OpenGL's numbers for a texture of two dimensions and for unsigned bytes."""
_ALPHA_MODES: dict[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}

_UNREAD_ATTRIBUTES = ("tangents", "joints_0", "weights_0", "targets")
_UNREAD_TEXTURES = (
    "normalTexture",
    "occlusionTexture",
    "metallicRoughnessTexture",
    "specularGlossinessTexture",
)
_NO_HIGHLIGHTS = "highlights (specular, shininess) are left out of pyrender's matt materials"
_NO_AMBIENT = "ambient colours of materials, which pyrender lacks, are left out"
_NO_NORMALS = "meshes without normals, which pyrender lights as if they faced the camera, get smooth ones"
_CUT_OUT = "pyrender ignores the alpha cut-off of materials and draws their surfaces whole"
_SQUARED_EMISSION = "pyrender draws the square of emission"
_TINTED_EMISSION = "pyrender multiplies emission by vertex colours, this package does not"
_FIRST_TEXCOORDS = "pyrender samples emission at the first texture coordinates"
_OTHER_SAMPLERS = "wrap modes and filters that glTF lacks become those of plain textures"
_NO_GLOSS = "metalness and gloss are left out, materials become matt"


class MeshWriter:
    """Makes pyrender's meshes and materials."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._mesh, self._material = cache(self._new_mesh), cache(self._new_material)
        self._arrays, self._texture = cache(_arrays), cache(pyrender_texture)

    def mesh(
        self, node: GeomNode, material: Material | None, color: Color | None, mirrored: bool, visible: bool
    ) -> Any:
        """Return a pyrender Mesh of a node's Geoms, shared by nodes that look alike; None without vertices.

        A material replaces those of the Geoms; a colour multiplies base colours and replaces vertex colours.
        `mirrored` is True if the node's net transform mirrors.
        """
        for geom, _ in node.geoms:
            if not len(geom.vertices):
                self._losses.add("geometry without vertices is left out", f"{node.name}/{geom.name}")
        parts = tuple(
            (geom, own if material is None else material) for geom, own in node.geoms if len(geom.vertices)
        )
        return self._mesh(parts, color, mirrored, visible) if parts else None

    def _new_mesh(
        self, parts: tuple[tuple[Geom, Material], ...], color: Color | None, mirrored: bool, visible: bool
    ) -> Any:
        import pyrender

        primitives = [self._primitive(geom, look, color, mirrored) for geom, look in parts]
        return pyrender.Mesh(primitives, name=parts[0][0].name, is_visible=visible)

    def _primitive(self, geom: Geom, material: Material, color: Color | None, mirrored: bool) -> Any:
        import pyrender

        if len(geom.vertices) > LARGEST_INDEX:
            raise SceneError(
                f"geom {geom.name!r}: {len(geom.vertices)} vertices, and pyrender keeps indices as float32: "
                f"split it into parts of {LARGEST_INDEX} at most"
            )
        colors = geom.colors if color is None else None
        if colors is not None and _tints_emission(colors, material):
            self._losses.add(_TINTED_EMISSION, geom.name)
        if _has_second_texcoords(geom, material):
            self._losses.add(_FIRST_TEXCOORDS, geom.name)
        if colors is not None and geom.alphas is not None:
            colors = np.column_stack([colors, geom.alphas])
        return pyrender.Primitive(
            **self._arrays(geom),
            color_0=colors,
            indices=geom.triangles[:, ::-1] if mirrored else geom.triangles,
            material=self._material(material, color),
        )

    def _new_material(self, material: Material, color: Color | None) -> Any:
        """Return a material as a pyrender Material; `color` multiplies its base colour."""
        import pyrender

        if material.specular.any():
            self._losses.add(_NO_HIGHLIGHTS, material.name)
        if material.ambient is not None:
            self._losses.add(_NO_AMBIENT, material.name)
        if _cuts_out(material):
            self._losses.add(_CUT_OUT, material.name)
        if _squares_emission(material):
            self._losses.add(_SQUARED_EMISSION, material.name)
        return pyrender.MetallicRoughnessMaterial(
            name=material.name,
            baseColorFactor=material.base_color * (1.0 if color is None else np.array(color)),
            baseColorTexture=self._image(material.texture),
            alphaMode=material.alpha_mode.upper(),
            alphaCutoff=material.alpha_cutoff,
            doubleSided=bool(material.double_sided),
            emissiveFactor=material.emission,
            emissiveTexture=self._image(material.emission_texture),
            metallicFactor=0.0,
            roughnessFactor=1.0,
        )

    def _image(self, texture: Texture | None) -> Any:
        return None if texture is None else self._texture(texture)


def _arrays(geom: Geom) -> dict[str, NDArray[np.float32] | None]:
    second = geom.texcoords_1
    return {
        "positions": vectors_to_gltf(geom.vertices).astype(np.float32),
        "normals": vectors_to_gltf(geom.normals).astype(np.float32),
        "texcoord_0": geom.texcoords.astype(np.float32),
        "texcoord_1": None if second is None else second.astype(np.float32),
    }


class MeshReader:
    """Makes Geoms, materials and textures from pyrender's meshes."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._geoms: dict[tuple[Any, ...], Geom] = {}
        self._of_primitives: dict[tuple[int, bool], Geom] = {}
        self._materials: dict[int, Material] = {}
        self._textures: dict[int, Texture | None] = {}

    def parts(self, mesh: Any, name: str, net: Float64) -> Iterable[tuple[Geom, Material, Any]]:
        """Yield a Geom, a material and None for each primitive of triangles.

        A primitive with instances yields one item for each instance, with its pyrender transform in place of
        None. `name` is for a mesh that has none; `net` goes from the mesh's space to world space.
        """
        name = mesh.name or name
        if mesh.weights is not None:
            self._losses.add("skins and morph weights are left out", name)
        for index, primitive in enumerate(mesh.primitives):
            part_name = f"{name}[{index}]" if len(mesh.primitives) > 1 else name
            if primitive.mode not in (_LIST, _STRIP, _FAN):
                self._losses.add("points and lines are left out", part_name)
                continue
            material = self._material(primitive.material, part_name)
            self._note_losses(primitive, material, part_name)
            for pose in (None,) if primitive.poses is None else primitive.poses:
                upper = net[:3, :3] if pose is None else pose[:3, :3].astype(np.float64) @ net[:3, :3]
                mirrored = bool(np.linalg.det(upper) < 0)
                key = (id(primitive), mirrored)
                if key not in self._of_primitives:
                    self._of_primitives[key] = self._geom(primitive, mirrored, part_name)
                yield self._of_primitives[key], material, pose

    def _note_losses(self, primitive: Any, material: Material, name: str) -> None:
        for attribute in _UNREAD_ATTRIBUTES:
            if getattr(primitive, attribute) is not None:
                self._losses.add(f"{attribute} of meshes are left out", name)
        if primitive.normals is None:
            self._losses.add(_NO_NORMALS, name)
        if primitive.color_0 is not None and _tints_emission(primitive.color_0, material):
            self._losses.add(_TINTED_EMISSION, name)

    def _geom(self, primitive: Any, mirrored: bool, name: str) -> Geom:
        triangles = _triangles(primitive)
        if mirrored:
            triangles = triangles[:, ::-1]
        colors = primitive.color_0
        # Equal arrays are one Geom under whatever material; pyrender copies indices and colours.
        shared = (primitive.positions, primitive.normals, primitive.texcoord_0, primitive.texcoord_1)
        key = (*map(id, shared), triangles.tobytes(), None if colors is None else colors.tobytes())
        if key not in self._geoms:
            self._geoms[key] = Geom(
                vectors_from_gltf(primitive.positions),
                triangles,
                normals=None if primitive.normals is None else vectors_from_gltf(primitive.normals),
                texcoords=primitive.texcoord_0,
                colors=colors,
                name=name,
                texcoords_1=primitive.texcoord_1,
            )
        return self._geoms[key]

    def _material(self, source: Any, part_name: str) -> Material:
        """Return a pyrender Material as a material; one without a name is named after its part."""
        if id(source) in self._materials:
            return self._materials[id(source)]
        name = source.name or f"material of {part_name}"
        color, image = self._base_color(source, name)
        texture = None if image is None else self._texture(image, image.name or name)
        for attribute in _UNREAD_TEXTURES:
            if getattr(source, attribute, None) is not None:
                self._losses.add(f"{attribute} of materials is left out", name)
        if source.wireframe:
            self._losses.add("wireframes are left out, materials become solid", name)
        emission, glow = self._emission(source, name)
        material = Material(
            name,
            color,
            texture,
            _ALPHA_MODES[source.alphaMode],
            source.alphaCutoff,
            source.doubleSided,
            emission=emission,
            emission_texture=glow,
        )
        if _cuts_out(material):
            self._losses.add(_CUT_OUT, name)
        if _squares_emission(material):
            self._losses.add(_SQUARED_EMISSION, name)
        self._materials[id(source)] = material
        return material

    def _base_color(self, source: Any, name: str) -> tuple[Any, Any]:
        """Return a material's factor and pyrender Texture of diffuse colour."""
        import pyrender

        if isinstance(source, pyrender.MetallicRoughnessMaterial):
            if source.metallicFactor != 0.0 or source.roughnessFactor != 1.0:
                self._losses.add(_NO_GLOSS, name)
            return source.baseColorFactor, source.baseColorTexture
        if isinstance(source, pyrender.material.SpecularGlossinessMaterial):
            self._losses.add(_NO_GLOSS, name)
            return source.diffuseFactor, source.diffuseTexture
        self._losses.add(f"colours of {type(source).__name__} are left out, materials become white", name)
        return np.ones(4), None

    def _emission(self, source: Any, name: str) -> tuple[Float64, Texture | None]:
        """Return a material's factor and texture of emission; an image that cannot be read is black."""
        image = source.emissiveTexture
        texture = None if image is None else self._texture(image, image.name or name)
        black = image is not None and texture is None
        return np.zeros(3) if black else np.asarray(source.emissiveFactor, dtype=np.float64), texture

    def _texture(self, source: Any, name: str) -> Texture | None:
        if id(source) not in self._textures:
            pixels, texture = self._pixels(source, name), None
            if pixels is not None:
                options, whole = sampling_options(source.sampler)
                texture = Texture(pixels, name, **options)
                if not whole:
                    self._losses.add(_OTHER_SAMPLERS, name)
            self._textures[id(source)] = texture
        return self._textures[id(source)]

    def _pixels(self, source: Any, name: str) -> NDArray[np.uint8] | None:
        """Return a pyrender Texture's image with four channels; missing ones are 0, and alpha 255."""
        image = source.source
        if image is None or image.ndim < 2 or (source.tex_type, source.data_format) != _BYTES:
            self._losses.add("textures without a plain image of bytes are left out", name)
            return None
        image = image.reshape(*image.shape[:2], -1)
        pixels = np.zeros((*image.shape[:2], 4), dtype=np.uint8)
        pixels[..., 3] = 255
        pixels[..., : image.shape[2]] = image
        return pixels


def _triangles(primitive: Any) -> Int64:
    """Return the triangles of a list, a strip or a fan, shape (m, 3)."""
    given = primitive.indices
    indices = np.arange(len(primitive.positions)) if given is None else np.asarray(given).ravel()
    indices = indices.astype(np.int64)
    if primitive.mode == _LIST:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    # each vertex makes a triangle with the one before it, and the one before that or the first of all
    first = indices[:-2] if primitive.mode == _STRIP else np.full_like(indices[2:], indices[:1])
    triangles = np.stack([first, indices[1:-1], indices[2:]], axis=1)
    if primitive.mode == _STRIP:
        triangles[1::2] = triangles[1::2, [1, 0, 2]]
    return triangles


def _tints_emission(colors: NDArray[Any], material: Material) -> bool:
    """Return True if vertex colours, multiplied with a material's emission, change it."""
    return _emits(material) and bool((colors[:, :3] != 1.0).any())


def _squares_emission(material: Material) -> bool:
    """Return True if the square of a material's emission is not the same."""
    return _emits(material) and bool((material.emission != material.emission**2).any())


def _emits(material: Material) -> bool:
    """Return True if a material's emission and its texture are not black."""
    texture = material.emission_texture
    return bool(material.emission.any() and (texture is None or texture.pixels[..., :3].any()))


def _cuts_out(material: Material) -> bool:
    """Return True for a "mask" with some alpha below its cut-off."""
    alpha = 1.0 if material.texture is None else material.texture.least_alpha()
    return material.alpha_mode == "mask" and bool(material.base_color[3] * alpha < material.alpha_cutoff)


def _has_second_texcoords(geom: Geom, material: Material) -> bool:
    """Return True if a material's emission depends on a Geom's second texture coordinates."""
    if material.emission_texture is None or material.emission_texcoord == 0 or geom.texcoords_1 is None:
        return False
    return _emits(material) and bool((geom.texcoords_1 != geom.texcoords).any())
