"""``firefly measure start``: the time to the first picture."""

from __future__ import annotations

from typing import Any

from firefly_sample.columns import align
from firefly_sample.commands.options import DEFAULT_SCENE, Device, Flag, SceneName, Size, StartTime, Whole
from firefly_sample.commands.terminal import print_json, print_result, progress_bar


def start(
    scene: SceneName = DEFAULT_SCENE,
    *,
    time: StartTime = None,
    size: Size = (800, 600),
    rounds: Whole = 5,
    device: Device = None,
    json: Flag = False,
) -> int:
    """Time fresh processes to their first picture, with and without the cache of models and textures.

    Parameters
    ----------
    time
        Time of the picture in seconds.
    rounds
        How often each kind of process runs.
    json
        Print JSON.
    """
    from firefly_sample.lab.start import measure_start

    with progress_bar("processes") as progress:
        result = measure_start(scene, size=size, time=time, rounds=rounds, device=device, progress=progress)
    if json:
        print_json(result)
    else:
        print_result(start_as_text(result))
    return 0


def start_as_text(result: dict[str, Any]) -> str:
    """Return a measurement as a table with a row for each state of the cache."""
    table = [("CACHE", "SECONDS", "RATIO", "SPREAD")]
    table += [
        (row["cache"], f"{row['seconds']:.2f}", f"{row['ratio']:.2f}", f"{row['spread']:.2f}")
        for row in result["rows"]
    ]
    size = "x".join(map(str, result["size"]))
    return "\n".join(
        [
            f"{result['scene']}, {size}, {result['driver']}; from a process's start to its first picture",
            align(table),
            f"ratios are to importing the libraries and opening a context: {result['dependencies']:.2f} s",
            "all pictures are equal",
        ]
    )
