"""Records of lights: one table of fields yields the float32 rows and the GLSL text that reads them.

A light reaches its shader as one vec4 a field: as attributes of an instanced draw, or as texels where one
shader loops over all lights. Only the fields that a variant asks for are there.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from firefly_sample.plan.light_set import LightKind
from firefly_sample.plan.variants import LightVariant
from firefly_sample.plan.variants import defines as defines_of

__all__ = ["RECORDS", "RECORD_OF_KIND", "ROW", "Field", "record_dtype", "record_fields", "record_glsl"]


class Field(NamedTuple):
    """A vec4 of a record.

    Attributes
    ----------
    name : str
        ``Light.<name>`` in GLSL.
    needs : str
        The define that must not be 0; empty for a field that is always there.
    what : str
        What is in it.
    """

    name: str
    needs: str
    what: str


_PLACE = Field("place", "", "centre in view space, reach")
_PIXEL = Field("pixel", "", "where the centre is seen, pixels across and up: two float32 of each")
_COLOR = Field("color", "", "linear colour, rest of the centre's y that float32 took")
_SPECULAR = Field("specular", "HIGHLIGHTS", "linear colour of highlights")
_FADE = Field("fade", "FALLOFF", "constant, linear, quadratic; 1/max distance, 0 without one")
_AXIS = Field("axis", "", "where it shines, unit vector; 1 - cos of the outer half-angle")
_CONE = Field(
    "cone", "", "1/width of the edge in 1 - cos, 0 for a hard one; exponent; height, tan of a proxy"
)
_SHADOW = Field("shadow", "TAPS", "first shadow map, how many")

ROW = 256
"""Records in a row of their texture: a power of two, which shaders need not divide by."""
_FETCHED = {defines_of(LightVariant(method=method))["METHOD"] for method in ("loop", "clustered")}
"""Methods whose shaders fetch lights by their number."""

RECORDS: dict[str, tuple[Field, ...]] = {
    "PointLight": (_PLACE, _PIXEL, _COLOR, _SPECULAR, _FADE, _SHADOW),
    "Spotlight": (_PLACE, _PIXEL, _COLOR, _AXIS, _CONE, _SPECULAR, _FADE, _SHADOW),
    "DirectionalLight": (_AXIS, _COLOR, _SPECULAR, _SHADOW),
}
"""Records by name."""

RECORD_OF_KIND: dict[LightKind, str] = {
    "directional": "DirectionalLight",
    "point": "PointLight",
    "spot": "Spotlight",
}


def record_fields(record: str, defines: dict[str, int]) -> tuple[Field, ...]:
    """The fields of a record that a variant has."""
    return tuple(field for field in RECORDS[record] if not field.needs or defines.get(field.needs, 0))


def record_dtype(record: str, defines: dict[str, int]) -> np.dtype[Any]:
    """The NumPy dtype of a variant's record, by the names of its attributes."""
    return _dtype_of(record_fields(record, defines))


@cache
def _dtype_of(fields: tuple[Field, ...]) -> np.dtype[Any]:
    return np.dtype([(f"in_{field.name}", np.float32, 4) for field in fields])


def record_glsl(record: str, defines: dict[str, int], stage: str) -> str:
    """What a shader needs to read a record.

    Parameters
    ----------
    stage : {"vert", "frag"}
        A vertex shader gets attributes ``in_<name>`` and `send_light`, which hands them on; a fragment shader
        the struct `Light` and `receive_light` or, where one shader walks many lights, `fetch_light`.
    """
    fields = record_fields(record, defines)
    names = [field.name for field in fields]
    loops = defines.get("METHOD") in _FETCHED
    if stage == "vert":
        if loops:
            return "void send_light() { }"
        lines = [f"in vec4 in_{field.name};  // {field.what}" for field in fields]
        lines += [f"flat out vec4 v_{name};" for name in names]
        sent = "".join(f" v_{name} = in_{name};" for name in names)
        return "\n".join([*lines, f"void send_light() {{{sent} }}"])
    lines = ["struct Light {", *(f"    vec4 {field.name};  // {field.what}" for field in fields), "};"]
    if loops:
        texels = ", ".join(f"texelFetch(u_lights, at + ivec2({k}, 0), 0)" for k in range(len(fields)))
        return "\n".join(
            [
                *lines,
                f"uniform sampler2D u_lights;  // {len(fields)} texels a light",
                "uniform int u_light_count;",
                "Light fetch_light(int i) {",
                f"    ivec2 at = ivec2({len(fields)} * (i & {ROW - 1}), i >> {ROW.bit_length() - 1});",
                f"    return Light({texels});",
                "}",
            ]
        )
    lines += [f"flat in vec4 v_{name};" for name in names]
    received = ", ".join(f"v_{name}" for name in names)
    return "\n".join([*lines, f"Light receive_light() {{ return Light({received}); }}"])
