"""Whether pictures hold at numerical extremes, for every way to find a position.

A case draws something whose answer is known, or is found in float64, and gives one number that must not
exceed the case's bound. Bounds are what accurate methods hold. A coarse method (a standard depth buffer, half
floats) errs by the law of its own format instead:

- While that law stays below a display code, it is the method's bound: within it the method passes, and no
  warning is asked for.
- Where it exceeds a display code, the bound is the case's own. A method that does not hold it fails as
  expected if `EXPECTED` names it, and only if the frame's plan warned its user of just that.

A method errs by another's law where a driver lacks what it needs; it is then judged as that one. Cases that a
driver cannot draw at all are left out.

No picture may hold a value that is not finite, whatever is expected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, Literal

from firefly_sample.errors import FireflyError, SettingsError, did_you_mean
from firefly_sample.lab.experiments import ALL_CASES
from firefly_sample.lab.experiments.bench import Bench
from firefly_sample.lab.experiments.case import Case, error_warning

Verdict = Literal["pass", "fail", "expected"]


@dataclass(frozen=True)
class Expected:
    """Failures that follow from a method's law.

    Attributes
    ----------
    cases : str
        Pattern of the cases' names, as a shell has them.
    methods : tuple of str
        By whose law the method errs.
    reason : str
    """

    cases: str
    methods: tuple[str, ...]
    reason: str

    def __str__(self) -> str:
        return f"{self.cases} with {', '.join(self.methods)}: {self.reason}"


_OTHER_DIGITS = "half floats keep three digits, and a place in other units is rounded to other ones"

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
        ("depth24", "depth16", "inverse_matrix"),
        "a standard depth buffer finds the surface elsewhere, out of a small light's reach",
    ),
    Expected(
        "small far light at y/n *",
        ("stored16f",),
        "half floats put a surface a thousand units away up to a unit aside, out of a small light's reach",
    ),
    Expected(
        "scaled by 1e-06",
        ("stored16f",),
        "half floats step by 6e-8 at least, and the whole scene is 2e-5 units long",
    ),
    Expected("scaled by 0.001", ("stored16f",), _OTHER_DIGITS),
    Expected("scaled by 1000", ("stored16f",), _OTHER_DIGITS),
    Expected(
        "scaled by 1e+06",
        ("stored16f",),
        "half floats end at 65504 units, and the scene is 2e7 units long",
    ),
    Expected(
        "scaled by 2^*50",
        ("stored16f",),
        "half floats hold 6e-8 to 65504 units, and the scene is 2e-14 or 2e16 units long",
    ),
    Expected(
        "time of 1e9 s either way, lightbulbs",
        ("stored16f",),
        "half floats move a surface 65 units away by up to 0.06, in or out of what a light's volume covers",
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
        Names, parts of names, or patterns as a shell has them; all when absent. What is a case's whole name
        is no part of another's.
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
            In the case's own unit. What is measured may be infinite or NaN, which JSON has as text.
        "verdict" : {"pass", "fail", "expected"}
        "warning" : str
            What the plan says of the method's error; of a case that failed because it could not be drawn,
            what went wrong; else empty.
        "reason" : str
            Of expected failures only: which they are, and why.

    Raises
    ------
    SettingsError
        If there is no such case or method, or the driver can draw none of them.
    NoGpuError
        If there is nothing to draw with.
    """
    chosen = _choose(cases, methods)
    rows = []
    with Bench(device, require_gpu) as bench:
        chosen = [(case, method) for case, method in chosen if bench.can_draw(case.needs)]
        if not chosen:
            raise SettingsError("this driver can draw none of these cases: firefly doctor says what it lacks")
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
    if math.isnan(measured):
        error = "what was measured is no number"
    if bench.not_finite:
        error = f"{bench.not_finite} values of its pictures are no finite numbers"
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
    """Why a case may fail with a method; None if it may not."""
    for expected in EXPECTED:
        if method in expected.methods and fnmatchcase(case, expected.cases):
            return expected
    return None


def _choose(cases: Sequence[str] | None, methods: Sequence[str] | None) -> list[tuple[Case, str]]:
    """The cases and methods that are asked for, in their own order."""
    known = list(dict.fromkeys(method for case in ALL_CASES for method in case.methods))
    if methods is not None and not any(methods):
        raise SettingsError(f"no method was named: choose from {', '.join(known)}, or leave it out")
    if cases is not None and not (cases and all(map(str.strip, cases))):
        raise SettingsError(
            f"no case was named: give a name, or a part of one, such as {ALL_CASES[0].name!r}, or leave the "
            "choice out"
        )
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
    return found


def _matches(pattern: str, name: str) -> bool:
    """Whether a case is meant: by its name or, if no case is called just that, by a part or a pattern."""
    if any(pattern == case.name for case in ALL_CASES):
        return pattern == name
    return pattern in name or fnmatchcase(name, pattern)
