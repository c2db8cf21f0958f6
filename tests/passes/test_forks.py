"""Processes that are forked before and after the driver was used: they draw, or an error says why not."""

import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")

START = """
import gc, hashlib, os, select, signal, sys, time, warnings
import moderngl
from firefly_sample import Renderer, Scene
from firefly_sample.errors import GpuError, NoGpuError

warnings.simplefilter("ignore", UserWarning)
warnings.simplefilter("error", ResourceWarning)

def picture(renderer):
    return hashlib.sha256(renderer.render(Scene(), 0.0, ("color", "depth")).color.tobytes()).hexdigest()

def new():
    with Renderer((16, 12)) as renderer:
        return picture(renderer)

def others():
    context = moderngl.create_standalone_context(backend="egl")
    target = context.simple_framebuffer((4, 4))
    target.use()
    context.clear(1.0)
    return context, target.read()

def refused(work, *words):
    start = time.monotonic()
    try:
        work()
    except GpuError as error:
        assert time.monotonic() - start < 5.0, "slow"  # milliseconds; a busy machine has its time
        assert all(word in str(error) for word in words), error
        return "refused"
    return "drawn"

def forked(work):
    # what `work` returns in a forked process, or how that ended
    readable, writable = os.pipe()
    child = os.fork()
    if not child:
        print("", end="", flush=True)
        os.write(writable, str(work()).encode())
        os.close(writable)
        sys.exit(0)
    os.close(writable)
    answer = b""
    while select.select([readable], [], [], 600.0)[0] and (some := os.read(readable, 4096)):
        answer += some
    os.close(readable)
    if not select.select([os.pidfd_open(child)], [], [], 600.0)[0]:
        os.kill(child, signal.SIGKILL)
        answer += b" HANGS"
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return answer.decode() + (f" {status}" if status else "")
"""

THREADS = """
clean = forked(lambda: (others()[1][:3] == bytes([255, 0, 0]), new()))
kept = others()
after_another = forked(lambda: refused(new, "forked", "another library", "spawn", "forkserver"))
renderer = Renderer((16, 12))
drawn = picture(renderer)
assert clean == str((True, drawn)), (clean, drawn)
assert after_another == "refused", after_another

def use():
    global renderer
    from firefly_sample.commands.doctor import examine
    from firefly_sample.gpu.device import Device
    found = [refused(work, "forked", "spawn", "forkserver") for work in (
        new, Device, lambda: picture(renderer), lambda: renderer.plan(Scene()), lambda: next(
        renderer.render_many(Scene(), (0.0,))))]
    found.append(any("forked" in finding.found and not finding.ok for finding in examine()))
    renderer.close()
    renderer.close()
    return found

def drop():
    global renderer
    del renderer
    gc.collect()
    return "dropped"

expected = str(["refused"] * 5 + [True])
assert (answer := forked(use)) == expected, answer
assert (answer := forked(drop)) == "dropped", answer
assert picture(renderer) == drawn  # what children do is nothing to their parent
renderer.close()
assert (answer := forked(lambda: refused(new, "forked"))) == "refused", answer
assert (answer := forked(lambda: forked(lambda: refused(new, "forked")))) == "refused", answer
"""

NO_THREADS = """
renderer = Renderer((16, 12))
drawn = picture(renderer)
assert (answer := forked(new)) == drawn, answer
answer = forked(lambda: refused(lambda: picture(renderer), "before this process was forked"))
assert answer == "refused", answer
assert picture(renderer) == drawn
renderer.close()
"""


@pytest.mark.parametrize(
    ("work", "threads"), [(THREADS, "2"), (NO_THREADS, "0")], ids=["threads", "no threads"]
)
def test_a_forked_process_draws_or_says_why_not(device, work, threads):
    if "llvmpipe" not in device.renderer:
        pytest.skip("what works after a fork is known of llvmpipe alone")
    done = subprocess.run(
        [sys.executable, "-c", START + work],
        env={**os.environ, "LP_NUM_THREADS": threads},
        capture_output=True,
        text=True,
        timeout=1800,
    )
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


LATE = """
import ctypes, threading, time
from firefly_sample.gpu.driver_checks import check_threads, was_forked
import os, sys

def name_itself():
    time.sleep(0.3)
    assert ctypes.CDLL(None).prctl(15, b"llvmpipe-0") == 0  # PR_SET_NAME
    time.sleep(5)

if (child := os.fork()) == 0:
    assert was_forked()
    threading.Thread(target=name_itself, daemon=True).start()
    check_threads("llvmpipe")
    os._exit(7)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="names threads as Linux does")
def test_threads_of_a_busy_machine_get_their_names_late():
    done = subprocess.run(
        [sys.executable, "-c", LATE],
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "LP_NUM_THREADS": "2"},
    )
    assert (done.returncode, done.stderr) == (7, "")


NAMED = """
import ctypes, sys, threading
from firefly_sample import Renderer, Scene
from firefly_sample.gpu.driver_checks import was_forked

libc, named, done = ctypes.CDLL(None, use_errno=True), threading.Event(), threading.Event()

def name_itself():
    assert libc.prctl(15, b"Gr\\xc3") == 0  # PR_SET_NAME
    named.set()
    done.wait(600)

thread = threading.Thread(target=name_itself)
thread.start()
named.wait(600)
assert libc.prctl(15, b"\\xff) 7") == 0  # the process, with what ends a name in /proc/self/stat
try:
    assert not was_forked()
    with Renderer((16, 12)) as renderer:
        renderer.render(Scene())
finally:
    done.set()
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="names threads as Linux does")
def test_threads_and_processes_have_names_of_any_bytes(device):
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", NAMED], capture_output=True, text=True, timeout=600
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
