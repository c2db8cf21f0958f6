"""Records of lights: one table of fields yields the float32 rows and the GLSL text that reads them.

A light reaches its shader as one vec4 per field: as attributes of an instanced draw, or as texels if one
shader loops over all lights. Only the fields that a variant needs are sent.

float32 rounds a position 300 units away by up to 1.5e-5, which shows beside a light that is a quarter of a
unit from a surface. A light's position is therefore sent twice: as it is, for its volume; and as the pixel at
which the camera sees it, in float32 and 256ths of its last digit. float32 holds a surface's own pixel
exactly, because it is a small number. So the difference of the two pixels keeps its digits however near they
are. Multiplied by the width of a pixel at the light's distance, it is the vector to the light across the
view.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.blocks import pixel_slopes
from firefly_sample.gpu.instance_rows import LARGEST
from firefly_sample.plan.lights.light_set import LightKind, LightSet
from firefly_sample.plan.shadows.maps import ShadowPlan
from firefly_sample.plan.variants import SHADER_CONSTANTS
from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]
Float32 = NDArray[np.float32]

ROW = 256
"""Records in a row of their texture: a power of two, which shaders need not divide by."""
SHADOW_TEXELS = 5
"""Texels per shadow map: three rows of view-to-light; scales and the depth's constants; its tile."""
MIDDLE = 128.0
"""The byte that stands for no step."""
PROXY_MARGIN = 1e-4
"""The width that a cone's proxy has beyond the cone, as a share of its height, against rounding."""

_COMPARED = SHADER_CONSTANTS["POSITION_SOURCE_INVERSE_MATRIX"]
"""From this method on, a shader compares positions."""
_LOOP = SHADER_CONSTANTS["LIGHT_METHOD_LOOP"]
_FETCHED = (_LOOP, SHADER_CONSTANTS["LIGHT_METHOD_CLUSTERED"])
"""Methods whose shaders fetch lights by their number; variants without a method loop."""


def rests(values: Float64) -> Float64:
    """Return float32's rounding errors, to 256ths of its last digit: the twin of ``include/rests.glsl``."""
    return np.asarray(_steps(values) * _step(values))


def packed_rests(values: Float64) -> Float64:
    """Return the rests of rows of three numbers as one whole number each, below 2^24: (n, 3) to (n,)."""
    return np.asarray((_steps(values) + MIDDLE) @ (1.0, 256.0, 65536.0))


def _steps(values: Float64) -> Float64:
    """Return the rounding errors as numbers of 256ths of the last digit."""
    steps = np.rint((values - _rounded(values)) / _step(values))
    return np.asarray(np.clip(steps, -MIDDLE, MIDDLE - 1.0))


def _step(values: Float64) -> Float64:
    return np.spacing(np.abs(values).astype(np.float32)).astype(np.float64) / 256.0


def _rounded(values: Float64) -> Float64:
    return values.astype(np.float32).astype(np.float64)


def _seen_pixels(lights: LightSet, view: View) -> Float64:
    """Return lights' pixels, (n, 2), at the distance that shaders use: their own or the near plane's."""
    distance = np.ones(len(lights))
    if view.lens.perspective:
        distance = np.maximum(_rounded(lights.positions[:, 1]), float(np.float32(view.near)))
    slopes, half = np.array(pixel_slopes(view)), 0.5 * np.array(view.size)
    offsets = np.array([view.lens.x_offset, view.lens.z_offset])
    with np.errstate(over="ignore"):
        pixels = lights.positions[:, [0, 2]] / distance[:, None] / slopes + half * (1.0 + offsets)
    return np.asarray(np.clip(pixels, -LARGEST, LARGEST))


def _place(lights: LightSet, _: View) -> Float64:
    return np.column_stack((lights.positions, lights.reaches))


def _pixel(lights: LightSet, view: View) -> Float64:
    pixels = _seen_pixels(lights, view)
    return np.column_stack((_rounded(pixels), rests(pixels)))


def _color(lights: LightSet, _: View) -> Float64:
    return np.column_stack((lights.colors, rests(lights.positions[:, 1])))


def _seen(lights: LightSet, view: View) -> Float64:
    across, up = _seen_pixels(lights, view).T
    return np.column_stack((across, lights.positions[:, 1], up, lights.reaches))


def _tint(lights: LightSet, view: View) -> Float64:
    return np.column_stack((lights.colors, packed_rests(_seen(lights, view)[:, :3])))


def _specular(lights: LightSet, _: View) -> Float64:
    return lights.specular_colors


def _shadow(lights: LightSet, _: View) -> Float64:
    return np.column_stack((lights.casters, lights.maps)).astype(np.float64)


def _fade(lights: LightSet, _: View) -> Float64:
    with np.errstate(divide="ignore"):
        return np.column_stack((lights.attenuations, 1.0 / lights.ends))


def _axis(lights: LightSet, _: View) -> Float64:
    inner, outer, _exponent = lights.cones.T
    # a cone that is a full circle with a hard edge must not lose the directions that rounding puts outside it
    endless = (inner == outer) & (outer >= 2.0 - 1e-9)
    return np.column_stack((lights.directions, np.where(endless, 4.0, outer)))


def _cone(lights: LightSet, _: View) -> Float64:
    inner, outer, exponent = lights.cones.T
    edge = outer > inner
    steep = np.where(edge, 1.0 / np.where(edge, outer - inner, 1.0), 0.0)
    cosine = np.maximum(1.0 - outer, 1e-3)  # wider ones have other proxies
    tangent = np.sqrt(np.maximum(outer * (2.0 - outer), 0.0)) / cosine
    height = np.minimum(lights.heights, LARGEST)
    return np.column_stack((steep, exponent, height, tangent * (1.0 + PROXY_MARGIN) + PROXY_MARGIN))


class Field(NamedTuple):
    """A vec4 of a record, ``Light.<name>`` in GLSL.

    `needs` is the define that must not be 0, empty for a field that is always there; `comment` describes the
    content; `values` returns its first numbers for each light, shape (n, 1 to 4). The others are 0.
    """

    name: str
    needs: str
    comment: str
    values: Callable[[LightSet, View], Float64]


_PLACE = Field("place", "", "centre in view space, reach", _place)
_PIXEL = Field(
    "pixel", "", "where the centre is seen, pixels across and up, and what float32 took of them", _pixel
)
_COLOR = Field("color", "", "linear colour, rest of the centre's y that float32 took", _color)
_SEEN = Field("seen", "", "pixel across where the centre is seen, its distance, pixel up; reach", _seen)
_TINT = Field("tint", "", "linear colour; what float32 took of seen: shaders/include/rests.glsl", _tint)
_SPECULAR = Field("specular", "SPECULAR_MODEL", "linear colour of highlights", _specular)
_FADE = Field("fade", "FALLOFF", "constant, linear, quadratic; 1/max distance, 0 without one", _fade)
_AXIS = Field("axis", "", "where it shines, unit vector; 1 - cos of the outer half-angle", _axis)
_EDGE = "1/width of the edge in 1 - cos, 0 for a hard one; exponent; height, tan of a proxy"
_CONE = Field("cone", "", _EDGE, _cone)
_SHADOW = Field("shadow", "SHADOW_TAPS", "first shadow map, how many", _shadow)

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
    """Return the fields of a record as it is sent to a variant's shader.

    Shaders that fetch lights pay for each texel: place, pixel and colour are sent to them in two. These lack
    the position across the view, which only shaders that compare stored positions need.
    """
    fields = _light_fields(record, defines)
    fetched = defines.get("LIGHT_METHOD", _LOOP) in _FETCHED
    if fetched and fields[0] is _PLACE and defines.get("POSITION_SOURCE", _COMPARED) < _COMPARED:
        return (_SEEN, _TINT, *fields[3:])
    return fields


def _light_fields(record: str, defines: dict[str, int]) -> tuple[Field, ...]:
    """Return the fields of ``Light`` in a variant's shader."""
    return tuple(field for field in RECORDS[record] if not field.needs or defines.get(field.needs, 0))


def record_dtype(record: str, defines: dict[str, int]) -> np.dtype[Any]:
    """Return the NumPy dtype of a variant's record, by the names of its attributes."""
    return _dtype_of(record_fields(record, defines))


@cache  # making one takes longer than all the rest of a draw's preparation
def _dtype_of(fields: tuple[Field, ...]) -> np.dtype[Any]:
    return np.dtype([(f"in_{field.name}", np.float32, 4) for field in fields])


def light_rows(record: str, defines: dict[str, int], lights: LightSet, view: View) -> Float32:
    """Return the records of lights as a variant's shader reads them, shape (n, fields, 4)."""
    fields = record_fields(record, defines)
    rows = np.zeros((len(lights), len(fields), 4))
    for index, field in enumerate(fields):
        values = field.values(lights, view)
        rows[:, index, : values.shape[1]] = values
    with np.errstate(over="ignore"):
        return rows.astype(np.float32)


def light_texels(rows: Float32) -> Float32:
    """Return records as texels, `ROW` of them in a row: shape (height, ROW * fields, 4)."""
    count, fields = rows.shape[:2]
    height = max(1, -(-count // ROW))
    texels = np.zeros((height * ROW, fields, 4), dtype=np.float32)
    texels[:count] = rows
    return texels.reshape(height, ROW * fields, 4)


def record_glsl(record: str, defines: dict[str, int], stage: str) -> str:
    """Return the GLSL that reads a record.

    Parameters
    ----------
    stage : {"vert", "frag"}
        A vertex shader gets attributes ``in_<name>`` and `send_light`, which hands them on; a fragment shader
        the struct `Light` and `receive_light` or, if it loops over many lights, `fetch_light`.
    """
    fields = _light_fields(record, defines)
    names = [field.name for field in fields]
    loops = defines.get("LIGHT_METHOD", _LOOP) in _FETCHED
    if stage == "vert":
        if loops:
            return "void send_light() { }"
        lines = [f"in vec4 in_{field.name};  // {field.comment}" for field in fields]
        lines += [f"flat out vec4 v_{name};" for name in names]
        sent = "".join(f" v_{name} = in_{name};" for name in names)
        return "\n".join([*lines, f"void send_light() {{{sent} }}"])
    lines = ["struct Light {", *(f"    vec4 {field.name};  // {field.comment}" for field in fields), "};"]
    if loops:
        return "\n".join([*lines, *_fetch_light(record_fields(record, defines), names)])
    lines += [f"flat in vec4 v_{name};" for name in names]
    received = ", ".join(f"v_{name}" for name in names)
    return "\n".join([*lines, f"Light receive_light() {{ return Light({received}); }}"])


def _fetch_light(texels: tuple[Field, ...], values: list[str]) -> list[str]:
    """Return the lines of `fetch_light`, which makes the `values` of a ``Light`` of texels."""
    rest = []
    if texels[0] is _SEEN:
        rest = ["    vec3 rest = rests(seen.xyz, tint.w);"]
        unpacked = "vec4(0.0, seen.y, 0.0, seen.w)", "vec4(seen.xz, rest.xz)", "vec4(tint.rgb, rest.y)"
        values = [*unpacked, *values[3:]]
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


def shadow_rows(shadows: ShadowPlan, view: View) -> Float32:
    """Return the constants that shaders look shadows up with, shape (maps, `SHADOW_TEXELS`, 4)."""
    rows = np.zeros((len(shadows.maps), SHADOW_TEXELS, 4))
    for row, shadow in zip(rows, shadows.maps, strict=True):
        view_to_light = view.view_to_world @ shadow.world_to_light
        row[:3, :3], row[:3, 3] = view_to_light[:3, :3].T, view_to_light[3, :3]
        lens, half = shadow.lens, shadow.tile.size / 2.0
        row[3] = lens.a * half, lens.c * half, lens.y_fold, lens.w_fold
        row[4] = *shadow.tile, float(lens.perspective)
    with np.errstate(over="ignore"):
        return rows.astype(np.float32)
