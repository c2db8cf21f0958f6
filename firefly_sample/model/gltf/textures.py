"""Textures of a glTF file: their images, samplers and texture coordinates (glTF 2.0, section 3.8)."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from firefly_sample.losses import Losses
from firefly_sample.model.data import TextureData
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.images import Images
from firefly_sample.model.gltf.json_object import JsonObject, shown
from firefly_sample.model.gltf.meshes import UvSet
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.glossy_textures import Image
from firefly_sample.scene.texture import MagFilter, MinFilter, Sampling, Wrap

_WRAPS: dict[int, Wrap] = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_MAGFILTERS: dict[int, MagFilter] = {9728: "nearest", 9729: "linear"}
_MINFILTERS: dict[int, MinFilter] = {
    9728: "nearest",
    9729: "linear",
    9984: "nearest_mipmap_nearest",
    9985: "linear_mipmap_nearest",
    9986: "nearest_mipmap_linear",
    9987: "linear_mipmap_linear",
}


class Slot(NamedTuple):
    """The reference of a material to one of its textures."""

    texture: int
    """An index into the file's textures."""
    texcoord: int
    transform: Float64 | None

    @property
    def uv_set(self) -> UvSet:
        """The texture coordinates, for `read_primitive`."""
        return self.texcoord, self.transform

    def shares_uv(self, other: Slot) -> bool:
        """Return whether two textures have the same texture coordinates."""
        if self.transform is None or other.transform is None:
            return self.texcoord == other.texcoord and self.transform is other.transform
        return self.texcoord == other.texcoord and np.array_equal(self.transform, other.transform)


def read_slot(parent: JsonObject, key: str) -> Slot | None:
    """Return what a material says about a texture, for example "emissiveTexture"; None if it has none."""
    info = parent.object(key)
    if info is None:
        return None
    texture = info.index("index", "textures")
    if texture is None:
        raise info.error("index", "is missing")
    moved = info.extension("KHR_texture_transform")
    texcoord = info.whole("texCoord", 0)
    if moved is None:
        return Slot(texture, texcoord, None)
    return Slot(texture, moved.whole("texCoord", texcoord), _transform(moved))


def _transform(extension: JsonObject) -> Float64 | None:
    """Return the 3x2 matrix of a KHR_texture_transform for rows (u, v, 1), None if it changes nothing.

    It scales, rotates and then moves. The rotation is counter-clockwise as the picture is seen, with v down:
    the extension's example, the lower left quarter turned by a quarter, fixes the sign.
    """
    offset = extension.numbers("offset", 2, (0.0, 0.0))
    scale = extension.numbers("scale", 2, (1.0, 1.0))
    angle = extension.number("rotation", 0.0)
    if (offset, scale, angle) == ((0.0, 0.0), (1.0, 1.0), 0.0):
        return None
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[scale[0] * c, -scale[0] * s], [scale[1] * s, scale[1] * c], [*offset]])


class Textures:
    """The textures that materials use, each once.

    Attributes
    ----------
    found : list of TextureData
    """

    def __init__(self, document: Document, images: Images, losses: Losses) -> None:
        self.found: list[TextureData] = []
        self._document, self._images, self._losses = document, images, losses
        self._places: dict[int, int | None] = {}

    def add(self, slot: Slot, material: str) -> int | None:
        """Return the place in `found` of a texture; None if it has no image that can be read."""
        if slot.texture not in self._places:
            source = self.source(slot, material)
            self._places[slot.texture] = None
            if source is not None:
                image = self._images.add(source, material)
                self._places[slot.texture] = self._keep(TextureData(image, *self._sampling(slot)))
        return self._places[slot.texture]

    def add_made(self, image: Image, name: str) -> int:
        """Return the place in `found` of a texture that is not in the file."""
        return self._keep(TextureData(self._images.add_made(image.pixels, name), *image.sampling))

    def decoded(self, slot: Slot, material: str) -> Image | None:
        """Return a texture of the file, without adding it; None if it has no image that can be read."""
        source = self.source(slot, material)
        if source is None:
            return None
        return Image(self._images.read(source, material).decode(), self._sampling(slot))

    def _keep(self, made: TextureData) -> int:
        self.found.append(made)
        return len(self.found) - 1

    def source(self, slot: Slot, material: str) -> int | None:
        """Return the index of a texture's image in the file; that in WebP, if it has one."""
        texture = self._document.item("textures", slot.texture, "texture")
        webp = texture.extension("EXT_texture_webp")
        found = None if webp is None else webp.index("source", "images")
        found = texture.index("source", "images") if found is None else found
        if found is None:
            self._losses.add(
                "textures without a PNG, JPEG or WebP image are left out, of materials", material
            )
        return found

    def _sampling(self, slot: Slot) -> Sampling:
        """Return the sampler of a texture. Filters that the file leaves open are trilinear."""
        texture = self._document.item("textures", slot.texture, "texture")
        number = texture.index("sampler", "samplers")
        if number is None:
            return Sampling("repeat", "repeat", "linear_mipmap_linear", "linear")
        sampler = self._document.item("samplers", number, texture.place("sampler"))
        return Sampling(
            _WRAPS[_code(sampler, "wrapS", 10497, _WRAPS)],
            _WRAPS[_code(sampler, "wrapT", 10497, _WRAPS)],
            _MINFILTERS[_code(sampler, "minFilter", 9987, _MINFILTERS)],
            _MAGFILTERS[_code(sampler, "magFilter", 9729, _MAGFILTERS)],
        )


def _code(
    sampler: JsonObject,
    key: str,
    default: int,
    known: Collection[int],
) -> int:
    code = sampler.whole(key, default)
    if code not in known:
        raise sampler.error(key, f"must be one of {', '.join(map(str, known))}, got {shown(code)}")
    return code
