"""Measure how the memory of a long capture grows: tiny pictures of an empty scene, in each way."""

from __future__ import annotations

from typing import Any

import numpy as np

from firefly_sample.capture.frames import parse_frames
from firefly_sample.errors import SceneError
from firefly_sample.lab.captures import Capturing
from firefly_sample.lab.reference.chunks import Progress, Steps
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes.plugin import Plugin

SIZE = (8, 6)
_SAMPLES = 8
_BLANK = "firefly_sample.lab.captures_growth:blank"

blank = Plugin("blank", "Nothing but the background.", (), Scene)


def measure_growth(
    frames: str = "1000:20000",
    *,
    workers: int = 2,
    device: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Measure how much memory a capture takes from one frame to a later one.

    Parameters
    ----------
    frames : str
        "FIRST:LAST": memory is compared between the moments when so many frames are on the disk. LAST is the
        number of frames of each capture.
    workers : int
        2 or more.
    device : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (captures done, captures in all).

    Returns
    -------
    dict
        The output of ``firefly measure captures --growth FIRST:LAST --json``: "driver"; "workers"; "frames",
        [FIRST, LAST]; "left_out", the ways that were not measured, with the reason; and "rows", one for each
        way: "way"; "rate", frames per second after the first quarter; "samples", a list of {"frame",
        "parent", "others"}, bytes of memory (proportional set size) of the process that captures, and of
        each process that it has started; "growth", bytes that its own memory grows from FIRST to LAST;
        "finished", bytes of its own when the manifest is written; and "others", bytes that the memory of all
        others together grows.

    Raises
    ------
    FireflyError
        If FIRST and LAST are no such numbers, or the driver is not usable.
    """
    span = parse_frames(frames)
    first, last = span.start, span.stop
    if span.step != 1 or first < 1:
        raise SceneError(f"growth is measured between two frames, for example 1000:20000, got {frames!r}")
    sampled = sorted({round(float(number)) for number in np.linspace(first, last, _SAMPLES)})
    rows = []
    with Capturing(_BLANK, None, workers, device) as capturing:
        steps = Steps(len(capturing.ways), progress)
        for way in capturing.ways:
            answer = capturing.capture(way, SIZE, last, sampled)
            samples = answer["samples"]
            rows.append(
                {
                    "way": way,
                    "rate": answer["rate"],
                    "samples": samples,
                    "growth": samples[-1]["parent"] - samples[0]["parent"],
                    "finished": answer["finished"]["parent"],
                    "others": sum(samples[-1]["others"]) - sum(samples[0]["others"]),
                }
            )
            steps.add()
    return {
        "driver": capturing.driver,
        "workers": workers,
        "frames": [first, last],
        "left_out": capturing.left_out,
        "rows": rows,
    }
