"""Cases at numerical extremes, each held to its bound with every position method.

A case measures one number against a known or float64 result; it must not exceed the case's bound, which the
accurate methods hold. The error of a coarse method (a standard depth buffer, half floats) follows the law of
its own format instead:

- While that law stays below a display code, it is the method's bound: within it the method passes, and needs
  no warning.
- Where it exceeds a display code, the bound is the case's own. A method that does not hold it fails as
  expected if `EXPECTED` names it, and only if the frame's plan warned of that error.

If a driver lacks what a method needs, the method is judged by the law of its substitute. Cases that a driver
cannot draw are left out. No picture may hold a value that is not finite, not even in an expected failure.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

from firefly_sample.errors import FireflyError, SettingsError, did_you_mean
from firefly_sample.lab.experiments import CASES
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.cases import error_warning
from firefly_sample.lab.experiments.experiment import Experiment


class Expected(NamedTuple):
    """Failures that follow from the error law of some methods; `cases` is a pattern as in a shell."""

    cases: str
    methods: tuple[str, ...]
    reason: str

    def __str__(self) -> str:
        return f"{self.cases} with {', '.join(self.methods)}: {self.reason}"


_STANDARD = ("depth24", "depth16", "inverse_matrix")
_HALF = ("stored16f",)
_FEW_CODES = "a standard depth buffer has few codes or none at 1e5 times the near plane's distance"
_OTHER_DIGITS = "half floats keep three digits, and a position in other units is rounded to other ones"
_HALF_END = "half floats end at 65504 units"

EXPECTED: tuple[Expected, ...] = (
    Expected(
        "distance, f/n 1000",
        ("depth16",),
        "16 bits of depth have an error of 7.6e-6 y/n of the distance: 4e-3 at y/n 500",
    ),
    Expected("distance, f/n 1e+0[69]", _STANDARD, _FEW_CODES),
    Expected("distance, far infinite, y/n 500000", _STANDARD, _FEW_CODES),
    Expected("distance, f/n 1e+09", _HALF, _HALF_END),
    Expected(
        "distance, fov 179.999",
        _HALF,
        f"{_HALF_END}, and a view this wide reaches a million to the side",
    ),
    Expected(
        "moved by 2^[23]0",
        ("inverse_matrix",),
        "it goes through float32 coordinates of a world whose origin is far away",
    ),
    Expected(
        "small far light at y/n *",
        _STANDARD,
        "a standard depth buffer finds the surface elsewhere, out of a small light's reach",
    ),
    Expected(
        "small far light at y/n *",
        _HALF,
        "half floats move a surface a thousand units away by up to a unit, out of a small light's reach",
    ),
    Expected(
        "scaled by 1e-06",
        _HALF,
        "half floats step by 6e-8 at least, and the whole scene is 2e-5 units long",
    ),
    Expected("scaled by 0.001", _HALF, _OTHER_DIGITS),
    Expected("scaled by 1000", _HALF, _OTHER_DIGITS),
    Expected("scaled by 1e+06", _HALF, f"{_HALF_END}, and the scene is 2e7 units long"),
    Expected(
        "scaled by 2^*50",
        _HALF,
        "half floats hold 6e-8 to 65504 units, and the scene is 2e-14 or 2e16 units long",
    ),
    Expected(
        "time of 1e9 s either way, lightbulbs",
        _HALF,
        "half floats move a surface 65 units away by up to 0.06, in or out of a light's volume",
    ),
)
"""The only failures that are expected. One that holds its bound after all passes."""


def measure_stability(
    cases: Sequence[str] | None = None,
    methods: Sequence[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
    device: int | None = None,
    require_gpu: bool = False,
) -> dict[str, Any]:
    """Measure the cases of `firefly_sample.lab.experiments`.

    Parameters
    ----------
    cases : sequence of str, optional
        Names, parts of names, or patterns as in a shell; all if absent. A whole name of a case does not count
        as a part of another's.
    methods : sequence of str, optional
        Most cases have one for each choice of `Settings.position_method`; all if absent.
    progress : callable, optional
        Called with (done, in all).
    device, require_gpu : see `firefly_sample.Renderer`

    Returns
    -------
    dict
        The output of ``firefly measure stability --json``: "driver", the GL renderer string, and "cases", one
        for each case and method, with

        "case", "method" : str
        "bound", "measured" : float
            In the case's own unit. The measured value may be infinite or NaN, which is text in JSON.
        "verdict" : {"pass", "fail", "expected"}
        "warning" : str
            The plan's warning of the method's error, or the error of a case that could not be drawn; else
            empty.
        "reason" : str
            Only of expected failures: which they are, and why.

    Raises
    ------
    SettingsError
        If there is no such case or method, or the driver can draw none of them.
    NoGpuError
        If there is nothing to draw with.
    """
    chosen = _choose(cases, methods)
    rows: list[dict[str, Any]] = []
    with ExperimentBench(device, require_gpu) as bench:
        driver = bench.renderer.driver
        chosen = [(case, method) for case, method in chosen if bench.can_draw(case.needs)]
        if not chosen:
            raise SettingsError(
                "this driver can draw none of these cases: firefly doctor lists what it lacks"
            )
        for case, method in chosen:
            rows.append(measure_case(bench, case, method))
            if progress is not None:
                progress(len(rows), len(chosen))
    return {"driver": driver, "cases": rows}


def measure_case(bench: ExperimentBench, case: Experiment, method: str) -> dict[str, Any]:
    """Return one row of `measure_stability`'s "cases"."""
    bench.begin()
    law, error = bench.law_of(method), ""
    bound = case.bound_for(law)
    try:
        measured = float(case.measure(bench, method, **case.arguments))
    except FireflyError as wrong:
        measured, error = math.inf, str(wrong)
    if math.isnan(measured):
        error = "the measured value is not a number"
    if bench.not_finite:
        error = f"{bench.not_finite} values of its pictures are not finite"
    warning = error or error_warning(bench.warnings, method)
    row = {"case": case.name, "method": method, "bound": bound, "measured": measured}
    if measured <= bound and not error:
        return row | {"verdict": "pass", "warning": warning}
    expected = reason_for(case.name, law) if warning and not error else None
    if expected is None:
        return row | {"verdict": "fail", "warning": warning}
    return row | {"verdict": "expected", "warning": warning, "reason": str(expected)}


def reason_for(case: str, method: str) -> Expected | None:
    """Return why a case may fail with a method, or None if it may not."""
    found = (each for each in EXPECTED if method in each.methods and fnmatchcase(case, each.cases))
    return next(found, None)


def _choose(cases: Sequence[str] | None, methods: Sequence[str] | None) -> list[tuple[Experiment, str]]:
    """Return the requested cases and methods, in the order of `CASES`."""
    known = list(dict.fromkeys(method for case in CASES for method in case.rows))
    example = repr(CASES[0].name)
    if methods is not None and not any(methods):
        raise SettingsError(f"no method was named: choose from {', '.join(known)}, or leave it out")
    if cases is not None and not (cases and all(map(str.strip, cases))):
        raise SettingsError(
            f"no case was named: give a name, or a part of one, such as {example}, or leave the choice out"
        )
    for method in methods or ():
        if method not in known:
            guess = did_you_mean(method, known)
            raise SettingsError(f"there is no method {method!r}{guess}: choose from {', '.join(known)}")
    wanted = {case.name for case in CASES} if cases is None else set()
    for pattern in cases or ():
        found = _meant(pattern)
        if not found:
            words = {word.strip(",") for case in CASES for word in (case.name, *case.name.split())}
            raise SettingsError(
                f"there is no case {pattern!r}{did_you_mean(pattern, sorted(words))}: "
                f"give a part of a name, such as {example}, or a pattern, such as 'spot*'"
            )
        wanted |= found
    chosen = [
        (case, method)
        for case in CASES
        if case.name in wanted
        for method in case.rows
        if not methods or method in methods
    ]
    if not chosen:
        raise SettingsError(
            f"no case that is called {' or '.join(map(repr, cases or ()))} is measured with "
            f"{' or '.join(methods or ())}: leave one of the two out"
        )
    return chosen


def _meant(pattern: str) -> set[str]:
    """Return the case of this whole name or, if there is none, those that a part or a pattern fits."""
    names = {case.name for case in CASES}
    return names & {pattern} or {name for name in names if pattern in name or fnmatchcase(name, pattern)}
