"""Convert materials and textures to pyrender's and back, each once, so that they stay shared.

Materials become metallic-roughness ones of metalness 0 and roughness 1. A Phong highlight (specular,
shininess) has no equal among them and is left out, as are, on the way back, metalness, gloss and bumps.
Emission is a plain factor here: an emissive texture becomes its mean colour in linear light.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.interop.losses import Losses
from firefly_sample.scene.material import AlphaMode, Material, Texture
from firefly_sample.scene.node import Color
from firefly_sample.srgb import srgb_to_linear

Float64 = NDArray[np.float64]

_CUT_OUT = "pyrender ignores the alpha cut-off of materials and draws their surfaces whole"
_SQUARED_EMISSION = "pyrender draws the square of emission"
_NO_GLOSS = "metalness and gloss are left out, materials become matt"

_ALPHA_MODES: dict[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}
_UNREAD_TEXTURES = (
    "normalTexture",
    "occlusionTexture",
    "metallicRoughnessTexture",
    "specularGlossinessTexture",
)

_BYTES = (0x0DE1, 0x1401)
"""OpenGL's numbers for a texture of two dimensions and for unsigned bytes."""


def _cuts_out(material: Material) -> bool:
    """Return True for a "mask" with some alpha below its cut-off."""
    alpha = 1.0 if material.texture is None else material.texture.least_alpha()
    return material.alpha_mode == "mask" and bool(material.base_color[3] * alpha < material.alpha_cutoff)


class MaterialWriter:
    """Makes pyrender's materials."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._materials: dict[tuple[int, Color | None], Any] = {}
        self._textures: dict[int, Any] = {}

    def material(self, material: Material, color: Color | None) -> Any:
        """Return a material as a pyrender Material; `color` multiplies its base colour."""
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
        if material.specular.any():
            self._losses.add(
                "highlights (specular, shininess) are left out of pyrender's matt materials", material.name
            )
        if material.ambient is not None:
            self._losses.add(
                "ambient colours of materials, which pyrender lacks, are left out", material.name
            )
        if _cuts_out(material):
            self._losses.add(_CUT_OUT, material.name)
        if (material.emission != material.emission**2).any():
            self._losses.add(_SQUARED_EMISSION, material.name)

    def _texture(self, texture: Texture | None) -> Any:
        import pyrender

        if texture is None:
            return None
        if id(texture) not in self._textures:
            self._textures[id(texture)] = pyrender.Texture(
                name=texture.name, source=texture.pixels, source_channels="RGBA"
            )
        return self._textures[id(texture)]


class MaterialReader:
    """Makes materials from pyrender's."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._materials: dict[int, Material] = {}
        self._textures: dict[int, Texture | None] = {}

    def material(self, source: Any, mesh: str) -> Material:
        """Return a pyrender Material as a material; one without a name is named after its mesh.

        Raises
        ------
        SceneError
            If a factor is out of its range.
        """
        if id(source) not in self._materials:
            self._materials[id(source)] = self._material(source, source.name or f"material of {mesh}")
        return self._materials[id(source)]

    def _material(self, source: Any, name: str) -> Material:
        color, image = self._base_color(source, name)
        texture = self._texture(image, name)
        for attribute in _UNREAD_TEXTURES:
            if getattr(source, attribute, None) is not None:
                self._losses.add(f"{attribute} of materials is left out", name)
        if source.wireframe:
            self._losses.add("wireframes are left out, materials become solid", name)
        material = Material(
            name,
            color,
            texture,
            _ALPHA_MODES[source.alphaMode],
            source.alphaCutoff,
            source.doubleSided,
            emission=self._emission(source, name),
        )
        if _cuts_out(material):
            self._losses.add(_CUT_OUT, name)
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

    def _emission(self, source: Any, name: str) -> Float64:
        """Return a material's factor times its texture's mean."""
        emission = np.asarray(source.emissiveFactor, dtype=np.float64)
        if source.emissiveTexture is not None and emission.any():
            pixels = self._pixels(source.emissiveTexture, name)
            if pixels is None:
                return np.zeros(3)
            if (pixels[..., :3] != pixels[0, 0, :3]).any():
                self._losses.add("emissive textures become their mean colour", name)
            emission = emission * srgb_to_linear(pixels[..., :3] / 255.0).mean(axis=(0, 1))
        if (emission * (1.0 - source.emissiveFactor)).any():
            self._losses.add(_SQUARED_EMISSION, name)
        return emission

    def _texture(self, source: Any, name: str) -> Texture | None:
        if source is None:
            return None
        if id(source) not in self._textures:
            name = source.name or name
            pixels = self._pixels(source, name)
            self._textures[id(source)] = None if pixels is None else Texture(pixels, name)
            if pixels is not None and not _is_plain(source.sampler):
                self._losses.add("samplers are left out, all textures repeat and are filtered", name)
        return self._textures[id(source)]

    def _pixels(self, source: Any, name: str) -> NDArray[np.uint8] | None:
        """Return a pyrender Texture's image with four channels; missing ones are 0, and alpha 255."""
        image = source.source
        kind = source.tex_type, source.data_format
        if image is None or image.ndim < 2 or kind != _BYTES:
            self._losses.add("textures without a plain image of bytes are left out", name)
            return None
        image = image.reshape(*image.shape[:2], -1)
        pixels = np.zeros((*image.shape[:2], 4), dtype=np.uint8)
        pixels[..., 3] = 255
        pixels[..., : image.shape[2]] = image
        return pixels


def _is_plain(sampler: Any) -> bool:
    """Return True if a pyrender Sampler repeats and filters as all textures do here."""
    import pyrender

    gltf = pyrender.GLTF
    return (
        (sampler.wrapS, sampler.wrapT) == (gltf.REPEAT, gltf.REPEAT)
        and sampler.magFilter in (None, gltf.LINEAR)
        and sampler.minFilter in (None, gltf.LINEAR_MIPMAP_LINEAR)
    )
