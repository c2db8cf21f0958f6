"""Which context is current while a renderer draws and afterwards; threads; renderers that nobody closes."""

import ctypes
import gc
import subprocess
import sys
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor

import moderngl
import numpy as np
import pytest

from firefly_sample.errors import GpuError, OutputError
from firefly_sample.gpu.device import Device
from tests.conftest import make_renderer
from tests.gl_objects import device_of
from tests.scenes import ball_scene, wall_scene


@pytest.fixture
def egl():
    library = ctypes.CDLL("libEGL.so.1")
    for name in ("eglGetCurrentContext", "eglGetCurrentDisplay"):
        getattr(library, name).restype = ctypes.c_void_p
    return library


@pytest.fixture
def other(device, egl):
    """Another program's context on the same display, current in this thread, with its own target bound."""
    with device:
        context = moderngl.create_standalone_context(backend="egl")
        context.simple_framebuffer((2, 2)).use()
        yield context
        context.__exit__(None, None, None)
        context.release()


def test_another_context_is_current_again_after_each_call(egl, other):
    held = egl.eglGetCurrentContext()
    assert held
    scene, now = wall_scene(), []
    renderer = make_renderer((16, 12))
    now.append(egl.eglGetCurrentContext())
    alone = renderer.render(scene).color
    now.append(egl.eglGetCurrentContext())
    for frame in renderer.render_many(scene, (0.0, 0.0, 0.0)):
        assert np.array_equal(frame.color, alone)
        now.append(egl.eglGetCurrentContext())
    with pytest.raises(OutputError):
        renderer.render(scene, 0.0, "nothing")
    with pytest.raises(GpuError, match="limit"):
        renderer.resize((10**6, 10))
    with device_of(renderer):
        assert egl.eglGetCurrentContext() != held
    with pytest.raises(ZeroDivisionError), device_of(renderer):
        raise ZeroDivisionError
    now.append(egl.eglGetCurrentContext())
    renderer.close()
    now.append(egl.eglGetCurrentContext())
    with pytest.raises(GpuError):
        make_renderer((8, 6), device=99)
    now.append(egl.eglGetCurrentContext())
    assert set(now) == {held}
    assert other.fbo.viewport == (0, 0, 2, 2)
    assert other.error == "GL_NO_ERROR"


def test_no_context_is_current_where_none_was(egl):
    assert not egl.eglGetCurrentContext()
    with make_renderer((8, 6)) as renderer:
        assert not egl.eglGetCurrentContext()
        renderer.render(wall_scene())
        assert not egl.eglGetCurrentContext()


def test_contexts_within_contexts_are_left_one_by_one(egl):
    first, second = Device(), Device()
    seen = []
    with first:
        seen.append(egl.eglGetCurrentContext())
        with first, second:
            seen.append(egl.eglGetCurrentContext())
            with first:
                seen.append(egl.eglGetCurrentContext())
            seen.append(egl.eglGetCurrentContext())
        seen.append(egl.eglGetCurrentContext())
    assert seen == [seen[0], seen[1], seen[0], seen[1], seen[0]]
    assert seen[0] != seen[1]
    assert not egl.eglGetCurrentContext()
    second.release()
    first.release()


def test_the_api_that_egl_binds_and_modernglos_default_context_stay(egl, other):
    """`eglCreateContext` makes what is bound; `moderngl.get_context()` is the last one made."""
    gles = 0x30A0
    default = moderngl.get_context()
    assert default is other
    assert egl.eglBindAPI(gles)
    with make_renderer((8, 6)) as renderer:
        renderer.render(wall_scene())
        assert egl.eglQueryAPI() == gles
    assert moderngl.get_context() is other
    assert egl.eglBindAPI(0x30A2)


def test_threads_that_share_a_renderer_wait_for_each_other(egl):
    """As those of a data loader do; each gets the picture of its own scene."""
    scenes = [ball_scene(count) for count in (1, 5, 20)]
    with make_renderer((64, 48)) as renderer, ThreadPoolExecutor(6) as pool:
        alone = [renderer.render(scene, 0.5).color for scene in scenes]

        def draw(i):
            if i % 2:
                return [renderer.render(scenes[i % 3], 0.5).color]
            return [frame.color for frame in renderer.render_many(scenes[i % 3], (0.5, 0.5))]

        drawn = list(pool.map(draw, range(36)))
        assert not any(pool.map(lambda _: egl.eglGetCurrentContext(), range(6)))
    for i, pictures in enumerate(drawn):
        assert all(np.array_equal(color, alone[i % 3]) for color in pictures), i


def test_threads_that_plan_draw_and_read_surfaces_get_their_own_or_an_error():
    """Between a thread's draw and its reading, another one may draw: then it is told so."""
    scenes, begun = [wall_scene(distance) for distance in (4.0, 8.0, 12.0)], threading.Barrier(3)
    with make_renderer((16, 12)) as renderer, ThreadPoolExecutor(3) as pool:
        refused = []

        def work(i):
            begun.wait(600)
            for _ in range(20):
                try:
                    plan = renderer.plan(scenes[i])
                    renderer.draw(plan, read=False)
                    distance = renderer.surface(plan).distance()
                except GpuError as error:
                    refused.append(str(error))
                    continue
                assert distance == pytest.approx(np.full((12, 16), (4.0, 8.0, 12.0)[i]), rel=1e-6)
            return i

        assert list(pool.map(work, range(3))) == [0, 1, 2]
    assert all("not the one that was drawn last" in said for said in refused)


def test_a_surface_reads_no_other_plan_s_pixels():
    with make_renderer((16, 12)) as renderer:
        plan, other = (renderer.plan(wall_scene(distance)) for distance in (4.0, 8.0))
        renderer.draw(plan)
        begun, surface, later = (renderer.surface(plan) for _ in range(3))
        assert begun.distance() == pytest.approx(np.full((12, 16), 4.0))
        renderer.draw(other)
        for read in (surface.distance, surface.albedo, surface.covered):
            with pytest.raises(GpuError, match="drawn last: draw it again"):
                read()
        assert begun.distance() == pytest.approx(np.full((12, 16), 4.0))  # it was read before
        renderer.draw(plan)
        assert surface.distance() == pytest.approx(np.full((12, 16), 4.0))
    with pytest.raises(GpuError, match="closed"):
        later.distance()


def test_a_renderer_that_another_thread_closes_says_that_it_is_closed():
    scene, closed = wall_scene(), threading.Barrier(5)
    for _ in range(3):
        renderer = make_renderer((16, 12))
        renderer.render(scene)

        def draw_until_closed(renderer=renderer):
            closed.wait(600)
            while True:
                renderer.render(scene)

        def close(renderer=renderer):
            closed.wait(600)
            renderer.close()

        with ThreadPoolExecutor(5) as pool:
            drawing = [pool.submit(draw_until_closed) for _ in range(3)]
            closing = [pool.submit(close) for _ in range(2)]
        assert [str(done.exception()) for done in drawing] == ["this renderer is closed: make a new one"] * 3
        assert [done.exception() for done in closing] == [None] * 2


def test_a_renderer_goes_from_thread_to_thread():
    scene = ball_scene(5)
    with ThreadPoolExecutor(1) as first, ThreadPoolExecutor(1) as second:
        renderer = first.submit(make_renderer, (64, 48)).result()
        pictures = [pool.submit(renderer.render, scene).result().color for pool in (first, second, first)]
        pictures.append(renderer.render(scene).color)
        second.submit(renderer.close).result()
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures)


def test_a_context_that_is_kept_in_another_thread_is_said_to_be(egl):
    device, entered, leave = Device(), threading.Event(), threading.Event()

    def keep():
        device.ctx.__enter__()
        entered.set()
        leave.wait(600)
        device.ctx.__exit__(None, None, None)

    thread = threading.Thread(target=keep)
    thread.start()
    assert entered.wait(600)
    with pytest.raises(GpuError, match="current in another thread") as caught, device:
        pass
    leave.set()
    thread.join()
    assert "pyrender" not in str(caught.value)
    with device:
        assert egl.eglGetCurrentContext()
    device.release()


def resident() -> float:
    """MiB of memory that this process has."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096 / 2**20


def test_a_dropped_renderer_is_freed_and_said_to_be_dropped():
    def drop():
        with pytest.warns(ResourceWarning, match=r"Renderer of 640x480 .* without close\(\).*with Renderer"):
            make_renderer((640, 480)).render(wall_scene(), 0.0, ("color", "depth"))  # no cycle keeps it

    drop()
    before = resident()
    for _ in range(6):
        drop()
    assert (resident() - before) / 6 < 2.0  # 7.5 MiB and more, when they are kept


def test_what_the_garbage_collector_drops_disturbs_no_drawing(egl, render):
    """It may run between any two calls, in any thread, with another context current."""
    scene = ball_scene(20)
    alone = render(scene).color
    with make_renderer() as renderer, warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", ResourceWarning)
        for kept in (make_renderer((16, 12)), make_renderer((16, 12))):
            kept.render(wall_scene())
            kept.itself = kept  # a cycle
        del kept
        with device_of(renderer) as device:
            held = egl.eglGetCurrentContext()
            gc.collect()
            assert egl.eglGetCurrentContext() == held
            assert device.ctx.error == "GL_NO_ERROR"
        assert np.array_equal(renderer.render(scene).color, alone)
        kept = make_renderer((16, 12))
        kept.itself = kept
        kept.render(wall_scene())
        del kept
        thread = threading.Thread(target=gc.collect)
        thread.start()
        thread.join()
        assert np.array_equal(renderer.render(scene).color, alone)
    assert len(said) == 3
    assert all("a Renderer of 16x12 was dropped" in str(warning.message) for warning in said)


def test_an_open_renderer_at_the_end_of_a_program_is_no_trouble():
    code = """
import warnings
from firefly_sample import Renderer, Scene
warnings.simplefilter("ignore", UserWarning)
renderer = Renderer((16, 12))
renderer.render(Scene())
cycle = [renderer]
cycle.append(cycle)
del renderer
frames = cycle[0].render_many(Scene(), (0.0, 1.0, 2.0))
next(frames)
"""
    done = subprocess.run(
        [sys.executable, "-X", "dev", "-W", "default::ResourceWarning", "-c", code],
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
