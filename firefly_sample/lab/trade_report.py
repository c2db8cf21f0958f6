"""A measured trade as a table, as a plot of error over time, and as pictures of differences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.measuring import logarithmic_axes, pareto_front, require

AMPLIFY = 8
"""Factor of the differences in a difference picture."""

LEAST = 1e-9
"""The smallest error in the plot, whose logarithmic axis has no 0."""

Row = dict[str, Any]
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
        str(errors["uncovered"]),
        str(errors["not_finite"]),
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
    """Write a PNG: largest error over time, and the Pareto front.

    Raises
    ------
    MissingPackageError
        If matplotlib is not installed.
    """
    require("matplotlib")
    from matplotlib.figure import Figure

    rows = [row for row in result["rows"] if row["group"] in _COLORS and "time_ratio" in row]
    figure = Figure(figsize=(11.0, 7.0), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    logarithmic_axes(axes)
    for group, color in _COLORS.items():
        mine = [row for row in rows if row["group"] == group]
        if mine:
            points = [_point(row) for row in mine]
            axes.errorbar(
                [x for x, _ in points],
                [y for _, y in points],
                xerr=[0.5 * row["spread"] * row["time_ratio"] for row in mine],
                fmt="D" if group in ("default", "preset") else "o",
                color=color,
                markersize=6,
                elinewidth=0.8,
                label=group,
                zorder=3,
            )
    everything = [_point(row) for row in rows]
    front = front_of(rows)
    steps = [_point(row) for row in front]
    axes.step(
        [x for x, _ in steps],
        [y for _, y in steps],
        where="post",
        color="#444444",
        linewidth=1.2,
        zorder=2,
        label="Pareto front",
    )
    axes.set_xlabel("time over the default's (bars: interquartile range)")
    axes.set_ylabel("largest error of radiance over its 99.9th percentile")
    width, height = result["size"]
    axes.set_title(f"{result['scene']}, {width}x{height}: error over time by settings", loc="left", pad=26)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}")
    axes.tick_params(axis="x", which="minor", labelsize=8, labelcolor="#777777")
    axes.set_xlim(_limits([x for x, _ in everything], 0.12))
    axes.set_ylim(_limits([y for _, y in everything], 0.08))
    axes.legend(frameon=False, fontsize=9, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, borderpad=0)
    _label(axes, rows, front)
    figure.savefig(file, format="png")


def _point(row: Row) -> tuple[float, float]:
    """Return the point of a row: its time ratio, and its error or `LEAST`."""
    return row["time_ratio"], max(row["errors"]["largest"], LEAST)


def _limits(values: Sequence[float], margin: float) -> tuple[float, float]:
    """Return the ends of a logarithmic axis: at least a factor of two, and a margin on each side."""
    low, high = min(values), max(values)
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
    names = {row["name"] for row in important}
    for row in [*important, *(row for row in rows if row["name"] not in names)]:
        if row["name"] in (text.get_text() for text in axes.texts):
            continue
        for offset, side in (((7, 3), "left"), ((-7, 3), "right"), ((7, -10), "left"), ((-7, -10), "right")):
            text = axes.annotate(
                row["name"],
                _point(row),
                xytext=offset,
                textcoords="offset points",
                ha=side,
                fontsize=8,
                color="#222222",
            )
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
