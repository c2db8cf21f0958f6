"""Measure frames of a live Panda3D program, beside the same scene drawn without Panda3D.

Both are drawn in one process, frame by frame in turn: times on a shared machine mean little by themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from firefly_sample.columns import align
from firefly_sample.errors import SceneError
from firefly_sample.frame import check_size
from firefly_sample.lab.fresh import start_process
from firefly_sample.lab.reference.chunks import Progress, Steps
from firefly_sample.model.panda3d.package import import_panda3d

_PROCESS = "firefly_sample.lab.panda3d_process"
_TIMES = "live", "alone", "graph", "picture", "hand over"


def measure_panda3d(
    *,
    lights: Sequence[int] = (0, 100, 500),
    frames: int = 20,
    size: tuple[int, int] = (640, 480),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Time frames of a Panda3D program with a `FireflyView`, which draws moving PointLights.

    Parameters
    ----------
    lights : sequence of int
        Numbers of lights, a row each.
    frames : int
        Frames of each row, after a first one that is not timed.
    size : (int, int)
        Pixels.
    progress : callable, optional
        Called with (rows done, rows in all).

    Returns
    -------
    dict
        The output of ``firefly measure panda3d --json``: "size", [width, height]; "frames"; "driver", the GL
        renderer string; and "rows", with "lights" and, each the median of milliseconds, "live", a frame of
        Panda3D's; "alone", the same scene drawn and read by a Renderer; and of the live frame "graph", to
        follow Panda3D's graph; "picture", to draw and read it; "hand over", to give it to Panda3D.

    Raises
    ------
    MissingPackageError
        If Panda3D is not installed.
    FireflyError
        If a number is wrong, or the process cannot draw.
    """
    import_panda3d()
    width, height = check_size(size)
    if frames < 1 or min(lights, default=-1) < 0:
        raise SceneError(f"there is nothing to measure with {frames} frames and lights {tuple(lights)}")
    steps = Steps(len(lights), progress)
    result: dict[str, Any] = {"size": [width, height], "frames": frames, "driver": "", "rows": []}
    for count in lights:
        with start_process(_PROCESS) as process:
            process.tell({"lights": count, "size": (width, height), "frames": frames})
            answer = process.answer()
        result["driver"] = answer["driver"]
        result["rows"].append({"lights": count, **{name: answer["ms"][name] for name in _TIMES}})
        steps.add(1)
    return result


def panda3d_as_text(result: dict[str, Any]) -> str:
    """Return a measurement as a table."""
    size = "x".join(map(str, result["size"]))
    head = ["LIGHTS", *(f"{name.upper()} MS" for name in _TIMES)]
    rows = [[str(row["lights"]), *(f"{row[name]:.1f}" for name in _TIMES)] for row in result["rows"]]
    return "\n".join(
        [
            f"{result['frames']} frames, {size}, {result['driver']}",
            align([head, *rows]),
            "live: a frame of Panda3D's; alone: the same scene without Panda3D; then the live frame's parts",
        ]
    )
