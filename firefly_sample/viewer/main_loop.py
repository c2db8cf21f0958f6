"""The loops of ``firefly run``: a scene in a window, and a performance test without window and display."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from firefly_sample.frame import check_size
from firefly_sample.plan.exposure import with_exposure_at
from firefly_sample.renderer import Renderer
from firefly_sample.scene.other_camera import SceneWithCamera
from firefly_sample.scene.parameter import resolve_parameters
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.scenes.plugin import scene_settings
from firefly_sample.settings import Settings
from firefly_sample.viewer.orbit import OrbitCamera
from firefly_sample.viewer.performance import PerformanceResult, PerformanceTest, check_seconds
from firefly_sample.viewer.shown_scene import Clock, ShownScene
from firefly_sample.viewer.viewer import Viewer

if TYPE_CHECKING:
    from firefly_sample.viewer.glfw_window import Window

IDLE_SECONDS = 0.1
"""How long to wait for an event while nothing moves."""


def run(
    scene_name: str,
    *,
    parameters: dict[str, Any],
    size: tuple[int, int] = (800, 600),
    settings: Settings | None = None,
    time: float = 0.0,
    require_gpu: bool = False,
    max_frames: int | None = None,
    performance_test: float | None = None,
    report: Callable[[PerformanceResult], None] = lambda result: print(result.line(), flush=True),
) -> None:
    """Show a scene in a window until the user closes it.

    A performance test measures how fast frames can be drawn: it does not wait for the screen.

    Parameters
    ----------
    scene_name, parameters, size, settings, time, require_gpu
        As ``firefly run`` takes them; `time` is the scene time at first, in seconds. An exposure of "auto"
        is measured then, and stays.
    max_frames : int, optional
        Close after this number of frames: for tests, and to measure a known amount of work.
    performance_test : float, optional
        Run a performance test of this number of seconds at once, and close.
    report : callable
        Is given the result of each performance test, however it ends; prints its line if absent.

    Raises
    ------
    FireflyError
        If there is no display or no glfw, or the scene, a parameter, the size, the seconds or the driver is
        wrong.
    """
    from firefly_sample.viewer.glfw_window import Window, check_display

    if performance_test is not None:
        check_seconds(performance_test)
    plugin = find_scene(scene_name)
    values = resolve_parameters(plugin.name, plugin.parameters, parameters)
    check_size(size)
    check_display()
    shown = ShownScene(plugin, values)
    settings = with_exposure_at(shown.scene, settings or Settings(**scene_settings(plugin)), time)
    with (
        Window(f"{plugin.name} - firefly", size) as window,
        Renderer(size, settings, require_gpu=require_gpu, window=True) as renderer,
    ):
        viewer = Viewer(shown, renderer, Clock(time, perf_counter()), Path(), report)
        if performance_test is not None:
            viewer.start_test(performance_test, then_close=True)
        window.listen(viewer)
        try:
            _draw_until_closed(window, viewer, max_frames)
        finally:
            viewer.end_test()


def _draw_until_closed(window: Window, viewer: Viewer, max_frames: int | None) -> None:
    """Draw frames until the user closes the window; while nothing changes, the last one stays on it."""
    frames = 0
    shown: tuple[tuple[int, int], float] | None = None
    while not (window.closed or viewer.closed) and frames != max_frames:
        now, hidden = perf_counter(), window.hidden
        due, wanted = viewer.due(now), (window.framebuffer_size, window.scale)
        if hidden:
            viewer.hide()
            shown = None
        elif due or window.uncovered or wanted != shown:
            window.wait_for_screen(not viewer.testing)
            viewer.draw(*wanted, now)
            window.set_title(viewer.title)
            window.swap()
            frames += 1
            shown = wanted
        window.wait(0.0 if due and not hidden else IDLE_SECONDS)


def run_headless(
    scene_name: str,
    seconds: float,
    *,
    parameters: dict[str, Any],
    report: Callable[[PerformanceResult], None],
    size: tuple[int, int] = (800, 600),
    settings: Settings | None = None,
    time: float = 0.0,
    require_gpu: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Draw a scene for some seconds while the camera turns, and report how fast that was; see `run`.

    Frames are drawn as in the window, each at its time on the clock, but neither shown nor read back.

    Parameters
    ----------
    report : callable
        Is given the result at the end, also if Ctrl-C or an error ends the test early.
    progress : callable, optional
        Is called with (whole seconds done, total), at first with (0, total), whenever that changes.
    """
    test, plugin = PerformanceTest(seconds), find_scene(scene_name)
    values = resolve_parameters(plugin.name, plugin.parameters, parameters)
    warned: set[str] = set()
    done, total = 0, math.ceil(seconds)
    scene = build_scene(plugin, **values)
    settings = with_exposure_at(scene, settings or Settings(**scene_settings(plugin)), time)
    with Renderer(size, settings, require_gpu=require_gpu) as renderer:
        frame = renderer.draw(renderer.plan(scene, time), read=False)
        clock, camera = Clock(time, perf_counter()), OrbitCamera(scene)
        turning = SceneWithCamera(scene, camera.path)
        try:
            progress(0, total)
            test.advance(perf_counter(), frame, camera)
            while not test.done:
                frame = renderer.draw(renderer.plan(turning, clock.time(perf_counter())), read=False)
                test.advance(perf_counter(), frame, camera)
                for text in frame.warnings:
                    if text not in warned:
                        warned.add(text)
                        warnings.warn(text, stacklevel=2)
                if min(int(test.elapsed), total) > done:
                    done = min(int(test.elapsed), total)
                    progress(done, total)
        finally:
            report(test.result(plugin.name, values, settings, frame))
