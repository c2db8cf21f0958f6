"""Settings by what a user will accept: the fastest within an error, or the most accurate within a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from firefly_sample.columns import align
from firefly_sample.errors import SettingsError
from firefly_sample.lab.candidates import Candidate, Search
from firefly_sample.lab.picture_errors import require
from firefly_sample.lab.reference.frame import reference_settings
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings


@dataclass(frozen=True)
class Choice:
    """What was chosen, and on what evidence.

    Attributes
    ----------
    settings : Settings
    chosen : Candidate
    candidates : tuple of Candidate
        All that were measured as wholes, fastest first.
    asked : str
        The bound in words.
    times : tuple of float
        Seconds of the frames that were measured.
    """

    settings: Settings
    chosen: Candidate
    candidates: tuple[Candidate, ...]
    asked: str
    times: tuple[float, ...]

    def evidence(self) -> str:
        """A table of what was measured, the chosen one marked."""
        rows = [("", "TIME", "SPREAD", "MS", "ERROR", "CODES", "SETTINGS")]
        for candidate in self.candidates:
            rows.append(
                (
                    "*" if candidate is self.chosen else "",
                    f"{candidate.ratio:.2f}",
                    f"{candidate.spread:.2f}",
                    f"{candidate.milliseconds:.0f}",
                    f"{candidate.error:.1e}",
                    str(candidate.codes),
                    candidate.name,
                )
            )
        frames = ", ".join(f"{time:g}" for time in self.times)
        return f"{self.asked}: {self.chosen.name}; largest errors at {frames} s\n{align(rows)}"


def choose(
    scene: str | Scene,
    *,
    max_error: float | None = None,
    max_codes: int | None = None,
    budget_ms: float | None = None,
    parameters: Mapping[str, Any] | None = None,
    given: Mapping[str, Any] | None = None,
    size: tuple[int, int] = (800, 600),
    times: Sequence[float] = (5.0, 10.0, 20.0, 40.0),
    device: int | None = None,
    require_gpu: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Choice:
    """The fastest settings within an error, or the most accurate within a time, measured on this scene.

    Every choice is measured alone, then the combinations that should do best. Errors are the largest on all
    frames, times those of the first. An error may be up to `MARGIN` of its bound there.

    Parameters
    ----------
    scene : str or Scene
        Name of a scene plugin, "package.module:object", or a scene.
    max_error : float, optional
        Largest error of linear radiance over its 99.9th percentile.
    max_codes : int, optional
        Largest difference of sRGB codes. With `max_error`, both are met.
    budget_ms : float, optional
        Milliseconds of a frame's passes on this machine: the smallest error within it. Not together with a
        bound.
    parameters : mapping, optional
        Of a scene that is given by name.
    given : mapping, optional
        Settings that stay as they are here. Times are of its "supersample", errors of single samples.
    size : (int, int)
        Pixels.
    times : sequence of float
        Seconds of the frames to measure. A few that are far apart: the largest error of an animated scene is
        another one on each.
    device, require_gpu : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (steps done, steps in all).

    Raises
    ------
    SettingsError
        If nothing is asked for, or nothing meets it: it says the best that can be had.
    FireflyError
        If the scene, a setting, the size or the driver is not as it must be.
    """
    asked = _asked(max_error, max_codes, budget_ms)
    fixed = dict(given or {})
    wanted = Settings().with_changes(**fixed)
    base = wanted.with_changes(supersample=1)
    reference_settings(base)  # says so where there is none
    require("embreex")
    if not times:
        raise SettingsError("there is no frame to measure on: give at least one time")
    with Renderer(size, base, device=device, require_gpu=require_gpu) as renderer:
        built, by_codes = _scene_of(scene, parameters), max_error is None and max_codes is not None
        samples = wanted.supersample
        search = Search(renderer, built, tuple(times), base, fixed, by_codes, samples, progress)
        if budget_ms is not None:
            chosen = search.most_accurate(budget_ms)
        else:
            chosen = search.fastest(max_error, max_codes, asked)
    return Choice(
        wanted.with_changes(**chosen.changes),
        chosen,
        tuple(sorted(search.measured, key=lambda candidate: candidate.ratio)),
        asked,
        tuple(times),
    )


def _asked(max_error: float | None, max_codes: int | None, budget_ms: float | None) -> str:
    """The bound in words, checked."""
    bounds = {"max_error": max_error, "max_codes": max_codes, "budget_ms": budget_ms}
    wanted = {name: value for name, value in bounds.items() if value is not None}
    if not wanted or (budget_ms is not None and len(wanted) > 1):
        raise SettingsError("give max_error, max_codes or both, or else budget_ms")
    for name, value in wanted.items():
        least = "0 or more" if name == "max_codes" else "above 0"
        if not 0 <= value < 1e30 or (name != "max_codes" and value == 0):
            raise SettingsError(f"{name} must be a number {least}, got {value!r}")
    return " and ".join(f"{name} {value:g}" for name, value in wanted.items())


def _scene_of(scene: str | Scene, parameters: Mapping[str, Any] | None) -> Scene:
    if isinstance(scene, Scene):
        return scene
    from firefly_sample.scenes import build_scene, find_scene

    return build_scene(find_scene(scene), **dict(parameters or {}))
