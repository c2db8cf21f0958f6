"""Materials of KHR_materials_pbrSpecularGlossiness, which become metallic-roughness ones.

Where a material has the extension, it stands instead of pbrMetallicRoughness, as the extension's text says.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import NamedTuple

from firefly_sample.losses import Losses
from firefly_sample.model.data import MaterialData
from firefly_sample.model.gltf.factors import Factors
from firefly_sample.model.gltf.json_object import JsonObject
from firefly_sample.model.gltf.textures import Slot, Textures, read_slot
from firefly_sample.scene.glossy_textures import GlossyMaterial, Image, to_metallic_material
from firefly_sample.scene.specular_glossiness import DIELECTRIC

_MEAN = "specular-glossiness textures that lie otherwise than diffuse ones become their mean, of materials"


class _Converted(NamedTuple):
    """A material's numbers, and the places of its textures."""

    base_color: tuple[float, float, float, float]
    metallic: float
    roughness: float
    texture: int | None
    metallic_roughness_texture: int | None
    losses: list[str]


class Glossiness:
    """Converts materials; those of equal factors and textures share the converted textures."""

    def __init__(self, textures: Textures, losses: Losses) -> None:
        self._textures, self._losses = textures, losses
        self._factors = Factors(losses)
        self._converted: dict[Hashable, _Converted] = {}

    def read(self, made: MaterialData, extension: JsonObject) -> Slot | None:
        """Set the colours, metalness and roughness of a material, and their textures.

        Returns the slot whose texture coordinates these textures have, None without any.
        """
        name, factors = made.name, self._factors
        color = factors.color(extension, "diffuseFactor", "diffuse colours", name)
        specular = factors.color(extension, "specularFactor", "specular colours", name, 3)[:3]
        glossiness = factors.number(extension, "glossinessFactor", "glossiness factors", name)
        diffuse, shine = (
            self._slot(extension, key, name) for key in ("diffuseTexture", "specularGlossinessTexture")
        )
        if shine is None and "specularGlossinessTexture" in extension:  # a mirror without it
            specular, glossiness = (DIELECTRIC, DIELECTRIC, DIELECTRIC), 0.0
        aligned = diffuse is None or shine is None or diffuse.shares_uv(shine)
        if not aligned:
            self._losses.add(_MEAN, name)
        slots = diffuse, shine
        textures = tuple(None if slot is None else slot.texture for slot in slots)
        key = (color, specular, glossiness, textures, aligned)
        if key not in self._converted:
            images = [
                None if slot is None else self._textures.decoded(slot, name) for slot in (diffuse, shine)
            ]
            if images[1] is not None and not aligned:
                r, g, b, a = images[1].mean()
                specular = specular[0] * r, specular[1] * g, specular[2] * b
                glossiness, images[1] = glossiness * a, None
            self._converted[key] = self._convert(GlossyMaterial(color, specular, glossiness, *images), name)
        found = self._converted[key]
        made.base_color, made.metallic, made.roughness = found[:3]
        made.texture, made.metallic_roughness_texture = found[3:5]
        for loss in found.losses:
            self._losses.add(loss, name)
        return diffuse or shine

    def _slot(self, extension: JsonObject, key: str, name: str) -> Slot | None:
        """Return the reference to a texture, None without one, or if it has no image that can be read."""
        slot = read_slot(extension, key)
        return slot if slot is not None and self._textures.source(slot, name) is not None else None

    def _convert(self, source: GlossyMaterial, name: str) -> _Converted:
        made = to_metallic_material(source)
        return _Converted(
            *made[:3],
            self._place(made.texture, f"{name} base colour"),
            self._place(made.metallic_roughness_texture, f"{name} metalness and roughness"),
            made.losses,
        )

    def _place(self, image: Image | None, name: str) -> int | None:
        return None if image is None else self._textures.add_made(image, name)
