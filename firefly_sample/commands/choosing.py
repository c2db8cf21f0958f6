"""Options of `capture` and `run` that choose settings by their measured error or time."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

from firefly_sample.capture.one_file import earlier_settings
from firefly_sample.commands.options import Whole
from firefly_sample.commands.terminal import complain, progress_bar

_GROUP = Group("Choose settings by measuring", sort_key=1)

MaxError = Annotated[
    float | None,
    Parameter(
        group=_GROUP,
        metavar="E",
        help="Measure the scene, then use the fastest settings whose largest error of radiance, divided by "
        "its 99.9th percentile, stays below this. Settings that you give are not changed.",
    ),
]
MaxCodes = Annotated[
    Whole | None,
    Parameter(
        group=_GROUP,
        metavar="N",
        help="The same for the largest difference in codes of the picture (0 to 255).",
    ),
]
BudgetMs = Annotated[
    float | None,
    Parameter(
        group=_GROUP,
        metavar="MS",
        help="Measure the scene, then use the most accurate settings whose passes draw a frame in this many "
        "milliseconds on this machine.",
    ),
]


def settings_within(
    scene: str,
    given: dict[str, Any],
    *,
    max_error: float | None,
    max_codes: int | None,
    budget_ms: float | None,
    quiet: bool = False,
    resumed: Path | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Return the given settings, with the chosen ones if there is a bound; print the evidence.

    Those of frames in the folder `resumed` are kept: measured times differ from run to run, and with other
    settings all frames would be drawn again. The other options are those of
    `firefly_sample.lab.choice.choose`.
    """
    bounds: dict[str, Any] = {"max_error": max_error, "max_codes": max_codes, "budget_ms": budget_ms}
    if all(bound is None for bound in bounds.values()):
        return given
    before = earlier_settings(resumed) if resumed is not None else None
    if before is not None:
        if not quiet:
            complain(f"the settings of the frames in {resumed} are kept: none are chosen again")
        return before | given
    from firefly_sample.lab.choice import choose

    with progress_bar("choosing settings", show=not quiet) as progress:
        choice = choose(scene, given=given, progress=progress, **bounds, **options)
    if not quiet:
        print(choice.evidence(), file=sys.stderr)
    return given | choice.chosen.changes
