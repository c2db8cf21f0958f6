"""Settings chosen by what their error may be, or by how long a frame may take: shared by capture and run."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from cyclopts import Group, Parameter

from firefly_sample.commands.options import Whole
from firefly_sample.commands.terminal import progress_bar

_GROUP = Group("Choose settings by measuring", sort_key=1)

MaxError = Annotated[
    float | None,
    Parameter(
        group=_GROUP,
        metavar="E",
        help="Choose the fastest settings whose largest error of radiance, over its 99.9th percentile, is at "
        "most this: measured on this scene first. Settings that are given stay.",
    ),
]
MaxCodes = Annotated[
    Whole | None,
    Parameter(group=_GROUP, metavar="N", help="The same, by the largest difference of sRGB codes."),
]
BudgetMs = Annotated[
    float | None,
    Parameter(
        group=_GROUP,
        metavar="MS",
        help="Choose the most accurate settings whose passes draw a frame in so many milliseconds on this "
        "machine.",
    ),
]


def settings_within(
    scene: str,
    given: dict[str, Any],
    *,
    max_error: float | None,
    max_codes: int | None,
    budget_ms: float | None,
    parameters: Mapping[str, Any],
    size: tuple[int, int],
    times: Sequence[float],
    device: int | None = None,
    require_gpu: bool = False,
    quiet: bool = False,
) -> dict[str, Any]:
    """The given settings with what was chosen, or as they are where nothing is asked for; tells why."""
    if max_error is None and max_codes is None and budget_ms is None:
        return given
    from firefly_sample.lab.choice import choose

    with progress_bar("choosing settings", show=not quiet) as progress:
        choice = choose(
            scene,
            max_error=max_error,
            max_codes=max_codes,
            budget_ms=budget_ms,
            parameters=parameters,
            given=given,
            size=size,
            times=times,
            device=device,
            require_gpu=require_gpu,
            progress=progress,
        )
    if not quiet:
        print(choice.evidence(), file=sys.stderr)
    return given | choice.chosen.changes
