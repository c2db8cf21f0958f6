"""``firefly measure panda3d``: frames of a live Panda3D program, and of the same scene alone."""

from __future__ import annotations

from firefly_sample.commands.options import Flag, Size, Whole
from firefly_sample.commands.terminal import print_json, print_result, progress_bar


def panda3d(*, frames: Whole = 20, size: Size = (640, 480), json: Flag = False) -> int:
    """Time frames of a Panda3D program that FireflyView draws, beside the same scene drawn without Panda3D.

    The program has a model, a floor, and 0, 100 or 500 moving PointLights. The table also shows the parts of
    a live frame: to follow Panda3D's graph, to draw and read the picture, and to hand it over to Panda3D.

    Parameters
    ----------
    frames
        Frames of each number of lights.
    json
        Print JSON.
    """
    from firefly_sample.lab.panda3d_speed import measure_panda3d, panda3d_as_text

    with progress_bar("rows", unit="row") as progress:
        result = measure_panda3d(frames=frames, size=size, progress=progress)
    if json:
        print_json(result)
    else:
        print_result(panda3d_as_text(result))
    return 0
