"""Materials of a glTF file as Phong materials (glTF 2.0, section 3.9)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.data import MaterialData
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.extensions import IMPLEMENTED, has_effect
from firefly_sample.model.gltf.images import Images
from firefly_sample.model.gltf.json_object import JsonObject, shown
from firefly_sample.model.gltf.meshes import UvSet
from firefly_sample.model.gltf.textures import Slot, Textures, read_slot
from firefly_sample.scene.material import LARGEST_SHININESS, AlphaMode

_ALPHA_MODES: dict[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}
Color = tuple[float, float, float, float]
_REFLECTANCE = 0.04
"""Of light that meets a surface of refractive index 1.5 head on (glTF 2.0, appendix B)."""


def phong_highlight(roughness: float) -> tuple[float, float]:
    """Return the specular reflectance and the shininess of a Phong highlight for a roughness of 0 to 1.

    alpha = roughness^2 is the width of glTF's microfacets, and n = 2 / alpha^2 - 2 the exponent whose lobe is
    as wide (B. Walter et al., "Microfacet Models for Refraction", EGSR 2007). (n + 8) / 8 keeps the energy of
    the highlight (T. Akenine-Möller et al., "Real-Time Rendering", 3rd edition, 7.6). Very rough surfaces,
    with n below 1, have no highlight.
    """
    alpha = roughness * roughness
    exponent = LARGEST_SHININESS
    if alpha > 0.0:
        exponent = min(2.0 / (alpha * alpha) - 2.0 if alpha > 1e-150 else exponent, exponent)
    if exponent < 1.0:
        return 0.0, 0.0
    return min(_REFLECTANCE * (exponent + 8.0) / 8.0, 1.0), exponent


def cut_out(color: Color, cutoff: float) -> tuple[Color, float]:
    """Return a base colour and a cut-off of 0 to 1 that cut the same as these (glTF 2.0, section 3.9.4).

    The base colour's alpha moves into the cut-off, since mipmaps keep the coverage of their texture's alpha
    at the cut-off. A cut-off above 1 shows nothing.
    """
    r, g, b, alpha = color
    if cutoff > alpha:
        return (r, g, b, 0.0), 1.0
    return (r, g, b, 1.0), cutoff / alpha if alpha > 0.0 else 0.0


class Materials:
    """The materials that primitives use, each once, and their textures.

    Attributes
    ----------
    found : list of MaterialData
    """

    def __init__(self, document: Document, images: Images, losses: Losses) -> None:
        self.found: list[MaterialData] = []
        self.textures = Textures(document, images, losses)
        self._document, self._images, self._losses = document, images, losses
        self._places: dict[int | None, int] = {}
        self._uv_sets: list[tuple[UvSet, ...]] = []

    def add(self, index: int | None) -> tuple[int, tuple[UvSet, ...]]:
        """Return the place in `found` of a material, and the texture coordinates that it needs.

        None is the default material: white, and rough without a metal's colour, which primitives without a
        material have. Its metalness, which is only a default, is no loss.
        """
        if index not in self._places:
            material, uv_sets = MaterialData("default material"), tuple[UvSet, ...]()
            if index is not None:
                material, uv_sets = self._read(index)
            self._places[index] = len(self.found)
            self.found.append(material)
            self._uv_sets.append(uv_sets)
        place = self._places[index]
        return place, self._uv_sets[place]

    def _read(self, index: int) -> tuple[MaterialData, tuple[UvSet, ...]]:
        source = self._document.item("materials", index, "material")
        name = source.text("name", "") or f"material {index}"
        surface = source.object("pbrMetallicRoughness") or self._document.as_object({}, source.where)
        made = MaterialData(name, double_sided=source.flag("doubleSided", False))
        made.base_color = self._shares(surface, "baseColorFactor", name)
        base, glow = read_slot(surface, "baseColorTexture"), read_slot(source, "emissiveTexture")
        made.texture = None if base is None else self.textures.add(base, name)
        self._set_alpha(made, source)
        self._set_emission(made, source, glow)
        self._set_highlight(made, surface)
        self._name_losses(source, name)
        pairs = (base, made.texture), (glow, made.emission_texture)
        slots = [slot for slot, texture in pairs if slot is not None and texture is not None]
        if len(slots) == 2 and slots[1].shares_uv(slots[0]):
            slots.pop()
        made.emission_texcoord = 1 if len(slots) == 2 else 0
        return made, tuple(slot.uv_set for slot in slots)

    def _shares(self, surface: JsonObject, key: str, name: str) -> Color:
        """Return a colour, of 0 to 1 each."""
        given = surface.numbers(key, 4, (1.0, 1.0, 1.0, 1.0))
        r, g, b, a = (min(max(number, 0.0), 1.0) for number in given)
        if (r, g, b, a) != given:
            self._losses.add("base colours outside 0 to 1 are clipped, of materials", name)
        return r, g, b, a

    def _set_alpha(self, made: MaterialData, source: JsonObject) -> None:
        mode = source.text("alphaMode", "OPAQUE")
        if mode not in _ALPHA_MODES:
            raise source.error("alphaMode", f"must be one of {', '.join(_ALPHA_MODES)}, got {shown(mode)}")
        made.alpha_mode = _ALPHA_MODES[mode]
        if made.alpha_mode == "mask":
            cutoff = source.number("alphaCutoff", 0.5, least=0.0)
            made.base_color, made.alpha_cutoff = cut_out(made.base_color, cutoff)

    def _set_emission(self, made: MaterialData, source: JsonObject, slot: Slot | None) -> None:
        factors = source.numbers("emissiveFactor", 3, (0.0, 0.0, 0.0), least=0.0)
        extension = source.extension("KHR_materials_emissive_strength")
        strength = 1.0 if extension is None else extension.number("emissiveStrength", 1.0, least=0.0)
        r, g, b = (factor * strength for factor in factors)
        made.emission = (r, g, b)
        if slot is not None and any(made.emission):  # a black one's texture costs nothing
            made.emission_texture = self.textures.add(slot, made.name)

    def _set_highlight(self, made: MaterialData, surface: JsonObject) -> None:
        """Set the highlight by the roughness, by its mean if it has a texture, and name what is lost."""
        roughness = min(max(surface.number("roughnessFactor", 1.0), 0.0), 1.0)
        metalness = min(max(surface.number("metallicFactor", 1.0), 0.0), 1.0)
        slot = read_slot(surface, "metallicRoughnessTexture")
        if slot is not None and (roughness > 0.0 or metalness > 0.0):
            texels = self._texels(slot, made.name)
            if texels is None:
                self._losses.add("unreadable roughness textures are left out, of materials", made.name)
            else:
                roughness *= float(texels[..., 1].mean()) / 255.0
                metalness *= float(texels[..., 2].max()) / 255.0
                if (texels[..., 1] != texels[0, 0, 1]).any():
                    self._losses.add("roughness textures are drawn by their mean, of materials", made.name)
        specular, made.shininess = phong_highlight(roughness)
        made.specular = (specular, specular, specular)
        if specular:
            self._losses.add("roughness is drawn as a Phong highlight, of materials", made.name)
        if metalness > 0.0:
            self._losses.add("metalness is not drawn, of materials", made.name)

    def _texels(self, slot: Slot, material: str) -> NDArray[np.uint8] | None:
        """Return the image of a texture that is not drawn; None if it is missing or damaged."""
        source = self.textures.source(slot)
        try:
            return None if source is None else self._images.read(source, material).decode()
        except ModelError:
            return None

    def _name_losses(self, source: JsonObject, name: str) -> None:
        for key, what in (("normalTexture", "normal maps"), ("occlusionTexture", "occlusion maps")):
            if read_slot(source, key) is not None:
                self._losses.add(f"{what} are not drawn, of materials", name)
        extensions = source.object("extensions")
        for extension in [] if extensions is None else extensions.json:
            found = source.extension(extension)
            if extension not in IMPLEMENTED and found is not None and has_effect(found, extension):
                self._losses.add(f"{extension} is not drawn, of materials", name)
