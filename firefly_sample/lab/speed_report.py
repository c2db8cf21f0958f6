"""Measured speed for people: a table for each size, and a plot of how frames grow with their lights."""

from __future__ import annotations

from typing import IO, Any

from firefly_sample.lab.picture_errors import require

DPI = 110

Row = dict[str, Any]
HEAD = (
    *("lights", "method", "ms", "spread", "ratio", "host ms", "of it plan", "draw calls", "bytes/px"),
    *("shaded", "a pair", "µs a light", "growth"),
)


def sizes_of(result: dict[str, Any]) -> list[tuple[int, int]]:
    """The sizes that were measured, (width, height), one or several."""
    size = result["size"]
    several = size if isinstance(size[0], list) else [size]
    return [(width, height) for width, height in several]


def speed_as_markdown(result: dict[str, Any]) -> str:
    """The rows as Markdown tables, one a size, with a line on what was measured, and what was left out."""
    lines = [
        f"{result['scene']}, {result['driver']}. Milliseconds are medians: of a frame, those of its passes; "
        f"of the host, what Python took beside them. Ratios are to {result['chosen']} in the same round. "
        '"A pair" is what was shaded over the pairs of a pixel and a light in range of it, "µs a light" what '
        'a light more costs since the row before of the same method, "growth" that over the one before.',
    ]
    for size in sizes_of(result):
        rows = [row for row in result["rows"] if tuple(row["size"]) == size]
        lines += ["", f"## {size[0]}x{size[1]}", ""]
        lines += [f"| {' | '.join(HEAD)} |", f"|--:|---|{'--:|' * (len(HEAD) - 2)}"]
        lines += [f"| {' | '.join(_cells(row))} |" for row in rows]
    if result["left_out"]:
        lines += ["", "Not drawn:", ""]
        lines += [
            f"- {row['method']} with {row['lights']:,} at {row['size'][0]}x{row['size'][1]}: {row['because']}"
            for row in result["left_out"]
        ]
    return "\n".join(lines) + "\n"


def _cells(row: Row) -> list[str]:
    return [
        f"{row['lights']:,}",
        row["method"],
        f"{row['ms']:.2f}",
        f"{row['spread']:.2f}",
        _number(row["ratio"], ".2f"),
        f"{row['host_ms']:.2f}",
        f"{row['plan_ms']:.2f}",
        str(row["draw_calls"]),
        f"{row['bytes_per_pixel']:g}",
        f"{row['shaded']:,}",
        _number(row["shaded_per_pair"], ".2f"),
        _number(row["slope"], ".1f"),
        _number(row["growth"], ".2f"),
    ]


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


_COLORS = {
    "volumes": "#2e6f95",
    "clustered": "#66a182",
    "auto": "#444444",
    "original": "#8d6a9f",
    "fullscreen": "#d1495b",
    "loop": "#e0a030",
}
_OTHER = "#999999"
_DASHED = "auto"
"""It is one of the others at any point: drawn over them, it lets them show."""


def figure_inches(panels: int) -> tuple[float, float]:
    """Width and height of the plot, `DPI` pixels each."""
    return (9.0 if panels == 1 else 1.0 + 5.5 * panels), 6.0


def growth_figure(result: dict[str, Any], file: IO[bytes]) -> None:
    """Write a PNG: milliseconds of a frame over lights, both logarithmic; a line a method, a panel a size.

    Frames without lights have no place on such an axis, nor have those whose clock told 0.

    Raises
    ------
    MissingPackageError
        If matplotlib is not installed.
    """
    require("matplotlib")
    from matplotlib.figure import Figure

    sizes = sizes_of(result)
    figure = Figure(figsize=figure_inches(len(sizes)), dpi=DPI, layout="constrained")
    panels = figure.subplots(1, len(sizes), sharex=True, sharey=True, squeeze=False)[0]
    lines: dict[str, Any] = {}
    for axes, size in zip(panels, sizes, strict=True):
        rows = [row for row in result["rows"] if tuple(row["size"]) == size and row["lights"] and row["ms"]]
        for method in dict.fromkeys(row["method"] for row in rows):
            mine = [row for row in rows if row["method"] == method]
            lines[method] = axes.errorbar(
                [row["lights"] for row in mine],
                [row["ms"] for row in mine],
                yerr=[0.5 * row["spread"] * row["ms"] for row in mine],
                color=_COLORS.get(method, _OTHER),
                fmt="--o" if method == _DASHED else "-o",
                markersize=4.5,
                linewidth=1.8,
                elinewidth=0.8,
                zorder=4 if method == _DASHED else 3,
            )
        _dress(axes, f"{size[0]}x{size[1]}")
    panels[0].set_ylabel("milliseconds of a frame (bars: from quartile to quartile)")
    title = f"{result['scene']}: what a frame costs, by how its lights are drawn"
    figure.suptitle(title, x=0.01, ha="left", fontsize=12)
    if lines:
        figure.legend(lines.values(), lines.keys(), frameon=False, fontsize=9, loc="outside right upper")
    if result["left_out"]:
        note = "Where a line ends early, frames took too long to be measured."
        figure.supxlabel(note, fontsize=8, color="#777777", x=0.01, ha="left")
    figure.savefig(file, format="png")


def _dress(axes: Any, title: str) -> None:
    """Axes that powers of ten mark, in plain numbers."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_title(title, loc="left", fontsize=10)
    axes.set_xlabel("lights in the scene")
    axes.grid(True, which="major", color="#dddddd", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.xaxis.set_major_formatter("{x:,g}")
    axes.yaxis.set_major_formatter("{x:,g}")
