"""Read pyrender's SpecularGlossinessMaterial as a metallic-roughness material."""

from __future__ import annotations

from typing import Any

from firefly_sample.interop.pyrender.textures import TextureReader
from firefly_sample.losses import Losses
from firefly_sample.scene.glossy_textures import GlossyMaterial, Image, to_metallic_material
from firefly_sample.scene.specular_glossiness import DIELECTRIC
from firefly_sample.scene.texture import Texture

_TWO_CHANNELS = "specularGlossinessTexture is left out, of whose image pyrender keeps two channels"


def read_glossiness(source: Any, name: str, textures: TextureReader, losses: Losses) -> dict[str, Any]:
    """Return the keywords of a `Material` with the reflection of pyrender's material.

    A material whose specularGlossinessTexture is left out is matt.
    """
    red, green, blue, alpha = source.diffuseFactor.tolist()
    specular, gloss = tuple(source.specularFactor.tolist()), source._glossinessFactor
    # the property glossinessFactor, without "_", calls itself for ever
    given, shine = source.specularGlossinessTexture, None
    if given is not None:
        if given.source_channels in ("RGB", "RGBA"):
            shine = textures.texture(given, name)
        else:
            losses.add(_TWO_CHANNELS, name)
        if shine is None:
            specular, gloss = (DIELECTRIC,) * 3, 0.0
    made = to_metallic_material(
        GlossyMaterial(
            (red, green, blue, alpha),
            specular,
            gloss,
            _image(textures.texture(source.diffuseTexture, name)),
            _image(shine),
        )
    )
    for loss in made.losses:
        losses.add(loss, name)
    return {
        "base_color": made.base_color,
        "texture": _texture(made.texture, f"{name} base colour"),
        "metallic": made.metallic,
        "roughness": made.roughness,
        "metallic_roughness_texture": _texture(
            made.metallic_roughness_texture, f"{name} metalness and roughness"
        ),
    }


def _image(texture: Texture | None) -> Image | None:
    return None if texture is None else Image(texture.pixels, texture.sampling)


def _texture(image: Image | None, name: str) -> Texture | None:
    return None if image is None else Texture(image.pixels, name, **image.sampling._asdict())
