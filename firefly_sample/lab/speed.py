"""Measure the speed of lighting methods on the same frames, and how much of their work is needed.

Times on a shared machine mean little by themselves, so each frame is drawn by every method in turn and ratios
are taken within a round. Counts do not depend on the machine: the fragments that the lighting passes shade,
over the (pixel, light) pairs that are really in range, counted in float64.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from firefly_sample.capture.files import as_folder, output_folder
from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.frame import check_size
from firefly_sample.lab.measuring import require, write_json
from firefly_sample.lab.reference.chunks import Progress, Steps
from firefly_sample.lab.speed_report import growth_figure, speed_as_markdown, with_slopes
from firefly_sample.lab.speed_sweep import LeftOut, Sweep, check_methods, steps_of
from firefly_sample.renderer import Renderer
from firefly_sample.scenes import find_scene
from firefly_sample.scenes.plugin import scene_settings, start_time
from firefly_sample.settings import Settings
from firefly_sample.whole_files import open_whole

Size = tuple[int, int]


def measure_speed(
    scene: str = "forest",
    folder: str | Path | None = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    counts: Sequence[int] | None = None,
    sizes: Sequence[Size] = ((800, 600),),
    methods: Sequence[str] | None = None,
    settings: Settings | None = None,
    time: float | None = None,
    seeds: Sequence[int] | None = None,
    rounds: int = 5,
    longest: float = 5.0,
    device: int | None = None,
    require_gpu: bool = False,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Time the same frames by each of `firefly_sample.lab.speed_sweep.METHODS`, with more and more lights.

    Parameters
    ----------
    scene : str
        Name of a scene plugin, or "package.module:object".
    folder : path, optional
        For ``speed.json``, a table (``speed.md``) and a plot (``growth.png``); no files when absent.
    parameters : mapping, optional
        The scene's parameters.
    counts : sequence of int, optional
        Numbers of lights: values of the scene's parameter that sets them, see
        `firefly_sample.scenes.plugin.lights_parameter`. When absent: its value in `parameters`, or else those
        of `firefly_sample.lab.speed_sweep.COUNTS` in its range. A scene without such a parameter is measured
        as it is.
    sizes : sequence of (int, int)
        Pixels.
    methods : sequence of str, optional
        Names of methods; all that fit the settings when absent.
    settings : Settings, optional
        Shared by all methods; "light_method" and "volume_depth_test" are set by each method, and
        "supersample" must be 1. The scene's own when absent.
    time : float
        Seconds; the scene's `start_time` when absent.
    seeds : sequence of int, optional
        Values of the scene's parameter "seed", a frame for each; the scene as it is when absent.
    rounds : int
        How often each method draws each frame, after a first round that compiles shaders and is not timed.
    longest : float
        Seconds that one frame may take. A method is left out from the step on in which a frame took longer,
        twice, or would by the line through the quickest frames of the last two steps; also at sizes with as
        many pixels or more.
    device, require_gpu : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (draws done or left out, all draws).

    Returns
    -------
    dict
        The output of ``firefly measure speed --json``: "scene", the plugin's name; "size", [width, height],
        or a list of these if there are several; "driver", the GL renderer string; "chosen", the method that
        ratios refer to; "left_out", the frames that were not drawn ("size", the count of "lights", "method"
        and "because"); and "rows", one per size, count of lights and method, each with

        - "size"; "method", a name of `firefly_sample.lab.speed_sweep.METHODS`; and "lights", the number in
          the scene (of the last seed);
        - "ms", milliseconds of all passes of a frame: the median over seeds and rounds;
        - "spread", interquartile range over median of one seed's rounds: the median over the seeds;
        - "ratio", this method's time over the chosen one's in the same round: the median over seeds and
          rounds; None if the chosen one was left out;
        - "passes", milliseconds of each pass by name, medians like "ms";
        - "host_ms", milliseconds of Python per frame: planning and drawing by the clock, minus the passes;
          and "plan_ms", the part of planning in that; medians likewise;
        - "draw_calls", and "bytes_per_pixel" of all targets, see
          `firefly_sample.plan.frame_plan.FramePlan`;
        - "shaded", fragments that the lighting passes shaded, summed over the seeds' frames. A fragment
          counts once per light that it evaluates: all in a loop, those in its cell's list in clusters;
        - "pairs", (pixel, light) pairs in range, summed likewise; equal for all methods;
        - "shaded_per_pair", "shaded" over "pairs"; None if no pixel is in range of a light;
        - "slope", microseconds per additional light since the previous count, and "growth", that over the
          previous slope; None where `firefly_sample.lab.speed_report.with_slopes` has none.

    Raises
    ------
    FireflyError
        If the scene, a parameter, a method, a setting, a size, the folder or the driver is not usable.
    """
    plugin = find_scene(scene)
    time = start_time(plugin) if time is None else time
    base = settings or Settings(**scene_settings(plugin, {"supersample": 1}))
    if rounds < 1 or (seeds is not None and not seeds) or not sizes:
        raise SceneError("there is nothing to measure: give at least one round, one seed and one size")
    if base.supersample != 1:
        raise SettingsError(f"setting 'supersample' must be 1 to measure speed; got {base.supersample}")
    if not longest > 0.0:
        raise SettingsError(f"longest must be a number of seconds above 0, got {longest!r}")
    names = check_methods(methods, base)
    steps = steps_of(plugin, dict(parameters or {}), counts, seeds)
    wanted = list(dict.fromkeys(check_size(size) for size in sizes))
    if folder is not None:
        folder = as_folder(folder)
        require("matplotlib")
    with (
        output_folder(folder) if folder is not None else nullcontext(),
        Renderer(wanted[0], base, device=device, require_gpu=require_gpu, reuse=False) as renderer,
    ):
        for size in wanted:
            renderer.resize(size)  # so that an impossible size is an error before anything is measured
        draws = len(wanted) * sum(len(step.variations) for step in steps) * (rounds + 1) * len(names)
        left_out, counted = LeftOut(longest), Steps(draws, progress)
        sweep = Sweep(plugin, renderer, base, time, rounds, names, left_out, counted)
        result: dict[str, Any] = {
            "scene": plugin.name,
            "size": list(wanted[0]) if len(wanted) == 1 else [list(size) for size in wanted],
            "driver": renderer.driver,
            "rows": [],
            "chosen": sweep.chosen,
            "left_out": left_out.rows,
        }
        for size in wanted:
            renderer.resize(size)
            for step in steps:
                result["rows"] = with_slopes([*result["rows"], *sweep.measure(size, step)])
                if folder is not None:  # after each step, so that an interruption loses little
                    write_json(folder / "speed.json", result)
        if folder is not None:
            with open_whole(folder / "speed.md") as file:
                file.write(speed_as_markdown(result).encode())
            with open_whole(folder / "growth.png") as file:
                growth_figure(result, file)
    return result
