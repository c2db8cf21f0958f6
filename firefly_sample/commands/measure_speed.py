"""``firefly measure speed``: what frames cost."""

from __future__ import annotations

from typing import Any

from firefly_sample.capture.sequence import DEFAULT_TIME
from firefly_sample.columns import align
from firefly_sample.commands.options import (
    DEFAULT_SCENE,
    Flag,
    SceneName,
    Size,
    Time,
    Whole,
    Wholes,
    without_settings,
)
from firefly_sample.commands.terminal import print_json, progress_bar
from firefly_sample.settings import Settings

__all__ = ["speed"]


@without_settings("lights", "volume_depth_test", "supersample")
def speed(
    scene: SceneName = DEFAULT_SCENE,
    *,
    time: Time = DEFAULT_TIME,
    seeds: Wholes | None = None,
    size: Size = (800, 600),
    device: Whole | None = None,
    require_gpu: Flag = False,
    json: Flag = False,
    settings: dict[str, Any],
    parameters: dict[str, Any],
) -> int:
    """Time each pass, and compare light volumes with full-screen passes and the original's method.

    Parameters
    ----------
    time
        Seconds.
    seeds
        Measure the frames of these seeds, separated by commas; the scene's own when absent.
    device
        Which EGL device to draw with (see firefly doctor).
    require_gpu
        Fail rather than draw with a software driver.
    json
        Print JSON.
    """
    from firefly_sample.measure.speed import measure_speed

    with progress_bar("frames") as progress:
        result = measure_speed(
            scene,
            parameters=parameters,
            size=size,
            settings=Settings().with_changes(**settings),
            time=time,
            seeds=seeds,
            device=device,
            require_gpu=require_gpu,
            progress=progress,
        )
    if json:
        print_json(result)
    else:
        print(speed_as_text(result))
    return 0


def speed_as_text(result: dict[str, Any]) -> str:
    """A measurement as a table: a row a method, with a column for each pass that any of them has."""
    rows = result["rows"]
    passes = list(dict.fromkeys(name for row in rows for name in row["passes"]))
    shown = (name.upper() for name in passes)
    head = ("METHOD", "LIGHTS", "MS", "SPREAD", "RATIO", *shown, "SHADED", "PAIRS", "PER PAIR")
    table = [
        (
            row["method"],
            str(row["lights"]),
            _number(row["ms"]),
            _number(row["spread"]),
            _number(row["ratio"]),
            *(_number(row["passes"].get(name)) for name in passes),
            _number(row["shaded"], 0),
            _number(row["pairs"], 0),
            _number(row["shaded_per_pair"]),
        )
        for row in rows
    ]
    size = "x".join(map(str, result["size"]))
    return "\n".join(
        [
            f"{result['scene']}, {size}, {result['driver']}; milliseconds of a frame and of each pass",
            align([head, *table]),
            f"chosen: {result['chosen']}; ratios are to its time",
        ]
    )


def _number(value: float | None, digits: int = 2) -> str:
    return "-" if value is None else f"{value:,.{digits}f}"
