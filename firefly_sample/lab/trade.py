"""Measure the time and the error of each setting on one frame of a scene, as a table, a plot and pictures.

Every row is complete in itself: its error against the float64 reference, and its time as a ratio to the
default's, from pairs of draws made one right after the other. Therefore an interrupted run can be resumed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.capture.files import as_folder, output_folder
from firefly_sample.encoding.format import Choices
from firefly_sample.encoding.formats import FORMATS
from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.lab.measuring import logarithmic_axes, pareto_front, require, write_json
from firefly_sample.lab.reference.cache import with_blended
from firefly_sample.lab.reference.chunks import Progress, Steps
from firefly_sample.lab.reference.frame import reference_settings, render_reference
from firefly_sample.lab.trade_bench import TradeBench, scale_of
from firefly_sample.lab.variations import Variation, signature, variations
from firefly_sample.plan.exposure import with_exposure_at
from firefly_sample.renderer import Renderer
from firefly_sample.scene.parameter import resolve_parameters
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.scenes.plugin import folder_name, scene_settings, start_time
from firefly_sample.settings import Settings
from firefly_sample.whole_files import open_whole

DIFFERENCES = 4
"""Number of rows whose difference from the reference is saved as a picture."""
REFERENCE_STEPS, ROW_STEPS = 100, 10
"""Steps of the progress: of the reference, and of each row."""
AMPLIFY = 8
"""Factor of the differences in a difference picture."""
LEAST = 1e-9
"""The smallest error in the plot, whose logarithmic axis has no 0."""

Row = dict[str, Any]


def measure_trade(
    scene: str = "forest",
    folder: str | Path | None = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    size: tuple[int, int] = (800, 600),
    settings: Settings | None = None,
    time: float | None = None,
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
        `default_folder` when absent. An interrupted run of the same measurement there is resumed.
    parameters : mapping, optional
        The scene's parameters.
    size : (int, int)
        Pixels.
    settings : Settings, optional
        The default, with which all are compared; the scene's own when absent. Its supersample must be 1 and
        its look "correct". An exposure of "auto" is measured once.
    time : float
        Seconds; the scene's `start_time` when absent.
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
        "errors", see `firefly_sample.lab.trade_bench.PictureErrors`. Settings that cannot be drawn have
        "skipped", the reason, instead. The row "texture filtering" is the driver's error, not a setting's,
        and has no times.

    Raises
    ------
    FireflyError
        If the scene, a parameter, a setting, the size, the folder or the driver is not usable.
    """
    from firefly_sample import __version__

    plugin = find_scene(scene)
    time = start_time(plugin) if time is None else time
    base = settings or Settings(**scene_settings(plugin, {"look": "correct", "supersample": 1}))
    if base.supersample != 1:
        raise SettingsError(f"setting 'supersample' must be 1 to measure errors; got {base.supersample}")
    if not 0.0 <= seconds < 1e9:
        raise SettingsError(f"seconds must be a number of 0 or more, got {seconds!r}")
    reference_settings(base)
    require("embreex", "flip_evaluator", "matplotlib")
    given = resolve_parameters(plugin.name, plugin.parameters, dict(parameters or {}))
    folder = as_folder(folder) if folder is not None else default_folder(scene)
    path = folder / "trade.json"
    built = build_scene(plugin, **given)
    base = with_exposure_at(built, base, time)
    with (
        output_folder(folder),
        Renderer(size, base, device=device, require_gpu=require_gpu) as renderer,
    ):
        chosen = variations(renderer.plan(built, time, ("color",)), base)
        head: dict[str, Any] = {
            "scene": plugin.name,
            "parameters": given,
            "size": list(size),
            "time": time,
            "settings": base.as_dict(),
            "driver": renderer.driver,
            "version": __version__,
        }
        key = _key([scene, seconds, head], chosen)
        rows = [] if fresh else _measured(path, key)
        steps = Steps(REFERENCE_STEPS + ROW_STEPS * (len(chosen) + 1), progress)
        bench = TradeBench(
            renderer, built, time, base, lambda done, of: steps.to(REFERENCE_STEPS * done // max(of, 1))
        )
        left_out, scale = 1.0 - float(bench.agreed.mean()), scale_of(bench.reference.radiance[bench.agreed])
        head["reference"] = {"left_out": left_out, "scale": scale}
        done = {row["name"] for row in rows}
        seen: set[tuple[Any, ...]] = set()
        for number, variation in enumerate(chosen, 1):
            try:
                own = signature(bench.plan(base.with_changes(**variation.changes)))
            except SceneError:  # maps or slices do not fit
                own = (variation.name,)
            if variation.name not in done and own not in seen:
                rows.append(_row(bench, variation, seconds))
                write_json(path, {**head, "rows": rows, "unfinished": key})
            seen.add(own)
            steps.to(REFERENCE_STEPS + ROW_STEPS * number)
        if "texture filtering" not in done:
            rows.append(_filtering(bench))
        result = {**head, "rows": rows}
        write_json(path, {**result, "unfinished": key})
        _write_report(folder, result, bench)
        write_json(path, result)  # last, so that a run interrupted before can be resumed
        steps.to(steps.total)
    return result


def default_folder(scene: str) -> Path:
    """Return the default folder of a measurement: ``measured/<the scene's name>``; of files, their stems."""
    return Path("measured") / folder_name(find_scene(scene))


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
    plan = with_blended(renderer, bench.scene, bench.time, plan)
    own = render_reference(plan, np.asarray(renderer.draw(plan)["visibility"], dtype=np.int32))
    errors = bench.errors(own.radiance.astype(np.float32), own.color, bench.covered, plan, flip=True)
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
        with open_whole(folder / f"difference-{slug}.png") as file:
            file.write(FORMATS["png"].encode({"color": picture}, Choices()))


# --- The report ---

HEAD = (
    *("settings", "time", "spread", "bytes/px", "largest", "99 %", "relMSE", "bias"),
    *("codes", "PSNR", "FLIP", "uncovered", "not finite"),
)


def trade_as_markdown(result: dict[str, Any]) -> str:
    """Return the rows as a Markdown table, with a line about the frame."""
    width, height = result["size"]
    lines = [
        f"{result['scene']}, {width}x{height}, t = {result['time']:g} s, {result['driver']}. "
        "Errors of linear radiance are divided by its 99.9th percentile. "
        f"{result['reference']['left_out']:.2%} of the pixels, in which the rasteriser and rays see "
        "different triangles, are not compared.",
        "",
        f"| {' | '.join(HEAD)} |",
        f"|---|{'--:|' * (len(HEAD) - 1)}",
    ]
    lines += [_line(row) for row in result["rows"] if "errors" in row]
    skipped = [f"- {row['name']}: {row['skipped']}" for row in result["rows"] if "skipped" in row]
    if skipped:
        lines += ["", "Not drawn:", "", *skipped]
    return "\n".join(lines) + "\n"


def _line(row: Row) -> str:
    errors = row["errors"]
    cost = ["", "", ""]
    if "time_ratio" in row:
        cost = [f"{row['time_ratio']:.2f}", f"{row['spread']:.2f}", f"{row['bytes_per_pixel']:g}"]
    psnr, flip = errors["psnr"], errors["flip"]
    cells = [
        row["name"],
        *cost,
        *(f"{errors[name]:.1e}" for name in ("largest", "percentile_99", "relmse", "bias")),
        str(errors["codes"]),
        "inf" if psnr is None else f"{psnr:.1f}",
        "" if flip is None else f"{flip:.4f}",
        *(str(errors[name]) for name in ("uncovered", "not_finite")),
    ]
    return f"| {' | '.join(cells)} |"


def front_of(rows: Sequence[Row]) -> list[Row]:
    """Return the Pareto front: rows that no other beats in both time and largest error, fastest first."""
    return pareto_front(rows, lambda row: (row["time_ratio"], row["errors"]["largest"]))


_COLORS = {
    "default": "#d1495b",
    "preset": "#d1495b",
    "alone": "#2e6f95",
    "combination": "#66a182",
    "baseline": "#8d6a9f",
}


def pareto_figure(result: dict[str, Any], file: IO[bytes]) -> None:
    """Write a PNG: largest error over time, and the Pareto front. It needs matplotlib."""
    from matplotlib.figure import Figure

    rows = [row for row in result["rows"] if row["group"] in _COLORS and "time_ratio" in row]
    figure = Figure(figsize=(11.0, 7.0), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    logarithmic_axes(axes)
    for group, color in _COLORS.items():
        mine = [row for row in rows if row["group"] == group]
        if mine:
            x, y = np.transpose([_point(row) for row in mine])
            axes.errorbar(
                x,
                y,
                xerr=[0.5 * row["spread"] * row["time_ratio"] for row in mine],
                fmt="D" if group in ("default", "preset") else "o",
                color=color,
                markersize=6,
                elinewidth=0.8,
                label=group,
                zorder=3,
            )
    front = front_of(rows)
    x, y = np.transpose([_point(row) for row in front])
    axes.step(x, y, where="post", color="#444444", linewidth=1.2, zorder=2, label="Pareto front")
    axes.set_xlabel("time over the default's (bars: interquartile range)")
    axes.set_ylabel("largest error of radiance over its 99.9th percentile")
    width, height = result["size"]
    axes.set_title(f"{result['scene']}, {width}x{height}: error over time by settings", loc="left", pad=26)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}")
    axes.tick_params(axis="x", which="minor", labelsize=8, labelcolor="#777777")
    times, errors = np.transpose([_point(row) for row in rows])
    axes.set_xlim(_limits(times, 0.12))
    axes.set_ylim(_limits(errors, 0.08))
    axes.legend(frameon=False, fontsize=9, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, borderpad=0)
    _label(axes, rows, front)
    figure.savefig(file, format="png")


def _point(row: Row) -> tuple[float, float]:
    """Return the point of a row: its time ratio, and its error or `LEAST`."""
    return row["time_ratio"], max(row["errors"]["largest"], LEAST)


def _limits(values: NDArray[np.float64], margin: float) -> tuple[float, float]:
    """Return the ends of a logarithmic axis: at least a factor of two, and a margin on each side."""
    low, high = float(values.min()), float(values.max())
    short = max(2.0 * low / high, 1.0) ** 0.5
    low, high = low / short, high * short
    room = (high / low) ** margin
    return low / room, high * room


def _label(axes: Any, rows: Sequence[Row], front: Sequence[Row]) -> None:
    """Write names beside points where there is room, first those of the front."""
    axes.figure.draw_without_rendering()  # computes the positions of points
    taken: list[Any] = []
    points = axes.transData.transform([_point(row) for row in rows])
    important = [*front, *(row for row in rows if row["group"] in ("default", "preset", "baseline"))]
    for name, row in {row["name"]: row for row in [*important, *rows]}.items():
        for offset, side in (((7, 3), "left"), ((-7, 3), "right"), ((7, -10), "left"), ((-7, -10), "right")):
            style = {"ha": side, "fontsize": 8, "color": "#222222"}
            text = axes.annotate(name, _point(row), offset, textcoords="offset points", **style)
            box = text.get_window_extent().padded(2.0)
            inside = axes.bbox.x0 <= box.x0 and box.x1 <= axes.figure.bbox.x1
            covers = sum(box.contains(*point) for point in points) > 0
            if inside and not covers and not any(box.overlaps(other) for other in taken):
                taken.append(box)
                break
            text.remove()


def difference_picture(
    color: NDArray[np.uint8], reference: NDArray[np.uint8], compared: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Return the picture, and beside it `AMPLIFY` times its difference in sRGB codes.

    The shape is (height, 2 * width, 3); pixels that are not compared are black.
    """
    off = np.abs(color.astype(np.int32) - reference.astype(np.int32)) * AMPLIFY
    shown = np.where(compared[..., None], np.minimum(off, 255), 0).astype(np.uint8)
    return np.concatenate([color, shown], axis=1)
