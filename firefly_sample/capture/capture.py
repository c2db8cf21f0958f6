"""Render a sequence of frames to files."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firefly_sample.capture.writers import (
    FrameEntry,
    FrameWriter,
    Manifest,
    as_folder,
    output_folder,
    remove_manifest,
    write_manifest,
)
from firefly_sample.errors import OutputError
from firefly_sample.frame import check_outputs
from firefly_sample.settings import Settings, to_number, to_whole

if TYPE_CHECKING:
    from firefly_sample.renderer import Renderer

MAX_FRAMES = 1_000_000
"""Frame numbers end below this: file names have six digits, so that they sort."""


def capture_frames(
    scene: str = "forest",
    folder: str | Path | None = None,
    *,
    frames: str | int | range = "0:1",
    fps: float = 24.0,
    time: float | None = None,
    size: tuple[int, int] = (800, 600),
    settings: Settings | None = None,
    outputs: Iterable[str] = ("color",),
    parameters: Mapping[str, Any] | None = None,
    device: int | None = None,
    require_gpu: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Manifest:
    """Render frames of a scene into files, and describe them in ``manifest.json``.

    Every file is written whole or not at all. The manifest is written last. If the run fails or is
    interrupted, complete frames stay and there is no manifest. Files are written by a few threads while the
    next frames are drawn.

    Parameters
    ----------
    scene : str
        Name of a scene plugin, "package.module:object", or a model's file: see `find_scene`.
    folder : path, optional
        Made if need be; `default_folder` when absent. Files of the same names are replaced.
    frames : str, int or range
        "FIRST:END" or "FIRST:END:STEP", END not included, or the number of one frame.
    fps : float
        Frames per second.
    time : float
        Seconds at frame 0: frame i shows ``time + i / fps``. When absent, the scene's `start_time`: 0 for
        model files, 5 for scenes that say nothing else.
    size : (int, int)
        Width and height in pixels.
    settings : Settings, optional
        `capture_settings` of the outputs, with the scene's own settings, when absent. An exposure of "auto"
        is measured once, at the time of frame 0, whatever the range of frames.
    outputs : iterable of str
        Names from `firefly_sample.frame.OUTPUTS`; pictures become PNG, data ``.npz``.
    parameters : mapping, optional
        The scene's parameters; those left out have their defaults.
    device, require_gpu : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (frames on disk, frames in all), first with (0, all).

    Returns
    -------
    Manifest
        The content of ``manifest.json``.

    Warns
    -----
    UserWarning
        Once for each warning of a frame, for example on blended materials that are drawn as cut-outs, and
        for a software driver.

    Raises
    ------
    FireflyError
        If the scene, a parameter, the frames, the size, an output, the folder or the driver is wrong. A new
        folder is removed again if it is empty.
    """
    from firefly_sample.scene.parameter import resolve_parameters
    from firefly_sample.scenes import build_scene, find_scene
    from firefly_sample.scenes.plugin import scene_settings, start_time

    numbers = parse_frames(frames)
    names = check_outputs(outputs)
    plugin = find_scene(scene)
    settings = settings if settings is not None else capture_settings(names, **scene_settings(plugin))
    check_outputs(names, settings.supersample)
    start = start_time(plugin) if time is None else time
    _check_clock(fps, start)
    fps, start = float(fps), float(start)
    resolved = resolve_parameters(plugin.name, plugin.parameters, dict(parameters or {}))
    folder = as_folder(folder) if folder is not None else default_folder(scene)

    with output_folder(folder):
        from firefly_sample.plan.exposure import with_exposure_at
        from firefly_sample.renderer import Renderer

        built = build_scene(plugin, **resolved)
        exposed = with_exposure_at(built, settings, start)
        with (
            Renderer(size, exposed, device=device, require_gpu=require_gpu) as renderer,
            FrameWriter(folder) as writer,
        ):
            manifest = _new_manifest(scene, resolved, settings, renderer)
            report = progress or (lambda done, total: None)
            report(0, len(numbers))
            times = (start + index / fps for index in numbers)
            for index, frame in zip(numbers, renderer.render_many(built, times, names), strict=True):
                if index == numbers[0]:
                    remove_manifest(folder)
                for warning in frame.warnings:
                    if warning not in manifest["warnings"]:
                        manifest["warnings"].append(warning)
                        warnings.warn(warning, stacklevel=2)
                for entry in writer.put(index, frame):
                    _add_frame(manifest, entry)
                    report(len(manifest["frames"]), len(numbers))
            for entry in writer.finish():
                _add_frame(manifest, entry)
                report(len(manifest["frames"]), len(numbers))
        write_manifest(folder, manifest)
    return manifest


def capture_settings(outputs: Iterable[str], **changes: Any) -> Settings:
    """Return the settings to capture `outputs` with: supersampled if all are color or color_alpha.

    `changes` are as in `Settings.with_changes`.
    """
    supersample = 2 if {"color", "color_alpha"}.issuperset(outputs) else 1
    return Settings().with_changes(**({"supersample": supersample} | changes))


def frame_times(frames: str | int | range, fps: float, time: float) -> tuple[float, ...]:
    """Return the times in seconds of at most five of some frames: the first, the last, and some between."""
    numbers = parse_frames(frames)
    _check_clock(fps, time)
    sample = dict.fromkeys(numbers[(len(numbers) - 1) * part // 4] for part in range(5))
    return tuple(time + index / fps for index in sample)


def _check_clock(fps: float, time: float) -> None:
    if not 0.0 < to_number(fps) < math.inf:
        raise OutputError(f"fps must be a finite number above 0, got {fps!r}")
    if not math.isfinite(to_number(time)):
        raise OutputError(f"time must be a finite number of seconds, got {time!r}")


def default_folder(scene: str) -> Path:
    """Return the default folder for the frames of a scene: ``captures/<its name>``; of files, their stems."""
    from firefly_sample.scenes import find_scene
    from firefly_sample.scenes.plugin import folder_name

    return Path("captures") / folder_name(find_scene(scene))


def parse_frames(frames: str | int | range) -> range:
    """Return the frame numbers of "FIRST:END", "FIRST:END:STEP" (END is not included) or one number."""
    numbers = frames
    if isinstance(numbers, str):
        match = re.fullmatch(r"(\d+)(?::(\d+)(?::(\d+))?)?", numbers.strip(), re.ASCII)
        if match is None:
            raise OutputError(
                f"frames must be FIRST:END, FIRST:END:STEP or one number, none negative, got {frames!r}"
            )
        first, end, step = (None if part is None else int(part) for part in match.groups())
        assert first is not None
        if step == 0:
            raise OutputError(f"frames {frames!r}: the step must be 1 or more")
        numbers = first if end is None else range(first, end, step or 1)
    if not isinstance(numbers, range):
        number = to_whole(numbers)
        if number is None:
            raise OutputError(f"frames must be a range, its text, or one whole number, got {frames!r}")
        numbers = range(number, number + 1)
    if not numbers:
        raise OutputError(f"frames {frames!r} holds no frame: the end is not included, so 0:1 is one frame")
    if min(numbers[0], numbers[-1]) < 0 or max(numbers[0], numbers[-1]) >= MAX_FRAMES:
        raise OutputError(f"frames must be between 0 and {MAX_FRAMES - 1}, got {frames!r}")
    return numbers


def _new_manifest(scene: str, parameters: dict[str, Any], settings: Settings, renderer: Renderer) -> Manifest:
    from firefly_sample import __version__

    return {
        "scene": scene,
        "parameters": parameters,
        "settings": settings.as_dict(),
        "exposure": to_number(renderer.settings.exposure),
        "seed": parameters.get("seed"),
        "driver": renderer.driver,
        "driver_version": renderer.driver_version,
        "software": renderer.software,
        "version": __version__,
        "warnings": [],
        "frames": [],
    }


def _add_frame(manifest: Manifest, entry: FrameEntry) -> None:
    """Append a frame; it keeps the names of its ids only if they differ from those of the first frame."""
    if "id_names" in entry and manifest.setdefault("id_names", entry["id_names"]) == entry["id_names"]:
        del entry["id_names"]
    manifest["frames"].append(entry)
