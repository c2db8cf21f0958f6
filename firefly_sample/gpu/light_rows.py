"""Rows of dots, lights and shadow maps: the cast to float32 of places in view space.

A float32 rounds a place 300 units away by up to 1.5e-5, which shows beside a light a quarter of a unit from
a surface. A light's place is therefore sent in two ways: as it is, for its volume; and as the pixel at which
the camera sees it, in a float32 and 256ths of its last digit. A surface's own pixel is a small number that
float32 holds exactly, so the difference of the two keeps its digits however near they are; times the width
of a pixel at the light's distance it is the way to the light across the view.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.records import ROW, record_fields
from firefly_sample.plan.frame_plan import SpriteSet
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.shadows.maps import ShadowPlan
from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]
Float32 = NDArray[np.float32]

SHADOW_TEXELS = 5
"""Of a shadow map: three rows of view-to-light; scales and the depth's constants; its tile."""
LARGEST = 3e38
"""What float32 holds."""
MIDDLE = 128.0
"""Of a byte: what stands for no step."""
SMALLEST_DOT = 1.0
"""Radius in pixels."""
PROXY_MARGIN = 1e-4
"""How much wider a cone's proxy is than the cone, of its height: what rounding may move its sides."""


def dot_rows(dots: SpriteSet, view: View) -> Float32:
    """Rows of soft dots, shape (n, 13).

    Centre and radius in view space; the pixel of the centre, two float32 each across and up; one over the
    radius in pixels, across and up; colour. A dot that would be smaller than a pixel is as large, and as much
    fainter, so that it neither vanishes nor flickers.
    """
    lens, half = view.lens, 0.5 * np.array(view.size)
    w = np.maximum(dots.positions[:, 1:2], 1e-30) if lens.perspective else np.ones((len(dots), 1))
    scales = half * (lens.a, lens.c) / w
    grow = np.maximum(SMALLEST_DOT / np.maximum(dots.radii[:, None] * scales[:, 1:], 1e-30), 1.0)
    radii = dots.radii[:, None] * grow
    pixels = np.clip(
        dots.positions[:, [0, 2]] * scales + half * (1.0 + np.array([lens.x_offset, lens.z_offset])),
        -LARGEST,
        LARGEST,
    )
    held = _rounded(pixels)
    columns = [dots.positions, radii, held, pixels - held, 1.0 / (radii * scales), dots.colors / grow**2]
    with np.errstate(over="ignore"):  # a radius beyond float32 reaches everything, as infinity does
        return np.concatenate(columns, axis=1).astype(np.float32)


def pixel_slopes(view: View) -> tuple[float, float]:
    """How far the way through a pixel moves across the view with each pixel, right and up.

    In units a unit of distance, or, under an orthographic lens, in units.
    """
    width, height = view.size
    return 2.0 / (width * view.lens.a), 2.0 / (height * view.lens.c)


def light_rows(record: str, defines: dict[str, int], lights: LightSet, view: View) -> Float32:
    """The records of lights as a variant's shader reads them, shape (n, fields, 4)."""
    fields = record_fields(record, defines)
    rows = np.zeros((len(lights), len(fields), 4))
    for index, field in enumerate(fields):
        rows[:, index] = _COLUMNS[field.name](lights, view)
    with np.errstate(over="ignore"):
        return rows.astype(np.float32)


def light_texels(rows: Float32) -> Float32:
    """Records as texels, `ROW` of them in a row: shape (height, ROW * fields, 4)."""
    count, fields = rows.shape[:2]
    height = max(1, -(-count // ROW))
    texels = np.zeros((height * ROW, fields, 4), dtype=np.float32)
    texels[:count] = rows
    return texels.reshape(height, ROW * fields, 4)


def _beside(values: Float64, *more: Float64) -> Float64:
    return np.concatenate([values, *(column.reshape(len(values), -1) for column in more)], axis=1)


def _padded(values: Float64) -> Float64:
    return np.pad(values, ((0, 0), (0, 4 - values.shape[1])))


def rests(values: Float64) -> Float64:
    """What float32 takes of numbers, to 256ths of their last digit: shaders/include/rests.glsl's twin."""
    return np.asarray(_steps(values) * _step(values))


def packed_rests(values: Float64) -> Float64:
    """The rests of rows of three numbers as one number each, whole and below 2^24: shape (n, 3) to (n,)."""
    return np.asarray((_steps(values) + MIDDLE) @ (1.0, 256.0, 65536.0))


def _steps(values: Float64) -> Float64:
    """How many 256ths of the last digit float32 takes."""
    steps = np.rint((values - _rounded(values)) / _step(values))
    return np.asarray(np.clip(steps, -MIDDLE, MIDDLE - 1.0))


def _step(values: Float64) -> Float64:
    return np.spacing(np.abs(values).astype(np.float32)).astype(np.float64) / 256.0


def _rounded(values: Float64) -> Float64:
    """As float32 holds them."""
    return values.astype(np.float32).astype(np.float64)


def _place(lights: LightSet, view: View) -> Float64:
    return _beside(lights.positions, lights.reaches)


def _pixel(lights: LightSet, view: View) -> Float64:
    pixels = _seen_pixels(lights, view)
    return _beside(_rounded(pixels), rests(pixels))


def _seen_pixels(lights: LightSet, view: View) -> Float64:
    """Where lights would be seen at the distance that shaders take, their own or the near plane's; (n, 2)."""
    distance = np.ones(len(lights))
    if view.lens.perspective:
        distance = np.maximum(_rounded(lights.positions[:, 1]), float(np.float32(view.near)))
    slopes, half = np.array(pixel_slopes(view)), 0.5 * np.array(view.size)
    offsets = np.array([view.lens.x_offset, view.lens.z_offset])
    with np.errstate(over="ignore"):
        pixels = lights.positions[:, [0, 2]] / distance[:, None] / slopes + half * (1.0 + offsets)
    return np.asarray(np.clip(pixels, -LARGEST, LARGEST))


def _color(lights: LightSet, view: View) -> Float64:
    return _beside(lights.colors, rests(lights.positions[:, 1]))


def _fade(lights: LightSet, view: View) -> Float64:
    with np.errstate(divide="ignore"):
        return _beside(lights.attenuations, 1.0 / lights.ends)


def _axis(lights: LightSet, view: View) -> Float64:
    inner, outer, _ = lights.cones.T
    # a cone that is a full circle and ends hard must not lose what rounding puts beyond its end
    endless = (inner == outer) & (outer >= 2.0 - 1e-9)
    return _beside(lights.directions, np.where(endless, 4.0, outer))


def _cone(lights: LightSet, view: View) -> Float64:
    inner, outer, exponent = lights.cones.T
    edge = outer > inner
    steep = np.where(edge, 1.0 / np.where(edge, outer - inner, 1.0), 0.0)
    cosine = np.maximum(1.0 - outer, 1e-3)  # wider ones have other proxies
    tangent = np.sqrt(np.maximum(outer * (2.0 - outer), 0.0)) / cosine
    height = np.minimum(lights.heights, LARGEST)
    return _beside(steep[:, None], exponent, height, tangent * (1.0 + PROXY_MARGIN) + PROXY_MARGIN)


def _seen(lights: LightSet, view: View) -> Float64:
    return _beside(_as_seen(lights, view), lights.reaches)


def _tint(lights: LightSet, view: View) -> Float64:
    return _beside(lights.colors, packed_rests(_as_seen(lights, view)))


def _as_seen(lights: LightSet, view: View) -> Float64:
    """Pixel across, distance and pixel up, shape (n, 3)."""
    across, up = _seen_pixels(lights, view).T
    return np.stack([across, lights.positions[:, 1], up], axis=1)


_COLUMNS: dict[str, Callable[[LightSet, View], Float64]] = {
    "place": _place,
    "pixel": _pixel,
    "seen": _seen,
    "tint": _tint,
    "color": _color,
    "specular": lambda lights, _: _padded(lights.specular_colors),
    "fade": _fade,
    "axis": _axis,
    "cone": _cone,
    "shadow": lambda lights, _: _padded(np.stack([lights.casters, lights.maps], axis=1).astype(np.float64)),
}


def shadow_rows(shadows: ShadowPlan, view: View) -> Float32:
    """What a shader needs to look shadows up, shape (maps, `SHADOW_TEXELS`, 4)."""
    rows = np.zeros((len(shadows.maps), SHADOW_TEXELS, 4))
    for row, shadow in zip(rows, shadows.maps, strict=True):
        view_to_light = view.view_to_world @ shadow.world_to_light
        row[:3, :3], row[:3, 3] = view_to_light[:3, :3].T, view_to_light[3, :3]
        lens, half = shadow.lens, shadow.tile.size / 2.0
        row[3] = lens.a * half, lens.c * half, lens.y_fold, lens.w_fold
        row[4] = *shadow.tile, float(lens.perspective)
    with np.errstate(over="ignore"):
        return rows.astype(np.float32)
