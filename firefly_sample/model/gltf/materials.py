"""Materials of a glTF file (glTF 2.0, section 3.9)."""

from __future__ import annotations

from dataclasses import replace

from firefly_sample.losses import Losses
from firefly_sample.model.data import MaterialData
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.extensions import IMPLEMENTED, has_effect
from firefly_sample.model.gltf.factors import Color4, Factors
from firefly_sample.model.gltf.glossiness import Glossiness
from firefly_sample.model.gltf.images import Images
from firefly_sample.model.gltf.json_object import JsonObject, shown
from firefly_sample.model.gltf.meshes import UvSet
from firefly_sample.model.gltf.textures import Slot, Textures, read_slot
from firefly_sample.scene.material import LARGEST_SCALE, AlphaMode

_ALPHA_MODES: dict[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}


def cut_out(color: Color4, cutoff: float) -> tuple[Color4, float]:
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
        self._factors, self._glossiness = Factors(losses), Glossiness(self.textures, losses)
        self._document, self._losses = document, losses
        self._places: dict[int | None, int] = {}
        self._uv_sets: list[tuple[UvSet, ...]] = []
        self._of_marks: dict[tuple[int, bool], int] = {}

    def add(self, index: int | None) -> tuple[int, tuple[UvSet, ...]]:
        """Return the place in `found` of a material, and the texture coordinates that it needs, at most two.

        None is the default material of primitives without one: white, rough and a metal, as a material
        without any property is (glTF 2.0, section 3.9.6).
        """
        if index not in self._places:
            material, uv_sets = MaterialData("default material", metallic=1.0), tuple[UvSet, ...]()
            if index is not None:
                material, uv_sets = self._read(index)
            self._places[index] = len(self.found)
            self.found.append(material)
            self._uv_sets.append(uv_sets)
        place = self._places[index]
        return place, self._uv_sets[place]

    def of_marks(self, place: int, normals: bool, tangents: bool) -> int:
        """Return the place of a material as points and lines have it, which may lack normals and tangents.

        Without normals, they show their colour without light. Without tangents, they have no normal map (glTF
        2.0, section 3.9.7).
        """
        made = self.found[place]
        if not normals and not made.unlit:
            if any(made.emission):
                self._losses.add("points and lines without normals do not emit, of materials", made.name)
            found = MaterialData(
                made.name,
                made.base_color,
                made.texture,
                made.alpha_mode,
                made.alpha_cutoff,
                made.double_sided,
                unlit=True,
            )
        elif normals and not tangents and made.normal_texture is not None:
            found = replace(made, normal_texture=None)
        else:
            return place
        key = place, found.unlit
        if key not in self._of_marks:
            self._of_marks[key] = len(self.found)
            self.found.append(found)
            self._uv_sets.append(self._uv_sets[place])
        return self._of_marks[key]

    def _read(self, index: int) -> tuple[MaterialData, tuple[UvSet, ...]]:
        source = self._document.item("materials", index, "material")
        name = source.text("name", "") or f"material {index}"
        made = MaterialData(name, double_sided=source.flag("doubleSided", False))
        made.unlit = source.extension("KHR_materials_unlit") is not None
        gloss = None if made.unlit else source.extension("KHR_materials_pbrSpecularGlossiness")
        surface = source.object("pbrMetallicRoughness") or self._document.as_object({}, source.where)
        slots: list[Slot] = []
        # in this order: two sets of texture coordinates are all that there are
        if gloss is not None:
            slot = self._glossiness.read(made, gloss)
            slots += [] if slot is None else [slot]
        else:
            made.base_color = self._factors.color(surface, "baseColorFactor", "base colours", name)
            made.texture, _ = self._placed(read_slot(surface, "baseColorTexture"), slots, name)
        self._set_alpha(made, source)
        if not made.unlit:
            self._set_normals(made, source, slots)
            if gloss is None:
                self._set_reflection(made, surface, slots)
            self._set_occlusion(made, source, slots)
            self._set_emission(made, source, slots)
        self._name_losses(source, name)
        return made, tuple(slot.uv_set for slot in slots)

    def _placed(self, slot: Slot | None, slots: list[Slot], name: str) -> tuple[int | None, int]:
        """Return the place of a texture, None without one, and the number of its texture coordinates.

        `slots` are those whose texture coordinates the material already has; a new one is added.
        """
        if slot is None:
            return None, 0
        number = next((i for i, other in enumerate(slots) if slot.shares_uv(other)), len(slots))
        if number == 2:
            self._losses.add(
                "textures with a third set of texture coordinates are left out, of materials", name
            )
            return None, 0
        texture = self.textures.add(slot, name)
        if texture is None:
            return None, 0
        if number == len(slots):
            slots.append(slot)
        return texture, number

    def _set_alpha(self, made: MaterialData, source: JsonObject) -> None:
        mode = source.text("alphaMode", "OPAQUE")
        if mode not in _ALPHA_MODES:
            raise source.error("alphaMode", f"must be one of {', '.join(_ALPHA_MODES)}, got {shown(mode)}")
        made.alpha_mode = _ALPHA_MODES[mode]
        if made.alpha_mode == "mask":
            cutoff = source.number("alphaCutoff", 0.5, least=0.0)
            made.base_color, made.alpha_cutoff = cut_out(made.base_color, cutoff)

    def _set_normals(self, made: MaterialData, source: JsonObject, slots: list[Slot]) -> None:
        slot = read_slot(source, "normalTexture")
        if slot is not None:
            info = source.required_object("normalTexture")
            made.normal_scale = self._factors.number(
                info, "scale", "scales of normal maps", made.name, -LARGEST_SCALE, LARGEST_SCALE
            )
            made.normal_texture, made.normal_texcoord = self._placed(slot, slots, made.name)

    def _set_reflection(self, made: MaterialData, surface: JsonObject, slots: list[Slot]) -> None:
        made.metallic = self._factors.number(surface, "metallicFactor", "metallic factors", made.name)
        made.roughness = self._factors.number(surface, "roughnessFactor", "roughness factors", made.name)
        slot = read_slot(surface, "metallicRoughnessTexture")
        if made.metallic > 0.0 or made.roughness > 0.0:  # else the texture changes nothing
            placed = self._placed(slot, slots, made.name)
            made.metallic_roughness_texture, made.metallic_roughness_texcoord = placed

    def _set_occlusion(self, made: MaterialData, source: JsonObject, slots: list[Slot]) -> None:
        slot = read_slot(source, "occlusionTexture")
        if slot is not None:
            info = source.required_object("occlusionTexture")
            made.occlusion_strength = self._factors.number(
                info, "strength", "strengths of occlusion", made.name
            )
        if made.occlusion_strength > 0.0:
            made.occlusion_texture, made.occlusion_texcoord = self._placed(slot, slots, made.name)

    def _set_emission(self, made: MaterialData, source: JsonObject, slots: list[Slot]) -> None:
        factors = source.numbers("emissiveFactor", 3, (0.0, 0.0, 0.0), least=0.0)
        extension = source.extension("KHR_materials_emissive_strength")
        strength = 1.0 if extension is None else extension.number("emissiveStrength", 1.0, least=0.0)
        r, g, b = (factor * strength for factor in factors)
        made.emission = (r, g, b)
        slot = read_slot(source, "emissiveTexture")
        if any(made.emission):  # a black one's texture costs nothing
            made.emission_texture, made.emission_texcoord = self._placed(slot, slots, made.name)

    def _name_losses(self, source: JsonObject, name: str) -> None:
        extensions = source.object("extensions")
        for extension in [] if extensions is None else extensions.json:
            found = source.extension(extension)
            if extension not in IMPLEMENTED and found is not None and has_effect(found, extension):
                self._losses.add(f"{extension} is not drawn, of materials", name)
