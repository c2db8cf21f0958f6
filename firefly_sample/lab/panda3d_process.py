"""The process that `firefly_sample.lab.panda3d_speed` times: a Panda3D program with a live view.

Its input is a job in JSON, a line, and its output the answer.
"""

from __future__ import annotations

import json
import random
import statistics
import sys
import warnings
from time import perf_counter
from typing import Any


def _program(lights: int, size: tuple[int, int]) -> Any:
    """Return a ShowBase without a window, with a model, a floor and lights that move."""
    from panda3d import core

    core.load_prc_file_data(
        "measure",
        f"load-display p3headlessgl\nwindow-type offscreen\nwin-size {size[0]} {size[1]}\n"
        "audio-library-name null\nnotify-level-device fatal\nprint-pipe-types false\n",
    )
    from direct.showbase.ShowBase import ShowBase

    base = ShowBase()
    base.cam.set_pos_hpr(0, -17, 8, 0, -25, 0)
    for name, place, scale in (("box", (-10, -10, -20), 20), ("teapot", (-3, 0, 0), 0.8)):
        model = base.loader.load_model(f"models/{name}")
        model.set_pos(*place)
        model.set_scale(scale)
        model.reparent_to(base.render)
    numbers = random.Random(1)
    for number in range(lights):
        light = core.PointLight(f"light {number}")
        light.set_color((numbers.uniform(0, 3), numbers.uniform(0, 3), 0.6, 1))
        light.set_attenuation((1, 0, 100))
        orbit = base.render.attach_new_node("orbit")
        orbit.attach_new_node(light).set_pos(numbers.uniform(0, 10), 0, numbers.uniform(0.2, 2))
        start = numbers.uniform(0, 360)
        orbit.hprInterval(numbers.uniform(9, 40), (start + 360, 0, 0), (start, 0, 0)).loop()
    return base


def _measure(lights: int, size: tuple[int, int], frames: int) -> dict[str, Any]:
    """Return the medians of the milliseconds of live frames, of their parts, and of the same scene alone."""
    from firefly_sample.interop.panda3d import FireflyView
    from firefly_sample.renderer import Renderer

    base = _program(lights, size)
    times: dict[str, list[float]] = {}
    with FireflyView(base) as view, Renderer(size, view.settings) as renderer:
        for number in range(frames + 1):
            start = perf_counter()
            base.task_mgr.step()
            live = perf_counter()
            renderer.render(view.scene, view.frame.time)
            if number:  # the first frame of both also compiles
                found = {"live": live - start, "alone": perf_counter() - live}
                own = {part: 1e-3 * value for part, value in view.milliseconds.items()}
                for name, value in (found | own).items():
                    times.setdefault(name, []).append(1e3 * value)
        driver = view.frame.driver
    base.destroy()
    return {"driver": driver, "ms": {name: statistics.median(values) for name, values in times.items()}}


def main() -> int:
    """Do the job on stdin."""
    from firefly_sample.errors import FireflyError

    warnings.simplefilter("ignore", UserWarning)
    stdout, sys.stdout = sys.stdout, sys.stderr  # only the answer goes to stdout, whatever a library prints
    job = json.loads(sys.stdin.readline())
    try:
        answer = _measure(job["lights"], tuple(job["size"]), job["frames"])
    except FireflyError as error:
        answer = {"error": str(error)}
    print(json.dumps(answer), file=stdout, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
