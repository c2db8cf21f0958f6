"""``firefly capture``: render frames to files."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Parameter

from firefly_sample.capture.sequence import (
    capture_frames,
    capture_settings,
    default_folder,
    frame_times,
)
from firefly_sample.commands.choosing import BudgetMs, MaxCodes, MaxError, settings_within
from firefly_sample.commands.options import (
    DEFAULT_SCENE,
    Device,
    Flag,
    Folder,
    Outputs,
    RequireGpu,
    SceneName,
    Size,
    StartTime,
)
from firefly_sample.commands.terminal import complain, print_json, print_summary, progress_bar
from firefly_sample.frame import check_outputs
from firefly_sample.scenes import find_scene
from firefly_sample.scenes.plugin import start_time


def capture(
    scene: SceneName = DEFAULT_SCENE,
    *,
    output: Annotated[
        Folder | None,
        Parameter(name=["--output", "-o"], show_default=lambda _: "captures/SCENE"),
    ] = None,
    frames: Annotated[str, Parameter(metavar="A:B[:STEP]", allow_leading_hyphen=True)] = "0:1",
    fps: float = 24.0,
    time: StartTime = None,
    size: Size = (800, 600),
    outputs: Outputs = ("color",),
    device: Device = None,
    require_gpu: RequireGpu = False,
    json: Flag = False,
    quiet: Annotated[Flag, Parameter(name=["--quiet", "-q"])] = False,
    max_error: MaxError = None,
    max_codes: MaxCodes = None,
    budget_ms: BudgetMs = None,
    settings: dict[str, Any],
    parameters: dict[str, Any],
) -> int:
    """Render frames of a scene to files: PNG pictures, npz data, and manifest.json.

    Options are also read from the environment (FIREFLY_CAPTURE_SIZE=320x240), and then, in the current
    folder, from the tables [firefly.capture] of firefly.toml and [tool.firefly.capture] of pyproject.toml.

    Parameters
    ----------
    output
        Folder for the files, made if need be; files of the same names are replaced.
    frames
        Frames A to B - 1, or one number.
    fps
        Frames per second: frame k is drawn at the time TIME + k / FPS.
    time
        The time of frame 0 in the scene.
    json
        Print the manifest.
    quiet
        Print neither a progress bar nor a summary.
    """
    if time is None:
        time = start_time(find_scene(scene))
    folder = output if output is not None else default_folder(scene)
    asked = capture_settings(outputs, **settings)
    check_outputs(outputs, asked.supersample)  # before the settings are chosen, which takes long
    settings = settings_within(
        scene,
        settings | {"supersample": asked.supersample},
        max_error=max_error,
        max_codes=max_codes,
        budget_ms=budget_ms,
        parameters=parameters,
        size=size,
        times=frame_times(frames, fps, time),
        device=device,
        require_gpu=require_gpu,
        quiet=quiet,
    )
    done = total = 0
    with progress_bar("frames", show=not quiet) as show_progress:

        def progress(now: int, in_all: int) -> None:
            nonlocal done, total
            done, total = now, in_all
            show_progress(now, in_all)

        try:
            manifest = capture_frames(
                scene,
                folder,
                frames=frames,
                fps=fps,
                time=time,
                size=size,
                settings=capture_settings(outputs, **settings),
                outputs=outputs,
                parameters=parameters,
                device=device,
                require_gpu=require_gpu,
                progress=progress,
            )
        except BaseException:
            if done:  # frames that were under way may be whole as well
                complain(
                    f"at least {done} of {total} frames are whole in {folder}; there is no manifest of them"
                )
            raise
    count = len(manifest["frames"])
    summary = f"{count} frame{'s' if count != 1 else ''} ({', '.join(outputs)}) in {folder}"
    if json:
        print_json(manifest, summary)
    else:
        print_summary(summary, quiet)
    return 0
