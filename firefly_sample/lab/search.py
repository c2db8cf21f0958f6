"""Search for settings: each choice is measured alone, then the most promising combinations as a whole.

Combinations are ranked by a prediction: errors of independent choices at most add up, and their ratios of
time roughly multiply. The result does not rest on predictions: it was drawn and timed as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.lab.measuring import pareto_front
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.trade_bench import FINEST, TradeBench
from firefly_sample.lab.variations import Variation, signature, single_choices
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

MARGIN = 0.7
"""Share of a bound that an error may reach on the measured frames: the largest of a million values differs
from frame to frame."""
MOST_NOISE = 0.1
"""Relative difference up to which two times may count as equal."""
UNCUT = 1e-6
MOST_VERIFIED = 8
MOST_TRIED = 20
SECONDS_ALONE, SECONDS_TOGETHER = 1.5, 4.0
"""About how long single choices and combinations are timed."""
REFERENCE_STEPS = 5
"""Steps of the progress, for each frame's reference."""

DIMENSIONS: tuple[tuple[str, ...], ...] = (
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
class Measured:
    """One choice of a dimension: its error with all others at their finest, and its time over the base's."""

    changes: dict[str, Any]
    error: float
    ratio: float
    spread: float


@dataclass(frozen=True)
class Option:
    """One choice of a dimension, or the prediction for a combination.

    Attributes
    ----------
    changes : dict
        Empty for the base's choice.
    error : float
        Of a choice: its error minus that of the finest choice of its dimension, 0 or more.
    ratio : float
        Its time over the base's; for a choice, 1 if the difference is within the spread.
    """

    changes: dict[str, Any]
    error: float
    ratio: float


def options_of(measured: list[Measured]) -> list[Option]:
    """Return the Pareto front of error and time of a dimension's choices, fastest first."""
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
    """Settings that were measured as a whole.

    Attributes
    ----------
    changes : dict
        The settings that differ from the base.
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


class Search:
    """Measures choices alone, then the most promising combinations."""

    def __init__(
        self,
        renderer: Renderer,
        scene: Scene,
        times: tuple[float, ...],
        base: Settings,
        fixed: dict[str, Any],
        by_codes: bool,
        samples: int,
        progress: Progress | None,
    ) -> None:
        self._base, self._fixed, self._by_codes, self._progress = base, fixed, by_codes, progress
        self._done = 0
        singles = [
            single
            for single in single_choices(renderer.plan(scene, times[0], ("color",)))
            if not set(single.changes) & fixed.keys()
        ]
        self._total = REFERENCE_STEPS * len(times) + len(singles) + MOST_TRIED
        self._benches = []
        for time in times:
            self._benches.append(TradeBench(renderer, scene, time, base, samples=samples))
            self._step(REFERENCE_STEPS)
        self.measured: list[Candidate] = []
        self._finest: dict[str, Any] = {}
        self._options = self._alone(singles)
        self._best = self.measure(self._different(self._finest))

    def _step(self, steps: int = 1) -> None:
        self._done += steps
        if self._progress is not None:
            self._progress(min(self._done, self._total), self._total)

    def _alone(self, singles: list[Variation]) -> list[list[Option]]:
        """Return the options of each dimension, and collect the finest choice of each."""
        bench = self._benches[0]
        open_to = {name for single in singles for name in single.changes}
        self._finest |= {name: value for name, value in FINEST.items() if name in open_to}
        if not {"cutoff_budget", "cutoff_threshold"} & self._fixed.keys():
            self._finest |= {"cutoff_budget": UNCUT, "cutoff_threshold": None}
        dimensions = []
        for names in DIMENSIONS:
            mine = [single for single in singles if next(iter(single.changes)) in names]
            if not mine or set(names) & self._fixed.keys():
                continue
            measured = [Measured({}, self._error_of(names, {}), 1.0, 0.0)]
            seen = {signature(bench.plan(self._base))}
            for single in mine:
                self._step()
                try:
                    own = signature(bench.plan(self._base.with_changes(**single.changes)))
                    if own in seen:
                        continue
                    error = self._error_of(names, single.changes)
                except SceneError:
                    continue  # maps or slices do not fit
                seen.add(own)
                timing = bench.time_of(self._base.with_changes(**single.changes), SECONDS_ALONE, most=5)
                measured.append(Measured(single.changes, error, timing.ratio, timing.spread))
            best = min(measured, key=lambda entry: entry.error)
            for name in names:
                self._finest.pop(name, None)
            self._finest |= best.changes
            dimensions.append(options_of(measured))
        return dimensions

    def _different(self, changes: dict[str, Any]) -> dict[str, Any]:
        """Return those that differ from the base."""
        return {name: value for name, value in changes.items() if getattr(self._base, name) != value}

    def _error_of(self, names: tuple[str, ...], changes: dict[str, Any]) -> float:
        """Return the error of one choice; all others are at their finest, so that none hides it."""
        rest = {name: value for name, value in self._finest.items() if name not in names}
        settings = self._base.with_changes(**(rest | changes))
        errors = [bench.draw(settings).errors for bench in self._benches]
        largest = max(e.largest for e in errors)
        # codes are whole numbers: radiance decides between equal ones
        return max(e.codes for e in errors) + min(largest, 0.99) if self._by_codes else largest

    def _predictions(self) -> list[Option]:
        finest = self._best.codes if self._by_codes else self._best.error
        return list(predictions(self._options, float(finest)))

    def measure(self, changes: dict[str, Any]) -> Candidate:
        """Draw settings on all frames, and time them on the first."""
        for known in self.measured:
            if known.changes == changes:
                return known
        settings = self._base.with_changes(**changes)
        errors = [bench.draw(settings).errors for bench in self._benches]
        timing = self._benches[0].time_of(settings, SECONDS_TOGETHER)
        candidate = Candidate(
            changes,
            max(e.largest for e in errors),
            max(e.codes for e in errors),
            timing.milliseconds,
            timing.ratio,
            timing.spread,
        )
        self.measured.append(candidate)
        return candidate

    def _verified(self, ranked: list[Option], good: Callable[[Candidate], bool]) -> list[Candidate]:
        """Return the first of the ranked combinations that are good when measured."""
        kept: list[Candidate] = []
        for prediction in ranked[:MOST_TRIED]:
            candidate = self.measure(prediction.changes)
            self._step()
            if good(candidate):
                kept.append(candidate)
            if len(kept) == MOST_VERIFIED:
                break
        return kept

    def fastest(self, max_error: float | None, max_codes: int | None, asked: str) -> Candidate:
        """Return the fastest candidate within the bounds, or one with half its error and about its time.

        `asked` is the bounds as text, for the error message if nothing meets them.
        """

        def good(candidate: Candidate) -> bool:
            return _within(candidate, max_error, max_codes, MARGIN)

        # predictions are often too high: the largest errors seldom fall on the same pixel
        most = 1.5 * MARGIN * max_error if max_error is not None else (max_codes or 0) + 1.0
        everything = self._predictions()
        promising = [p for p in everything if p.error <= most]
        ranked = sorted(promising, key=lambda p: (round(p.ratio, 3), p.error))
        kept = self._verified(ranked, good)
        if len(kept) < MOST_VERIFIED:
            nearest = sorted(everything, key=lambda p: (p.error, p.ratio))[: MOST_VERIFIED - len(kept)]
            kept += [candidate for candidate in self._verified(nearest, good) if candidate not in kept]
        # short timings are noisy: never give up the base for something slower
        kept += [c for c in (self._best, self.measure({})) if good(c) and c not in kept]
        if not kept:  # nothing keeps the margin: take the most accurate within the bounds
            kept = [c for c in self.measured if _within(c, max_error, max_codes, 1.0)]
            kept = [min(kept, key=lambda c: (c.error, c.ratio))] if kept else []
        if not kept:
            by_codes = self._by_codes
            best = min(self.measured, key=lambda c: (c.codes if by_codes else c.error, c.error))
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

        default = self.measure({})
        everything = self._predictions()
        within = [p for p in everything if p.ratio * default.milliseconds <= 1.1 * budget_ms]
        kept = self._verified(sorted(within, key=lambda p: (p.error, p.ratio)), good)
        kept += [candidate for candidate in (self._best, default) if good(candidate)]
        if not kept:
            fast = sorted(everything, key=lambda p: p.ratio)[:MOST_VERIFIED]
            best = min((self.measure(p.changes) for p in fast), key=lambda candidate: candidate.milliseconds)
            if not good(best):
                raise SettingsError(
                    f"no settings draw this scene in {budget_ms:g} ms: the fastest takes "
                    f"{best.milliseconds:.0f} ms, with {best.name}"
                )
            return best
        return min(kept, key=lambda candidate: candidate.error)


def _within(candidate: Candidate, max_error: float | None, max_codes: int | None, margin: float) -> bool:
    return (max_error is None or candidate.error <= margin * max_error) and (
        max_codes is None or candidate.codes <= max_codes
    )
