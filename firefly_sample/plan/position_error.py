"""Estimate the error of positions, and warn where it shows.

Depth in perspective is scale/y + offset, so an error d of the depth becomes an error of the distance y of

    dy / y = d * y * (far - near) / (far * near),

about d * y / near: the farther a surface is, the fewer codes the depth buffer has for it. d is half a code of
the buffer and, in 24 bits, two to three times as much again for float32's rounding of the interpolated depth
and of the shader's constants. With the inverse of the view-projection matrix, homogeneous coordinates of the
world are small differences of large numbers: the camera's distance from the world's origin is rounded too,
and that error is also magnified by y / near. (The law is derived in docs/unprojection.md; the factors are the
largest errors measured on llvmpipe, by the cases "distance ..." of `firefly_sample.lab.stability`.)

The effect of an error e on the picture is estimated beside a light. Light that fades as 1/d^2 changes by
2*e/d where a surface at the distance d from the light is moved by e. sRGB is 1.055*L^(1/2.4) - 0.055 at
white, which rises by 1.055/2.4 of dL/L, so that a relative change dL/L of 0.0089 is one display code of 255.
At a level L below white it is L^(1/2.4) codes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.plan.lights.light_set import LightSet, largest_channel
from firefly_sample.plan.lights.reach import light_reach
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.view import Eye
from firefly_sample.plan.visible import Visible
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.light import Falloff
from firefly_sample.settings import PositionMethod

CODE = 2.4 / 1.055 / 255.0
"""Relative change of radiance that changes white by one display code, and a darker level by less."""
HALF_FLOAT_END = 65504.0
"""The largest half float."""
NEARNESS = 0.25
"""Assumed distance of a surface from a light, as a share of the light's reach."""

_DEPTH_STEP: dict[str, float] = {"depth24": 1.5e-7, "inverse_matrix": 1.8e-7, "depth16": 2.0**-17 + 1.5e-7}
"""Largest error of a depth in 0..1, from which the distance is computed."""
_RELATIVE: dict[str, float] = {"linear32f": 4.5e-7, "stored32f": 4.5e-7, "depth32f": 1.8e-7}
"""Largest relative error of the methods that do not depend on near and far."""
_HALF_STEP, _SMALLEST_HALF = 2.0**-10, 2.0**-24
"""Largest relative error of a half float where a driver truncates, and the least absolute one."""
_FLOAT = 2.0**-24
_LINEAR = 0.0031308
"""Below, sRGB is 12.92 times as much."""
_FINEST: tuple[PositionMethod, ...] = ("linear32f", "depth32f", "stored32f")


def depth_error(step: float, near: float, far: float, perspective: bool, distance: ArrayLike) -> Float64:
    """Return the error of distances, in scene units, from an error `step` of a standard depth in 0..1.

    `distance`, of any shape, is along the view axis; see `position_errors`.
    """
    y = np.asarray(distance, dtype=np.float64)
    if not perspective:
        return np.full_like(y, step * (far - near))
    share = 1.0 if math.isinf(far) else (far - near) / far
    return np.asarray(step * share * y / near * y)


def position_errors(
    method: str,
    near: float,
    far: float,
    perspective: bool,
    distance: ArrayLike,
    from_origin: float = 0.0,
    clip_control: bool = True,
) -> Float64:
    """Return the largest expected errors of positions at some distances, all in scene units.

    The method is a choice of `Settings.position_method`. Distances are along the view axis, of any shape;
    `far` may be infinite in perspective. `from_origin` is the camera's distance from the world's origin: the
    method "inverse_matrix" goes through world coordinates. Without `clip_control`, "depth32f" is a standard
    24-bit depth buffer. An error may be larger than its distance, which means noise.
    """
    y = np.asarray(distance, dtype=np.float64)
    if method == "stored16f":
        rounded = np.maximum(_HALF_STEP * np.minimum(y, HALF_FLOAT_END), _SMALLEST_HALF)
        return np.maximum(rounded, y - HALF_FLOAT_END)
    if method == "depth32f" and not clip_control:
        method = "depth24"
    if method not in _DEPTH_STEP:
        return np.asarray(_RELATIVE[method] * y)
    error = depth_error(_DEPTH_STEP[method], near, far, perspective, y)
    if method == "inverse_matrix":
        magnified = y / near if perspective else np.ones_like(y)
        error = error + _FLOAT * from_origin * np.maximum(magnified, 1.0)
    return error


def position_error(
    method: str,
    near: float,
    far: float,
    perspective: bool,
    distance: float,
    from_origin: float = 0.0,
    clip_control: bool = True,
) -> float:
    """Return `position_errors` of a single distance."""
    return float(position_errors(method, near, far, perspective, distance, from_origin, clip_control))


def codes_shown(error: ArrayLike, from_light: ArrayLike, level: ArrayLike = 1.0) -> Float64:
    """Return the error in display codes of a surface `from_light` away from a light, moved by `error`.

    `level` is the brightness of the surface there, 0 to 1: a relative change is fewer codes where it is dark.
    """
    beside, shown = np.asarray(from_light, dtype=np.float64), np.minimum(level, 1.0)
    slope = np.where(shown > _LINEAR, shown ** (1.0 / 2.4), 12.92 * 2.4 / 1.055 * shown)
    with np.errstate(divide="ignore", invalid="ignore"):
        codes = 2.0 * np.asarray(error, dtype=np.float64) / beside / CODE * slope
    return np.where(beside > 0.0, codes, np.inf)


def position_warnings(
    needs: Needs,
    eye: Eye,
    seen: Visible,
    sets: Sequence[LightSet],
    exposure: float = 1.0,
) -> Iterator[str]:
    """Yield a line if the expected error of positions exceeds one display code beside a light.

    The error is estimated at the farthest position that a light reaches and that is in view; `exposure` is
    the largest channel's.
    """
    if not needs.needs_positions or needs.forward:
        return
    method, lens = needs.position_method, eye.lens
    errors = _Errors(needs, lens, float(np.linalg.norm(eye.camera.view_to_world[3, :3])))
    lamps = _lamps_of(sets, exposure)
    if not len(lamps.ends):
        return
    # bounding spheres are known, and mostly enough; boxes are tighter, and take longer
    if method != "stored16f" and errors.codes(method, errors.worst(lamps, seen.farthest)) <= 1.0:
        return
    farthest = max(float(part.box[1][1]) for part in seen.parts)
    surface = errors.worst(lamps, farthest)
    if not surface.distance > 0.0:
        return
    if method == "stored16f":
        reached = min(lens.get_far(), farthest, float(lamps.ends.max()))
        largest = max(reached, _across(lens, seen, reached))
        if largest > HALF_FLOAT_END:
            yield (
                f"position_method=stored16f: half floats end at {HALF_FLOAT_END:.0f} units and geometry in "
                f"view reaches {largest:.2g}: beyond the end it is lit as if it were at the end; use "
                "position_method=stored32f, which has no such limit"
            )
            return
    if errors.codes(method, surface) > 1.0:
        yield errors.warning(method, surface)


@dataclass(frozen=True, eq=False)
class _Lamps:
    """n lights that show errors of positions, because they have a position or shadows."""

    ends: Float64  # (n,), the farthest distance along the view axis that each reaches
    sizes: Float64  # (n,), assumed distance of a surface from the light; infinite to assume that from the eye
    levels: Float64  # (n,), brightness of a white surface there


def _lamps_of(sets: Iterable[LightSet], exposure: float) -> _Lamps:
    columns = [(np.zeros(0),) * 3]
    for lights in sets:
        if lights.kind != "directional":
            sizes, fading = _sizes(lights)
            brightness = exposure * largest_channel(lights.colors) * fading
            columns.append((lights.positions[:, 1] + lights.reaches, sizes, brightness))
        elif lights.shadowed or lights.particle_shadowed:
            endless = np.full(len(lights), np.inf)
            columns.append((endless, endless, np.ones(len(lights))))
    return _Lamps(*(np.concatenate(column) for column in zip(*columns, strict=True)))


def _sizes(lights: LightSet) -> tuple[Float64, Float64]:
    """Return the assumed distance of a surface from each light, and the light's attenuation there.

    The distance is a quarter of the light's reach or, if that is less, the distance at which an attenuation
    has halved the light; if the light is infinite at its position, the distance at which it has fallen to 1.
    """
    quarter = NEARNESS * lights.reaches
    if lights.falloff is not Falloff.ATTENUATION:
        return quarter, np.full(len(lights), (1.0 - NEARNESS) ** 2)
    kc, kl, kq = lights.attenuations.T
    start = np.where(kc > 0.0, 2.0 * kc, largest_channel(lights.colors))
    sizes = np.minimum(quarter, light_reach(lights.attenuations, start, np.ones(len(start))))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        fading = 1.0 / (kc + sizes * (kl + sizes * kq))
    return sizes, np.where(np.isfinite(sizes) & (sizes > 0.0), fading, 1.0)


class _Surface(NamedTuple):
    """A surface where an error is estimated: its distance from the eye, from a light, and its brightness."""

    distance: float
    beside: float
    level: float


@dataclass(frozen=True)
class _Errors:
    """The errors of a frame's positions, for a camera this far from the world's origin."""

    needs: Needs
    lens: Lens
    from_origin: float

    def at(self, method: PositionMethod, distance: ArrayLike) -> Float64:
        near, far, perspective = self.lens.get_near(), self.lens.get_far(), not self.needs.orthographic
        clip_control = self.needs.capabilities.clip_control
        return position_errors(method, near, far, perspective, distance, self.from_origin, clip_control)

    def codes(self, method: PositionMethod, surface: _Surface) -> float:
        error = float(self.at(method, surface.distance))
        return float(codes_shown(error, surface.beside, surface.level))

    def worst(self, lamps: _Lamps, farthest: float) -> _Surface:
        """Return the surface, up to a distance, on which the error of positions shows most."""
        distances = np.maximum(np.minimum(lamps.ends, min(self.lens.get_far(), farthest)), 0.0)
        beside = np.where(np.isfinite(lamps.sizes), lamps.sizes, distances)
        codes = codes_shown(self.at(self.needs.position_method, distances), beside, lamps.levels)
        index = int(np.argmax(np.where(distances > 0.0, codes, -1.0)))
        return _Surface(float(distances[index]), float(beside[index]), float(lamps.levels[index]))

    def warning(self, method: PositionMethod, surface: _Surface) -> str:
        codes, orthographic = self.codes(method, surface), self.needs.orthographic
        shown = f"{min(codes, 255.0):.0f}" if codes >= 10.0 else f"{codes:.2g}"
        by_depth = method not in ("linear32f", "stored16f", "stored32f")
        by_origin = method == "inverse_matrix" and self.from_origin > 3.0 * surface.distance
        why = ""
        if by_depth:
            near, far = self.lens.get_near(), self.lens.get_far()
            why = f", planes {far - near:.2g} apart" if orthographic else f", near plane {near:.2g}"
        if by_origin:
            why += f", {self.from_origin:.2g} from the world's origin"
        finer = next((name for name in _FINEST if self.codes(name, surface) <= 1.0), None)
        if finer is None:
            advice = "no method is more accurate: the lights are too small for their distance"
        else:
            advice = f"use position_method={finer}, which is off by {self.at(finer, surface.distance):.2g}"
            if by_origin:
                advice += ", or bring the camera near the world's origin"
            elif by_depth and not orthographic:
                advice += ", or move the near plane out"
        error = self.at(method, surface.distance)
        return (
            f"position_method={method}: at {surface.distance:.2g} units{why}, positions are off by about "
            f"{error:.2g} units, which is about {shown} display codes on a surface "
            f"{surface.beside:.2g} from a light; {advice}"
        )


def _across(lens: Lens, seen: Visible, distance: float) -> float:
    """Return how far to a side geometry may be seen, up to a distance along the view axis."""
    k = lens.constants()
    reached = distance if k.perspective else 1.0
    widest = np.max([np.abs(part.box).max(axis=0) for part in seen.parts], axis=0, initial=0.0)
    x, _, z = map(float, widest)
    wide, high = (1.0 + abs(k.x_offset)) / k.a, (1.0 + abs(k.z_offset)) / k.c
    return max(min(reached * wide, x), min(reached * high, z))
