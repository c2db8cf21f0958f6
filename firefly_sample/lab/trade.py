"""What each setting costs in time and in error, on one frame of a scene.

Every row is complete in itself: its error against the float64 reference, and its time as a ratio to the
default's, of pairs of draws made one right after the other. So a run that was interrupted goes on where it
stopped.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from firefly_sample.capture.writers import as_folder, open_whole, output_folder, write_image
from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.frame import Frame
from firefly_sample.lab.picture_errors import require, scale_of
from firefly_sample.lab.reference.frame import reference_settings, render_reference
from firefly_sample.lab.trade_bench import Bench
from firefly_sample.lab.trade_report import difference_picture, pareto_figure, trade_as_markdown
from firefly_sample.lab.variations import Variation, signature, variations
from firefly_sample.renderer import Renderer
from firefly_sample.scene.parameter import resolve_parameters
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings

NAME = "trade.json"
DIFFERENCES = 4
"""Rows whose difference to the reference is made a picture."""
STEPS_OF_REFERENCE = 100
"""Of the progress, for the reference."""


def measure_trade(
    scene: str = "forest",
    folder: str | Path | None = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    size: tuple[int, int] = (800, 600),
    settings: Settings | None = None,
    time: float = 5.0,
    seconds: float = 4.0,
    fresh: bool = False,
    device: int | None = None,
    require_gpu: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Measure the trade of speed for accuracy on one frame, and write it down.

    Parameters
    ----------
    scene : str
        Name of a scene plugin, or "package.module:object".
    folder : path, optional
        Where ``trade.json``, ``trade.md``, ``pareto.png`` and the pictures of the largest differences go;
        ``measured/<scene>`` when absent. One of the same that was interrupted there is gone on with.
    parameters : mapping, optional
        The scene's parameters.
    size : (int, int)
        Pixels.
    settings : Settings, optional
        What all is compared with: the default. Its supersample must be 1 and its look "correct".
    time : float
        Seconds.
    seconds : float
        About how long to time each row.
    fresh : bool
        Begin anew in any case.
    device, require_gpu : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (steps done, steps in all).

    Returns
    -------
    dict
        What ``trade.json`` holds: "scene", "parameters", "size", "time", "settings" (all of the default's),
        "driver", "version", "reference" ("left_out": the share of pixels in which rays and the rasteriser see
        different triangles, which are not compared; "scale": the 99.9th percentile of its radiance) and
        "rows", each with "name", "group", "settings" (what differs from the default), "time_ratio", "spread",
        "milliseconds", "bytes_per_pixel", "fragments" (of the passes of light) and "errors", see
        `firefly_sample.lab.picture_errors.Errors`. A row that cannot be drawn has "skipped", the reason, instead.
        The row "texture filtering" is the driver's, not a setting's: it has errors alone.

    Raises
    ------
    FireflyError
        If the scene, a parameter, a setting, the size, the folder or the driver is not as it must be.
    """
    plugin = find_scene(scene)
    given, base = dict(parameters or {}), settings or Settings()
    if base.supersample != 1:
        raise SettingsError(f"setting 'supersample' must be 1 to measure errors; got {base.supersample}")
    if not 0.0 <= seconds < 1e9:
        raise SettingsError(f"seconds must be a number of 0 or more, got {seconds!r}")
    reference_settings(base)
    require("embreex", "flip_evaluator", "matplotlib")
    given = resolve_parameters(plugin.name, plugin.parameters, given)
    folder = as_folder(folder) if folder is not None else default_folder(scene)
    built = build_scene(plugin, **given)
    with (
        output_folder(folder),
        Renderer(size, base, device=device, require_gpu=require_gpu) as renderer,
    ):
        chosen = variations(renderer.plan(built, time, ("color",)), base)
        head = _head(plugin.name, given, size, time, base, renderer.driver)
        key = _key([scene, seconds, head], chosen)
        rows = [] if fresh else _measured(folder / NAME, key)
        steps = _Steps(len(chosen) + 1, progress)
        bench = Bench(renderer, built, time, base, steps.reference)
        head["reference"] = {
            "left_out": bench.disagreed,
            "scale": scale_of(bench.reference.radiance[bench.agreed]),
        }
        done = {row["name"] for row in rows}
        seen: set[tuple[Any, ...]] = set()
        for index, variation in enumerate(chosen):
            own = _signature(bench, variation)
            if variation.name not in done and own not in seen:
                rows.append(_row(bench, variation, seconds))
                _write(folder, {**head, "rows": rows, "unfinished": key})
            seen.add(own)
            steps.row(index)
        if "texture filtering" not in done:
            rows.append(_filtering(bench))
        result = {**head, "rows": rows}
        _write(folder, {**result, "unfinished": key})
        _write_report(folder, result, bench)
        _write(folder, result)  # last: what is interrupted before is gone on with
        steps.row(len(chosen))
    return result


def default_folder(scene: str) -> Path:
    """Return the folder of a measurement that was given none: ``measured/<the plugin's name>``."""
    return Path("measured") / find_scene(scene).name


def _head(
    scene: str, parameters: dict[str, Any], size: tuple[int, int], time: float, base: Settings, driver: str
) -> dict[str, Any]:
    from firefly_sample import __version__

    return {
        "scene": scene,
        "parameters": parameters,
        "size": list(size),
        "time": time,
        "settings": base.as_dict(),
        "driver": driver,
        "version": __version__,
    }


def _key(head: list[Any], chosen: list[Variation]) -> str:
    """Return a digest of what is measured, so that rows of another measurement are not mixed in."""
    text = json.dumps([head, [(variation.name, variation.changes) for variation in chosen]], sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def _measured(path: Path, key: str) -> list[dict[str, Any]]:
    """Return the rows of an interrupted measurement of the same."""
    try:
        before = json.loads(path.read_text(encoding="utf-8"))
        return list(before["rows"]) if before.get("unfinished") == key else []
    except (OSError, ValueError, KeyError, AttributeError, TypeError):
        return []


class _Steps:
    """Progress: the reference first, then rows."""

    def __init__(self, rows: int, progress: Callable[[int, int], None] | None) -> None:
        self._rows, self._progress = rows * STEPS_OF_REFERENCE // 10, progress

    def _tell(self, done: int) -> None:
        if self._progress is not None:
            self._progress(done, STEPS_OF_REFERENCE + self._rows)

    def reference(self, done: int, total: int) -> None:
        """So much of the reference is made."""
        self._tell(STEPS_OF_REFERENCE * done // max(total, 1))

    def row(self, index: int) -> None:
        """That row is done."""
        self._tell(STEPS_OF_REFERENCE + (index + 1) * STEPS_OF_REFERENCE // 10)


def _signature(bench: Bench, variation: Variation) -> tuple[Any, ...]:
    """Of the frame, so that none is measured twice; of the variation where it cannot be drawn."""
    try:
        return signature(bench.plan(bench.base.with_changes(**variation.changes)))
    except SceneError:
        return (variation.name,)


def _row(bench: Bench, variation: Variation, seconds: float) -> dict[str, Any]:
    row: dict[str, Any] = {"name": variation.name, "group": variation.group, "settings": variation.changes}
    settings = bench.base.with_changes(**variation.changes)
    try:
        drawn = bench.draw(settings, flip=True)
    except SceneError as error:  # maps or slices that do not fit
        return row | {"skipped": str(error)}
    timing = bench.time_of(settings, seconds, most=99)
    return row | {
        "time_ratio": timing.ratio,
        "spread": timing.spread,
        "milliseconds": timing.milliseconds,
        "bytes_per_pixel": bench.plan(settings).bytes_per_pixel,
        "fragments": drawn.frame.shaded,
        "errors": drawn.errors.as_dict(),
    }


def _filtering(bench: Bench) -> dict[str, Any]:
    """Measure the driver's filtering of textures: a reference that filters exactly, held against ours."""
    renderer, base = bench.renderer, bench.base
    renderer.settings = reference_settings(base.with_changes(light_method="volumes", light_resolution="full"))
    plan = renderer.plan(bench.scene, bench.time, ("visibility",))
    own = render_reference(plan, np.asarray(renderer.draw(plan)["visibility"], dtype=np.int32))
    frame = Frame(
        {"radiance": own.radiance.astype(np.float32), "color": own.color},
        plan.time,
        plan.size,
        {},
        plan.counts,
        renderer.driver,
        renderer.software,
    )
    errors = bench.errors(frame, bench.covered, plan.exposure, flip=True)
    return {"name": "texture filtering", "group": "driver", "settings": {}, "errors": errors.as_dict()}


def _write(folder: Path, result: dict[str, Any]) -> None:
    with open_whole(folder / NAME) as file:
        file.write(json.dumps(result, indent=1, allow_nan=False).encode() + b"\n")


def _write_report(folder: Path, result: dict[str, Any], bench: Bench) -> None:
    with open_whole(folder / "trade.md") as file:
        file.write(trade_as_markdown(result).encode())
    with open_whole(folder / "pareto.png") as file:
        pareto_figure(result, file)
    drawn = [row for row in result["rows"] if "milliseconds" in row and row["group"] != "look"]
    for old in folder.glob("difference-*.png"):
        old.unlink()
    worst = sorted(drawn, key=lambda row: -row["errors"]["flip"])[:DIFFERENCES]
    for row in worst:
        frame = bench.draw(bench.base.with_changes(**row["settings"])).frame
        picture = difference_picture(np.asarray(frame["color"]), bench.reference.color, bench.agreed)
        slug = "".join(c if c.isalnum() else "-" for c in row["name"].lower())
        write_image(folder / f"difference-{slug}.png", "color", picture)
