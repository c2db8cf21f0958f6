"""A pass's variant: a frozen dataclass whose fields become the defines of its shaders.

A field is a define of the same name in capitals: a bool is 0 or 1, a number itself, and a choice is compared
with the constant of its name, ``#if NORMAL_FORMAT == NORMAL_FORMAT_OCT16``. `CONSTANTS` lists the choices.
A field of `OPTIONAL` is a define only where it is neither False nor 0, so that a frame without the feature
has the shader that it would have if there were no such feature: ``#ifdef METALLIC``.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from typing import Any, Literal, get_args

LightKind = Literal["none", "directional", "point", "spot"]
DrawMethod = Literal["sphere", "cone", "fullscreen", "loop", "clustered"]
SpecularModel = Literal["none", "phong", "blinn_phong"]
FalloffChoice = Literal["ramp_squared", "attenuation"]
RangeFalloff = Literal["karis", "gltf"]
PositionSource = Literal["distance", "depth", "inverse_matrix", "stored"]
PositionTarget = Literal["none", "float32", "float16"]
NormalFormat = Literal["oct16", "oct16_unorm", "oct8", "unorm", "float", "classic"]
AlbedoFormat = Literal["linear", "sqrt8", "sqrt10"]
Interpolation = Literal["rasterizer", "float64"]
LightResolution = Literal["full", "half"]
LightView = Literal["overdraw", "volumes", "wireframe"]
Look = Literal["correct", "classic", "pyrender", "flat", "panda3d"]
Transparency = Literal["none", "sorted", "exact", "weighted"]
Tone = Literal["none", "exponential"]
ShadowTaps = Literal[0, 1, 4, 16]
MapCoordinates = Literal[0, 1, 2]
"""0 without a texture, 1 if it is sampled at the first texture coordinates, 2 if at the second."""

CONSTANTS: dict[str, tuple[str, ...]] = {
    "light_kind": get_args(LightKind),
    "light_method": get_args(DrawMethod),
    "specular_model": get_args(SpecularModel),
    "falloff": get_args(FalloffChoice),
    "range_falloff": get_args(RangeFalloff),
    "position_source": get_args(PositionSource),
    "position_target": get_args(PositionTarget),
    "normal_format": get_args(NormalFormat),
    "albedo_format": get_args(AlbedoFormat),
    "interpolation": get_args(Interpolation),
    "light_resolution": get_args(LightResolution),
    "light_view": get_args(LightView),
    "look": get_args(Look),
    "tone": get_args(Tone),
    "transparency": get_args(Transparency),
}
"""The choices of each field that is one; a choice's number in shaders is its index."""


OPTIONAL = frozenset(
    {
        "metallic",
        "unlit",
        "metallic_map",
        "normal_map",
        "occlusion_map",
        "modulate_map",
        "metallic_roughness",
        "transparency",
        "sorted",
        "numbered",
        "color_alpha",
        "pyrender",
        "tint",
        "panda3d",
        "scaled",
        "local_viewer",
        "local_viewers",
        "gloss",
    }
)
"""Fields that are no define where they are False or 0."""


@dataclass(frozen=True)
class Variant:
    """The base of all variants; a pass without choices uses it as it is."""


@dataclass(frozen=True)
class SurfaceFeatures:
    """The features of its shader that a draw of surfaces needs."""

    textured: bool = False
    vertex_color: bool = False
    cutout: bool = False  # True if alpha below the material's cutoff is not drawn
    double_sided: bool = False
    vertex_alpha: bool = False  # True if the alpha of vertex colours cuts out
    emission_textured: bool = False
    second_texcoords: bool = False  # True if the emission texture has texture coordinates of its own
    metallic: bool = False  # True for metallic-roughness materials
    unlit: bool = False
    metallic_map: MapCoordinates = 0  # metalness and roughness
    normal_map: MapCoordinates = 0
    occlusion_map: MapCoordinates = 0
    modulate_map: MapCoordinates = 0  # a second texture of the base colour
    scaled: bool = False  # True if a colour scale multiplies what is shown, apart from the colours
    local_viewer: bool = False  # True if highlights see the eye where it is, in a look that asks


@cache
def defines(variant: Variant) -> dict[str, int]:
    """Return the defines of a variant: names in capitals and their numbers.

    The dict is shared: do not change it.
    """
    result: dict[str, int] = {}
    for field in fields(variant):
        value = getattr(variant, field.name)
        if value is None or isinstance(value, Variant):  # what another shader needs
            continue
        if isinstance(value, tuple):  # of variants, such as sets of lights: LIGHT_SETS 2, LIGHT_SET_0_...
            name = field.name.upper().removesuffix("S")
            parts = {
                f"{name}_{i}_{key}": part for i, one in enumerate(value) for key, part in defines(one).items()
            }
            result |= parts
            value = len(value)
        number = number_of(field.name, value)
        if number or field.name not in OPTIONAL:
            result[field.name.upper()] = number
    return result


def number_of(field: str, value: Any) -> int:
    """Return the define of a field's value, which is a bool, a number or a choice."""
    return CONSTANTS[field].index(value) if isinstance(value, str) else int(value)


def constants_of(field: str) -> dict[str, int]:
    """Return the defines that the choices of a field are compared with."""
    return {f"{field}_{choice}".upper(): number for number, choice in enumerate(CONSTANTS[field])}


SHADER_CONSTANTS = {
    name: number
    for field in CONSTANTS
    if field not in OPTIONAL
    for name, number in constants_of(field).items()
}
"""Defines that every shader has, for example ``NORMAL_FORMAT_OCT16`` 0."""
