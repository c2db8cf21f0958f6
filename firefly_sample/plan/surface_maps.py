"""The textures of a draw of surfaces, but for that of the base colour, and how each is sampled."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from firefly_sample.plan.variants import MapCoordinates
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material
from firefly_sample.scene.texture import Texture


class Map(NamedTuple):
    """A texture, and the texture coordinates that it is sampled at: 1 for the first, 2 for the second."""

    texture: Texture
    coordinates: MapCoordinates


class Maps(NamedTuple):
    """Each texture that takes part, or None; and how strongly two of them do."""

    emission: Map | None = None
    metallic: Map | None = None  # metalness and roughness
    normal: Map | None = None
    occlusion: Map | None = None
    modulate: Map | None = None  # colour and alpha that multiply those of the base colour's
    normal_scale: float = 1.0
    occlusion_strength: float = 1.0

    def named(self) -> Iterator[tuple[str, Map]]:
        """Yield the name and the map of each texture that there is."""
        for name, entry in zip(self._fields[:5], self[:5], strict=True):
            if isinstance(entry, Map):
                yield name, entry

    def coordinates(self, name: str) -> MapCoordinates:
        """Return the texture coordinates of a map, 0 if there is none of that name."""
        found = getattr(self, name)
        return 0 if found is None else found.coordinates


NO_MAPS = Maps()


_NONE = (None, None, None, None, None)


def _textures(material: Material) -> tuple[Texture | None, ...]:
    maps = material.emission_texture, material.metallic_roughness_texture
    return (*maps, material.normal_texture, material.occlusion_texture, material.modulate_texture)


def look_of_maps(material: Material) -> tuple[Any, ...]:
    """Return what must be the same for instances that are drawn together, hashable."""
    if _textures(material) == _NONE:  # asked of every material in every frame
        return _NONE
    textures = (
        (material.emission_texture, material.emission_texcoord),
        (material.metallic_roughness_texture, material.metallic_roughness_texcoord),
        (material.normal_texture, material.normal_texcoord, material.normal_scale),
        (material.occlusion_texture, material.occlusion_texcoord, material.occlusion_strength),
        (material.modulate_texture, material.modulate_texcoord),
    )
    return tuple(None if texture is None else (id(texture), *how) for texture, *how in textures)


def maps_of(materials: Sequence[Material], geom: Geom) -> Maps:
    """Return the maps of materials that are drawn together; a texture that changes nothing is left out."""
    first, second = materials[0], geom.texcoords_1 is not None
    if _textures(first) == _NONE:
        return NO_MAPS

    def made(texture: Texture | None, texcoord: int) -> Map | None:
        return None if texture is None else Map(texture, 2 if texcoord == 1 and second else 1)

    modulate = made(first.modulate_texture, first.modulate_texcoord)
    if first.unlit:
        return Maps(modulate=modulate)
    glows = any(material.emission.any() for material in materials)
    return Maps(
        made(first.emission_texture, first.emission_texcoord) if glows else None,
        made(first.metallic_roughness_texture, first.metallic_roughness_texcoord),
        made(first.normal_texture, first.normal_texcoord),
        made(first.occlusion_texture, first.occlusion_texcoord),
        modulate,
        first.normal_scale,
        first.occlusion_strength,
    )
