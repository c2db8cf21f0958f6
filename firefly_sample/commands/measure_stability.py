"""``firefly measure stability``: hold cases at numerical extremes to their bounds."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from operator import itemgetter
from typing import Annotated, Any

from cyclopts import CycloptsError, Parameter

from firefly_sample.columns import align
from firefly_sample.commands.options import Flag, Names, Patterns, Whole
from firefly_sample.commands.terminal import print_json, print_result, progress_bar

Row = dict[str, Any]


def stability(
    *words: Annotated[str, Parameter(show=False)],
    case: Patterns | None = None,
    method: Names | None = None,
    device: Whole | None = None,
    require_gpu: Flag = False,
    json: Flag = False,
    markdown: Flag = False,
) -> int:
    """Measure numerical extremes with every position method, and hold each to its bound.

    The exit code is 1 if a case fails that is not expected to.

    Parameters
    ----------
    case
        Run the case with exactly this name, or else every case whose name contains it or matches it as a
        shell pattern, for example 'spot of *'. May be repeated.
    method
        Run these methods only, separated by commas. May be repeated.
    device
        Which EGL device to draw with (see firefly doctor).
    require_gpu
        Fail rather than draw with a software driver.
    json
        Print JSON.
    markdown
        Print the tables as Markdown, as docs/stability.md has them.
    """
    from firefly_sample.lab.stability import measure_stability

    if words:
        raise CycloptsError(f"{words[0]!r} is not an option: choose a case with --case {words[0]!r}")
    if json and markdown:
        raise CycloptsError("--json and --markdown exclude each other: leave one of them out")
    with progress_bar("cases") as progress:
        result = measure_stability(
            cases=case, methods=method, progress=progress, device=device, require_gpu=require_gpu
        )
    if json:
        print_json(result | {"cases": [_finite_or_text(row) for row in result["cases"]]})
    else:
        print_result(stability_as_markdown(result) if markdown else stability_as_text(result))
    return int(any(row["verdict"] == "fail" for row in result["cases"]))


def _finite_or_text(row: Row) -> Row:
    """Return a row with "inf" and "nan" as text, since JSON has no such numbers."""
    return {
        key: str(value) if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in row.items()
    }


def stability_as_text(result: dict[str, Any]) -> str:
    """Return a measurement as a table, a row per case and method; then the reasons of expected failures."""
    table = [("CASE", "METHOD", "BOUND", "MEASURED", "VERDICT", "WARNING")]
    for name, rows in _by_case(result).items():
        for row in rows:
            numbers = (f"{row['bound']:.3g}", f"{row['measured']:.3g}")
            table.append((name, row["method"], *numbers, row["verdict"], row["warning"]))
            name = ""
    reasons = [f"expected: {reason}" for reason in _reasons(result)]
    counts = Counter(row["verdict"] for row in result["cases"])
    verdicts = ", ".join(f"{counts[name]} {name}" for name in ("pass", "expected", "fail"))
    return "\n".join([result["driver"], align(table), *reasons, verdicts])


def _by_case(result: dict[str, Any]) -> dict[str, list[Row]]:
    return {name: list(rows) for name, rows in groupby(result["cases"], itemgetter("case"))}


def _reasons(result: dict[str, Any]) -> list[str]:
    """Return the reasons of expected failures, each once."""
    return list(dict.fromkeys(row["reason"] for row in result["cases"] if row["verdict"] == "expected"))


def stability_as_markdown(result: dict[str, Any]) -> str:
    """Return a measurement as the tables of docs/stability.md.

    Cases of position methods have a column per method, or are only named if they are 0 with every method.
    Cases with other methods have a row per method. The reasons of expected failures follow.
    """
    from firefly_sample.lab.experiments.experiment import POSITIONS

    methods = [method for method in POSITIONS if any(row["method"] == method for row in result["cases"])]
    wide, zero, others = [], [], []
    for name, rows in _by_case(result).items():
        if rows[0]["method"] not in POSITIONS:
            others += [(name, row["method"], _number(row["bound"]), _measured(row)) for row in rows]
        elif any(row["measured"] != 0.0 for row in rows):
            wide.append((name, *_cells(rows, methods)))
        else:
            zero.append(name)
    verdicts = Counter(row["verdict"] for row in result["cases"])
    parts = [
        f"{result['driver']}: {verdicts['pass']} pass, {verdicts['expected']} fail as expected, "
        f"{verdicts['fail']} fail otherwise."
    ]
    if wide:
        parts.append(_markdown(("case", "bound", *methods), *wide))
    if zero:
        text = f"Every method measured 0: {'; '.join(zero)}."
        parts.append(textwrap.fill(text, 118, break_long_words=False, break_on_hyphens=False))
    if others:
        parts.append(_markdown(("case", "method", "bound", "measured"), *others))
    if reasons := _reasons(result):
        parts += ["These fail as expected:", "\n".join(f"- {reason}" for reason in reasons)]
    return "\n\n".join(parts)


def _cells(rows: Sequence[Row], methods: Sequence[str]) -> list[str]:
    """Return the smallest bound, and each method's figure, followed by its own bound where that differs."""
    least = min(row["bound"] for row in rows)
    found = {row["method"]: row for row in rows}
    bounds = {row["method"]: f" ({_number(row['bound'])})" for row in rows if row["bound"] != least}
    return [_number(least), *(_measured(found[method]) + bounds.get(method, "") for method in methods)]


def _measured(row: Row) -> str:
    number = _number(row["measured"])
    return {"pass": number, "expected": f"**{number}**"}.get(row["verdict"], f"{number} fails")


def _number(value: float) -> str:
    """Return two digits, for example 3.3e-7; 0 as it is."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    digits, power = f"{value:.1e}".split("e")
    return f"{digits}e{int(power)}"


def _markdown(*rows: Sequence[str]) -> str:
    """Return a table; its first row is the head."""
    head, *body = ["| " + " | ".join(cells) + " |" for cells in rows]
    return "\n".join([head, "|" + "---|" * len(rows[0]), *body])
