"""``firefly run`` as a user meets it: a real window, real keys, a real mouse, and what is on the screen."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from firefly_sample.viewer.window_views import PICTURE, draw_view, views_of
from tests.cli.command import environment
from tests.conftest import make_renderer
from tests.viewer.driver import BARE, LAMPS, SIZE
from tests.viewer.workshop import workshop

WORKSHOP = "tests.viewer.workshop:workshop"
LINE = (
    r"performance test: (\d+) frames? in ([\d.]+) s, ([\d.]+) frames/s at 480x360, "
    r"(\d+) lights in view of (\d+) \(.+\)"
)


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
    for _ in range(views_of("correct").index("id")):
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
    """Each view is what is drawn without a window."""
    window = open_window("--lamps", "10", scene=WORKSHOP)
    window.pause()
    scene = workshop.build(shadows=True, lamps=10)
    with make_renderer(SIZE) as renderer:
        for view in (*views_of("correct")[1:], PICTURE):
            window.key("v")
            name = "workshop" if view == PICTURE else f"workshop, {view}"
            window.wait_until(view, lambda name=name: window.title() == f"{name} - firefly")
            expected = draw_view(renderer, scene, 0.0, view, read=True).picture()
            window.wait_until(f"{view} as it must be", lambda picture=expected: shows(window, picture))


def shows(window, picture):
    """Whether the window shows a picture where no text covers it; other drivers may differ a little."""
    uncovered = slice(0, 295), BARE[1]
    difference = np.abs(window.grab()[uncovered].astype(int) - picture[uncovered])
    return (difference > 2).any(axis=-1).mean() < 0.005


def test_the_shadow_maps_are_saved_as_they_are_shown(open_window, tmp_path):
    window = open_window("--lamps", "0", scene=WORKSHOP)
    window.pause()
    for _ in range(views_of("correct").index("shadow_atlas")):
        window.key("v")
    window.wait_until("the view", lambda: window.title() == "workshop, shadow_atlas - firefly")
    with make_renderer(SIZE) as renderer:
        expected = draw_view(renderer, workshop.build(shadows=True, lamps=0), 0.0, "shadow_atlas").picture()
    window.wait_until("the maps", lambda: shows(window, expected))
    shown = window.picture()
    window.key("s")
    path = tmp_path / "workshop_0001.png"
    window.wait_until("a screenshot", lambda: complete(path, SIZE))
    saved = np.asarray(Image.open(path))
    np.testing.assert_array_equal(saved[BARE], shown)
    assert len(np.unique(saved)) > 100
    window.key("k")  # no shadows: another scene, nothing to see
    window.wait_until("a black picture", lambda: not window.picture().any())
    window.key("s")
    path = tmp_path / "workshop_0002.png"
    window.wait_until("another screenshot", lambda: complete(path, SIZE))
    assert not np.asarray(Image.open(path)).any()


def numbers(line):
    """Frames, seconds, rate, and lights in view and in the scene, from the line of a performance test."""
    match = re.fullmatch(LINE, line)
    assert match, line
    return [float(number) for number in match.groups()]


def test_t_turns_the_camera_until_t_is_pressed_again(open_window):
    window = open_window()
    before = window.pause()
    window.key("t")
    first = window.wait_until("a turn", lambda: different(window, before))
    window.wait_until("it to go on", lambda: different(window, first) is not None)
    window.key("t")
    window.wait_until("the result", lambda: window.printed)
    stopped = window.settled()
    assert not np.array_equal(stopped, before)
    (line,) = window.printed
    frames, seconds, rate, in_view, in_scene = numbers(line)
    assert frames > 0
    assert rate == pytest.approx(frames / seconds, rel=0.1 / seconds + 0.1 / rate)
    assert 0 < in_view <= in_scene == 10
    window.key("r")
    np.testing.assert_array_equal(window.changed_from(stopped), before)


def different(window, before):
    now = window.picture()
    return None if np.array_equal(now, before) else now


def test_escape_ends_a_performance_test_and_then_the_window(open_window):
    window = open_window()
    before = window.pause()
    window.key("t")
    window.wait_until("a turn", lambda: different(window, before))
    window.key("Escape")
    window.wait_until("the result", lambda: window.printed)
    assert window.process.poll() is None
    window.key("Escape")
    assert window.finish() == (0, "")
    assert len(window.printed) == 1
    assert numbers(window.printed[0])[0] > 0


def test_a_performance_test_from_the_start_prints_and_closes(open_window):
    window = open_window("--performance-test", "2", stays=False)
    assert window.finish() == (0, "")
    (line,) = window.printed
    frames, seconds, *_ = numbers(line)
    assert frames > 0
    assert seconds >= 2.0


def test_a_performance_test_as_json(open_window):
    window = open_window("--performance-test", "0.5", "--json", "--lamps", "5", stays=False)
    assert window.finish() == (0, "")
    result = json.loads("".join(window.printed))
    assert (result["scene"], result["size"], result["parameters"]["lamps"]) == ("lamps", list(SIZE), 5)
    assert result["seconds"] >= 0.5


def test_ctrl_c_prints_the_result_so_far(open_window):
    window = open_window("--performance-test", "600")
    before = window.picture()
    for _ in range(3):  # the first frames are not counted
        window.wait_until("a turn", lambda before=before: different(window, before))
        before = window.picture()
    window.process.send_signal(signal.SIGINT)
    assert window.finish() == (130, "firefly: interrupted\n")
    (line,) = window.printed
    frames, seconds, *_ = numbers(line)
    assert frames > 0
    assert seconds < 600


def test_sigterm_closes_the_window(open_window):
    window = open_window()
    window.process.terminate()
    assert window.finish() == (143, "firefly: terminated\n")


def test_a_window_that_closes_during_a_performance_test_prints_the_result_so_far(display, tmp_path):
    code = f"""
from firefly_sample.viewer.main_loop import run
run({LAMPS!r}, parameters={{}}, size={SIZE}, performance_test=600, max_frames=8)
"""
    done = python(code, display, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    frames, *_ = numbers(done.stdout.splitlines()[-1])
    assert frames == 6  # the first one compiles, and that the last one is finished, nobody has looked


def test_the_window_follows_its_size_and_saves_what_it_shows(open_window, tmp_path):
    window = open_window()
    window.pause()
    window.key("s")
    first = tmp_path / "lamps_0001.png"
    window.wait_until("a screenshot", lambda: complete(first, SIZE))
    saved = first.read_bytes()
    np.testing.assert_array_equal(np.asarray(Image.open(first))[BARE], window.picture())
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


def test_what_another_window_has_covered_in_a_pause_is_drawn_again(open_window):
    window = open_window("--lamps", "0", scene=WORKSHOP)
    bare = window.message()
    before = window.pause()
    # a message that ends would draw it again, too
    window.wait_until("no message", lambda: np.array_equal(window.message(), bare))
    covering = open_window("--lamps", "3", stays=False)
    window.wait_until("another window on it", lambda: different(window, before))
    covering.process.terminate()
    covering.finish()
    window.wait_until("the first picture", lambda: np.array_equal(window.picture(), before))


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
from firefly_sample.viewer.main_loop import run
for size in ((1, 1), (64, 48), (2, 300)):
    run({LAMPS!r}, parameters={{"lamps": 0}}, size=size, max_frames=3)
"""
    done = python(code, display, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_lens_that_fixes_a_shape_is_warned_of_once_and_drawn_in_any_window(display, tmp_path):
    code = """
import json
import warnings
from pathlib import Path
from firefly_sample.renderer import Renderer
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.viewer.glfw_window import Window
from firefly_sample.viewer.shown_scene import Clock, ShownScene
from firefly_sample.viewer.viewer import Viewer
from tests.viewer.workshop import Workshop

class Pair(Workshop):
    def build(self, **values):
        scene = super().build(**values)
        scene.camera.node().lens = PerspectiveLens(fov=(60, 40), near=0.5, far=60)
        return scene

sizes = (400, 300), (300, 400), (635, 400)
with Window("pair", sizes[0]), Renderer(sizes[0], window=True) as renderer:
    shown = ShownScene(Pair(), {"shadows": False, "lamps": 2})
    viewer = Viewer(shown, renderer, Clock(0.0, 0.0), Path(), print)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for size in sizes:
            viewer.draw(size, 1.0, 0.0)
            viewer.drag("middle", 0.1, 0.1)
    print(json.dumps([str(warning.message) for warning in caught]))
"""
    done = python(code, display, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    (warning,) = json.loads(done.stdout)
    assert re.match(
        "the camera's field of view of 60 x 40 degrees fixes .* and the window has another", warning
    )


def test_nothing_stays_behind_on_the_gpu(display, tmp_path):
    """The views make and drop objects from frame to frame; their number stays, and is 0 in the end."""
    code = """
import gc
from pathlib import Path
from firefly_sample.gpu.device import Device
from firefly_sample.renderer import Renderer
from firefly_sample.settings import Settings
from firefly_sample.viewer.glfw_window import Window
from firefly_sample.viewer.shown_scene import Clock, ShownScene
from firefly_sample.viewer.viewer import Viewer
from firefly_sample.viewer.window_views import views_of
from tests.viewer.workshop import workshop

size = (100, 75)
with Window("leak", size) as window:
    device = Device(window=True)

    def live():
        with device:
            device.unbind()
            return device.raw.count_objects(1024)  # the lowest names come first

    Device(window=True)  # moderngl keeps a framebuffer for each
    before = live()
    with Renderer(size, Settings(supersample=2), window=True) as renderer:
        gc.freeze()  # what is imported stays
        shown = ShownScene(workshop, {"shadows": True, "lamps": 5})
        viewer = Viewer(shown, renderer, Clock(0.0, 0.0), Path(), print)
        counts, period = [], 2 * len(views_of("correct"))
        for now in range(3 * period):
            # over a period, each view with and without shadows, and the camera where it was at first
            keys = ["r"] if now % period == 0 else ["t"] if now % 7 == 1 else []
            keys += ["k"] if now % (period // 2) else []
            for key in (*keys, "f1", "s"):
                viewer.key(key, False)
            viewer.draw((100 + now % 2, 75), 1.0, float(now))
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
        timeout=600,
        check=False,
    )
