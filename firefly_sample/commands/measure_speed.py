"""``firefly measure speed``: frame times by the number of lights and the lighting method."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Parameter

from firefly_sample.commands.options import (
    DEFAULT_SCENE,
    Device,
    Flag,
    Folder,
    Names,
    RequireGpu,
    SceneName,
    Sizes,
    StartTime,
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
    counts: Wholes | None = None,
    sizes: Sizes = ((800, 600),),
    methods: Names | None = None,
    time: StartTime = None,
    seeds: Wholes | None = None,
    rounds: Whole = 5,
    longest: float = 5.0,
    device: Device = None,
    require_gpu: RequireGpu = False,
    json: Flag = False,
    settings: dict[str, Any],
    parameters: dict[str, Any],
) -> int:
    """Time frames with more and more lights, by each lighting method.

    Each frame is drawn by all methods in turn, and ratios are taken within a round. Besides the times, the
    tables compare the shaded fragments with the (pixel, light) pairs in range.

    Parameters
    ----------
    output
        Folder for speed.json, a table (speed.md) and a plot (growth.png); created if necessary.
    counts
        Numbers of lights, separated by commas, for a scene that can have any number. When absent, the number
        that you give by the scene's own option, or else 1,4,16,64,256,500,1000,4000,10000.
    sizes
        Widths and heights in pixels, separated by commas, for example 640x360,800x600,1920x1080.
    methods
        Lighting methods, separated by commas, from: volumes, original, clustered, auto, fullscreen, loop.
        When absent, all that the settings allow. "original" is volumes without a depth test, as in Panda3D's
        sample.
    time
        Time of the frame in seconds.
    seeds
        Measure the frames of these seeds, separated by commas; the scene's own seed when absent.
    rounds
        How often each method draws each frame.
    longest
        Seconds that a frame may take; frames that would take longer are left out and listed.
    json
        Print JSON.
    """
    from firefly_sample.lab.speed import measure_speed
    from firefly_sample.lab.speed_report import speed_as_text

    with progress_bar("frames", unit="frame") as progress:
        result = measure_speed(
            scene,
            output,
            parameters=parameters,
            counts=counts,
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
