"""``firefly capture``: render frames to files."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from cyclopts import Parameter

from firefly_sample.capture.frames import frame_times
from firefly_sample.capture.manifest import Manifest
from firefly_sample.capture.one_file import place_of
from firefly_sample.capture.sequence import (
    capture_frames,
    capture_settings,
    default_folder,
    default_outputs,
)
from firefly_sample.commands.choosing import BudgetMs, MaxCodes, MaxError, settings_within
from firefly_sample.commands.options import (
    DEFAULT_SCENE,
    Device,
    Flag,
    FolderOrFile,
    Names,
    Outputs,
    RequireGpu,
    SceneName,
    Size,
    StartTime,
    Sweep,
    Whole,
    Workers,
)
from firefly_sample.commands.terminal import (
    complain,
    messages,
    print_file,
    print_json,
    print_summary,
    progress_bar,
)
from firefly_sample.frame import check_outputs
from firefly_sample.scenes import find_scene
from firefly_sample.scenes.plugin import start_time

SOME_FAILED = 3
"""The exit code if some frames could not be drawn, and all others are whole."""


def capture(
    scene: SceneName = DEFAULT_SCENE,
    *,
    output: Annotated[
        FolderOrFile | None,
        Parameter(name=["--output", "-o"], show_default=lambda _: "captures/SCENE"),
    ] = None,
    frames: Annotated[str, Parameter(metavar="A:B[:STEP]", allow_leading_hyphen=True)] = "0:1",
    fps: float = 24.0,
    time: StartTime = None,
    views: Annotated[str | None, Parameter(metavar="orbit:N|FILE")] = None,
    size: Size = (800, 600),
    outputs: Annotated[Outputs | None, Parameter(show_default=lambda _: "color")] = None,
    formats: Annotated[
        Names | None, Parameter(name=["--format", "--formats"], show_default=lambda _: "png,npz")
    ] = None,
    quality: Whole | None = None,
    depth_scale: Annotated[float | None, Parameter(metavar="UNITS", show_default=lambda _: "0.001")] = None,
    crf: Whole | None = None,
    pad: Flag = False,
    dataset: Annotated[Literal["nerf", "bop", "coco"] | None, Parameter(show_choices=False)] = None,
    sweep: Sweep = (),
    resume: Flag = False,
    overwrite: Flag = False,
    fail_fast: Flag = False,
    workers: Workers = None,
    cluster: Annotated[str | None, Parameter(metavar="ADDRESS|local")] = None,
    shard: Annotated[str | None, Parameter(metavar="I/N")] = None,
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
    """Render frames of a scene to files, or to one film.

    Options are also read from the environment (FIREFLY_CAPTURE_SIZE=320x240), and then, in the current
    folder, from the tables [firefly.capture] of firefly.toml and [tool.firefly.capture] of pyproject.toml.

    Parameters
    ----------
    output
        Folder for the files; or one film (.mp4, .webm, .webp, .apng, .gif), or one picture (.png, .exr, ...).
    frames
        Frames A to B - 1, or one number.
    fps
        Frame k is drawn at TIME + k / FPS.
    time
        The time of frame 0 in the scene.
    views
        Cameras around the scene, or poses from a file.
    formats
        Formats of the files: png, webp, jpeg, npz, png16, exr, exr16; or of one output, as in depth=png16.
    quality
        Of JPEG (95 when absent) and WebP (without loss when absent), 1 to 100.
    depth_scale
        Scene units of one code of a 16-bit depth: 0.001 for millimetres, where a unit is a metre.
    crf
        The quality of MP4 and WebM: 0 is without loss, 18 hardly visible loss, and more is smaller.
    pad
        Repeat the last column and row of a film's pictures where its codec needs even sides.
    dataset
        Make a data set: nerf, bop or coco.
    sweep
        Capture every combination of such values, of parameters and settings; may be repeated.
    resume
        Go on with the capture in the folder.
    overwrite
        Replace the capture in the folder.
    fail_fast
        Stop at the first frame that cannot be drawn; otherwise the others are drawn.
    workers
        Draw in N processes; auto: one for each core.
    cluster
        Draw on a dask cluster, at the address of its scheduler, or local.
    shard
        Draw the I-th of N shares; other processes draw the others into the same folder.
    json
        Print the manifest, or what a shard drew.
    quiet
        Print neither a progress bar nor a summary.
    """
    if time is None:
        time = start_time(find_scene(scene))
    folder = output if output is not None else default_folder(scene)
    if outputs is None:
        outputs = default_outputs(folder, dataset)
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
        resumed=folder if resume else None,
    )
    with messages(show=not quiet), progress_bar("frames", show=not quiet, unit="frame") as show_progress:
        result = capture_frames(
            scene,
            folder,
            frames=frames,
            fps=fps,
            time=time,
            views=views,
            size=size,
            settings=capture_settings(outputs, **settings),
            outputs=outputs,
            formats=formats,
            quality=quality,
            depth_scale=depth_scale,
            crf=crf,
            pad=pad,
            dataset=dataset,
            parameters=parameters,
            sweep=sweep or None,
            resume=resume,
            overwrite=overwrite,
            fail_fast=fail_fast,
            workers=workers,
            cluster=cluster,
            shard=shard,
            device=device,
            require_gpu=require_gpu,
            progress=show_progress,
        )
    if isinstance(result, Manifest):
        captures = result.captures()
        count = sum(len(part["frames"]) for part in captures)
        failed = sum(len(part["failed"]) for part in captures)
    else:
        count, failed = result
    is_bound = isinstance(result, Manifest) and "file" in result
    place = place_of(folder, is_bound)
    summary = f"{count} frame{'s' if count != 1 else ''} ({', '.join(outputs)}) in {place}"
    if isinstance(result, Manifest) and json:
        print_file(result.path, summary)
    elif json:
        print_json({"shard": shard, "frames": count, "failed": failed}, summary)
    else:
        print_summary(summary, quiet)
    if failed:
        frames_failed = f"{failed} frame{'s' if failed != 1 else ''} could not be drawn"
        unwritten = "" if place == folder else f", and {folder} is not written"
        complain(f"{frames_failed}{unwritten}: --resume tries again")
        return SOME_FAILED
    return 0
