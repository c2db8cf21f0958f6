"""Measure the time and the error of each setting, on one frame of a scene.

Every row is complete in itself: its error against the float64 reference, and its time as a ratio to the
default's, from pairs of draws made one right after the other. Therefore an interrupted run can be resumed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from firefly_sample.capture.writers import as_folder, open_whole, output_folder, write_image
from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.frame import Frame
from firefly_sample.lab.measuring import require, write_json
from firefly_sample.lab.picture_errors import scale_of
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.reference.frame import reference_settings, render_reference
from firefly_sample.lab.trade_bench import TradeBench
from firefly_sample.lab.trade_report import difference_picture, pareto_figure, trade_as_markdown
from firefly_sample.lab.variations import Variation, signature, variations
from firefly_sample.renderer import Renderer
from firefly_sample.scene.parameter import resolve_parameters
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings

DIFFERENCES = 4
"""Number of rows whose difference from the reference is saved as a picture."""
REFERENCE_STEPS, ROW_STEPS = 100, 10
"""Steps of the progress: of the reference, and of each row."""


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
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Measure the trade of speed for accuracy on one frame, and write the results to files.

    Parameters
    ----------
    scene : str
        Name of a scene plugin, or "package.module:object".
    folder : path, optional
        For ``trade.json``, ``trade.md``, ``pareto.png`` and the pictures of the largest differences;
        ``measured/<scene>`` when absent. An interrupted run of the same measurement there is resumed.
    parameters : mapping, optional
        The scene's parameters.
    size : (int, int)
        Pixels.
    settings : Settings, optional
        The default, with which all are compared. Its supersample must be 1 and its look "correct".
    time : float
        Seconds.
    seconds : float
        About how long each row is timed.
    fresh : bool
        Start over, even if an interrupted run could be resumed.
    device, require_gpu : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (steps done, steps in all).

    Returns
    -------
    dict
        The contents of ``trade.json``: "scene", "parameters", "size", "time", "settings" (all of the
        default's), "driver", "version", "reference" ("left_out": the share of pixels in which rays and the
        rasteriser see different triangles, which are not compared; "scale": the 99.9th percentile of its
        radiance) and "rows", each with "name", "group", "settings" (what differs from the default),
        "time_ratio", "spread", "milliseconds", "bytes_per_pixel", "fragments" (of the lighting passes) and
        "errors", see `firefly_sample.lab.picture_errors.PictureErrors`. Settings that cannot be drawn have
        "skipped", the reason, instead. The row "texture filtering" is the driver's error, not a setting's,
        and has no times.

    Raises
    ------
    FireflyError
        If the scene, a parameter, a setting, the size, the folder or the driver is not usable.
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
    path = folder / "trade.json"
    built = build_scene(plugin, **given)
    with (
        output_folder(folder),
        Renderer(size, base, device=device, require_gpu=require_gpu) as renderer,
    ):
        chosen = variations(renderer.plan(built, time, ("color",)), base)
        head = _head(plugin.name, given, size, time, base, renderer.driver)
        key = _key([scene, seconds, head], chosen)
        rows = [] if fresh else _measured(path, key)
        total = REFERENCE_STEPS + ROW_STEPS * (len(chosen) + 1)

        def tell(done: int) -> None:
            if progress is not None:
                progress(done, total)

        bench = TradeBench(
            renderer, built, time, base, lambda done, of: tell(REFERENCE_STEPS * done // max(of, 1))
        )
        head["reference"] = {
            "left_out": bench.disagreed,
            "scale": scale_of(bench.reference.radiance[bench.agreed]),
        }
        done = {row["name"] for row in rows}
        seen: set[tuple[Any, ...]] = set()
        for number, variation in enumerate(chosen, 1):
            own = _signature(bench, variation)
            if variation.name not in done and own not in seen:
                rows.append(_row(bench, variation, seconds))
                write_json(path, {**head, "rows": rows, "unfinished": key})
            seen.add(own)
            tell(REFERENCE_STEPS + ROW_STEPS * number)
        if "texture filtering" not in done:
            rows.append(_filtering(bench))
        result = {**head, "rows": rows}
        write_json(path, {**result, "unfinished": key})
        _write_report(folder, result, bench)
        write_json(path, result)  # last, so that a run interrupted before can be resumed
        tell(total)
    return result


def default_folder(scene: str) -> Path:
    """Return the default folder of a measurement: ``measured/<the plugin's name>``."""
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
    """Return a digest of what is measured, so that rows of different measurements do not mix."""
    text = json.dumps([head, [(variation.name, variation.changes) for variation in chosen]], sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def _measured(path: Path, key: str) -> list[dict[str, Any]]:
    """Return the rows of an interrupted run of the same measurement."""
    try:
        before = json.loads(path.read_text(encoding="utf-8"))
        return list(before["rows"]) if before.get("unfinished") == key else []
    except (OSError, ValueError, KeyError, AttributeError, TypeError):
        return []


def _signature(bench: TradeBench, variation: Variation) -> tuple[Any, ...]:
    """Return the signature of a frame, or a variation's name if it cannot be drawn."""
    try:
        return signature(bench.plan(bench.base.with_changes(**variation.changes)))
    except SceneError:
        return (variation.name,)


def _row(bench: TradeBench, variation: Variation, seconds: float) -> dict[str, Any]:
    row: dict[str, Any] = {"name": variation.name, "group": variation.group, "settings": variation.changes}
    settings = bench.base.with_changes(**variation.changes)
    try:
        drawn = bench.draw(settings, flip=True)
    except SceneError as error:  # maps or slices do not fit
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


def _filtering(bench: TradeBench) -> dict[str, Any]:
    """Measure the driver's error of texture filtering, by a reference that filters exactly."""
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


def _write_report(folder: Path, result: dict[str, Any], bench: TradeBench) -> None:
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
