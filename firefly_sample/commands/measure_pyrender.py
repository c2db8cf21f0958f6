"""``firefly measure pyrender``: frames of pyrender's scenes, drawn here and by pyrender."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from firefly_sample.commands.options import Flag, Folder, Names, Size, Whole
from firefly_sample.commands.terminal import print_json, print_result, progress_bar


def pyrender(
    *,
    output: Annotated[Folder | None, Parameter(name=["--output", "-o"])] = None,
    scenes: Names | None = None,
    ways: Names | None = None,
    frames: Whole = 1000,
    size: Size = (640, 480),
    json: Flag = False,
) -> int:
    """Time loops over poses of pyrender's scenes, drawn by this package and by pyrender itself.

    Each renderer draws in a process of its own. They draw the same poses in turn, some frames at a time, and
    ratios are taken within a turn. The table also shows the meshes that were converted after the first frame,
    and how much memory grew from frame 100 to the last.

    Parameters
    ----------
    output
        Folder for pyrender.json and a table, pyrender.md; created if necessary.
    scenes
        Scenes, separated by commas, from: one mesh, tabletop, 300 nodes. All when absent.
    ways
        What is drawn of each pose, separated by commas, from: color+depth, depth, segments, color+segments.
        All when absent.
    frames
        Poses of each loop.
    json
        Print JSON.
    """
    from firefly_sample.lab.pyrender_speed import measure_pyrender, pyrender_as_text

    with progress_bar("frames", unit="frame") as progress:
        result = measure_pyrender(
            output, scenes=scenes, ways=ways, frames=frames, size=size, progress=progress
        )
    done = f"the files in {output}" if output is not None else ""
    if json:
        print_json(result, done)
    else:
        print_result(pyrender_as_text(result), done)
    return 0
