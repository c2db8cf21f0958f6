"""Records of lights: one table of fields yields the float32 rows and the GLSL text that reads them.

A light reaches its shader as one vec4 a field: as attributes of an instanced draw, or as texels where one
shader loops over all lights. Only the fields that a variant asks for are there.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from firefly_sample.plan.lights.light_set import LightKind
from firefly_sample.plan.variants import SHADER_CONSTANTS


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
_PIXEL = Field("pixel", "", "where the centre is seen, pixels across and up, and what float32 took of them")
_COLOR = Field("color", "", "linear colour, rest of the centre's y that float32 took")
_SEEN = Field("seen", "", "pixel across where the centre is seen, its distance, pixel up; reach")
_TINT = Field("tint", "", "linear colour; what float32 took of seen: shaders/include/rests.glsl")
_SPECULAR = Field("specular", "SPECULAR_MODEL", "linear colour of highlights")
_FADE = Field("fade", "FALLOFF", "constant, linear, quadratic; 1/max distance, 0 without one")
_AXIS = Field("axis", "", "where it shines, unit vector; 1 - cos of the outer half-angle")
_CONE = Field(
    "cone", "", "1/width of the edge in 1 - cos, 0 for a hard one; exponent; height, tan of a proxy"
)
_SHADOW = Field("shadow", "SHADOW_TAPS", "first shadow map, how many")

ROW = 256
"""Records in a row of their texture: a power of two, which shaders need not divide by."""
_COMPARED = SHADER_CONSTANTS["POSITION_SOURCE_INVERSE_MATRIX"]
"""From this method on, a shader compares positions."""
_LOOP = SHADER_CONSTANTS["LIGHT_METHOD_LOOP"]
_FETCHED = (_LOOP, SHADER_CONSTANTS["LIGHT_METHOD_CLUSTERED"])
"""Methods whose shaders fetch lights by their number; what has no method loops."""

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
    """The fields of a record as it is sent to a variant's shader."""
    fields = _light_fields(record, defines)
    return (_SEEN, _TINT, *fields[3:]) if _is_packed(fields, defines) else fields


def _light_fields(record: str, defines: dict[str, int]) -> tuple[Field, ...]:
    """The fields of ``Light`` in a variant's shader."""
    return tuple(field for field in RECORDS[record] if not field.needs or defines.get(field.needs, 0))


def _is_packed(fields: tuple[Field, ...], defines: dict[str, int]) -> bool:
    """Whether place, pixel and colour are sent in two texels: where shaders fetch lights a texel is dear.

    What is left out is the place across the view, which only stored positions are compared with.
    """
    fetched = defines.get("LIGHT_METHOD", _LOOP) in _FETCHED
    return fetched and fields[0] is _PLACE and defines.get("POSITION_SOURCE", _COMPARED) < _COMPARED


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
    fields = _light_fields(record, defines)
    names = [field.name for field in fields]
    loops = defines.get("LIGHT_METHOD", _LOOP) in _FETCHED
    if stage == "vert":
        if loops:
            return "void send_light() { }"
        lines = [f"in vec4 in_{field.name};  // {field.what}" for field in fields]
        lines += [f"flat out vec4 v_{name};" for name in names]
        sent = "".join(f" v_{name} = in_{name};" for name in names)
        return "\n".join([*lines, f"void send_light() {{{sent} }}"])
    lines = ["struct Light {", *(f"    vec4 {field.name};  // {field.what}" for field in fields), "};"]
    if loops:
        return "\n".join([*lines, *_fetch_light(record_fields(record, defines), fields)])
    lines += [f"flat in vec4 v_{name};" for name in names]
    received = ", ".join(f"v_{name}" for name in names)
    return "\n".join([*lines, f"Light receive_light() {{ return Light({received}); }}"])


def _fetch_light(texels: tuple[Field, ...], fields: tuple[Field, ...]) -> list[str]:
    """The lines of `fetch_light`: what is sent as texels, as the fields of ``Light``."""
    values, rest = [field.name for field in fields], []
    if texels[0] is _SEEN:
        rest = ["    vec3 rest = rests(seen.xyz, tint.w);"]
        values[:3] = "vec4(0.0, seen.y, 0.0, seen.w)", "vec4(seen.xz, rest.xz)", "vec4(tint.rgb, rest.y)"
    return [
        f"uniform sampler2D u_lights;  // {len(texels)} texels a light",
        "uniform int u_light_count;",
        "Light fetch_light(int i) {",
        f"    ivec2 at = ivec2({len(texels)} * (i & {ROW - 1}), i >> {ROW.bit_length() - 1});",
        *(
            f"    vec4 {field.name} = texelFetch(u_lights, at + ivec2({k}, 0), 0);"
            for k, field in enumerate(texels)
        ),
        *rest,
        f"    return Light({', '.join(values)});",
        "}",
    ]
