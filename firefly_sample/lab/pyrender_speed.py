"""Measure frames of pyrender's scenes: drawn by `firefly_sample.interop.pyrender`, and by pyrender itself.

Each renderer draws each scene in a process of its own, the same poses in the same order. They take turns,
block of frames by block of frames, and ratios are taken within a block: times on a shared machine mean little
by themselves.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from firefly_sample.columns import align
from firefly_sample.errors import SceneError, did_you_mean
from firefly_sample.frame import check_size
from firefly_sample.interop.pyrender.package import import_pyrender
from firefly_sample.lab.fresh import FreshProcess, start_process
from firefly_sample.lab.measuring import quartile_spread, write_json
from firefly_sample.lab.pyrender_process import WAYS
from firefly_sample.lab.pyrender_scenes import SCENES
from firefly_sample.lab.reference.chunks import Progress, Steps
from firefly_sample.whole_files import open_whole

SAMPLES = (4, 1)
"""pyrender's samples a pixel: its own number, and what it takes to draw as much as we do."""
_PROCESS = "firefly_sample.lab.pyrender_process"
_BLOCK = 20
"""Frames that a renderer draws before it is the next one's turn."""
_SETTLED = 100
"""The frame from which memory must no longer grow, in a loop that is more than twice as long."""
_HEAD = ("scene", "drawn", "samples", "ours ms", "pyrender ms", "ratio", "spread", "converted", "growth MiB")


def measure_pyrender(
    output: Path | None = None,
    *,
    scenes: Sequence[str] | None = None,
    ways: Sequence[str] | None = None,
    frames: int = 1000,
    size: tuple[int, int] = (640, 480),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Time loops over poses, drawn by our OffscreenRenderer and by pyrender's.

    Parameters
    ----------
    output : Path, optional
        Folder for pyrender.json and a table, pyrender.md; created if necessary.
    scenes, ways : sequence of str, optional
        Names from `firefly_sample.lab.pyrender_scenes.SCENES` and `firefly_sample.lab.pyrender_process.WAYS`;
        all when absent.
    frames : int
        Poses of each loop, after a first frame that is not timed.
    size : (int, int)
        Pixels.
    progress : callable, optional
        Called with (frames done, frames in all).

    Returns
    -------
    dict
        The output of ``firefly measure pyrender --json``: "size", [width, height]; "frames"; "driver", the GL
        renderer string; "pyrender", its version; and "rows", one for each scene, way and number of samples:
        "scene"; "drawn", the way; "samples", pyrender's samples a pixel; "ms" and "pyrender_ms", medians of a
        frame's milliseconds; "ratio", ours over pyrender's in the same block, the median; "spread",
        interquartile range over median of the ratios; "converted", the number of meshes that ours converted
        after the first frame; and "growth", the bytes by which its process grew, without libraries, from
        frame 100 (with fewer than 200 frames, from the middle) to the last.

    Raises
    ------
    MissingPackageError
        If pyrender is not installed.
    FireflyError
        If a name or a number is wrong, or a process cannot draw.
    """
    version = str(import_pyrender().__version__)
    chosen, drawn = _names("scene", scenes, tuple(SCENES)), _names("way", ways, WAYS)
    width, height = check_size(size)
    if frames < 2:
        raise SceneError(f"there is nothing to measure with {frames} frames: give two or more")
    steps = Steps(len(chosen) * len(drawn) * (1 + len(SAMPLES)) * frames, progress)
    result: dict[str, Any] = {
        "size": [width, height],
        "frames": frames,
        "driver": "",
        "pyrender": version,
        "rows": [],
    }
    for scene in chosen:
        with _drawers(scene, (width, height)) as drawers:
            drivers = {kind: drawer.driver() for kind, drawer in drawers.items()}
            result["driver"] = drivers["ours"]
            for way in drawn:
                result["rows"] += _rows(scene, way, drawers, frames, steps)
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
        write_json(output / "pyrender.json", result)
        with open_whole(output / "pyrender.md") as file:
            file.write(pyrender_as_markdown(result).encode())
    return result


def _names(what: str, given: Sequence[str] | None, known: Sequence[str]) -> tuple[str, ...]:
    for name in given or ():
        if name not in known:
            raise SceneError(f"there is no {what} {name!r}{did_you_mean(name, known)}: {', '.join(known)}")
    return tuple(known if given is None else given)


class _Drawer:
    """A process that draws one scene with one renderer: see `firefly_sample.lab.pyrender_process`."""

    def __init__(self, process: FreshProcess, kind: str, scene: str, size: tuple[int, int]) -> None:
        self._process = process
        process.tell({"renderer": kind, "scene": scene, "size": size})

    def driver(self) -> str:
        """Wait until it can draw, and return the name of its driver, if it is ours."""
        return str(self._process.answer()["driver"])

    def draw(self, way: str, first: int, end: int) -> dict[str, Any]:
        """Return the milliseconds of some frames, and the memory and the conversions after them."""
        self._process.tell({"way": way, "first": first, "end": end})
        return self._process.answer()


@contextmanager
def _drawers(scene: str, size: tuple[int, int]) -> Iterator[dict[str, _Drawer]]:
    """Start a process for each renderer, all at once."""
    with ExitStack() as stack:
        drawers = {}
        for kind in ("ours", *map(str, SAMPLES)):
            process = stack.enter_context(start_process(_PROCESS, PYOPENGL_PLATFORM="egl"))
            drawers[kind] = _Drawer(process, kind, scene, size)
        yield drawers


def _rows(
    scene: str, way: str, drawers: dict[str, _Drawer], frames: int, steps: Steps
) -> Iterator[dict[str, Any]]:
    """Yield the rows of a loop: one for each number of pyrender's samples."""
    first = {kind: drawer.draw(way, 0, 1) for kind, drawer in drawers.items()}
    settled = min(_SETTLED, frames // 2)
    taken: dict[str, list[list[float]]] = {kind: [] for kind in drawers}
    memory, converted = {}, 0
    for number, (start, end) in enumerate(_blocks(settled, frames)):
        # every second block goes the other way round, so that a machine that slows down favours none
        for kind in list(drawers)[:: 1 if number % 2 == 0 else -1]:
            answer = drawers[kind].draw(way, 1 + start, 1 + end)
            taken[kind].append(answer["milliseconds"])
            steps.add(end - start)
            if kind == "ours":
                memory[end] = answer["memory"]
                converted = answer["converted"] - first[kind]["converted"]
    for samples in SAMPLES:
        theirs = taken[str(samples)]
        ratios = [
            statistics.median(own) / statistics.median(one)
            for own, one in zip(taken["ours"], theirs, strict=True)
        ]
        yield {
            "scene": scene,
            "drawn": way,
            "samples": samples,
            "ms": _median(taken["ours"]),
            "pyrender_ms": _median(theirs),
            "ratio": statistics.median(ratios),
            "spread": quartile_spread(ratios),
            "converted": converted,
            "growth": memory[frames] - memory[settled],
        }


def _blocks(settled: int, frames: int) -> Iterator[tuple[int, int]]:
    """Yield the first frame of each block and the one after its last; one of them ends at `settled`."""
    starts = sorted({*range(0, settled, _BLOCK), *range(settled, frames, _BLOCK)})
    yield from zip(starts, [*starts[1:], frames], strict=True)


def _median(blocks: Iterable[Iterable[float]]) -> float:
    return statistics.median(value for block in blocks for value in block)


def pyrender_as_text(result: dict[str, Any]) -> str:
    """Return a measurement as a table."""
    return "\n".join(
        [
            _title(result),
            align([[name.upper() for name in _HEAD], *map(_cells, result["rows"])]),
            "ratios are ours over pyrender's, of frames drawn in turn",
            "converted: meshes after the first frame; growth: from frame 100 to the last",
        ]
    )


def pyrender_as_markdown(result: dict[str, Any]) -> str:
    """Return a measurement as a Markdown table below its title."""
    lines = [f"{_title(result)}:", "", f"| {' | '.join(_HEAD)} |", f"|---|---|{'--:|' * (len(_HEAD) - 2)}"]
    lines += [f"| {' | '.join(_cells(row))} |" for row in result["rows"]]
    return "\n".join(lines) + "\n"


def _title(result: dict[str, Any]) -> str:
    size = "x".join(map(str, result["size"]))
    return f"{result['frames']} poses, {size}, {result['driver']}, pyrender {result['pyrender']}"


def _cells(row: dict[str, Any]) -> list[str]:
    return [
        row["scene"],
        row["drawn"],
        str(row["samples"]),
        f"{row['ms']:.1f}",
        f"{row['pyrender_ms']:.1f}",
        f"{row['ratio']:.2f}",
        f"{row['spread']:.2f}",
        str(row["converted"]),
        f"{round(row['growth'] / 2**20, 1) + 0.0:.1f}",  # never -0.0
    ]
