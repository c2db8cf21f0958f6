"""Choose settings by measuring: the fastest within an error, or the most accurate within a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from firefly_sample.columns import align
from firefly_sample.errors import SettingsError
from firefly_sample.lab.measuring import require
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.reference.frame import reference_settings
from firefly_sample.lab.search import Candidate, Search
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings


@dataclass(frozen=True)
class Choice:
    """The chosen settings and the evidence for them.

    Attributes
    ----------
    settings : Settings
    chosen : Candidate
    candidates : tuple of Candidate
        All settings that were measured as a whole, fastest first.
    asked : str
        The bound as text.
    times : tuple of float
        Seconds of the frames that were measured.
    """

    settings: Settings
    chosen: Candidate
    candidates: tuple[Candidate, ...]
    asked: str
    times: tuple[float, ...]

    def evidence(self) -> str:
        """Return a table of the candidates, the chosen one marked."""
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
    progress: Progress | None = None,
) -> Choice:
    """Choose the fastest settings within an error, or the most accurate within a time, by measuring a scene.

    Every choice is measured alone, then the most promising combinations. Errors are the largest on all
    frames, times are those of the first frame. Errors on the measured frames must stay below 0.7 of their
    bound (`firefly_sample.lab.search.MARGIN`), since other frames have other errors.

    Parameters
    ----------
    scene : str or Scene
        Name of a scene plugin, "package.module:object", or a scene.
    max_error : float, optional
        Largest error of linear radiance over its 99.9th percentile.
    max_codes : int, optional
        Largest difference of sRGB codes. With `max_error`, both bounds are met.
    budget_ms : float, optional
        Milliseconds of a frame's passes on this machine: choose the smallest error within it. It excludes
        `max_error` and `max_codes`.
    parameters : mapping, optional
        Parameters of a scene that is given by name.
    given : mapping, optional
        Settings that are fixed. Times are measured with its "supersample", errors on single samples.
    size : (int, int)
        Pixels.
    times : sequence of float
        Seconds of the frames to measure. Give a few that are far apart: the largest error of an animated
        scene differs from frame to frame.
    device, require_gpu : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (steps done, all steps).

    Raises
    ------
    SettingsError
        If no bound is given, or no settings meet it: the message names the best.
    FireflyError
        If the scene, a setting, the size or the driver is not usable.
    """
    asked = _asked(max_error, max_codes, budget_ms)
    fixed = dict(given or {})
    wanted = Settings().with_changes(**fixed)
    base = wanted.with_changes(supersample=1)
    reference_settings(base)  # raises if this look has no reference
    require("embreex")
    if not times:
        raise SettingsError("the list of times is empty: give the time of at least one frame to measure")
    with Renderer(size, base, device=device, require_gpu=require_gpu) as renderer:
        if isinstance(scene, str):
            scene = build_scene(find_scene(scene), **dict(parameters or {}))
        by_codes, samples = max_error is None and max_codes is not None, wanted.supersample
        search = Search(renderer, scene, tuple(times), base, fixed, by_codes, samples, progress)
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
    """Check the bounds, and return them as text."""
    bounds = {"max_error": max_error, "max_codes": max_codes, "budget_ms": budget_ms}
    wanted = {name: value for name, value in bounds.items() if value is not None}
    if not wanted or (budget_ms is not None and len(wanted) > 1):
        raise SettingsError("give max_error, max_codes or both, or only budget_ms")
    for name, value in wanted.items():
        least = "0 or more" if name == "max_codes" else "above 0"
        if not 0 <= value < 1e30 or (name != "max_codes" and value == 0):
            raise SettingsError(f"{name} must be a number {least}, got {value!r}")
    return " and ".join(f"{name} {value:g}" for name, value in wanted.items())
