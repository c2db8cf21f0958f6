"""A pass's variant: a frozen dataclass whose fields become the defines of its shaders.

A field is a define of the same name in capitals: a bool is 0 or 1, a number itself, and a choice is compared
with the constant of its name, ``#if NORMAL_FORMAT == NORMAL_FORMAT_OCT16``. `CONSTANTS` lists the choices.
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
Look = Literal["correct", "classic"]
Tone = Literal["none", "exponential"]
ShadowTaps = Literal[0, 1, 4, 16]

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
}
"""The choices of each field that is one; a choice's number in shaders is its index."""


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


@cache
def defines(variant: Variant) -> dict[str, int]:
    """Return the defines of a variant: names in capitals and their numbers.

    The dict is shared: do not change it.
    """
    names = [field.name for field in fields(variant)]
    return {name.upper(): number_of(name, getattr(variant, name)) for name in names}


def number_of(field: str, value: Any) -> int:
    """Return the define of a field's value, which is a bool, a number or a choice."""
    return CONSTANTS[field].index(value) if isinstance(value, str) else int(value)


SHADER_CONSTANTS = {
    f"{field}_{choice}".upper(): number
    for field, choices in CONSTANTS.items()
    for number, choice in enumerate(choices)
}
"""Defines that every shader has, for example ``NORMAL_FORMAT_OCT16`` 0."""
