"""Say so when positions will be so far off that it shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

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
    distance = _farthest(lens, seen, sets)
    if not distance > 0.0:
        return None
    beside = _nearness(sets, distance)
    from_origin = float(np.linalg.norm(camera.view_to_world[3, :3]))

    def error(method: PositionMethod) -> float:
        return position_error(
            method,
            lens.get_near(),
            lens.get_far(),
            not needs.orthographic,
            distance,
            from_origin,
            needs.capabilities.clip_control,
        )

    method = needs.settings.position
    across = _across(lens, seen, distance)
    if method == "stored16f" and max(distance, across) > HALF_FLOAT_END:
        return (
            f"position=stored16f: half floats end at {HALF_FLOAT_END:.0f} units and "
            f"{max(distance, across):.2g} are seen: what is farther is lit as if it were there; "
            "position=stored32f does not end"
        )
    codes = codes_shown(error(method), beside)
    if not codes > 1.0:
        return None
    finer = next((name for name in _FINEST if codes_shown(error(name), beside) <= 1.0), None)
    why = _why(method, needs, lens, distance, from_origin)
    return (
        f"position={method}: at {distance:.2g} units{why}, a position errs by about "
        f"{error(method):.2g} units, which shows (about {_codes(codes)} display codes "
        f"{beside:.2g} from a light); {_way_out(finer, method, needs, distance, from_origin)}"
    )


def _codes(codes: float) -> str:
    return f"{min(codes, 255.0):.0f}" if codes >= 10.0 else f"{codes:.2g}"


def _minds_origin(method: PositionMethod, distance: float, from_origin: float) -> bool:
    """Whether most of the error comes from the world's origin being far away."""
    return method == "inverse_matrix" and from_origin > 3.0 * distance


def _why(method: PositionMethod, needs: Needs, lens: Lens, distance: float, from_origin: float) -> str:
    """What of the scene makes the error."""
    if method in ("linear32f", "stored16f", "stored32f"):
        return ""
    planes = f", near plane {lens.get_near():.2g}"
    if needs.orthographic:
        planes = f", planes {lens.get_far() - lens.get_near():.2g} apart"
    if _minds_origin(method, distance, from_origin):
        return f"{planes}, {from_origin:.2g} from the world's origin"
    return planes


def _way_out(
    finer: PositionMethod | None,
    method: PositionMethod,
    needs: Needs,
    distance: float,
    from_origin: float,
) -> str:
    if finer is None:
        return "no method is finer: lights are small for how far away they are seen"
    if _minds_origin(method, distance, from_origin):
        return f"position={finer} does not, or bring the camera near the world's origin"
    if method in ("linear32f", "stored16f", "stored32f") or needs.orthographic:
        return f"position={finer} does not"
    return f"position={finer} does not, or move the near plane out"


def _farthest(lens: Lens, seen: Sequence[VisiblePart], sets: Sequence[LightSet]) -> float:
    """The farthest place along the view axis that may be seen and lit by a light that has a place."""
    ends = [float(part.box()[1][1]) for part in seen]
    lit = [
        np.inf if lights.kind == "directional" else float((lights.positions[:, 1] + lights.reaches).max())
        for lights in sets
        if len(lights) and (lights.kind != "directional" or lights.shadowed)
    ]
    return min(lens.get_far(), max(ends, default=0.0), max(lit, default=0.0))


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
