"""``firefly measure captures``: frames a second by one process, by workers, and by a cluster."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from firefly_sample.commands.options import (
    DEFAULT_SCENE,
    Device,
    Flag,
    Folder,
    SceneName,
    Sizes,
    StartTime,
    Whole,
)
from firefly_sample.commands.terminal import print_json, print_result, progress_bar
from firefly_sample.errors import OutputError


def captures(
    scene: SceneName = DEFAULT_SCENE,
    *,
    output: Annotated[Folder | None, Parameter(name=["--output", "-o"])] = None,
    sizes: Sizes = ((160, 120), (800, 600)),
    workers: Whole = 2,
    frames: Whole | None = None,
    time: StartTime = None,
    rounds: Whole = 3,
    growth: Annotated[str | None, Parameter(metavar="FIRST:LAST")] = None,
    device: Device = None,
    json: Flag = False,
) -> int:
    """Time captures by one process, by worker processes, and by a dask cluster on this machine.

    The files go into a temporary folder, which is removed; the environment variable TMPDIR chooses its disk.
    The tables show the time to the first frame, then frames per second, and the memory of each process.

    Parameters
    ----------
    output
        Folder for captures.json and captures.md; created if necessary.
    sizes
        Widths and heights in pixels, separated by commas.
    workers
        The number of worker processes, also in the cluster.
    frames
        Frames of each capture; when absent, as many as one process draws in 15 seconds.
    time
        Time of the first frame in seconds.
    rounds
        How often each way captures the frames.
    growth
        Measure instead how much memory a capture of tiny pictures takes between two frames, 1000:20000 say.
    json
        Print JSON.
    """
    if growth is not None:
        from firefly_sample.lab.captures_growth import measure_growth
        from firefly_sample.lab.captures_report import growth_as_text

        if output is not None:
            raise OutputError("--growth writes no files: leave --output out, and use --json")
        with progress_bar("captures") as progress:
            result = measure_growth(growth, workers=workers, device=device, progress=progress)
        text, done = growth_as_text(result), ""
    else:
        from firefly_sample.lab.captures import measure_captures
        from firefly_sample.lab.captures_report import captures_as_text

        with progress_bar("captures") as progress:
            result = measure_captures(
                scene,
                output,
                sizes=sizes,
                workers=workers,
                frames=frames,
                time=time,
                rounds=rounds,
                device=device,
                progress=progress,
            )
        text, done = captures_as_text(result), f"the files in {output}" if output is not None else ""
    if json:
        print_json(result, done)
    else:
        print_result(text, done)
    return 0
