"""The process in which `firefly_sample.lab.fireflies` runs a program of Panda3D, frame by frame.

The job is its only argument, in JSON, and each line of its output is an answer.
"""

from __future__ import annotations

import json
import os
import pickle
import random
import runpy
import statistics
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from firefly_sample.errors import FireflyError

FRAMES_PER_SECOND = 30
_QUIET_FRAMES = 3
"""Frames without a change in the graph after which all models are there."""
_LOADING_SECONDS = 120.0
_SEED = 1
Answer = Callable[[dict[str, Any]], None]


class _Done(BaseException):
    """Ends the program where it would run its main loop."""


def run_program(job: dict[str, Any], answer: Answer) -> dict[str, Any]:
    """Run main.py of a folder up to a time of its own, and return what it shows then.

    Its clock stands still until its models are loaded, and goes on by a thirtieth of a second a frame. Its
    random numbers have a fixed seed.

    Parameters
    ----------
    job : dict
        "folder"; "into", a folder for picture.npy and scene.pickle; "size"; "seconds"; "has_display".
    answer : callable
        Takes progress, and before that whether Panda3D can open a window; if not, nothing is run.

    Raises
    ------
    FireflyError
        If the program fails or ends by itself, or its graph is not one that `from_deferred` reads.
    """
    from panda3d import core

    display = "pandagl" if job["has_display"] else "p3headlessgl"
    width, height = job["size"]
    core.load_prc_file_data(
        "firefly_sample",
        f"load-display {display}\naux-display\nwindow-type offscreen\nwin-size {width} {height}\n"
        "audio-library-name null\nsync-video false\nnotify-level-device fatal\n",
    )
    pipe = core.GraphicsPipeSelection.get_global_ptr().make_default_pipe()
    opened = pipe is not None and pipe.is_valid()
    answer({"opened": opened})
    if not opened:
        return {}
    folder = Path(job["folder"])
    clock = core.ClockObject.get_global_clock()
    clock.set_mode(core.ClockObject.M_slave)
    core.get_model_path().prepend_directory(core.Filename.from_os_specific(str(folder)))
    os.chdir(folder)
    sys.path.insert(0, str(folder))
    sys.argv = ["main.py"]
    given, random.seed = random.seed, lambda *arguments, **named: given(*arguments or (_SEED,), **named)
    random.seed()
    found: dict[str, Any] = {}

    def drive(*_: object) -> None:
        found.update(_drive(clock, job, answer))
        raise _Done

    _replace_main_loops(drive)
    run_main()
    return found


def run_main() -> None:
    """Run main.py of the working folder until it would run its main loop.

    Raises
    ------
    FireflyError
        If it fails, or ends before that.
    """
    try:
        runpy.run_path("main.py", run_name="__main__")
    except _Done:
        return
    except FireflyError:
        raise
    except SystemExit as error:
        raise FireflyError(
            f"main.py ended by sys.exit({error.code!r}) before its picture was drawn"
        ) from error
    except Exception as error:
        raise FireflyError(f"main.py failed{_place(error)}: {type(error).__name__}: {error}") from error
    raise FireflyError("main.py ended without a call of run()")


def _place(error: BaseException) -> str:
    """Return the line of main.py at which an error was raised."""
    lines = [each.lineno for each in traceback.extract_tb(error.__traceback__) if each.filename == "main.py"]
    return f" in line {lines[-1]}" if lines else ""


def _replace_main_loops(drive: Callable[..., None]) -> None:
    from direct.showbase.ShowBase import ShowBase
    from direct.task.Task import TaskManager

    ShowBase.run = drive
    TaskManager.run = drive


def _drive(clock: Any, job: dict[str, Any], answer: Answer) -> dict[str, Any]:
    """Run the frames of the program that has opened `base`; return figures, and write the files."""
    import builtins

    from panda3d import core

    from firefly_sample.interop.panda3d.deferred import find_cameras, from_deferred, shader_name, shaders_of

    base = getattr(builtins, "base", None)
    if base is None or base.win is None:
        raise FireflyError("main.py runs without a window")
    _settle(base)
    frames, spent = max(1, round(job["seconds"] * FRAMES_PER_SECOND)), []
    for frame in range(frames):
        clock.set_dt(1.0 / FRAMES_PER_SECOND)
        clock.set_frame_time((frame + 1) / FRAMES_PER_SECOND)
        start = time.perf_counter()
        base.task_mgr.step()
        spent.append(1e3 * (time.perf_counter() - start))
        answer({"done": frame + 1, "total": frames})
    for layer in (base.aspect2d, base.pixel2d):  # texts; a deferred program shows its picture by render2d
        layer.hide()
    base.task_mgr.step()
    into, shown = Path(job["into"]), base.win.get_screenshot()
    if shown is None:
        raise FireflyError("Panda3D gives no picture of its window")
    size = shown.get_x_size(), shown.get_y_size()
    codes = np.frombuffer(shown.get_ram_image_as("RGB"), dtype=np.uint8)
    np.save(into / "picture.npy", codes.reshape(size[1], size[0], 3)[::-1])
    made = from_deferred(base.render)
    with (into / "scene.pickle").open("wb") as file:
        pickle.dump(made.scene, file)
    lines = made.lines
    if not job["has_display"]:
        in_cg = [each for each in shaders_of(find_cameras(base.render)) if each.get_language() == each.SL_Cg]
        if in_cg:
            names = ", ".join(repr(shader_name(shader)) for shader in in_cg)
            lines = [f"Panda3D does not run shaders in Cg without an X display: {names}", *lines]
    driver = base.win.get_gsg().get_driver_renderer()
    base.destroy()  # at its exit, Panda3D would lock what is gone already
    return {
        "milliseconds": statistics.median(spent),
        "frames": frames,
        "driver": driver,
        "version": core.PandaSystem.get_version_string(),
        "models": made.models,
        "lights": made.lights,
        "dots": made.dots,
        "lines": lines,
    }


def _settle(base: Any) -> None:
    """Run frames, at one time, until all models that are being loaded are in the graph."""
    from panda3d import core

    chain = core.AsyncTaskManager.get_global_ptr().find_task_chain(base.loader.loader.get_task_chain())
    quiet, before, start = 0, -1, time.monotonic()
    while quiet < _QUIET_FRAMES:
        base.task_mgr.step()
        nodes = base.render.find_all_matches("**/+GeomNode")
        now = sum(path.node().get_num_geoms() for path in nodes)
        loading = chain is not None and chain.get_num_tasks() > 0
        quiet = quiet + 1 if now == before and not loading else 0
        before = now
        if time.monotonic() - start > _LOADING_SECONDS:
            raise FireflyError(f"main.py loads models for more than {_LOADING_SECONDS:g} s")
        if loading:
            time.sleep(0.005)


def main() -> int:
    """Do the job in the only argument; only answers go to stdout, whatever the program prints."""
    stdout = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def answer(told: dict[str, Any]) -> None:
        print(json.dumps(told), file=stdout, flush=True)

    try:
        answer(run_program(json.loads(sys.argv[1]), answer))
    except FireflyError as error:
        answer({"error": str(error)})
    return 0


if __name__ == "__main__":
    sys.exit(main())
