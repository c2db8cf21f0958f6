"""How fast lights are drawn, by several methods on the same frames, and how much of that work is needed.

Times on a shared machine mean little by themselves, so each frame is drawn by every method in turn and
the ratios are taken within a frame. What does not depend on the machine is counted: fragments that the
light pass shades, over (pixel, light) pairs that are really in range, counted in float64.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from firefly_sample.capture.writers import as_folder, open_whole, output_folder
from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.frame import check_size
from firefly_sample.lab.picture_errors import require
from firefly_sample.lab.speed_limit import LeftOut
from firefly_sample.lab.speed_methods import check_methods
from firefly_sample.lab.speed_report import growth_figure, speed_as_markdown
from firefly_sample.lab.speed_rows import with_slopes
from firefly_sample.lab.speed_steps import steps_of
from firefly_sample.lab.speed_sweep import Sweep
from firefly_sample.renderer import Renderer
from firefly_sample.scenes import find_scene
from firefly_sample.settings import Settings

SIZES = ((640, 360), (800, 600), (1920, 1080))
"""What to measure a whole sweep at; one of them, the second, is measured when nothing is said."""
NAME = "speed.json"

Size = tuple[int, int]


def measure_speed(
    scene: str = "forest",
    folder: str | Path | None = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    lights: Sequence[int] | None = None,
    sizes: Sequence[Size] = (SIZES[1],),
    methods: Sequence[str] | None = None,
    settings: Settings | None = None,
    time: float = 5.0,
    seeds: Sequence[int] | None = None,
    rounds: int = 5,
    longest: float = 5.0,
    device: int | None = None,
    require_gpu: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Draw the same frames by every method of `METHODS`, with more and more lights.

    Parameters
    ----------
    scene : str
        Name of a scene plugin, or "package.module:object".
    folder : path, optional
        Where ``speed.json``, a table (``speed.md``) and a plot (``growth.png``) go; nowhere when absent.
    parameters : mapping, optional
        The scene's parameters.
    lights : sequence of int, optional
        Values of the parameter that counts the scene's lights, see
        `firefly_sample.scenes.plugin.lights_parameter`. When absent: its value in `parameters`, or those of
        `LIGHTS` that it may have. A scene without such a parameter is measured as it is.
    sizes : sequence of (int, int)
        Pixels.
    methods : sequence of str, optional
        Of `METHODS`; all of them that fit the settings when absent.
    settings : Settings, optional
        What all methods share; "lights" and "volume_depth_test" are each method's own, and "supersample"
        must be 1.
    time : float
        Seconds.
    seeds : sequence of int, optional
        One frame for each, through the scene's parameter "seed"; the scene as it is when absent.
    rounds : int
        How often each frame is drawn by each method, after a first round that compiles and is not timed.
    longest : float
        Seconds that one frame may take. A method whose frame took longer, twice, or would by the line through
        the quickest frames of its last two steps, is left out from that step on, also at sizes with as many
        pixels or more.
    device, require_gpu : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (draws done or left out, draws in all).

    Returns
    -------
    dict
        What ``firefly measure speed --json`` prints: "scene", the plugin's name; "size", [width, height], or
        a list of these if there are several; "driver", the GL renderer string; "chosen", the method that the
        ratios refer to; "left_out", what was not drawn ("size", "lights" that were asked for, "method" and
        "because"); and "rows", one a size, count of lights and method, each with

        "size" : [int, int]
        "lights" : int
            Lights in the scene (of the last seed).
        "method" : str
            A key of `METHODS`.
        "ms" : float
            Milliseconds of a frame, all passes: the median over seeds and rounds.
        "spread" : float
            Interquartile range over median of one seed's rounds; the median of this over the seeds.
        "ratio" : float or None
            This method's time over the chosen one's in the same round: the median over seeds and rounds. None
            where that was left out.
        "passes" : dict
            Milliseconds of each pass by its name, medians as of "ms".
        "host_ms", "plan_ms" : float
            Milliseconds of Python a frame, medians likewise: what planning and drawing it took by the clock,
            less its passes; and the part of planning in that.
        "draw_calls" : int
        "bytes_per_pixel" : float
            Of all targets, see `firefly_sample.plan.frame_plan.FramePlan`.
        "shaded" : int
            Fragments that the light pass shaded, summed over the seeds' frames. A fragment that walks several
            lights counts once for each: in the loop all, in clusters those in its cell's list.
        "pairs" : int
            (Pixel, light) pairs in range, summed likewise; the same for all methods.
        "shaded_per_pair" : float or None
            "shaded" over "pairs", None where no pixel is in range of a light.
        "slope", "growth" : float or None
            Microseconds that a light more costs, from the count before to this one, and that over the same of
            the step before; see `firefly_sample.lab.speed_rows.with_slopes`.

    Raises
    ------
    FireflyError
        If the scene, a parameter, a method, a setting, a size, the folder or the driver is not as it must be.
    """
    plugin = find_scene(scene)
    base = settings or Settings()
    if rounds < 1 or (seeds is not None and not seeds) or not sizes:
        raise SceneError("there is nothing to measure: give at least one round, one seed and one size")
    if base.supersample != 1:
        raise SettingsError(f"setting 'supersample' must be 1 to measure speed; got {base.supersample}")
    if not longest > 0.0:
        raise SettingsError(f"the longest frame must be a number of seconds above 0, got {longest!r}")
    names = check_methods(methods, base)
    steps = steps_of(plugin, dict(parameters or {}), lights, seeds)
    wanted = list(dict.fromkeys(check_size(size) for size in sizes))
    if folder is not None:
        folder = as_folder(folder)
        require("matplotlib")
    with (
        output_folder(folder) if folder is not None else nullcontext(),
        Renderer(wanted[0], base, device=device, require_gpu=require_gpu, reuse=False) as renderer,
    ):
        for size in wanted:
            renderer.resize(size)  # what is too large is told before anything is measured
        draws = len(wanted) * sum(len(step.variations) for step in steps) * (rounds + 1) * len(names)
        sweep = Sweep(plugin, renderer, base, time, rounds, names, LeftOut(longest), draws, progress)
        result: dict[str, Any] = {
            "scene": plugin.name,
            "size": list(wanted[0]) if len(wanted) == 1 else [list(size) for size in wanted],
            "driver": renderer.driver,
            "rows": [],
            "chosen": sweep.chosen,
            "left_out": sweep.left_out.rows,
        }
        for size in wanted:
            renderer.resize(size)
            for step in steps:
                result["rows"] = with_slopes([*result["rows"], *sweep.measure(size, step)])
                if folder is not None:  # whoever is interrupted keeps what was measured
                    _write(folder, result)
        if folder is not None:
            _write_report(folder, result)
    return result


def _write(folder: Path, result: dict[str, Any]) -> None:
    with open_whole(folder / NAME) as file:
        file.write(json.dumps(result, indent=1, allow_nan=False).encode() + b"\n")


def _write_report(folder: Path, result: dict[str, Any]) -> None:
    with open_whole(folder / "speed.md") as file:
        file.write(speed_as_markdown(result).encode())
    with open_whole(folder / "growth.png") as file:
        growth_figure(result, file)
