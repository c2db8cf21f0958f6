"""Extensions of glTF: those that this reader implements, and what is lost where it does not draw one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from firefly_sample.losses import Losses
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.json_object import JsonObject

IMPLEMENTED = frozenset(
    {
        "EXT_mesh_gpu_instancing",
        "EXT_meshopt_compression",
        "EXT_texture_webp",
        "KHR_draco_mesh_compression",
        "KHR_lights_punctual",
        "KHR_materials_emissive_strength",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_unlit",
        "KHR_mesh_quantization",
        "KHR_texture_transform",
    }
)

NEUTRAL: dict[str, Mapping[str, Any]] = {
    "KHR_materials_anisotropy": {"anisotropyStrength": 0.0},
    "KHR_materials_clearcoat": {"clearcoatFactor": 0.0},
    "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.0},
    "KHR_materials_dispersion": {"dispersion": 0.0},
    "KHR_materials_ior": {"ior": 1.5},
    "KHR_materials_iridescence": {"iridescenceFactor": 0.0},
    "KHR_materials_sheen": {"sheenColorFactor": [0.0, 0.0, 0.0]},
    "KHR_materials_specular": {"specularFactor": 1.0, "specularColorFactor": [1.0, 1.0, 1.0]},
    "KHR_materials_transmission": {"transmissionFactor": 0.0},
    "KHR_materials_volume": {"thicknessFactor": 0.0},
}
"""Extensions of materials with the values, which are also the defaults, that leave the surface as it is."""

NAMED_ELSEWHERE = frozenset(
    {
        *NEUTRAL,
        "KHR_animation_pointer",
        "KHR_texture_basisu",
    }
)
"""Those whose losses are named with the materials and animations that have them."""

HARMLESS = frozenset(
    {
        "EXT_instance_features",
        "EXT_mesh_features",
        "EXT_structural_metadata",
        "EXT_texture_avif",
        "KHR_audio_emitter",
        "KHR_xmp_json_ld",
        "MSFT_texture_dds",
    }
)
"""Those that do not change the picture, or only offer images in another form."""

_PARTLY = {
    "KHR_materials_variants": "of the variants in KHR_materials_variants the default one is drawn",
    "MSFT_lod": "of the levels of detail in MSFT_lod the first one is drawn",
}


def check_extensions(document: Document, losses: Losses) -> None:
    """Note the extensions that are not drawn.

    Raises
    ------
    ModelError
        If the file requires an extension that is not implemented; the message names all of them.
    """
    missing = [name for name in document.extensions_required() if name not in IMPLEMENTED]
    if missing:
        raise document.error(
            "extensionsRequired",
            f"{', '.join(dict.fromkeys(missing))} cannot be read: export the model without that",
        )
    for name in document.extensions_used():
        if name in _PARTLY:
            losses.add(_PARTLY[name])
        elif name not in IMPLEMENTED | NAMED_ELSEWHERE | HARMLESS:
            losses.add("unknown extensions are not drawn", name)


def has_effect(extension: JsonObject, name: str) -> bool:
    """Return whether an extension of a material changes its surface."""
    neutral = NEUTRAL.get(name)
    if neutral is None:
        return True
    textures = any(key.endswith("Texture") for key in extension.json)
    differs = any(extension.json.get(key, value) != value for key, value in neutral.items())
    # a texture multiplies a factor, so that it changes nothing where the factor is neutral because it is 0
    return differs or (textures and name == "KHR_materials_specular")
