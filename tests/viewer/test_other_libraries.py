"""Renderers beside windows of Panda3D, pyglet and glfw, beside pyrender, and in a window of their own."""

import subprocess
import sys

from tests.cli.command import environment
from tests.viewer.hosts import HOSTS


def test_other_libraries_and_a_renderer_change_nothing_of_each_other(display):
    """Whoever comes first, each draws what it draws alone, and finds context and state as it left them."""
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
        out, error = process.communicate(timeout=300)
        assert process.returncode == 0, f"{order} first: {error}"
        printed[order] = [line.split() for line in out.splitlines() if line.startswith(tuple(HOSTS))]
    assert printed["theirs"] == printed["ours"]
    assert [name for name, _ in printed["ours"][::2]] == list(HOSTS)
    assert len({picture for _, picture in printed["ours"][1::2]}) == 1


WINDOW = """
import glfw, pytest, warnings
from firefly_sample.errors import GpuError, NoGpuError
from firefly_sample.gpu.device import Device
from firefly_sample.renderer import Renderer
from firefly_sample.viewer.glfw_window import Window
from tests.viewer.hosts import current, lit_wall

warnings.simplefilter("ignore", UserWarning)
scene = lit_wall()
with pytest.raises(NoGpuError, match="needs a window's OpenGL context, but none is current"):
    Renderer((64, 48), window=True)
alone = Renderer((64, 48))
with pytest.raises(NoGpuError, match="needs a window's GLX context, but one of EGL"), alone._device:
    Renderer((64, 48), window=True)
picture = alone.render(scene).color.tobytes()
with Window("window", (64, 48)) as window:
    held = current()
    assert held["glXGetCurrentContext"] and not held["eglGetCurrentContext"]
    shown = Renderer((64, 48), window=True)
    for _ in range(2):  # in the window's context, and in another one
        assert shown.render(scene).color.tobytes() == picture
        assert alone.render(scene).color.tobytes() == picture
        assert current() == held
    with alone._device:
        assert current()["eglGetCurrentContext"]
        assert shown.render(scene).color.tobytes() == picture
        assert current()["eglGetCurrentContext"]
    assert current() == held
    dropped = Renderer((32, 24), window=True)
    with pytest.warns(ResourceWarning, match="32x24.*window's context"):
        del dropped
    assert current() == held
    assert shown.render(scene).color.tobytes() == picture
for work in (lambda: shown.render(scene), lambda: shown.draw(shown.plan(scene), read=False)):
    with pytest.raises(GpuError, match="gone with its window"):
        work()
shown.close()
glfw.init()
handle = glfw.create_window(64, 48, "another", None, None)
glfw.make_context_current(handle)
shown = Renderer((64, 48), window=True)
glfw.destroy_window(handle)  # the connection to the X server stays
with pytest.raises(GpuError, match="the window is closed"):
    shown.render(scene)
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
        timeout=120,
    )
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr
