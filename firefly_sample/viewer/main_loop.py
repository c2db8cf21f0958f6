"""``firefly run``: a scene in a window."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

from firefly_sample.frame import check_size
from firefly_sample.renderer import Renderer
from firefly_sample.scene.parameter import resolve_parameters
from firefly_sample.scenes import find_scene
from firefly_sample.settings import Settings
from firefly_sample.viewer.clock import Clock
from firefly_sample.viewer.glfw_window import Window, check_display
from firefly_sample.viewer.performance import PerformanceResult, check_seconds
from firefly_sample.viewer.shown_scene import Stage
from firefly_sample.viewer.viewer import Viewer

IDLE_SECONDS = 0.1
"""How long to wait for something to happen while nothing moves."""


def run(
    scene_name: str,
    *,
    parameters: dict[str, Any],
    size: tuple[int, int] = (800, 600),
    settings: Settings | None = None,
    time: float = 0.0,
    require_gpu: bool = False,
    max_frames: int | None = None,
    screenshot_dir: Path | str | None = None,
    performance_test: float | None = None,
    report: Callable[[PerformanceResult], None] | None = None,
) -> None:
    """Show a scene in a window until the user closes it.

    A performance test measures how fast frames can be drawn: it does not wait for the screen.

    Parameters
    ----------
    scene_name : str
        As `firefly_sample.scenes.find_scene` takes it.
    parameters : dict of str to object
        Values of the scene's parameters; the others have their defaults.
    size : (int, int)
        The window's width and height at first.
    settings : Settings, optional
    time : float
        Scene time at first, in seconds.
    require_gpu : bool
        Refuse a software driver.
    max_frames : int, optional
        Close after so many frames: for tests, and to measure a known amount of work.
    screenshot_dir : Path or str, optional
        Where the key S saves; the current folder when absent.
    performance_test : float, optional
        Run a performance test of so many seconds at once, and close.
    report : callable, optional
        Is given the result of each performance test, however it ends; its line is printed when absent.

    Raises
    ------
    ViewerError
        If there is no display, or glfw is not installed.
    FireflyError
        If the scene, a parameter, the size, the seconds or the driver is wrong.
    """
    if performance_test is not None:
        check_seconds(performance_test)
    settings = settings or Settings()
    plugin = find_scene(scene_name)
    values = resolve_parameters(plugin.name, plugin.parameters, parameters)
    check_size(size)
    check_display()
    stage = Stage(plugin, values)
    with (
        Window(f"{plugin.name} - firefly", size) as window,
        Renderer(size, settings, require_gpu=require_gpu, window=True) as renderer,
    ):
        clock, folder = Clock(time, perf_counter()), Path(screenshot_dir or ".")
        viewer = Viewer(stage, renderer, clock, folder, report or _print_line)
        if performance_test is not None:
            viewer.start_test(performance_test, then_leave=True)
        window.listen(viewer)
        try:
            _show(window, viewer, max_frames)
        finally:
            viewer.end_test()


def _show(window: Window, viewer: Viewer, max_frames: int | None) -> None:
    """Draw frames until somebody wants to leave; while nothing changes, the last one stays on the window."""
    frames = 0
    shown: tuple[tuple[int, int], float] | None = None
    while not (window.closed or viewer.closed) and frames != max_frames:
        now, hidden = perf_counter(), window.hidden
        due, seen = viewer.due(now), (window.framebuffer_size, window.scale)
        if hidden:
            viewer.hide()
            shown = None
        elif due or window.uncovered or seen != shown:
            window.wait_for_screen(not viewer.testing)
            viewer.draw(*seen, now)
            window.set_title(viewer.title)
            window.swap()
            frames += 1
            shown = seen
        window.wait(0.0 if due and not hidden else IDLE_SECONDS)


def _print_line(result: PerformanceResult) -> None:
    print(result.line(), flush=True)
