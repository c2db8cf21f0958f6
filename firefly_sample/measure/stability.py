"""Whether pictures hold at numerical extremes, for every way to find a position.

A case draws something whose answer is known, or is found in float64, and gives one number that must not
pass the case's bound. Bounds are what accurate methods hold. A coarse method (a standard depth buffer, half
floats) errs by the law of its own format instead:

- While that law stays below a display code, it is the method's bound: within it the method passes, and no
  warning is asked for.
- Where it passes a display code, the bound is the case's own. A method that does not hold it fails as
  expected if `EXPECTED` names it, and only if the frame's plan warned its user of just that.

No picture may hold a value that is not finite, whatever is expected.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, Literal

from firefly_sample.errors import FireflyError, SettingsError, did_you_mean
from firefly_sample.measure.stability_cases import ALL_CASES
from firefly_sample.measure.stability_cases.bench import Bench
from firefly_sample.measure.stability_cases.case import Case

__all__ = ["EXPECTED", "Expected", "Verdict", "measure_case", "measure_stability", "reason_for"]

Verdict = Literal["pass", "fail", "expected"]


@dataclass(frozen=True)
class Expected:
    """Failures that follow from a method's law.

    Attributes
    ----------
    cases : str
        Pattern of the cases' names, as a shell has them.
    methods : tuple of str
    reason : str
    """

    cases: str
    methods: tuple[str, ...]
    reason: str


EXPECTED: tuple[Expected, ...] = (
    Expected(
        "distance, f/n 1000",
        ("depth16",),
        "16 bits of depth err by 7.6e-6 y/n of the distance: 4e-3 at y/n 500",
    ),
    Expected(
        "distance, f/n 1e+0[69]",
        ("depth24", "depth16", "inverse_matrix"),
        "a standard depth buffer has few codes or none for what is 1e5 times as far away as its near plane",
    ),
    Expected(
        "distance, far infinite, y/n 500000",
        ("depth24", "depth16", "inverse_matrix"),
        "a standard depth buffer has few codes or none for what is 1e5 times as far away as its near plane",
    ),
    Expected(
        "distance, f/n 1e+09",
        ("stored16f",),
        "half floats end at 65504 units",
    ),
    Expected(
        "distance, fov 179.999",
        ("stored16f",),
        "half floats end at 65504 units, and a view this wide reaches a million aside",
    ),
    Expected(
        "moved by 2^[23]0",
        ("inverse_matrix",),
        "it goes through float32 coordinates of a world whose origin is far away",
    ),
    Expected(
        "small far light at y/n *",
        ("stored16f",),
        "half floats put a surface a thousand units away up to a unit aside, out of a small light's volume",
    ),
    Expected(
        "scaled by *",
        ("stored16f",),
        "half floats keep three digits, other ones in other units, and neither 2e7 units nor 1e-5 of them",
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
    """Measure the cases of `firefly_sample.measure.stability_cases`.

    Parameters
    ----------
    cases : sequence of str, optional
        Names, parts of names, or patterns as a shell has them; all when absent.
    methods : sequence of str, optional
        Most cases have one for each choice of `Settings.position`; all when absent.
    progress : callable, optional
        Called with (done, in all).
    device, require_gpu : see `firefly_sample.Renderer`

    Returns
    -------
    dict
        What ``firefly measure stability --json`` prints: "driver", the GL renderer string, and "cases", one
        for each case and method, with

        "case", "method" : str
        "bound", "measured" : float
            In the case's own unit; a measurement that is no finite number is float64's largest.
        "verdict" : {"pass", "fail", "expected"}
        "warning" : str
            What the plan says of the method; of a case that failed because it could not be drawn, the error;
            else empty.

    Raises
    ------
    SettingsError
        If there is no such case or method.
    NoGpuError
        If there is nothing to draw with.
    """
    chosen = list(_choose(cases, methods))
    rows = []
    with Bench(device, require_gpu) as bench:
        for done, (case, method) in enumerate(chosen, 1):
            rows.append(measure_case(bench, case, method))
            if progress is not None:
                progress(done, len(chosen))
        driver = bench.renderer.driver
    return {"driver": driver, "cases": rows}


def measure_case(bench: Bench, case: Case, method: str) -> dict[str, Any]:
    """One row of `measure_stability`'s "cases"."""
    bench.begin()
    law, error = bench.law_of(method), ""
    bound = case.bound_for(law)
    try:
        measured = float(case.run(bench, method))
    except FireflyError as wrong:
        measured, error = math.inf, str(wrong)
    if bench.not_finite:
        error = f"{bench.not_finite} values of its pictures are no finite numbers"
    warning = next((line for line in bench.warnings if f"position={method}:" in line), "")
    return {
        "case": case.name,
        "method": method,
        "bound": bound,
        "measured": measured if math.isfinite(measured) else sys.float_info.max,
        "verdict": "fail" if error else _verdict(case, law, measured <= bound, bool(warning)),
        "warning": error or warning,
    }


def _verdict(case: Case, method: str, holds: bool, warned: bool) -> Verdict:
    if holds:
        return "pass"
    return "expected" if warned and reason_for(case.name, method) is not None else "fail"


def reason_for(case: str, method: str) -> Expected | None:
    """Why a case may fail with a method; None if it may not."""
    for expected in EXPECTED:
        if method in expected.methods and fnmatchcase(case, expected.cases):
            return expected
    return None


def _choose(cases: Sequence[str] | None, methods: Sequence[str] | None) -> Iterator[tuple[Case, str]]:
    """The cases and methods that are asked for, in their own order."""
    known = list(dict.fromkeys(method for case in ALL_CASES for method in case.methods))
    for method in methods or ():
        if method not in known:
            raise SettingsError(
                f"there is no method {method!r}{did_you_mean(method, known)}: choose from {', '.join(known)}"
            )
    for pattern in cases or ():
        if not any(_matches(pattern, case.name) for case in ALL_CASES):
            words = {word.strip(",") for case in ALL_CASES for word in (case.name, *case.name.split())}
            raise SettingsError(
                f"there is no case {pattern!r}{did_you_mean(pattern, sorted(words))}: "
                f"give a part of a name, such as {ALL_CASES[0].name!r}, or a pattern, such as 'spot*'"
            )
    found = [
        (case, method)
        for case in ALL_CASES
        if not cases or any(_matches(pattern, case.name) for pattern in cases)
        for method in case.methods
        if not methods or method in methods
    ]
    if not found:
        raise SettingsError(
            f"no case that is called {' or '.join(map(repr, cases or ()))} is measured with "
            f"{' or '.join(methods or ())}: leave one of the two out"
        )
    return iter(found)


def _matches(pattern: str, name: str) -> bool:
    return pattern in name or fnmatchcase(name, pattern)
