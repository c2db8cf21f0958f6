"""``firefly measure trade``: the time and the error of each setting."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Parameter

from firefly_sample.commands.options import (
    DEFAULT_SCENE,
    Device,
    Flag,
    Folder,
    RequireGpu,
    SceneName,
    Size,
    StartTime,
    without_settings,
)
from firefly_sample.commands.terminal import print_json, print_result, progress_bar
from firefly_sample.settings import Settings


@without_settings("supersample", "look")
def trade(
    scene: SceneName = DEFAULT_SCENE,
    *,
    output: Annotated[
        Folder | None,
        Parameter(name=["--output", "-o"], show_default=lambda _: "measured/SCENE"),
    ] = None,
    time: StartTime = None,
    size: Size = (800, 600),
    seconds: float = 4.0,
    fresh: Flag = False,
    device: Device = None,
    require_gpu: RequireGpu = False,
    json: Flag = False,
    settings: dict[str, Any],
    parameters: dict[str, Any],
) -> int:
    """Measure each setting's time, and its error against a float64 reference; the same for forward shading.

    Writes trade.json, a table (trade.md), a plot (pareto.png) and pictures of the largest differences. An
    interrupted run is resumed by the same command. Settings that you give change the
    default that all rows are compared with.

    Parameters
    ----------
    output
        Folder for the files; created if necessary.
    time
        Time of the frame in seconds.
    seconds
        About how many seconds to time each row.
    fresh
        Start over, even if an interrupted run could be resumed.
    json
        Print the contents of trade.json instead of the table.
    """
    from firefly_sample.lab.trade import default_folder, measure_trade, trade_as_markdown

    with progress_bar("measuring") as progress:
        result = measure_trade(
            scene,
            output,
            parameters=parameters,
            size=size,
            settings=Settings().with_changes(**settings),
            time=time,
            seconds=seconds,
            fresh=fresh,
            device=device,
            require_gpu=require_gpu,
            progress=progress,
        )
    done = f"the files in {output if output is not None else default_folder(scene)}"
    if json:
        print_json(result, done)
    else:
        print_result(trade_as_markdown(result), done)
    return 0
