"""Say so when positions will be so far off that it shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.batches import VisiblePart
from firefly_sample.plan.camera import CameraMatrices
from firefly_sample.plan.light_set import LightSet
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.position_error import HALF_FLOAT_END, codes_shown, position_error
from firefly_sample.plan.reach import light_reach
from firefly_sample.scene.falloff import Falloff
from firefly_sample.scene.lens import Lens
from firefly_sample.settings import PositionMethod

__all__ = ["position_warning"]

Float64 = NDArray[np.float64]

NEARNESS = 0.25
"""Of its reach: how near a light a surface is taken to be."""
_FINEST: tuple[PositionMethod, ...] = ("linear32f", "depth32f", "stored32f")


def position_warning(
    needs: Needs,
    lens: Lens,
    camera: CameraMatrices,
    seen: Sequence[VisiblePart],
    sets: Sequence[LightSet],
) -> str | None:
    """One line if the expected error of positions passes a display code beside lights; else None.

    It is expected at the farthest place that is both seen and lit, and is worth as many codes as beside a
    light of the median of all lights' sizes: see `firefly_sample.plan.position_error`.
    """
    if not needs.placed or needs.forward:
        return None
    method, farthest = needs.settings.position, min(lens.get_far(), _farthest_lit(sets))
    from_origin = float(np.linalg.norm(camera.view_to_world[3, :3]))

    def at(distance: float) -> _Place:
        return _Place(needs, lens, from_origin, distance, _nearness(sets, distance))

    # bounding spheres are known, and mostly enough; boxes are tighter, and take a while
    around = max(float(part.farthest.max()) for part in seen)
    if method != "stored16f" and at(min(farthest, around)).codes(method) <= 1.0:
        return None
    place = at(min(farthest, max(float(part.box()[1][1]) for part in seen)))
    if not place.distance > 0.0:
        return None
    if method == "stored16f":
        largest = max(place.distance, _across(lens, seen, place.distance))
        if largest > HALF_FLOAT_END:
            return (
                f"position=stored16f: half floats end at {HALF_FLOAT_END:.0f} units and {largest:.2g} are "
                "seen: what is farther is lit as if it were there; position=stored32f does not end"
            )
    return place.line() if place.codes(method) > 1.0 else None


@dataclass(frozen=True)
class _Place:
    """Where an error is expected: how far along the view axis, and how near a light."""

    needs: Needs
    lens: Lens
    from_origin: float
    distance: float
    beside: float

    def error(self, method: PositionMethod) -> float:
        return position_error(
            method,
            self.lens.get_near(),
            self.lens.get_far(),
            not self.needs.orthographic,
            self.distance,
            self.from_origin,
            self.needs.capabilities.clip_control,
        )

    def codes(self, method: PositionMethod) -> float:
        return codes_shown(self.error(method), self.beside)

    def line(self) -> str:
        method = self.needs.settings.position
        codes = self.codes(method)
        shown = f"{min(codes, 255.0):.0f}" if codes >= 10.0 else f"{codes:.2g}"
        return (
            f"position={method}: at {self.distance:.2g} units{self._why()}, a position errs by about "
            f"{self.error(method):.2g} units, which shows (about {shown} display codes "
            f"{self.beside:.2g} from a light); {self._way_out()}"
        )

    @property
    def _by_depth(self) -> bool:
        return self.needs.settings.position not in ("linear32f", "stored16f", "stored32f")

    @property
    def _by_origin(self) -> bool:
        """Whether most of the error comes from the world's origin being far away."""
        return self.needs.settings.position == "inverse_matrix" and self.from_origin > 3.0 * self.distance

    def _why(self) -> str:
        """What of the scene makes the error."""
        if not self._by_depth:
            return ""
        near, far = self.lens.get_near(), self.lens.get_far()
        planes = f", planes {far - near:.2g} apart" if self.needs.orthographic else f", near plane {near:.2g}"
        return planes + (f", {self.from_origin:.2g} from the world's origin" if self._by_origin else "")

    def _way_out(self) -> str:
        finer = next((name for name in _FINEST if self.codes(name) <= 1.0), None)
        if finer is None:
            return "no method is finer: lights are small for how far away they are seen"
        if self._by_origin:
            return f"position={finer} does not, or bring the camera near the world's origin"
        if self._by_depth and not self.needs.orthographic:
            return f"position={finer} does not, or move the near plane out"
        return f"position={finer} does not"


def _farthest_lit(sets: Sequence[LightSet]) -> float:
    """The farthest place along the view axis that a light that has a place, or shadows, may reach."""
    lit = [
        np.inf if lights.kind == "directional" else float((lights.positions[:, 1] + lights.reaches).max())
        for lights in sets
        if len(lights) and (lights.kind != "directional" or lights.shadowed)
    ]
    return max(lit, default=0.0)


def _across(lens: Lens, seen: Sequence[VisiblePart], distance: float) -> float:
    """How far to a side something may be seen, up to a distance along the view axis."""
    boxes = [np.abs(part.box()) for part in seen]
    constants = lens.constants()
    wide = (1.0 + abs(constants.x_offset)) / constants.a
    high = (1.0 + abs(constants.z_offset)) / constants.c
    reached = distance if constants.perspective else 1.0
    return max(
        min(reached * wide, max((float(box[:, 0].max()) for box in boxes), default=0.0)),
        min(reached * high, max((float(box[:, 2].max()) for box in boxes), default=0.0)),
    )


def _nearness(sets: Iterable[LightSet], distance: float) -> float:
    """How near a surface is taken to be to a light: the median of what the lights say, else `distance`."""
    sizes = np.concatenate(
        [np.zeros(0), *(_sizes(lights) for lights in sets if lights.kind != "directional")]
    )
    sizes = sizes[np.isfinite(sizes)]
    return float(np.median(sizes)) if len(sizes) else distance


def _sizes(lights: LightSet) -> Float64:
    """A quarter of each light's reach or, where that is less, where an attenuation has halved it.

    One that is infinite at the light has no half: where it has fallen to 1.
    """
    quarter = NEARNESS * lights.reaches
    if lights.falloff is not Falloff.ATTENUATION:
        return quarter
    constant = lights.attenuations[:, 0]
    start = np.where(constant > 0.0, 2.0 * constant, lights.colors.max(axis=1))
    return np.minimum(quarter, light_reach(lights.attenuations, start, np.ones(len(start))))
