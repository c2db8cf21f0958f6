"""``firefly run --performance-test --headless``: the performance test without window and display."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from time import perf_counter
from typing import Any

from firefly_sample.renderer import Renderer
from firefly_sample.scene.parameter import resolve_parameters
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from firefly_sample.viewer.clock import Clock
from firefly_sample.viewer.orbit import OrbitCamera, SceneSeenBy
from firefly_sample.viewer.performance import PerformanceResult, PerformanceTest


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
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Draw a scene for some seconds while the camera turns, and report how fast that was.

    Frames are drawn as in the window, each at the time that it is, but neither shown nor read back. A frame
    counts when the GPU has finished it, see `firefly_sample.viewer.performance`.

    Parameters
    ----------
    scene_name : str
        As `firefly_sample.scenes.find_scene` takes it.
    seconds : float
        How long.
    parameters : dict of str to object
        Values of the scene's parameters; the others have their defaults.
    report : callable
        Is given the result at the end, also where Ctrl-C or an error ends it early.
    size : (int, int)
        Width and height in pixels.
    settings : Settings, optional
    time : float
        Scene time at first, in seconds.
    require_gpu : bool
        Refuse a software driver.
    progress : callable, optional
        Called with (whole seconds done, in all), first with (0, all), whenever that changes.

    Raises
    ------
    FireflyError
        If the seconds, the scene, a parameter, the size or the driver is wrong.
    """
    test, settings = PerformanceTest(seconds), settings or Settings()
    plugin = find_scene(scene_name)
    values = resolve_parameters(plugin.name, plugin.parameters, parameters)
    told: set[str] = set()
    done, total = 0, math.ceil(seconds)
    tell = progress or (lambda done, total: None)
    with Renderer(size, settings, require_gpu=require_gpu) as renderer:
        scene = build_scene(plugin, **values)
        frame = renderer.draw(renderer.plan(scene, time), read=False)
        clock, camera = Clock(time, perf_counter()), OrbitCamera(scene)
        seen = SceneSeenBy(scene, camera.path)
        try:
            tell(0, total)
            test.advance(perf_counter(), frame, camera)
            while not test.done:
                frame = renderer.draw(renderer.plan(seen, clock.time(perf_counter())), read=False)
                test.advance(perf_counter(), frame, camera)
                _warn(frame.warnings, told)
                if min(int(test.elapsed), total) > done:
                    done = min(int(test.elapsed), total)
                    tell(done, total)
        finally:
            report(test.result(plugin.name, values, settings, frame))


def _warn(texts: tuple[str, ...], told: set[str]) -> None:
    """Pass a plan's warnings on, each once."""
    for text in texts:
        if text not in told:
            told.add(text)
            warnings.warn(text, stacklevel=3)
