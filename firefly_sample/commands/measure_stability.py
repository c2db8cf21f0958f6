"""``firefly measure stability``: whether pictures hold at numerical extremes."""

from __future__ import annotations

from collections import Counter
from typing import Any

from firefly_sample.columns import align
from firefly_sample.commands.options import Flag, Names, Patterns, Whole
from firefly_sample.commands.terminal import print_json, progress_bar

__all__ = ["stability"]


def stability(
    *,
    case: Patterns | None = None,
    method: Names | None = None,
    device: Whole | None = None,
    require_gpu: Flag = False,
    json: Flag = False,
) -> int:
    """Draw numerical extremes by every way to find a position, and hold each to its bound.

    The exit code is 1 if any failed that was not expected to.

    Parameters
    ----------
    case
        Measure the cases of this name, part of a name or pattern only; repeat it for more.
    method
        Measure with these methods only: repeat it, or separate them by commas.
    device
        Which EGL device to draw with (see firefly doctor).
    require_gpu
        Fail rather than draw with a software driver.
    json
        Print JSON.
    """
    from firefly_sample.measure.stability import measure_stability

    with progress_bar("cases") as progress:
        result = measure_stability(
            cases=case, methods=method, progress=progress, device=device, require_gpu=require_gpu
        )
    if json:
        print_json(result)
    else:
        print(stability_as_text(result))
    return int(any(row["verdict"] == "fail" for row in result["cases"]))


def stability_as_text(result: dict[str, Any]) -> str:
    """A measurement as a table: a row a case and method, each case's name once; then why what failed may."""
    from firefly_sample.measure.stability import reason_for

    table = [("CASE", "METHOD", "BOUND", "MEASURED", "VERDICT", "WARNING")]
    before, reasons = "", {}
    for row in result["cases"]:
        name = row["case"] if row["case"] != before else ""
        before = row["case"]
        numbers = (f"{row['bound']:.3g}", f"{row['measured']:.3g}")
        table.append((name, row["method"], *numbers, row["verdict"], row["warning"]))
        expected = reason_for(row["case"], row["method"])
        if row["verdict"] == "expected" and expected is not None:
            reasons[expected.cases, expected.methods] = expected.reason
    lines = [result["driver"], align(table)]
    lines += [
        f"expected: {cases} with {', '.join(methods)}: {why}" for (cases, methods), why in reasons.items()
    ]
    counts = Counter(row["verdict"] for row in result["cases"])
    lines.append(", ".join(f"{counts[name]} {name}" for name in ("pass", "expected", "fail")))
    return "\n".join(lines)
