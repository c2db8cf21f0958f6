"""The methods of drawing lights that are measured, and how to count what each shades."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from firefly_sample.errors import SettingsError, did_you_mean
from firefly_sample.frame import Frame
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.settings import Settings

METHODS: dict[str, dict[str, Any]] = {
    "volumes": {"light_method": "volumes", "volume_depth_test": True},
    "original": {"light_method": "volumes", "volume_depth_test": False},
    "clustered": {"light_method": "clustered"},
    "auto": {"light_method": "auto"},
    "fullscreen": {"light_method": "fullscreen"},
    "loop": {"light_method": "loop"},
}
"""Settings of each method: our volumes; the original's, without a depth test; clusters; whichever of volumes
and clusters a plan finds cheaper; a full-screen pass for each light; and one that loops over all lights."""
CHOSEN = "volumes"
"""What ratios refer to where it is measured."""


def check_methods(given: Sequence[str] | None, base: Settings) -> list[str]:
    """The names of methods without repetitions; when None is given, all of `METHODS` that fit the settings.

    Raises
    ------
    SettingsError
        If there is none, no such method, or one that does not fit the settings.
    """
    if given is None:
        return [name for name, changes in METHODS.items() if _fits(base, changes)]
    names = list(dict.fromkeys(given))
    for name in names:
        if name not in METHODS:
            raise SettingsError(
                f"there is no method {name!r}{did_you_mean(name, METHODS)}: choose from {', '.join(METHODS)}"
            )
        base.with_changes(**METHODS[name])
    if not names:
        raise SettingsError(f"no methods were asked for: choose from {', '.join(METHODS)}")
    return names


def _fits(base: Settings, changes: dict[str, Any]) -> bool:
    try:
        base.with_changes(**changes)
    except SettingsError:
        return False
    return True


def shaded_by(frame: Frame, plan: FramePlan) -> int:
    """What the lights' passes shaded; in which way, the plan says, for the method may have let it choose."""
    return SHADED.get(plan.culling.method, _as_counted)(frame, plan)


def _as_counted(frame: Frame, _: FramePlan) -> int:
    """The renderer's count: fragments, and of clusters the lights in the lists of all pixels."""
    return frame.shaded or 0


def _walked_by_all(frame: Frame, plan: FramePlan) -> int:
    """Fragments times the lights that each stands for; a large set has several full-screen passes."""
    passes = sum(len(lights.parts()) for lights in plan.lights)
    return (frame.shaded or 0) // max(passes, 1) * sum(map(len, plan.lights))


SHADED: dict[str, Callable[[Frame, FramePlan], int]] = {"loop": _walked_by_all}
"""How to count what a method of culling shades, where it is not as the renderer counts."""
