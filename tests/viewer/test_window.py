"""``firefly run`` as a user meets it: a real window, real keys, a real mouse, and what is on the screen."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from tests.cli.command import environment
from tests.viewer.driver import LAMPS, SIZE

VIEWS = ("strip", "albedo", "normal", "depth", "position", "id")


def test_keys_change_what_is_in_the_scene(open_window):
    window = open_window()
    before = window.pause()
    steps = {"Up": ("lamps", 11), "Down": ("lamps", 10), "Right": ("reach", 3.0 * 1.111)}
    assert window.said == [{"build": {"lamps": 10, "reach": 3.0, "dusk": True}}]
    for count, (key, (name, value)) in enumerate(steps.items(), 2):
        window.key(key)
        window.wait_until(f"key {key}", lambda count=count: len(window.said) == count)
        assert window.said[-1] == {"set": name, "value": pytest.approx(value)}
        if key == "Up":
            window.changed_from(before)
        elif key == "Down":  # as many as at first, at the same time: the same picture
            window.wait_until("the first picture", lambda: np.array_equal(window.picture(), before))
    brighter = window.changed_from(before)
    assert brighter.astype(int).sum() > before.astype(int).sum()


def test_a_parameter_that_is_not_live_keeps_the_camera(open_window):
    window = open_window()
    window.pause()
    for _ in range(len(VIEWS)):
        window.key("v")
    window.wait_until("the ids", lambda: window.title() == "lamps, id - firefly")
    before = window.settled()
    window.drag(1, (300, 200), (340, 190), (380, 180))
    turned = window.changed_from(before)
    window.key("d")
    window.wait_until(
        "a new scene", lambda: window.said[-1] == {"build": {"lamps": 10, "reach": 3.0, "dusk": False}}
    )
    np.testing.assert_array_equal(window.settled(), turned)
    window.key("r")
    np.testing.assert_array_equal(window.changed_from(turned), before)


def test_v_goes_through_the_buffers_and_back(open_window):
    window = open_window()
    seen = {"": window.pause()}
    whole = window.grab()
    for view in VIEWS:
        window.key("v")
        window.wait_until(view, lambda view=view: window.title() == f"lamps, {view} - firefly")
        seen[view] = window.settled()
        if view == "strip":  # the picture stays; below it, five buffers
            np.testing.assert_array_equal(seen["strip"], seen[""])
            assert (window.grab()[-60:] != whole[-60:]).mean() > 0.5
    window.key("v")
    window.wait_until("the picture", lambda: window.title() == "lamps - firefly")
    np.testing.assert_array_equal(window.changed_from(seen["id"]), seen[""])
    names = [name for name in seen if name != "strip"]
    for i, one in enumerate(names):
        for other in names[:i]:
            assert (seen[one] != seen[other]).any(axis=-1).mean() > 0.2
    assert (np.ptp(seen["depth"], axis=-1) == 0).all()
    assert len(np.unique(seen["id"].reshape(-1, 3), axis=0)) <= 5  # three balls, a floor, nothing


def test_the_window_follows_its_size_and_saves_what_it_shows(open_window, tmp_path):
    window = open_window()
    window.pause()
    window.key("s")
    first = tmp_path / "lamps_0001.png"
    window.wait_until("a screenshot", lambda: complete(first, SIZE))
    saved = first.read_bytes()
    np.testing.assert_array_equal(np.asarray(Image.open(first))[:240, 240:], window.picture())
    window.xdotool("windowsize", window.window(), "720", "300")
    second = tmp_path / "lamps_0002.png"
    window.wait_until("the larger window", lambda: window.grab((720, 300))[:, 600:].any())
    window.key("s")
    window.wait_until("another screenshot", lambda: complete(second, (720, 300)))
    assert first.read_bytes() == saved
    wide = np.asarray(Image.open(second))
    np.testing.assert_array_equal(wide[:200, 400:], window.grab((720, 300))[:200, 400:])


def complete(path, size):
    try:
        with Image.open(path) as image:
            image.load()
            return image.size == size
    except OSError:
        return False


def test_the_mouse_moves_the_camera_and_r_brings_it_back(open_window):
    window = open_window()
    first = window.pause()
    for move in (
        lambda: window.drag(1, (300, 200), (330, 210), (360, 220)),
        lambda: window.drag(3, (300, 200), (320, 200), (340, 220)),
        lambda: window.drag(2, (300, 200), (280, 200), (260, 180)),
        lambda: window.xdotool("click", "4"),
        lambda: window.xdotool("click", "5"),
    ):
        move()
        moved = window.changed_from(first)
        assert (moved != first).any(axis=-1).mean() > 0.02
        window.key("r")
        np.testing.assert_array_equal(window.changed_from(moved), first)


def test_time_goes_on_unless_it_is_paused(open_window):
    window = open_window()
    before = window.picture()
    window.wait_until("the lamps to move", lambda: not np.array_equal(window.picture(), before))
    still = window.pause()
    window.key("p")
    window.wait_until("the lamps to move on", lambda: not np.array_equal(window.picture(), still))


def test_escape_closes_the_help_and_then_the_window(open_window):
    window = open_window()
    before = window.pause()
    window.key("F1")
    help_shown = window.changed_from(before)
    assert (help_shown != before).any(axis=-1).mean() > 0.3
    window.key("Escape")
    np.testing.assert_array_equal(window.changed_from(help_shown), before)
    window.key("Escape")
    assert window.finish() == (0, "")


def test_it_ends_after_so_many_frames_at_any_size(display, tmp_path):
    code = f"""
from firefly_sample.viewer.window import run
for size in ((1, 1), (64, 48), (2, 300)):
    run({LAMPS!r}, parameters={{"lamps": 0}}, size=size, max_frames=3)
"""
    done = python(code, display, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_nothing_stays_behind_on_the_gpu(display, tmp_path):
    """The views make and drop objects from frame to frame; their number stays, and is 0 in the end."""
    code = """
import gc
from pathlib import Path
from firefly_sample.gpu.device import Device
from firefly_sample.renderer import Renderer
from firefly_sample.settings import Settings
from firefly_sample.viewer.clock import Clock
from firefly_sample.viewer.glfw_window import Window
from firefly_sample.viewer.stage import Stage
from firefly_sample.viewer.viewer import Viewer
from firefly_sample.viewer.views import VIEWS
from tests.viewer.lamps import lamps

size = (320, 240)
with Window("leak", size) as window:
    device = Device(window=True)

    def live():
        with device:
            device.unbind()
            return device.raw.count_objects()

    Device(window=True)  # moderngl keeps a framebuffer for each
    before = live()
    with Renderer(size, Settings(supersample=2), window=True) as renderer:
        stage = Stage(lamps, {"lamps": 5, "reach": 3.0, "dusk": True})
        viewer = Viewer(stage, renderer, Clock(0.0, 0.0), Path())
        counts, period = [], 2 * len(VIEWS)
        for now in range(3 * period):
            for key in ("f1", "up", "d", "s"):
                viewer.key(key, False)
            viewer.scroll(1)
            viewer.draw((320 + now % 2, 240), 1.0, float(now))
            window.swap()
            gc.collect()  # scenes are full of cycles
            counts.append(live())
            viewer.key("v", False)
        assert counts[-period:] == counts[-2 * period:-period], counts
        assert counts[-1]["Texture"] > 2, counts
    assert live() == before, (live(), before)
"""
    done = python(code, display, tmp_path)
    assert done.returncode == 0, done.stderr


def python(code, display, folder):
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=folder,
        env=environment(DISPLAY=display),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
