"""``firefly measure speed``: what frames cost, by how many lights they have and how these are drawn."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Parameter

from firefly_sample.capture.sequence import DEFAULT_TIME
from firefly_sample.columns import align
from firefly_sample.commands.options import (
    DEFAULT_SCENE,
    Flag,
    Folder,
    Names,
    SceneName,
    Sizes,
    Time,
    Whole,
    Wholes,
    without_settings,
)
from firefly_sample.commands.terminal import print_json, print_result, progress_bar
from firefly_sample.settings import Settings


@without_settings("light_method", "volume_depth_test", "supersample")
def speed(
    scene: SceneName = DEFAULT_SCENE,
    *,
    output: Annotated[Folder | None, Parameter(name=["--output", "-o"])] = None,
    lights: Wholes | None = None,
    sizes: Sizes = ((800, 600),),
    methods: Names | None = None,
    time: Time = DEFAULT_TIME,
    seeds: Wholes | None = None,
    rounds: Whole = 5,
    longest: float = 5.0,
    device: Whole | None = None,
    require_gpu: Flag = False,
    json: Flag = False,
    settings: dict[str, Any],
    parameters: dict[str, Any],
) -> int:
    """Time frames with more and more lights, drawn as volumes, full-screen passes and the original's method.

    Each frame is drawn by all methods in turn, and ratios are taken within a round. Beside the times stands
    what was shaded, over what is in range of a light.

    Parameters
    ----------
    output
        Folder for speed.json, a table (speed.md) and a plot (growth.png); made if need be.
    lights
        How many lights, separated by commas: of a scene that can have any number. When absent, what the
        scene's own option says, or 1,4,16,64,256,500,1000,4000,10000.
    sizes
        Widths and heights in pixels, separated by commas; a whole sweep is 640x360,800x600,1920x1080.
    methods
        Which ways of drawing lights, separated by commas, for example volumes,loop; all that the settings
        allow when absent. A name that does not exist is answered with those that do.
    time
        Seconds.
    seeds
        Measure the frames of these seeds, separated by commas; the scene's own when absent.
    rounds
        How often each frame is drawn by each method.
    longest
        Seconds that a frame may take; what takes longer, or would, is left out, and said to be.
    device
        Which EGL device to draw with (see firefly doctor).
    require_gpu
        Fail rather than draw with a software driver.
    json
        Print JSON.
    """
    from firefly_sample.lab.speed import measure_speed

    with progress_bar("frames") as progress:
        result = measure_speed(
            scene,
            output,
            parameters=parameters,
            lights=lights,
            sizes=sizes,
            methods=methods,
            settings=Settings().with_changes(**settings),
            time=time,
            seeds=seeds,
            rounds=rounds,
            longest=longest,
            device=device,
            require_gpu=require_gpu,
            progress=progress,
        )
    done = f"the files in {output}" if output is not None else ""
    if json:
        print_json(result, done)
    else:
        print_result(speed_as_text(result), done)
    return 0


def speed_as_text(result: dict[str, Any]) -> str:
    """A measurement as tables, one a size: a row a count of lights and method, a column for each pass."""
    rows = result["rows"]
    passes = list(dict.fromkeys(name for row in rows for name in row["passes"]))
    head = (
        *("METHOD", "LIGHTS", "MS", "SPREAD", "RATIO", *(name.upper() for name in passes)),
        *("HOST", "CALLS", "SHADED", "PAIRS", "PER PAIR", "US A LIGHT", "GROWTH"),
    )
    several = isinstance(result["size"][0], list)
    lines = []
    for size in result["size"] if several else [result["size"]]:
        table = [_cells(row, passes) for row in rows if row["size"] == size]
        shape = "x".join(map(str, size))
        lines += [
            f"{result['scene']}, {shape}, {result['driver']}; milliseconds of a frame and of each pass",
            align([head, *table]),
        ]
    lines.append(f"chosen: {result['chosen']}; ratios are to its time")
    for left in result["left_out"]:
        shape = "x".join(map(str, left["size"]))
        lines.append(f"left out: {left['method']} with {left['lights']:,} at {shape}: {left['because']}")
    return "\n".join(lines)


def _cells(row: dict[str, Any], passes: list[str]) -> list[str]:
    return [
        row["method"],
        str(row["lights"]),
        *(_number(row[name]) for name in ("ms", "spread", "ratio")),
        *(_number(row["passes"].get(name)) for name in passes),
        _number(row["host_ms"]),
        str(row["draw_calls"]),
        *(_number(row[name], 0) for name in ("shaded", "pairs")),
        *(_number(row[name]) for name in ("shaded_per_pair", "slope", "growth")),
    ]


def _number(value: float | None, digits: int = 2) -> str:
    return "-" if value is None else f"{value:,.{digits}f}"
