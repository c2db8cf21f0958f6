"""Renderers beside windows of Panda3D, pyglet and glfw, beside pyrender, and in a window of their own."""

import subprocess
import sys

from tests.cli.command import environment
from tests.viewer.hosts import HOSTS


def test_other_libraries_and_a_renderer_change_nothing_of_each_other(display):
    """Whoever comes first, each draws what it draws alone, and finds context and state as it left them.

    pyrender comes last; its end shuts down the EGL display that both use.
    """
    running = {
        order: subprocess.Popen(
            [sys.executable, "-m", "tests.viewer.hosts", order],
            env=environment(DISPLAY=display),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for order in ("theirs", "ours")
    }
    printed = {}
    for order, process in running.items():
        out, error = process.communicate(timeout=600)
        assert process.returncode == 0, f"{order} first: {error}"
        printed[order] = [line.split() for line in out.splitlines() if line.startswith((*HOSTS, "again"))]
    *ours_first, again = printed["ours"]
    assert ours_first == printed["theirs"]
    assert [name for name, _ in ours_first[::2]] == list(HOSTS)
    assert {picture for _, picture in ours_first[1::2]} == {again[1]}


WINDOW = """
import glfw, warnings
from firefly_sample.errors import GpuError
from firefly_sample.renderer import Renderer
from firefly_sample.viewer.glfw_window import Window
from tests.gl_objects import device_of
from tests.viewer.hosts import current, lit_wall

warnings.simplefilter("ignore", UserWarning)
scene = lit_wall()

def refused(words, work):
    try:
        work()
    except GpuError as error:
        assert words in str(error), error
        return True

def in_window(size=(64, 48)):
    return Renderer(size, window=True)

assert refused("needs a window's OpenGL context, but none is current", in_window)
alone = Renderer((64, 48))
with device_of(alone):
    assert refused("needs a window's GLX context, but one of EGL", in_window)
picture = alone.render(scene).color.tobytes()
with Window("window", (64, 48)) as window:
    held = current()
    assert held["glXGetCurrentContext"] and not held["eglGetCurrentContext"]
    shown = in_window()
    for _ in range(2):  # in the window's context, and in another one
        assert shown.render(scene).color.tobytes() == picture
        assert alone.render(scene).color.tobytes() == picture
        assert current() == held
    with device_of(alone):
        assert current()["eglGetCurrentContext"]
        assert shown.render(scene).color.tobytes() == picture
        assert current()["eglGetCurrentContext"]
    assert current() == held
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        in_window((32, 24))
    assert "32x24" in str(said[-1].message) and "window's context" in str(said[-1].message), said
    assert current() == held
    assert shown.render(scene).color.tobytes() == picture
assert refused("gone with its window", lambda: shown.render(scene))
assert refused("gone with its window", lambda: shown.present(shown.plan(scene)))
shown.close()
glfw.init()
handle = glfw.create_window(64, 48, "another", None, None)
glfw.make_context_current(handle)
shown = in_window()
glfw.destroy_window(handle)  # the connection to the X server stays
assert refused("the window is closed", lambda: shown.render(scene))
shown.close()
assert alone.render(scene).color.tobytes() == picture
alone.close()
print("done")
"""


def test_a_window_and_a_renderer_without_one_take_turns_and_the_windows_end_is_an_error(display):
    """Asking Xlib about a connection that is closed would crash."""
    done = subprocess.run(
        [sys.executable, "-c", WINDOW],
        env=environment(DISPLAY=display),
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr
