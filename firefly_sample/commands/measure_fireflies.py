"""``firefly measure fireflies``: Panda3D's sample, drawn by Panda3D and here, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter, Token

from firefly_sample.commands.options import Device, Flag, Folder, Size, Time
from firefly_sample.commands.terminal import print_json, print_result, progress_bar
from firefly_sample.settings import Look


def _to_png(_: Any, tokens: Sequence[Token]) -> Path:
    path = Path(tokens[0].value)
    if path.suffix.lower() != ".png" or "\0" in path.name:
        raise ValueError(f"it must name a PNG file, for example both.png, got {tokens[0].value!r}")
    return path


_PngFile = Annotated[Path, Parameter(converter=_to_png, n_tokens=1, metavar="FILE")]


def fireflies(
    folder: Folder,
    /,
    *,
    output: Annotated[_PngFile | None, Parameter(name=["--output", "-o"])] = None,
    seconds: Time = 10.0,
    size: Size = (800, 600),
    look: Look = "classic",
    device: Device = None,
    json: Flag = False,
) -> int:
    """Draw your copy of Panda3D's sample fireflies by Panda3D and by this package, side by side.

    A process of its own runs the sample's main.py, in the display that DISPLAY names, in Xvfb, or without a
    display. Without one, Panda3D runs no shaders in Cg. Each ball that the sample draws as a light becomes a
    light. What is not drawn is named.

    Parameters
    ----------
    folder
        The sample's folder, with main.py.
    output
        A PNG file for both pictures, Panda3D's on the left.
    seconds
        The time of the pictures, after its models are loaded.
    size
        Width and height of each picture in pixels.
    look
        The look of our picture.
    json
        Print JSON.
    """
    from firefly_sample.lab.fireflies import fireflies_as_text, measure_fireflies

    with progress_bar("frames", unit="frame") as progress:
        result = measure_fireflies(
            folder, output, seconds=seconds, size=size, look=look, device=device, progress=progress
        )
    done = str(output) if output is not None else ""
    if json:
        print_json(result, done)
    else:
        print_result(fireflies_as_text(result), done)
    return 0
