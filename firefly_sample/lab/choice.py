"""Choose settings by measuring: the fastest within an error, or the most accurate within a time.

Each choice is measured alone, then the most promising combinations as a whole. Combinations are ranked by a
prediction: errors of independent choices at most add up, and their ratios of time roughly multiply. The
result does not rest on predictions: it was drawn and timed as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from firefly_sample.columns import align
from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.lab.measuring import pareto_front, require
from firefly_sample.lab.reference.chunks import Progress, Steps
from firefly_sample.lab.reference.frame import reference_settings
from firefly_sample.lab.trade_bench import FINEST, TradeBench
from firefly_sample.lab.variations import Variation, signature, single_choices
from firefly_sample.plan.exposure import with_exposure_at
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.scenes.plugin import scene_settings
from firefly_sample.settings import Settings

MARGIN = 0.7
"""Share of a bound that an error may reach on the measured frames: the largest of a million values differs
from frame to frame."""
MOST_NOISE = 0.1
"""Relative difference up to which two times may count as equal."""
UNCUT = {"cutoff_budget": 1e-6, "cutoff_threshold": None}
MOST_VERIFIED, MOST_TRIED = 8, 20
"""Combinations that are kept to choose from, and combinations that are measured for that."""
SECONDS_ALONE, SECONDS_TOGETHER = 1.5, 4.0
"""About how long single choices and combinations are timed."""
REFERENCE_STEPS = 5
"""Steps of the progress, for each frame's reference."""

DIMENSIONS: tuple[tuple[str, ...], ...] = (
    ("transparency",),
    ("shadow_resolution",),
    ("shadow_taps",),
    ("cutoff_budget", "cutoff_threshold"),
    ("light_resolution",),
    ("accumulation_format",),
    ("albedo_format",),
    ("normal_format",),
    ("interpolation",),
    ("position_method",),
    ("volume_proxy",),
    ("particle_shadow_interpolation",),
    ("particle_shadow_slices",),
    ("particle_shadow_tile",),
    ("particle_shadow_format",),
    ("particle_shadows", "particle_shadow_reads"),
    ("particle_order", "particle_order_depths"),
)
"""Settings that are one decision together, in the order of their possible errors, largest first."""


@dataclass(frozen=True)
class Option:
    """One choice of a dimension, or the prediction for a combination; the base's choice has no changes.

    The error of a measured choice is that with all other choices at their finest; `options_of` returns what
    it adds to the finest choice's. The ratio is the time over the base's, and has the spread.
    """

    changes: dict[str, Any]
    error: float
    ratio: float
    spread: float = 0.0


def options_of(measured: list[Option]) -> list[Option]:
    """Return the Pareto front of added error and time of a dimension's choices, fastest first.

    A ratio of time that differs from 1 by less than its spread becomes 1.
    """
    finest = min(entry.error for entry in measured)
    options = []
    for entry in measured:
        differs = abs(entry.ratio - 1.0) > max(entry.spread, 0.02)
        options.append(Option(entry.changes, entry.error - finest, entry.ratio if differs else 1.0))
    return pareto_front(options, lambda option: (option.ratio, option.error))


def predictions(dimensions: list[list[Option]], finest: float) -> Iterator[Option]:
    """Yield all combinations; `finest` is the error with every choice at its finest."""
    for chosen in product(*dimensions):
        changes: dict[str, Any] = {}
        for option in chosen:
            changes |= option.changes
        yield Option(
            changes,
            finest + sum(option.error for option in chosen),
            math.prod(option.ratio for option in chosen),
        )


@dataclass(frozen=True)
class Candidate:
    """Settings that were measured as a whole: `changes` are those that differ from the base.

    Attributes
    ----------
    error : float
        Largest error of radiance on any frame, over its 99.9th percentile.
    codes : int
        Largest difference of sRGB codes on any frame.
    milliseconds, ratio, spread : float
        Time on the first frame, the same over the base's time, and the interquartile range of that ratio.
    """

    changes: dict[str, Any]
    error: float
    codes: int
    milliseconds: float
    ratio: float
    spread: float

    @property
    def name(self) -> str:
        """The changes as text."""
        return ", ".join(f"{name}={value}" for name, value in self.changes.items()) or "default"


@dataclass(frozen=True)
class Choice:
    """The chosen settings and the evidence for them.

    Attributes
    ----------
    candidates : tuple of Candidate
        All settings that were measured as a whole, fastest first.
    asked : str
        The bound as text.
    times : tuple of float
        Times of the frames that were measured, in seconds.
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
            mark = "*" if candidate is self.chosen else ""
            times = f"{candidate.ratio:.2f}", f"{candidate.spread:.2f}", f"{candidate.milliseconds:.0f}"
            rows.append((mark, *times, f"{candidate.error:.1e}", str(candidate.codes), candidate.name))
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

    Errors are the largest on all frames, times are those of the first frame. Errors on the measured frames
    must stay below 0.7 of their bound (`MARGIN`), since other frames have other errors.

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
        Settings that are fixed, beside a named scene's own. Times are measured with its "supersample",
        errors on single samples, and an exposure of "auto" once, at the first time.
    size : (int, int)
        Pixels.
    times : sequence of float
        Seconds of the frames to measure, a few that are far apart: errors differ from frame to frame.
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
    if isinstance(scene, str):
        plugin = find_scene(scene)
        fixed = scene_settings(plugin, fixed)
        scene = build_scene(plugin, **dict(parameters or {}))
    wanted = Settings().with_changes(**fixed)
    base = wanted.with_changes(supersample=1)
    reference_settings(base)  # raises if this look has no reference
    require("embreex")
    if not times:
        raise SettingsError("the list of times is empty: give the time of at least one frame to measure")
    base = with_exposure_at(scene, base, times[0])
    with Renderer(size, base, device=device, require_gpu=require_gpu) as renderer:
        by_codes = max_error is None and max_codes is not None
        search = _Search(renderer, scene, times, base, fixed, by_codes, wanted.supersample, progress)
        if budget_ms is not None:
            chosen = search.most_accurate(budget_ms)
        else:
            chosen = search.fastest(max_error, max_codes, asked)
    candidates = tuple(sorted(search.measured, key=lambda candidate: candidate.ratio))
    return Choice(wanted.with_changes(**chosen.changes), chosen, candidates, asked, tuple(times))


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


class _Search:
    """Measures choices alone, then the most promising combinations; `measured` collects all of these."""

    def __init__(
        self,
        renderer: Renderer,
        scene: Scene,
        times: Sequence[float],
        base: Settings,
        fixed: dict[str, Any],
        by_codes: bool,
        samples: int,
        progress: Progress | None,
    ) -> None:
        self._base, self._fixed, self._by_codes = base, fixed, by_codes
        plan = renderer.plan(scene, times[0], ("color",))
        singles = [single for single in single_choices(plan) if not single.changes.keys() & fixed.keys()]
        self._steps = Steps(REFERENCE_STEPS * len(times) + len(singles) + MOST_TRIED, progress)
        self._benches = []
        for time in times:
            self._benches.append(TradeBench(renderer, scene, time, base, samples=samples))
            self._steps.add(REFERENCE_STEPS)
        self.measured: list[Candidate] = []
        self._finest: dict[str, Any] = {}
        options = self._alone(singles)
        finest = {name: value for name, value in self._finest.items() if getattr(base, name) != value}
        self._best = self._measure(finest)
        least = self._best.codes if by_codes else self._best.error
        self._predictions = list(predictions(options, float(least)))

    def _alone(self, singles: list[Variation]) -> list[list[Option]]:
        """Return the options of each dimension, and collect the finest choice of each."""
        bench = self._benches[0]
        open_to = {name for single in singles for name in single.changes}
        self._finest |= {name: value for name, value in FINEST.items() if name in open_to}
        if not UNCUT.keys() & self._fixed.keys():
            self._finest |= UNCUT
        dimensions = []
        for names in DIMENSIONS:
            mine = [single.changes for single in singles if next(iter(single.changes)) in names]
            if not mine or set(names) & self._fixed.keys():
                continue
            measured = [Option({}, self._error_of(names, {}), 1.0)]
            seen = {signature(bench.plan(self._base))}
            for changes in mine:
                self._steps.add()
                settings = self._base.with_changes(**changes)
                try:
                    own = signature(bench.plan(settings))
                    if own in seen:
                        continue
                    error = self._error_of(names, changes)
                except SceneError:
                    continue  # maps or slices do not fit
                seen.add(own)
                timing = bench.time_of(settings, SECONDS_ALONE, most=5)
                measured.append(Option(changes, error, timing.ratio, timing.spread))
            best = min(measured, key=lambda entry: entry.error)
            for name in names:
                self._finest.pop(name, None)
            self._finest |= best.changes
            dimensions.append(options_of(measured))
        return dimensions

    def _errors(self, settings: Settings) -> tuple[float, int]:
        """Return the largest error of radiance and of codes on all frames."""
        errors = [bench.draw(settings).errors for bench in self._benches]
        return max(e.largest for e in errors), max(e.codes for e in errors)

    def _error_of(self, names: tuple[str, ...], changes: dict[str, Any]) -> float:
        """Return the error of one choice; all others are at their finest, so that none hides it."""
        rest = {name: value for name, value in self._finest.items() if name not in names}
        largest, codes = self._errors(self._base.with_changes(**(rest | changes)))
        # codes are whole numbers: radiance decides between equal ones
        return codes + min(largest, 0.99) if self._by_codes else largest

    def _measure(self, changes: dict[str, Any]) -> Candidate:
        """Draw settings on all frames, and time them on the first."""
        for known in self.measured:
            if known.changes == changes:
                return known
        settings = self._base.with_changes(**changes)
        errors = self._errors(settings)
        timing = self._benches[0].time_of(settings, SECONDS_TOGETHER)
        self.measured.append(Candidate(changes, *errors, timing.milliseconds, timing.ratio, timing.spread))
        return self.measured[-1]

    def _verified(self, ranked: list[Option], good: Callable[[Candidate], bool]) -> list[Candidate]:
        """Return the first of the ranked combinations that are good when measured."""
        kept: list[Candidate] = []
        for prediction in ranked[:MOST_TRIED]:
            candidate = self._measure(prediction.changes)
            self._steps.add()
            if good(candidate):
                kept.append(candidate)
            if len(kept) == MOST_VERIFIED:
                break
        return kept

    def fastest(self, max_error: float | None, max_codes: int | None, asked: str) -> Candidate:
        """Return the fastest candidate within the bounds, or one with half its error and about its time."""

        def good(candidate: Candidate, margin: float = MARGIN) -> bool:
            return (max_error is None or candidate.error <= margin * max_error) and (
                max_codes is None or candidate.codes <= max_codes
            )

        # predictions are often too high: the largest errors seldom fall on the same pixel
        most = 1.5 * MARGIN * max_error if max_error is not None else (max_codes or 0) + 1.0
        promising = [p for p in self._predictions if p.error <= most]
        kept = self._verified(sorted(promising, key=lambda p: (round(p.ratio, 3), p.error)), good)
        if len(kept) < MOST_VERIFIED:
            nearest = sorted(self._predictions, key=lambda p: (p.error, p.ratio))[: MOST_VERIFIED - len(kept)]
            kept += [candidate for candidate in self._verified(nearest, good) if candidate not in kept]
        # short timings are noisy: never give up the base for something slower
        kept += [c for c in (self._best, self._measure({})) if good(c) and c not in kept]
        if not kept:  # nothing keeps the margin: take the most accurate within the bounds
            kept = sorted((c for c in self.measured if good(c, 1.0)), key=lambda c: (c.error, c.ratio))[:1]
        if not kept:
            best = min(self.measured, key=lambda c: (c.codes if self._by_codes else c.error, c.error))
            fixed = [name for name in self._fixed if name != "supersample"]  # it does not affect errors
            stay = f" with {', '.join(fixed)} fixed" if fixed else ""
            raise SettingsError(
                f"no settings meet {asked} on this scene{stay}: the best have an error of {best.error:.1e} "
                f"and {best.codes} codes, with {best.name}"
            )
        quickest = min(kept, key=lambda candidate: candidate.ratio)
        near = min(max(quickest.spread, 0.02), MOST_NOISE)
        as_fast = [c for c in kept if c.ratio <= quickest.ratio * (1.0 + near)]
        best = min(as_fast, key=lambda candidate: candidate.error)
        return best if best.error <= 0.5 * quickest.error else quickest

    def most_accurate(self, budget_ms: float) -> Candidate:
        """Return the candidate with the smallest error within a time."""

        def good(candidate: Candidate) -> bool:
            return candidate.milliseconds <= budget_ms

        default = self._measure({})
        within = [p for p in self._predictions if p.ratio * default.milliseconds <= 1.1 * budget_ms]
        kept = self._verified(sorted(within, key=lambda p: (p.error, p.ratio)), good)
        kept += [candidate for candidate in (self._best, default) if good(candidate)]
        if kept:
            return min(kept, key=lambda candidate: candidate.error)
        fast = sorted(self._predictions, key=lambda p: p.ratio)[:MOST_VERIFIED]
        best = min((self._measure(p.changes) for p in fast), key=lambda candidate: candidate.milliseconds)
        if not good(best):
            raise SettingsError(
                f"no settings draw this scene in {budget_ms:g} ms: the fastest takes "
                f"{best.milliseconds:.0f} ms, with {best.name}"
            )
        return best
