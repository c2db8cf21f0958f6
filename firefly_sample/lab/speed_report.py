"""Rows of measured speed, tables of them, and a plot of how frame times grow with the number of lights."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import IO, Any

from firefly_sample.columns import align
from firefly_sample.lab.measuring import logarithmic_axes, quartile_spread

Row = dict[str, Any]
Size = tuple[int, int]

DPI = 110
_COLORS = {
    "volumes": "#2e6f95",
    "clustered": "#66a182",
    "auto": "#444444",
    "original": "#8d6a9f",
    "fullscreen": "#d1495b",
    "loop": "#e0a030",
}
_DASHED = "auto"
"""It coincides with one of the others at any point: a dashed line on top lets the other show."""


@dataclass(frozen=True)
class Draw:
    """One frame, drawn once.

    Attributes
    ----------
    passes : mapping of str to float
        Milliseconds of each pass.
    plan_ms : float
        Milliseconds of planning.
    host_ms : float
        Milliseconds of planning and drawing minus those of the passes: the time that Python took.
    """

    passes: Mapping[str, float]
    plan_ms: float
    host_ms: float

    @property
    def ms(self) -> float:
        """Milliseconds of all passes."""
        return sum(self.passes.values())


@dataclass
class Draws:
    """All draws of a frame by one method, with each seed, and the counts of their work.

    Attributes
    ----------
    by_seed : list of list of Draw
        In the order of rounds, so that a round can be compared with that of a different method.
    shaded : int
        Summed over the seeds; `draw_calls` and `bytes_per_pixel` are those of the last seed's frame.
    """

    by_seed: list[list[Draw]] = field(default_factory=list)
    shaded: int = 0
    draw_calls: int = 0
    bytes_per_pixel: float = 0.0

    @property
    def all(self) -> list[Draw]:
        """The draws of every seed, one after the other."""
        return [draw for draws in self.by_seed for draw in draws]


def make_row(method: str, size: Size, lights: int, own: Draws, chosen: Draws | None, pairs: int) -> Row:
    """Return a row of `firefly_sample.lab.speed.measure_speed`, without "slope" and "growth".

    Ratios refer to the draws of the chosen method, if there are any.
    """
    draws = own.all
    # a GPU's clock may give 0 for a nearly empty frame
    ratios = [a.ms / b.ms for a, b in zip(draws, chosen.all, strict=True) if b.ms] if chosen else []
    names = dict.fromkeys(name for draw in draws for name in draw.passes)
    passes = {name: [draw.passes[name] for draw in draws if name in draw.passes] for name in names}
    return {
        "size": list(size),
        "lights": lights,
        "method": method,
        "ms": statistics.median(draw.ms for draw in draws),
        "spread": statistics.median(quartile_spread([draw.ms for draw in seed]) for seed in own.by_seed),
        "ratio": statistics.median(ratios) if ratios else None,
        "passes": {name: statistics.median(values) for name, values in passes.items()},
        "host_ms": statistics.median(draw.host_ms for draw in draws),
        "plan_ms": statistics.median(draw.plan_ms for draw in draws),
        "draw_calls": own.draw_calls,
        "bytes_per_pixel": own.bytes_per_pixel,
        "shaded": own.shaded,
        "pairs": pairs,
        "shaded_per_pair": own.shaded / pairs if pairs else None,
    }


def with_slopes(rows: Sequence[Row]) -> list[Row]:
    """Return the rows with the cost of a light, compared with the previous row of the same size and method.

    "slope" is in microseconds per light: None without a previous row with fewer lights. "growth" is the slope
    over the previous slope, 1 where time is a straight line over lights: None if one of the two is missing or
    the previous slope is not above 0.
    """
    found, before = [], dict[tuple[Any, ...], Row]()
    for row in rows:
        key = (*row["size"], row["method"])
        last, slope, growth = before.get(key), None, None
        if last is not None and row["lights"] > last["lights"]:
            slope = 1e3 * (row["ms"] - last["ms"]) / (row["lights"] - last["lights"])
            if last["slope"] is not None and last["slope"] > 0.0:
                growth = slope / last["slope"]
        before[key] = {**row, "slope": slope, "growth": growth}
        found.append(before[key])
    return found


def sizes_of(result: dict[str, Any]) -> list[Size]:
    """Return the sizes that were measured, one or several."""
    size = result["size"]
    several = size if isinstance(size[0], list) else [size]
    return [(width, height) for width, height in several]


_COLUMNS = {
    "lights": ("lights", ",d"),
    "method": ("method", ""),
    "ms": ("ms", ".2f"),
    "spread": ("spread", ".2f"),
    "ratio": ("ratio", ".2f"),
    "host_ms": ("host ms", ".2f"),
    "plan_ms": ("plan ms", ".2f"),
    "draw_calls": ("draw calls", "d"),
    "bytes_per_pixel": ("bytes/px", "g"),
    "shaded": ("shaded", ",d"),
    "pairs": ("pairs", ",d"),
    "shaded_per_pair": ("shaded/pair", ".2f"),
    "slope": ("us/light", ".1f"),
    "growth": ("growth", ".2f"),
}
"""The columns of a table: the key in a row, the heading and the format."""
_PASSES = slice(5, 5)
"""The place of the columns of passes among them."""


def _table(result: dict[str, Any], size: Size, passes: Sequence[str] = ()) -> list[list[str]]:
    """Return the heading and the rows of one size, with a column for each of `passes`."""
    head = [heading for heading, _ in _COLUMNS.values()]
    head[_PASSES] = passes
    table = [head]
    for row in result["rows"]:
        if tuple(row["size"]) == size:
            cells = [_cell(row[key], form) for key, (_, form) in _COLUMNS.items()]
            cells[_PASSES] = [_cell(row["passes"].get(name), ".2f") for name in passes]
            table.append(cells)
    return table


def _cell(value: Any, form: str) -> str:
    return "-" if value is None else format(value, form)


def _shape(size: Sequence[int]) -> str:
    return "x".join(map(str, size))


def _left_out(result: dict[str, Any]) -> list[str]:
    return [
        f"{row['method']} with {row['lights']:,} lights at {_shape(row['size'])}: {row['because']}"
        for row in result["left_out"]
    ]


def speed_as_text(result: dict[str, Any]) -> str:
    """Return the rows as aligned tables, one per size, with a column for each pass."""
    passes = list(dict.fromkeys(name for row in result["rows"] for name in row["passes"]))
    lines = []
    for size in sizes_of(result):
        head, *rows = _table(result, size, passes)
        frame = f"{result['scene']}, {_shape(size)}, {result['driver']}"
        lines.append(f"{frame}; milliseconds of a frame and its passes")
        lines.append(align([[heading.upper() for heading in head], *rows]))
    lines.append(f"ratios are to the time of method {result['chosen']}")
    return "\n".join([*lines, *(f"left out: {text}" for text in _left_out(result))])


def speed_as_markdown(result: dict[str, Any]) -> str:
    """Return the rows as Markdown tables, one per size, with a legend and a list of what was left out."""
    lines = [
        f"{result['scene']}, {result['driver']}. Times are medians in milliseconds: `ms` of a frame's "
        "passes, `host ms` of Python beside them, `plan ms` the part of planning in that. Ratios are to "
        f"method {result['chosen']} in the same round. `shaded/pair` is the number of shaded fragments over "
        "the (pixel, light) pairs in range, `us/light` the microseconds per additional light since the "
        "previous row of the same method, `growth` that over the previous one.",
    ]
    for size in sizes_of(result):
        head, *rows = _table(result, size)
        lines += ["", f"## {_shape(size)}", "", f"| {' | '.join(head)} |"]
        lines += [f"|--:|---|{'--:|' * (len(head) - 2)}"]
        lines += [f"| {' | '.join(cells)} |" for cells in rows]
    if result["left_out"]:
        lines += ["", "Not drawn:", "", *(f"- {text}" for text in _left_out(result))]
    return "\n".join(lines) + "\n"


def figure_inches(panels: int) -> tuple[float, float]:
    """Return width and height of the plot, `DPI` pixels each."""
    return (9.0 if panels == 1 else 1.0 + 5.5 * panels), 6.0


def growth_figure(result: dict[str, Any], file: IO[bytes]) -> None:
    """Write a PNG: milliseconds of a frame over lights; a line per method, a panel per size.

    Frames without lights, and frames for which the clock gave 0, cannot be shown on its logarithmic axes. It
    needs matplotlib.
    """
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
                color=_COLORS[method],
                fmt="--o" if method == _DASHED else "-o",
                markersize=4.5,
                linewidth=1.8,
                elinewidth=0.8,
                zorder=4 if method == _DASHED else 3,
            )
        logarithmic_axes(axes)
        axes.set_title(_shape(size), loc="left", fontsize=10)
        axes.set_xlabel("lights in the scene")
        axes.xaxis.set_major_formatter("{x:,g}")
        axes.yaxis.set_major_formatter("{x:,g}")
    panels[0].set_ylabel("milliseconds per frame (bars: interquartile range)")
    title = f"{result['scene']}: frame time by lighting method"
    figure.suptitle(title, x=0.01, ha="left", fontsize=12)
    if lines:
        figure.legend(lines.values(), lines.keys(), frameon=False, fontsize=9, loc="outside right upper")
    if result["left_out"]:
        note = "A line ends early where frames took too long to be measured."
        figure.supxlabel(note, fontsize=8, color="#777777", x=0.01, ha="left")
    figure.savefig(file, format="png")
