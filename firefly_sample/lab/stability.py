"""Cases at numerical extremes, each held to its bound with every position method.

A case measures one number against a known or float64 result; it must not exceed the case's bound, which the
accurate methods hold. The error of a coarse method (a standard depth buffer, half floats) follows the law of
its own format instead:

- While that law stays below a display code, it is the method's bound: within it the method passes, and needs
  no warning.
- Where it exceeds a display code, the bound is the case's own. A method that does not hold it fails as
  expected if `EXPECTED` names it, and only if the frame's plan warned of that error.

If a driver lacks what a method needs, the method is judged by the law of its substitute. Cases that a driver
cannot draw are left out. No picture may hold a value that is not finite, whatever is expected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, Literal

from firefly_sample.errors import FireflyError, SettingsError, did_you_mean
from firefly_sample.lab.experiments import CASES
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import Experiment
from firefly_sample.lab.experiments.position_bounds import error_warning

Verdict = Literal["pass", "fail", "expected"]


@dataclass(frozen=True)
class Expected:
    """Failures that follow from a method's error law.

    Attributes
    ----------
    cases : str
        Pattern of the cases' names, as in a shell.
    methods : tuple of str
        The methods whose law it is.
    reason : str
    """

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

EXPECTED: tuple[Expected, ...] = tuple(
    Expected(cases, methods, reason)
    for cases, methods, reason in (
        (
            "distance, f/n 1000",
            ("depth16",),
            "16 bits of depth have an error of 7.6e-6 y/n of the distance: 4e-3 at y/n 500",
        ),
        ("distance, f/n 1e+0[69]", _STANDARD, _FEW_CODES),
        ("distance, far infinite, y/n 500000", _STANDARD, _FEW_CODES),
        ("distance, f/n 1e+09", _HALF, _HALF_END),
        ("distance, fov 179.999", _HALF, f"{_HALF_END}, and a view this wide reaches a million to the side"),
        (
            "moved by 2^[23]0",
            ("inverse_matrix",),
            "it goes through float32 coordinates of a world whose origin is far away",
        ),
        (
            "small far light at y/n *",
            _STANDARD,
            "a standard depth buffer finds the surface elsewhere, out of a small light's reach",
        ),
        (
            "small far light at y/n *",
            _HALF,
            "half floats move a surface a thousand units away by up to a unit, out of a small light's reach",
        ),
        (
            "scaled by 1e-06",
            _HALF,
            "half floats step by 6e-8 at least, and the whole scene is 2e-5 units long",
        ),
        ("scaled by 0.001", _HALF, _OTHER_DIGITS),
        ("scaled by 1000", _HALF, _OTHER_DIGITS),
        ("scaled by 1e+06", _HALF, f"{_HALF_END}, and the scene is 2e7 units long"),
        (
            "scaled by 2^*50",
            _HALF,
            "half floats hold 6e-8 to 65504 units, and the scene is 2e-14 or 2e16 units long",
        ),
        (
            "time of 1e9 s either way, lightbulbs",
            _HALF,
            "half floats move a surface 65 units away by up to 0.06, in or out of a light's volume",
        ),
    )
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
    rows = []
    with ExperimentBench(device, require_gpu) as bench:
        driver = bench.renderer.driver
        chosen = [(case, method) for case, method in chosen if bench.can_draw(case.needs)]
        if not chosen:
            raise SettingsError(
                "this driver can draw none of these cases: firefly doctor lists what it lacks"
            )
        for done, (case, method) in enumerate(chosen, 1):
            rows.append(measure_case(bench, case, method))
            if progress is not None:
                progress(done, len(chosen))
    return {"driver": driver, "cases": rows}


def measure_case(bench: ExperimentBench, case: Experiment, method: str) -> dict[str, Any]:
    """Return one row of `measure_stability`'s "cases"."""
    bench.begin()
    law, error = bench.law_of(method), ""
    bound = case.bound_for(law)
    try:
        measured = float(case.measure(bench, method))
    except FireflyError as wrong:
        measured, error = math.inf, str(wrong)
    if math.isnan(measured):
        error = "the measured value is not a number"
    if bench.not_finite:
        error = f"{bench.not_finite} values of its pictures are not finite"
    warning = error_warning(bench.warnings, method)
    expected = reason_for(case.name, law) if warning and not error else None
    verdict: Verdict = "fail" if expected is None else "expected"
    if measured <= bound and not error:
        verdict = "pass"
    row = {
        "case": case.name,
        "method": method,
        "bound": bound,
        "measured": measured,
        "verdict": verdict,
        "warning": error or warning,
    }
    if expected is not None and verdict == "expected":
        row["reason"] = str(expected)
    return row


def reason_for(case: str, method: str) -> Expected | None:
    """Return why a case may fail with a method, or None if it may not."""
    for expected in EXPECTED:
        if method in expected.methods and fnmatchcase(case, expected.cases):
            return expected
    return None


def _choose(cases: Sequence[str] | None, methods: Sequence[str] | None) -> list[tuple[Experiment, str]]:
    """Return the requested cases and methods, in the order of `CASES`."""
    known = list(dict.fromkeys(method for case in CASES for method in case.rows))
    if methods is not None and not any(methods):
        raise SettingsError(f"no method was named: choose from {', '.join(known)}, or leave it out")
    if cases is not None and not (cases and all(map(str.strip, cases))):
        raise SettingsError(
            f"no case was named: give a name, or a part of one, such as {CASES[0].name!r}, or leave the "
            "choice out"
        )
    for method in methods or ():
        if method not in known:
            raise SettingsError(
                f"there is no method {method!r}{did_you_mean(method, known)}: choose from {', '.join(known)}"
            )
    for pattern in cases or ():
        if not any(_matches(pattern, case.name) for case in CASES):
            words = {word.strip(",") for case in CASES for word in (case.name, *case.name.split())}
            raise SettingsError(
                f"there is no case {pattern!r}{did_you_mean(pattern, sorted(words))}: "
                f"give a part of a name, such as {CASES[0].name!r}, or a pattern, such as 'spot*'"
            )
    found = [
        (case, method)
        for case in CASES
        if not cases or any(_matches(pattern, case.name) for pattern in cases)
        for method in case.rows
        if not methods or method in methods
    ]
    if not found:
        raise SettingsError(
            f"no case that is called {' or '.join(map(repr, cases or ()))} is measured with "
            f"{' or '.join(methods or ())}: leave one of the two out"
        )
    return found


def _matches(pattern: str, name: str) -> bool:
    """Return whether a case is meant: by its whole name or, if no case has that, by a part or a pattern."""
    if any(pattern == case.name for case in CASES):
        return pattern == name
    return pattern in name or fnmatchcase(name, pattern)
