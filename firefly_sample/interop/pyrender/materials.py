"""Convert materials to pyrender's MetallicRoughnessMaterial and back.

A metallic-roughness material keeps its metalness and roughness and all its textures. A Phong material becomes
a matt one, of metalness 0 and roughness 1, without its highlight (specular, shininess). It comes back as a
metallic-roughness material: pyrender draws a highlight of 4 % on every such surface, and no attribute of it
says that it was a Phong material.

pyrender's shader (mesh.frag) differs from glTF 2.0 in what it does with a material: see docs/pyrender.md. A
loss names each difference that depends on the material.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.interop.pyrender.glossiness import read_glossiness
from firefly_sample.interop.pyrender.textures import Keep, TextureReader, pyrender_texture
from firefly_sample.losses import Losses
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import AlphaMode, Material
from firefly_sample.scene.node import Color
from firefly_sample.scene.texture import Texture

_ALPHA_MODES: dict[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}

_NO_HIGHLIGHTS = "highlights (specular, shininess) are left out of pyrender's matt materials"
_NO_AMBIENT = "ambient colours of materials, which pyrender lacks, are left out"
_LIT = "pyrender has no unlit materials and lights them"
_NO_SCALE = "scales of normal maps, which pyrender lacks, become 1"
_NO_SECOND = "pyrender has no second texture that multiplies the first and leaves it out"
_OCCLUSION = "pyrender's occlusion darkens all light by its full strength, and ours ambient light alone"
_CUT_OUT = "pyrender ignores the alpha cut-off of materials and draws their surfaces whole"
_SQUARED_EMISSION = "pyrender draws the square of emission"


class MaterialWriter:
    """Makes pyrender's materials."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._texture = cache(pyrender_texture)
        self._material = cache(self._new_material)

    def material(self, material: Material, color: Color | None, wireframe: bool) -> Any:
        """Return a material as a pyrender Material; `color` multiplies its base colour."""
        return self._material(material, color, wireframe)

    def _new_material(self, material: Material, color: Color | None, wireframe: bool) -> Any:
        import pyrender

        if material.specular.any():
            self._losses.add(_NO_HIGHLIGHTS, material.name)
        if material.ambient is not None:
            self._losses.add(_NO_AMBIENT, material.name)
        if material.unlit:
            self._losses.add(_LIT, material.name)
        if material.normal_texture is not None and material.normal_scale != 1.0:
            self._losses.add(_NO_SCALE, material.name)
        if material.modulate_texture is not None:
            self._losses.add(_NO_SECOND, material.name)
        _note_differences(material, self._losses)
        matt = material.metallic is None
        return pyrender.MetallicRoughnessMaterial(
            name=material.name,
            baseColorFactor=material.base_color * (1.0 if color is None else np.array(color)),
            baseColorTexture=self._image(material.texture),
            alphaMode=material.alpha_mode.upper(),
            alphaCutoff=material.alpha_cutoff,
            doubleSided=bool(material.double_sided),
            wireframe=wireframe,
            emissiveFactor=material.emission,
            emissiveTexture=self._image(material.emission_texture),
            metallicFactor=0.0 if matt else material.metallic,
            roughnessFactor=1.0 if matt else material.roughness,
            metallicRoughnessTexture=self._image(material.metallic_roughness_texture, True),
            normalTexture=self._image(material.normal_texture),
            occlusionTexture=self._image(material.occlusion_texture),
        )

    def _image(self, texture: Texture | None, metallic_roughness: bool = False) -> Any:
        return None if texture is None else self._texture(texture, metallic_roughness)


class MaterialReader:
    """Makes materials from pyrender's.

    `keep` keeps their textures: see `TextureReader`. With `compare`, note what pyrender draws differently.
    """

    def __init__(self, losses: Losses, keep: Keep | None = None, *, compare: bool = True) -> None:
        self._losses, self._compare = losses, compare
        self._textures = TextureReader(losses, keep)
        self._materials: dict[int, Material] = {}

    def material(self, source: Any, part_name: str) -> Material:
        """Return a pyrender Material as a material; one without a name is named after its part."""
        if id(source) not in self._materials:
            name = source.name or f"material of {part_name}"
            self._materials[id(source)] = self._new_material(source, name)
        return self._materials[id(source)]

    def _new_material(self, source: Any, name: str) -> Material:
        glow = self._textures.texture(source.emissiveTexture, name)
        black = source.emissiveTexture is not None and glow is None  # as pyrender draws it
        material = Material(
            name,
            **self._reflection(source, name),
            alpha_mode=_ALPHA_MODES[source.alphaMode],
            alpha_cutoff=source.alphaCutoff,
            double_sided=source.doubleSided,
            emission=np.zeros(3) if black else source.emissiveFactor.astype(np.float64),
            emission_texture=glow,
            normal_texture=self._textures.texture(source.normalTexture, name),
            occlusion_texture=self._textures.texture(source.occlusionTexture, name),
        )
        if self._compare:
            _note_differences(material, self._losses)
        return material

    def _reflection(self, source: Any, name: str) -> dict[str, Any]:
        """Return the keywords of a `Material` that depend on the class of pyrender's."""
        import pyrender

        if isinstance(source, pyrender.MetallicRoughnessMaterial):
            return {
                "base_color": source.baseColorFactor,
                "texture": self._textures.texture(source.baseColorTexture, name),
                "metallic": source.metallicFactor,
                "roughness": source.roughnessFactor,
                "metallic_roughness_texture": self._textures.texture(
                    source.metallicRoughnessTexture, name, metallic_roughness=True
                ),
            }
        if isinstance(source, pyrender.material.SpecularGlossinessMaterial):
            return read_glossiness(source, name, self._textures, self._losses)
        self._losses.add(f"colours of {type(source).__name__} are left out, materials become white", name)
        return {}


def _note_differences(material: Material, losses: Losses) -> None:
    """Note what pyrender draws differently of a material that is in both libraries."""
    if _cuts_out(material):
        losses.add(_CUT_OUT, material.name)
    if emits(material) and (material.emission != material.emission**2).any():
        losses.add(_SQUARED_EMISSION, material.name)
    occlusion = material.occlusion_texture
    if occlusion is not None and (occlusion.pixels[..., 0] != 255).any():
        losses.add(_OCCLUSION, material.name)


def tints_emission(colors: NDArray[Any], material: Material) -> bool:
    """Return True if vertex colours, multiplied with a material's emission, change it."""
    return emits(material) and bool((colors[:, :3] != 1.0).any())


def emits(material: Material) -> bool:
    """Return True if a material's emission and its texture are not black."""
    texture = material.emission_texture
    return bool(material.emission.any() and (texture is None or texture.pixels[..., :3].any()))


def has_second_texcoords(geom: Geom, material: Material) -> bool:
    """Return True if a material's look depends on a Geom's second texture coordinates."""
    if geom.texcoords_1 is None or not (geom.texcoords_1 != geom.texcoords).any():
        return False
    slots = (
        (material.emission_texture if emits(material) else None, material.emission_texcoord),
        (material.metallic_roughness_texture, material.metallic_roughness_texcoord),
        (material.normal_texture, material.normal_texcoord),
        (material.occlusion_texture, material.occlusion_texcoord),
    )
    return any(texture is not None and texcoord == 1 for texture, texcoord in slots)


def _cuts_out(material: Material) -> bool:
    """Return True for a "mask" with some alpha below its cut-off."""
    alpha = 1.0 if material.texture is None else material.texture.least_alpha()
    return material.alpha_mode == "mask" and bool(material.base_color[3] * alpha < material.alpha_cutoff)
