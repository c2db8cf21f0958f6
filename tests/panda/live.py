"""Panda3D programs with a live view, in a process of their own with a display: functions that run there.

Panda3D has one ShowBase at a time in a process. `start_live` gives a function that calls those of this module
in that process; they keep what the later ones need in `_program`.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import runpy
import subprocess
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from firefly_sample import Renderer
from firefly_sample.errors import SceneError
from firefly_sample.interop.panda3d import FireflyView, from_panda3d
from firefly_sample.lab.x_display import start_display
from tests.panda.oracle import CONFIGURATION

EXAMPLE = Path(__file__).parents[2] / "docs/examples/live_panda3d.py"
SIZE = (160, 120)
_program: dict[str, Any] = {}


class Pictures(NamedTuple):
    """Three pictures after one frame, uint8, first row on top: of the window, the view, and without a view.

    `alone` is what our renderer draws of the same graph, converted anew.
    """

    window: np.ndarray
    view: np.ndarray
    alone: np.ndarray


@contextmanager
def start_live(messages: Path) -> Iterator[Callable[..., Any]]:
    """``call(function, *arguments)`` in the other process, whose stderr goes to the file `messages`."""
    spawn = multiprocessing.get_context("spawn")
    with start_display() as display:
        initial = display, str(messages)
        with ProcessPoolExecutor(1, mp_context=spawn, initializer=_configure, initargs=initial) as pool:
            yield lambda function, *arguments: pool.submit(function, *arguments).result()
            pool.submit(end).result()


def _configure(display: str, messages: str) -> None:
    os.environ["DISPLAY"] = display
    os.dup2(os.open(messages, os.O_WRONLY | os.O_CREAT), 2)
    from panda3d import core

    size = f"win-size {SIZE[0]} {SIZE[1]}\nwin-origin 0 0\n"
    core.load_prc_file_data("tests", CONFIGURATION + size)


# --- what runs in the other process ---


def start_example() -> None:
    """Run the example up to its ``base.run()``; from now on each step lasts a second of Panda3D's time."""
    from direct.showbase.ShowBase import ShowBase
    from panda3d import core

    clock = core.ClockObject.get_global_clock()
    clock.set_mode(core.ClockObject.M_non_real_time)
    clock.set_dt(1.0)
    random.seed(1)
    run, ShowBase.run = ShowBase.run, lambda self: None
    try:
        _program.update(runpy.run_path(str(EXAMPLE)))
    finally:
        ShowBase.run = run


def start_plain() -> None:
    """A ShowBase with a panda and a lamp, and a view."""
    from direct.showbase.ShowBase import ShowBase
    from panda3d import core

    base = ShowBase()
    base.disable_mouse()
    base.cam.set_pos(0, -30, 6)
    panda = base.loader.load_model("models/panda")
    panda.reparent_to(base.render)
    lamp = base.render.attach_new_node(core.PointLight("lamp"))
    lamp.set_pos(5, -20, 15)
    base.render.set_light(lamp)
    base.render.set_shader_auto()
    _program.update(base=base, panda=panda, lamp=lamp, view=FireflyView(base))


def end() -> list[str]:
    """End the program; return the names of the threads that are left."""
    base = _program.get("base")
    _program.clear()
    if base is not None:
        base.destroy()
    return [thread.name for thread in threading.enumerate()]


def step(count: int = 1) -> None:
    for _ in range(count):
        _program["base"].task_mgr.step()


def window() -> np.ndarray:
    """The window's picture, shape (height, width, 3)."""
    from panda3d import core

    image = _program["base"].win.get_screenshot()
    width, height = image.get_x_size(), image.get_y_size()
    codes = np.frombuffer(image.get_ram_image_as("RGB"), dtype=np.uint8)
    assert isinstance(image, core.Texture)
    return codes.reshape(height, width, 3)[::-1].copy()


def pictures() -> Pictures:
    """Pictures after one more frame."""
    base, view = _program["base"], _program["view"]
    step()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = from_panda3d(base.render, base.cam, background=view.scene.background)
        with Renderer(view.frame.size, view.settings) as renderer:
            alone = renderer.render(scene, view.frame.time)
    return Pictures(window(), view.frame.color, alone.color)


def changes() -> dict[str, Pictures]:
    """Change the example's graph, one thing after the other; pictures of the frame after each."""
    from panda3d import core

    base, teapot = _program["base"], _program["teapot"]
    sun = core.NodePath(core.DirectionalLight("sun"))
    smiley = base.loader.load_model("models/smiley")
    smiley.set_pos(2, -6, 2)

    def come() -> None:
        smiley.reparent_to(base.render)
        sun.reparent_to(base.render)

    def go() -> None:
        smiley.remove_node()
        sun.remove_node()

    def look_around() -> None:
        base.cam.set_x(3)
        base.camLens.set_fov(70)
        base.set_background_color(0.3, 0.2, 0.1)

    done = {
        "a model moves": lambda: teapot.set_pos(0, -2, 1),
        "a model and a light come": come,
        "the camera and the background change": look_around,
        "they go": go,
        "all lights go": _program["swarm"].remove_node,
    }
    found = {}
    for what, change in done.items():
        change()
        found[what] = pictures()
    return found


def layer(view: bool) -> tuple[np.ndarray, np.ndarray]:
    """Panda3D's 2D layer alone over black and over white, with a view or without."""
    base = _program["base"]
    base.render.hide()
    if not view:
        _program["view"].close()
    before, found = tuple(base.win.get_clear_color()), []
    for level in (0.0, 1.0):
        base.set_background_color(level, level, level)
        step(2)
        found.append(window())
    base.set_background_color(*before)
    base.render.show()
    if not view:
        _program["view"] = FireflyView(base)
    return found[0], found[1]


def press(x: int, y: int) -> float:
    """Click into the window; return the height of the teapot once that has changed, or else at last."""
    teapot = _program["teapot"]
    before = teapot.get_z()
    subprocess.run(["xdotool", "mousemove", str(x), str(y)], check=True)
    step(2)
    for button in ("mousedown", "mouseup"):
        subprocess.run(["xdotool", button, "1"], check=True)
        step(2)
    for _ in range(20):
        if teapot.get_z() != before:
            break
        step()
    return teapot.get_z()


# --- of the plain program ---


def view_again() -> None:
    """A new view, in place of the one that has ended."""
    _program["view"] = FireflyView(_program["base"])


def resized(width: int, height: int) -> tuple[tuple[int, int], tuple[int, ...]]:
    """The size of the view's frame and the shape of the window's picture in a window of another size."""
    from panda3d import core

    base = _program["base"]
    base.win.request_properties(core.WindowProperties.size(width, height))
    for _ in range(100):
        step()
        if base.win.get_x_size() == width:
            break
    step()
    return _program["view"].frame.size, window().shape


def warned() -> list[list[str]]:
    """The warnings of three frames: the first and the last have something new that is not drawn."""
    from panda3d import core

    said = []
    for name in ("first", None, "second"):
        if name is not None:
            node = core.CallbackNode(name)
            node.set_cull_callback(lambda data: None)
            _program["base"].render.attach_new_node(node)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            step()
        said.append([str(warning.message) for warning in caught])
    return said


def another_camera() -> tuple[bool, list[str]]:
    """Is a view open, and what is said, after its region has got another camera."""
    from panda3d import core

    base = _program["base"]
    region = base.cam.node().get_display_region(0)
    region.set_camera(base.render.attach_new_node(core.Camera("filter")))
    is_open = _program["view"].is_open
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        step(2)
    assert is_open
    is_open = _program["view"].is_open
    region.set_camera(base.cam)
    view_again()
    return is_open, [str(warning.message) for warning in caught]


def inverted() -> tuple[np.ndarray, np.ndarray]:
    """The window's picture with one of Panda3D's filters, and the view's, which is made after it."""
    from direct.filter.CommonFilters import CommonFilters

    base = _program["base"]
    _program["view"].close()
    filters = CommonFilters(base.win, base.cam)
    assert filters.set_inverted()
    view_again()
    step(2)
    found = window(), _program["view"].frame.color
    _program["view"].close()
    filters.cleanup()
    view_again()
    return found


def told(*texts: str) -> list[str]:
    """What a view says of frames that have these warnings, one each."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for text in texts:
            _program["view"]._warn(SimpleNamespace(warnings=(text,)))
    return [str(warning.message) for warning in caught]


def _refusal(**arguments: Any) -> str:
    try:
        FireflyView(_program["base"], **arguments)
    except SceneError as error:
        return str(error)
    return "it is not refused"


def refused() -> str:
    """What a second view of the same camera says."""
    return _refusal()


def refused_without_region() -> str:
    """What a view of a camera that no window shows says."""
    from panda3d import core

    return _refusal(camera=core.NodePath(core.Camera("spare")))


def two_halves() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The picture of a window in halves, each with a view, and the two views' pictures."""
    base = _program["base"]
    first = base.cam.node().get_display_region(0)
    first.set_dimensions(0, 0.5, 0, 1)
    camera = base.make_camera(base.win, displayRegion=(0.5, 1, 0, 1))
    camera.set_pos(10, -30, 6)
    with FireflyView(base, camera) as other:
        step(2)
        found = window(), _program["view"].frame.color, other.frame.color
    base.win.remove_display_region(camera.node().get_display_region(0))
    camera.remove_node()
    first.set_dimensions(0, 1, 0, 1)
    return found


def closed() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Panda3D's pictures before a view and after it, and the view's."""
    _program["view"].close()
    found = []
    for _ in range(2):
        step(2)
        found.append(window())
        view_again()
        step()
        picture = _program["view"].frame.color
        _program["view"].close()
    view_again()
    return found[0], found[1], picture


def failed(where: str) -> tuple[str, bool, np.ndarray, np.ndarray]:
    """What is raised by an error; is the view open; the next picture, and Panda3D's own."""
    base, view = _program["base"], _program["view"]

    def fail(*_: Any) -> None:
        raise RuntimeError("no picture today")

    if where == "thread":
        view._renderer.render = fail
    else:
        view._mirror.update = fail
    said = "nothing"
    try:
        step()
    except RuntimeError as error:
        said = str(error)
    step(2)
    own = window()
    view_again()
    _program["view"].close()
    step(2)
    is_open, expected = view.is_open, window()
    view_again()
    assert base.win.is_valid()
    return said, is_open, own, expected


def ended(how: str) -> tuple[bool, list[str]]:
    """End a view; is it open, and the names of the threads that are left."""
    base, view = _program["base"], _program["view"]
    step()
    if how == "destroy":
        view.destroy()
    elif how == "remove the task":
        base.task_mgr.remove("FireflyView")
    elif how == "close the window":
        base.open_main_window()  # which closes the old one
        step()
    else:
        base.destroy()
        _program.clear()
    threads = [thread.name for thread in threading.enumerate()]
    if _program:
        view_again()
    return view.is_open, threads
