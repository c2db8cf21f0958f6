"""Processes that are forked while a window's context is current, and those that open their own window."""

import subprocess
import sys

from tests.cli.command import environment

START = """
import ctypes, hashlib, os, traceback, warnings
from firefly_sample import Renderer
from firefly_sample.errors import NoGpuError
from firefly_sample.viewer.glfw_window import Window
from firefly_sample.gpu.current import current_context
from tests.viewer.hosts import lit_wall

warnings.simplefilter("ignore", UserWarning)

def forked(work):
    child = os.fork()
    if not child:
        try:
            work()
        except BaseException:
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
"""

SHARED = """
xlib = ctypes.CDLL("libX11.so.6")
xlib.XNextRequest.restype, xlib.XNextRequest.argtypes = ctypes.c_ulong, [ctypes.c_void_p]

def drawn():
    # without a word to the X server, which would take it for the parent's
    sent = xlib.XNextRequest(held.display)
    with Renderer((64, 48)) as renderer:
        found = renderer.render(lit_wall()).color.tobytes()
    try:
        Renderer((64, 48), window=True)
    except NoGpuError as error:
        assert "none is current" in str(error), error  # GLVND forgets in a fork what was current
    else:
        raise AssertionError("drawn in the parent's window")
    assert xlib.XNextRequest(held.display) == sent
    os.write(writable, hashlib.sha256(found).digest())

with Window("shared", (64, 48)) as window:
    held = current_context()
    readable, writable = os.pipe()
    assert forked(drawn) == 0
    with Renderer((64, 48)) as renderer:  # in the parent all is as before
        own = renderer.render(lit_wall()).color.tobytes()
    assert os.read(readable, 64) == hashlib.sha256(own).digest()
    assert current_context() == held
    window.swap()
"""

OWN = """
def drawn():
    with Window("own", (64, 48)):
        for window in (False, True):
            with Renderer((64, 48), window=window) as renderer:
                assert renderer.render(lit_wall()).color.any()

assert forked(drawn) == 0
"""


def run(code, display):
    command = [sys.executable, "-c", START + code]
    done = subprocess.run(
        command, env=environment(DISPLAY=display), capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr
    assert not done.stderr


def test_a_window_s_connection_is_left_to_the_parent(display):
    run(SHARED, display)


def test_a_forked_process_draws_beside_a_window_of_its_own(display):
    run(OWN, display)
