"""Measure captures by one process, by worker processes, and by a cluster of processes on this machine.

Each capture is a real one, into a temporary folder, by a fresh process. Rates on a shared machine mean little
by themselves, so every round captures the same frames in each way in turn, and ratios are taken within a
round: to the one process. The start is measured apart from the rate of the frames after it.
"""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Sequence
from contextlib import nullcontext
from importlib.util import find_spec
from pathlib import Path
from time import monotonic
from typing import Any

from firefly_sample.capture.files import as_folder, output_folder
from firefly_sample.disk_cache import VARIABLE
from firefly_sample.errors import FireflyError, SceneError
from firefly_sample.extras import install_command
from firefly_sample.frame import check_size
from firefly_sample.lab.captures_report import captures_as_markdown
from firefly_sample.lab.fresh import answer_of
from firefly_sample.lab.measuring import quartile_spread, write_json
from firefly_sample.lab.reference.chunks import Progress, Steps
from firefly_sample.scenes import find_scene
from firefly_sample.scenes.plugin import start_time
from firefly_sample.whole_files import open_whole

FEWEST = 4
"""Frames of a capture: the first quarter of them is not in its rate."""
_SECONDS = 15.0
_PILOT = 12
_PROCESS = "firefly_sample.lab.captures_process"


class Capturing:
    """Captures of a scene in several ways, each by a fresh process. A context manager.

    The cache of models is a temporary one; the user's own is neither read nor written.

    Parameters
    ----------
    scene : str
    time : float, optional
        Of frame 0; the scene's `start_time` when absent.
    workers : int
    device : int, optional

    Attributes
    ----------
    ways : dict
        The arguments `workers` and `cluster` of `capture_frames`, by the name of the way.
    left_out : dict of str to str
        The names of other ways, with the reason.
    """

    def __init__(self, scene: str, time: float | None, workers: int, device: int | None) -> None:
        if workers < 2:
            raise SceneError(f"workers must be 2 or more to be compared with one process, got {workers}")
        self.plugin = find_scene(scene)
        self.workers = workers
        self.ways: dict[str, dict[str, Any]] = {
            "one process": {"workers": None, "cluster": None},
            f"{workers} workers": {"workers": workers, "cluster": None},
        }
        self.left_out: dict[str, str] = {}
        cluster = f"cluster of {workers}"
        if find_spec("distributed") is not None:
            self.ways[cluster] = {"workers": workers, "cluster": "local"}
        else:
            self.left_out[cluster] = f"distributed is not installed: run {install_command('cluster')}"
        start = start_time(self.plugin) if time is None else time
        self._job = {"scene": scene, "time": start, "device": device}
        self._answers: dict[Any, tuple[str, str]] = {}

    def capture(
        self, way: str, size: tuple[int, int], frames: int, sampled: Sequence[int] = ()
    ) -> dict[str, Any]:
        """Capture frames and return the answer of the process: see `captures_process`.

        Raises a FireflyError if the files differ from those of the same capture in another way.
        """
        with tempfile.TemporaryDirectory(dir=self._folder.name) as folder:
            job = {
                **self._job,
                **self.ways[way],
                "size": list(size),
                "frames": frames,
                "warm": max(frames // FEWEST, 1),
                "sampled": list(sampled),
                "folder": str(Path(folder, "capture")),
                "began": monotonic(),
            }
            # dask leaves an empty folder among temporary files
            own = {VARIABLE: str(Path(self._folder.name, "cache")), "TMPDIR": self._folder.name}
            _, answer = answer_of(_PROCESS, job, **own)
        same = self._answers.setdefault((size, frames), (way, answer["sha256"]))
        if same[1] != answer["sha256"]:
            raise FireflyError(
                f"scene {self.plugin.name!r}: the frames by {way} differ from those by {same[0]}; please "
                "report this as a bug"
            )
        self.driver = answer["driver"]
        return answer

    def __enter__(self) -> Capturing:
        self._folder = tempfile.TemporaryDirectory(prefix="firefly-captures-")
        return self

    def __exit__(self, *_: object) -> None:
        self._folder.cleanup()


def measure_captures(
    scene: str = "forest",
    folder: str | Path | None = None,
    *,
    sizes: Sequence[tuple[int, int]] = ((160, 120), (800, 600)),
    workers: int = 2,
    frames: int | None = None,
    time: float | None = None,
    rounds: int = 3,
    device: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Time captures by one process, by worker processes, and by a dask cluster of processes.

    All have the scene's own settings for captures, and the output color. A cluster is left out if distributed
    is not installed.

    Parameters
    ----------
    scene : str
        Name of a scene plugin, or "package.module:object".
    folder : path, optional
        Gets captures.json and captures.md.
    sizes : sequence of (int, int)
        Pixels.
    workers : int
        The number of processes in both ways that have several; 2 or more.
    frames : int, optional
        Of each capture, at least `FEWEST`; when absent, as many as one process draws in 15 seconds.
    time : float
        Of frame 0 in seconds; the scene's `start_time` when absent.
    rounds : int
        How often each way captures the frames of each size, after a short capture that is not timed.
    device : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (captures done, captures in all).

    Returns
    -------
    dict
        The output of ``firefly measure captures --json``: "scene", the plugin's name; "driver", the GL
        renderer string; "workers"; "rounds"; "left_out", the ways that were not measured, with the reason;
        and "rows", one for each size and way, with medians over the rounds:

        - "size", [width, height]; "frames" of a capture; "way"; "sha256" of the hashes of all files;
        - "first", seconds from the start of the process until the first frame is on the disk;
        - "rate", frames per second from a quarter of the frames to the last one;
        - "ratio", that over the rate of one process in the same round; and "spread", interquartile range
          over median of the ratios;
        - "cpu", seconds of processor time of all processes per frame, in the same part of the capture;
        - "cores", how many processor cores were busy with that; if other programs run, they take the rest,
          and ways with more processes get a larger share;
        - "seconds" from the start of the process until the manifest is written and the workers have ended;
        - "parent", "worker" and "all", bytes of memory (proportional set size) of the process that captures,
          of the largest worker, or None if there is none, and of all processes, when the last frame is on
          the disk.

    Raises
    ------
    FireflyError
        If the scene, a size, the folder or the driver is not usable, or files differ between two ways.
    """
    if rounds < 1 or not sizes:
        raise SceneError("there is nothing to measure: give at least one round and one size")
    if frames is not None and frames < FEWEST:
        raise SceneError(f"a capture to be measured must have at least {FEWEST} frames, got {frames}")
    if folder is not None:
        folder = as_folder(folder)
    wanted = list(dict.fromkeys(check_size(size) for size in sizes))
    with (
        output_folder(folder) if folder is not None else nullcontext(),
        Capturing(scene, time, workers, device) as capturing,
    ):
        steps = Steps(len(wanted) * (1 + rounds * len(capturing.ways)), progress)
        rows: list[dict[str, Any]] = []
        for size in wanted:
            pilot = capturing.capture("one process", size, frames or _PILOT)
            steps.add()
            count = frames or max(round(pilot["rate"] * _SECONDS), _PILOT)
            taken: dict[str, list[dict[str, Any]]] = {way: [] for way in capturing.ways}
            for number in range(rounds):
                # every second round goes the other way round, so that a machine that slows down favours none
                for way in list(taken)[:: 1 if number % 2 == 0 else -1]:
                    taken[way].append(capturing.capture(way, size, count))
                    steps.add()
            rows += [_row(size, count, way, own, taken["one process"]) for way, own in taken.items()]
        result = {
            "scene": capturing.plugin.name,
            "driver": capturing.driver,
            "workers": workers,
            "rounds": rounds,
            "left_out": capturing.left_out,
            "rows": rows,
        }
        if folder is not None:
            write_json(folder / "captures.json", result)
            with open_whole(folder / "captures.md") as file:
                file.write(captures_as_markdown(result).encode())
    return result


def _row(
    size: tuple[int, int], frames: int, way: str, own: list[dict[str, Any]], one: list[dict[str, Any]]
) -> dict[str, Any]:
    def median(name: str) -> float:
        return float(statistics.median(answer[name] for answer in own))

    ratios = [a["rate"] / b["rate"] for a, b in zip(own, one, strict=True)]
    memory = [answer["memory"] for answer in own]
    workers = [max(each["others"]) for each in memory if each["others"]]
    return {
        "size": list(size),
        "frames": frames,
        "way": way,
        "first": median("first"),
        "rate": median("rate"),
        "ratio": statistics.median(ratios),
        "spread": quartile_spread(ratios),
        "cpu": median("cpu"),
        "cores": statistics.median(answer["cpu"] * answer["rate"] for answer in own),
        "seconds": median("seconds"),
        "parent": round(statistics.median(each["parent"] for each in memory)),
        "worker": round(statistics.median(workers)) if workers else None,
        "all": round(statistics.median(each["parent"] + sum(each["others"]) for each in memory)),
        "sha256": own[0]["sha256"],
    }
