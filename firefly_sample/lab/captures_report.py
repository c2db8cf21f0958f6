"""Tables of measured captures."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from firefly_sample.columns import align

MIB = 2**20
_HEAD = (
    "way",
    "first s",
    "frames/s",
    "ratio",
    "spread",
    "CPU s/frame",
    "cores",
    "all s",
    "parent",
    "worker",
    "all",
)


def captures_as_text(result: dict[str, Any]) -> str:
    """Return a measurement of captures as aligned tables, one for each size."""
    lines = []
    for title, rows in _tables(result):
        head = [name.upper() for name in _HEAD]
        lines += [f"{result['scene']}, {title}, {result['driver']}", align([head, *rows])]
    lines.append("first s: from the process's start to the first frame on the disk; all s: to its end")
    lines.append("ratios are of frames/s, without the first quarter, to one process in the same round")
    lines.append("memory in MiB (PSS) when the last frame is on the disk; the files of all ways are equal")
    return "\n".join(lines + _left_out(result))


def captures_as_markdown(result: dict[str, Any]) -> str:
    """Return a measurement of captures as Markdown tables, one for each size, with a legend."""
    lines = [
        f"{result['scene']}, {result['driver']}; medians of {result['rounds']} rounds. `first s` is the time "
        "from the process's start to the first frame on the disk, `all s` to its end. `frames/s` and `CPU "
        "s/frame` are without the first quarter of the frames; `cores` is their product, the processor cores "
        "that were busy. `ratio` is to one process in the same round, `spread` the interquartile range of "
        "the ratios over their median. Memory is in MiB (PSS) when the last frame is on the disk: of the "
        "process that captures, of the largest worker, and of all.",
    ]
    for title, rows in _tables(result):
        lines += ["", f"## {title}", "", f"| {' | '.join(_HEAD)} |", f"|---|{'--:|' * (len(_HEAD) - 1)}"]
        lines += [f"| {' | '.join(cells)} |" for cells in rows]
    return "\n".join([*lines, "", *_left_out(result)]).rstrip() + "\n"


def growth_as_text(result: dict[str, Any]) -> str:
    """Return a measurement of growth as a table with a row for each way."""
    first, last = result["frames"]
    head = ["WAY", "FRAMES/S", f"AT {first}", f"AT {last}", "GROWTH", "AT THE END", "GROWTH OF OTHERS"]
    rows = [
        [
            row["way"],
            f"{row['rate']:.1f}",
            f"{row['samples'][0]['parent'] / MIB:.1f}",
            f"{row['samples'][-1]['parent'] / MIB:.1f}",
            f"{row['growth'] / MIB:+.1f}",
            f"{row['finished'] / MIB:.1f}",
            f"{row['others'] / MIB:+.1f}",
        ]
        for row in result["rows"]
    ]
    about = f"an empty scene, {last} frames, {result['driver']}; memory in MiB (PSS) of the capturing process"
    return "\n".join([about, align([head, *rows]), *_left_out(result)])


def _tables(result: dict[str, Any]) -> Iterator[tuple[str, list[list[str]]]]:
    """Yield a title and rows of cells for each size."""
    for size in dict.fromkeys(tuple(row["size"]) for row in result["rows"]):
        rows = [row for row in result["rows"] if tuple(row["size"]) == size]
        yield f"{size[0]}x{size[1]}, {rows[0]['frames']} frames", [_cells(row) for row in rows]


def _cells(row: dict[str, Any]) -> list[str]:
    sizes = (row["parent"], row["worker"], row["all"])
    return [
        row["way"],
        f"{row['first']:.2f}",
        f"{row['rate']:.2f}",
        f"{row['ratio']:.2f}",
        f"{row['spread']:.2f}",
        f"{row['cpu']:.3f}",
        f"{row['cores']:.1f}",
        f"{row['seconds']:.1f}",
        *("-" if size is None else f"{size / MIB:.0f}" for size in sizes),
    ]


def _left_out(result: dict[str, Any]) -> list[str]:
    return [f"left out: {way}: {reason}" for way, reason in result["left_out"].items()]
