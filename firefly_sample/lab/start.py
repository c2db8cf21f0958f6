"""How soon the first picture is there: in fresh processes, with what is derived from models kept or not.

Times on a shared machine mean little by themselves, so every round runs each kind of process in turn, and the
ratios are taken within a round: to a process that imports the libraries and opens a context.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

from firefly_sample.derived import VARIABLE
from firefly_sample.errors import FireflyError, SceneError
from firefly_sample.frame import check_size
from firefly_sample.lab.trade_bench import quartile_spread
from firefly_sample.scenes import find_scene

CACHES = ("off", "empty", "full")
"""What each kind of process finds; in this order, "full" is what "empty" left."""


def measure_start(
    scene: str = "forest",
    *,
    size: tuple[int, int] = (800, 600),
    time: float = 5.0,
    rounds: int = 5,
    device: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Time processes from their start to their first picture.

    The folders of what is kept are temporary; the user's own is neither read nor written.

    Parameters
    ----------
    scene : str
        Name of a scene plugin, or "package.module:object".
    size : (int, int)
        Pixels.
    time : float
        Seconds, of the picture.
    rounds : int
        How often each kind of process runs, after one picture that is not timed.
    device : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (processes done, processes in all).

    Returns
    -------
    dict
        What ``firefly measure start --json`` prints: "scene", the plugin's name; "size", [width, height];
        "rounds"; "driver", the GL renderer string; "dependencies", the median seconds of a process that
        imports NumPy, moderngl, trimesh and Pillow and opens a context; and "rows", one for each of `CACHES`:

        "cache" : str
            What is kept of models: nothing and nothing will be ("off"), nothing yet, or all.
        "seconds" : float
            From the start of the process to its picture: the median.
        "ratio" : float
            To "dependencies" in the same round: the median.
        "spread" : float
            Interquartile range over median of the ratios.
        "sha256" : str
            Of the picture's bytes.

    Raises
    ------
    FireflyError
        If the scene, the size or the driver is not as it must be, or two pictures differ.
    """
    plugin = find_scene(scene)
    width, height = check_size(size)
    if rounds < 1:
        raise SceneError("there is nothing to measure: give at least one round")
    total, done = 1 + rounds * (1 + len(CACHES)), 0
    taken: dict[str, list[float]] = {name: [] for name in ("dependencies", *CACHES)}
    answers: dict[str, dict[str, Any]] = {}
    picture = {"scene": scene, "size": [width, height], "time": time, "device": device}
    jobs = {"dependencies": {"scene": None, "device": device}} | dict.fromkeys(CACHES, picture)

    def run(name: str, folder: str) -> float:
        nonlocal done
        seconds, answer = _run(jobs[name], folder)
        before = answers.setdefault(name if name == "dependencies" else "picture", answer)
        if answer != before:
            raise FireflyError(
                f"scene {plugin.name!r}: the picture with the cache {name!r} is another than before: "
                "delete the cache and report this"
            )
        done += 1
        if progress is not None:
            progress(done, total)
        return seconds

    run("off", "off")
    for _ in range(rounds):
        with tempfile.TemporaryDirectory(prefix="firefly-start-") as folder:
            for name, seconds in taken.items():
                seconds.append(run(name, str(Path(folder, "kept")) if name in ("empty", "full") else "off"))
    return {
        "scene": plugin.name,
        "size": [width, height],
        "rounds": rounds,
        "driver": answers["picture"]["driver"],
        "dependencies": statistics.median(taken["dependencies"]),
        "rows": [
            _row(name, taken[name], taken["dependencies"], answers["picture"]["sha256"]) for name in CACHES
        ],
    }


def _row(name: str, seconds: list[float], unit: list[float], digest: str) -> dict[str, Any]:
    ratios = [own / one for own, one in zip(seconds, unit, strict=True)]
    return {
        "cache": name,
        "seconds": statistics.median(seconds),
        "ratio": statistics.median(ratios),
        "spread": quartile_spread(ratios),
        "sha256": digest,
    }


def _run(job: dict[str, Any], folder: str) -> tuple[float, dict[str, Any]]:
    """Seconds until a fresh process answers, and its answer."""
    # what can be imported here can be imported there, and nothing else: by itself, -m adds the working folder
    command = [sys.executable, "-P", "-m", "firefly_sample.lab.start_process", json.dumps(job)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), VARIABLE: folder}
    with tempfile.TemporaryFile("w+") as errors:
        start = perf_counter()
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=errors, text=True
        ) as process:
            try:
                assert process.stdout is not None
                line = process.stdout.readline()
                seconds = perf_counter() - start
            except BaseException:
                process.kill()
                raise
        if not line:
            errors.seek(0)
            said = errors.read().strip().splitlines()
            raise FireflyError(
                f"a process ended without a picture: {said[-1] if said else 'it said nothing'}"
            )
    answer = json.loads(line)
    if "error" in answer:
        raise FireflyError(answer["error"])
    return seconds, answer
