"""Measure the time to the first picture in fresh processes, with and without the cache of models.

Times on a shared machine mean little by themselves, so every round runs each kind of process in turn, and
ratios are taken within a round: to a process that imports the libraries and opens a context.
"""

from __future__ import annotations

import statistics
import tempfile
from pathlib import Path
from typing import Any

from firefly_sample.disk_cache import VARIABLE
from firefly_sample.errors import FireflyError, SceneError
from firefly_sample.frame import check_size
from firefly_sample.lab.fresh import answer_of
from firefly_sample.lab.measuring import quartile_spread
from firefly_sample.lab.reference.chunks import Progress, Steps
from firefly_sample.scenes import find_scene
from firefly_sample.scenes.plugin import start_time

CACHES = ("off", "empty", "full")
"""The state of the cache for each kind of process, in this order: "full" is what "empty" left."""
_PROCESS = "firefly_sample.lab.start_process"


def measure_start(
    scene: str = "forest",
    *,
    size: tuple[int, int] = (800, 600),
    time: float | None = None,
    rounds: int = 5,
    device: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Time processes from their start to their first picture.

    The cache folders are temporary; the user's own cache is neither read nor written.

    Parameters
    ----------
    scene : str
        Name of a scene plugin, or "package.module:object".
    size : (int, int)
        Pixels.
    time : float
        Of the picture, in seconds; the scene's `start_time` when absent.
    rounds : int
        How often each kind of process runs, after one that is not timed.
    device : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (processes done, processes in all).

    Returns
    -------
    dict
        The output of ``firefly measure start --json``: "scene", the plugin's name; "size", [width, height];
        "rounds"; "driver", the GL renderer string; "dependencies", the median seconds of a process that
        imports NumPy, moderngl, trimesh and Pillow and opens a context; and "rows", one for each of `CACHES`:
        "cache", the state of the cache: not used ("off"), used but empty, or full; "seconds", from the start
        of the process to its picture, the median; "ratio", that over "dependencies" in the same round, the
        median; "spread", interquartile range over median of the ratios; and "sha256" of the picture's bytes.

    Raises
    ------
    FireflyError
        If the scene, the size or the driver is not usable, or two pictures differ.
    """
    plugin = find_scene(scene)
    time = start_time(plugin) if time is None else time
    width, height = check_size(size)
    if rounds < 1:
        raise SceneError("there is nothing to measure: give at least one round")
    steps = Steps(1 + rounds * (1 + len(CACHES)), progress)
    taken: dict[str, list[float]] = {name: [] for name in ("dependencies", *CACHES)}
    answers: dict[str, dict[str, Any]] = {}
    picture = {"scene": scene, "size": [width, height], "time": time, "device": device}
    jobs = {"dependencies": {"scene": None, "device": device}} | dict.fromkeys(CACHES, picture)

    def run(name: str, folder: str) -> float:
        seconds, answer = answer_of(_PROCESS, jobs[name], **{VARIABLE: folder})
        before = answers.setdefault(name if name == "dependencies" else "picture", answer)
        if answer != before:
            raise FireflyError(
                f"scene {plugin.name!r}: the picture drawn with cache state {name!r} differs from the "
                "earlier one; please delete the cache and report this as a bug"
            )
        steps.add()
        return seconds

    run("off", "off")
    for _ in range(rounds):
        with tempfile.TemporaryDirectory(prefix="firefly-start-") as folder:
            for name, seconds in taken.items():
                seconds.append(run(name, str(Path(folder, "cache")) if name in ("empty", "full") else "off"))
    rows = []
    for cache in CACHES:
        ratios = [own / one for own, one in zip(taken[cache], taken["dependencies"], strict=True)]
        rows.append(
            {
                "cache": cache,
                "seconds": statistics.median(taken[cache]),
                "ratio": statistics.median(ratios),
                "spread": quartile_spread(ratios),
                "sha256": answers["picture"]["sha256"],
            }
        )
    return {
        "scene": plugin.name,
        "size": [width, height],
        "rounds": rounds,
        "driver": answers["picture"]["driver"],
        "dependencies": statistics.median(taken["dependencies"]),
        "rows": rows,
    }
