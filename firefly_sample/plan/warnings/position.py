"""Warn of positions that will be so far off that it shows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.plan.lights.light_set import LightSet, largest_channel
from firefly_sample.plan.lights.reach import light_reach
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.position_error import HALF_FLOAT_END, codes_shown, position_errors
from firefly_sample.plan.view import Eye
from firefly_sample.plan.visible import Visible
from firefly_sample.scene.falloff import Falloff
from firefly_sample.scene.lens_base import Lens
from firefly_sample.settings import PositionMethod

Float64 = NDArray[np.float64]

NEARNESS = 0.25
"""Assumed distance of a surface from a light, as a share of the light's reach."""
_FINEST: tuple[PositionMethod, ...] = ("linear32f", "depth32f", "stored32f")


def position_warnings(
    needs: Needs,
    eye: Eye,
    seen: Visible,
    sets: Sequence[LightSet],
    exposure: float = 1.0,
) -> Iterator[str]:
    """Yield a line if the expected error of positions exceeds one display code beside a light.

    The error is estimated at the farthest position that a light reaches and that is in view. It shows more
    the nearer that is to the light and the brighter it is: see `firefly_sample.plan.position_error`.
    `exposure` is the largest channel's.
    """
    if not needs.placed or needs.forward:
        return
    method, lamps, lens = needs.settings.position_method, _lamps_of(sets, exposure), eye.lens
    from_origin = float(np.linalg.norm(eye.camera.view_to_world[3, :3]))

    def worst_up_to(distance: float) -> _Surface:
        return _worst(needs, lens, from_origin, lamps, min(lens.get_far(), distance))

    # bounding spheres are known, and mostly enough; boxes are tighter, and take longer
    if method != "stored16f" and worst_up_to(seen.farthest).codes() <= 1.0:
        return
    farthest = max(float(part.box[1][1]) for part in seen.parts)
    surface = worst_up_to(farthest)
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
    if surface.codes() > 1.0:
        yield surface.line()


@dataclass(frozen=True, eq=False)
class _Lamps:
    """n lights that show errors of positions, because they have a position or shadows.

    Attributes
    ----------
    ends : ndarray of float64, shape (n,)
        The farthest distance along the view axis that each reaches.
    sizes : ndarray of float64, shape (n,)
        Assumed distance of a surface from the light; infinite if its distance from the eye is assumed.
    levels : ndarray of float64, shape (n,)
        Brightness of a white surface there.
    """

    ends: Float64
    sizes: Float64
    levels: Float64


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


@dataclass(frozen=True)
class _Surface:
    """A surface where an error is estimated: its distance from the eye, from a light, and its brightness."""

    needs: Needs
    lens: Lens
    from_origin: float
    distance: float
    beside: float
    level: float

    def error(self, method: PositionMethod) -> float:
        return float(_error(self.needs, self.lens, self.from_origin, method, self.distance))

    def codes(self, method: PositionMethod | None = None) -> float:
        error = self.error(method or self.needs.settings.position_method)
        return float(codes_shown(error, self.beside, self.level))

    def line(self) -> str:
        codes = self.codes()
        shown = f"{min(codes, 255.0):.0f}" if codes >= 10.0 else f"{codes:.2g}"
        method = self.needs.settings.position_method
        return (
            f"position_method={method}: at {self.distance:.2g} units{self._why()}, positions are off by "
            f"about {self.error(method):.2g} units, which is about {shown} display codes on a surface "
            f"{self.beside:.2g} from a light; {self._way_out()}"
        )

    @property
    def _by_depth(self) -> bool:
        return self.needs.settings.position_method not in ("linear32f", "stored16f", "stored32f")

    @property
    def _by_origin(self) -> bool:
        """Whether most of the error comes from the distance of the world's origin."""
        return (
            self.needs.settings.position_method == "inverse_matrix" and self.from_origin > 3.0 * self.distance
        )

    def _why(self) -> str:
        """Return the numbers of the scene that cause the error."""
        if not self._by_depth:
            return ""
        near, far = self.lens.get_near(), self.lens.get_far()
        planes = f", planes {far - near:.2g} apart" if self.needs.orthographic else f", near plane {near:.2g}"
        return planes + (f", {self.from_origin:.2g} from the world's origin" if self._by_origin else "")

    def _way_out(self) -> str:
        finer = next((name for name in _FINEST if self.codes(name) <= 1.0), None)
        if finer is None:
            return "no method is more accurate: the lights are too small for their distance"
        advice = f"use position_method={finer}, which is off by {self.error(finer):.2g}"
        if self._by_origin:
            return f"{advice}, or bring the camera near the world's origin"
        if self._by_depth and not self.needs.orthographic:
            return f"{advice}, or move the near plane out"
        return advice


def _error(
    needs: Needs, lens: Lens, from_origin: float, method: PositionMethod, distance: ArrayLike
) -> Float64:
    return position_errors(
        method,
        lens.get_near(),
        lens.get_far(),
        not needs.orthographic,
        distance,
        from_origin,
        needs.capabilities.clip_control,
    )


def _worst(needs: Needs, lens: Lens, from_origin: float, lamps: _Lamps, farthest: float) -> _Surface:
    """Return the surface, up to a distance, on which the error of positions shows most."""
    distances = np.maximum(np.minimum(lamps.ends, farthest), 0.0)
    beside = np.where(np.isfinite(lamps.sizes), lamps.sizes, distances)
    error = _error(needs, lens, from_origin, needs.settings.position_method, distances)
    index = int(np.argmax(np.where(distances > 0.0, codes_shown(error, beside, lamps.levels), -1.0)))
    return _Surface(
        needs,
        lens,
        from_origin,
        float(distances[index]),
        float(beside[index]),
        float(lamps.levels[index]),
    )


def _across(lens: Lens, seen: Visible, distance: float) -> float:
    """Return how far to a side geometry may be seen, up to a distance along the view axis."""
    boxes = [np.abs(part.box) for part in seen.parts]
    constants = lens.constants()
    wide = (1.0 + abs(constants.x_offset)) / constants.a
    high = (1.0 + abs(constants.z_offset)) / constants.c
    reached = distance if constants.perspective else 1.0
    return max(
        min(reached * wide, max((float(box[:, 0].max()) for box in boxes), default=0.0)),
        min(reached * high, max((float(box[:, 2].max()) for box in boxes), default=0.0)),
    )
