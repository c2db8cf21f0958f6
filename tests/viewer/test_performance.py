"""The performance test by a clock of our own: the camera's turn, the count of frames, and the results."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firefly_sample.errors import FireflyError, SettingsError
from firefly_sample.frame import Frame, LightCounts
from firefly_sample.settings import Settings
from firefly_sample.viewer import main_loop
from firefly_sample.viewer.main_loop import run_headless
from firefly_sample.viewer.orbit import OrbitCamera
from firefly_sample.viewer.performance import (
    LONGEST,
    SECONDS,
    TURN_SECONDS,
    PerformanceResult,
    PerformanceTest,
    check_seconds,
)
from tests.cli.command import GLADE
from tests.scenes import ball_scene, plain_camera


def frame_of(in_view=7, **milliseconds):
    lights = LightCounts(10, in_view, 0)
    return Frame({}, 0.0, (64, 48), milliseconds, lights, "driver", True, camera=plain_camera())


def result_of(test):
    return test.result("lamps", {"lamps": 10}, Settings(), frame_of())


@pytest.fixture
def camera():
    return OrbitCamera(ball_scene())


def test_it_turns_once_in_half_a_minute_and_ends_where_it_began(camera):
    test, start = PerformanceTest(), camera.path.get_net_mat()
    assert TURN_SECONDS == SECONDS == 30.0
    for now in np.arange(100.0, 115.1, 0.5):
        test.advance(now, frame_of(), camera)
        if now == 100.0:
            np.testing.assert_array_equal(camera.path.get_net_mat(), start)
    half = camera.path.get_net_mat()
    np.testing.assert_allclose(half[3, :2] + start[3, :2], 2 * camera.pivot[:2], atol=1e-9)
    assert half[3, 2] == pytest.approx(start[3, 2], abs=1e-12)
    for now, done in ((121.0, False), (129.9, False), (130.0, True)):
        test.advance(now, frame_of(), camera)
        assert test.done == done
    np.testing.assert_allclose(camera.path.get_net_mat(), start, rtol=0, atol=1e-9)


def test_the_turn_continues_from_where_the_mouse_has_put_the_camera():
    def mouse(camera):
        camera.turn(0.1, 0.05)
        camera.zoom(2)

    turned, moved = OrbitCamera(ball_scene()), OrbitCamera(ball_scene())
    for camera in (turned, moved):
        test = PerformanceTest()
        for now in (0.0, 2.0, 5.0):
            test.advance(now, frame_of(), camera)
            if camera is moved and now == 2.0:
                mouse(camera)
    mouse(turned)
    np.testing.assert_allclose(moved.path.get_net_mat(), turned.path.get_net_mat(), atol=1e-12)


def test_frames_are_counted_between_the_ends_of_the_first_and_the_last(camera):
    test = PerformanceTest(2.0)
    assert (test.began, test.elapsed) == (False, 0.0)
    test.advance(50.0, frame_of(10, geometry=900.0, compiling=900.0), camera)
    assert test.began
    for now, in_view, milliseconds in ((50.5, 4, 1.0), (51.0, 6, 2.0), (51.5, 8, 9.0), (52.25, 9, 3.0)):
        assert not test.done
        test.advance(now, frame_of(in_view, geometry=milliseconds), camera)
    assert test.done
    result = result_of(test)
    assert (result.frames, result.seconds, result.frames_per_second) == (4, 2.25, 4 / 2.25)
    assert (result.lights.in_scene, result.lights.in_view) == (10, 7)
    assert result.milliseconds == {"geometry": 2.5}
    assert test.progress == "2 of 2 s"


def test_a_pass_that_is_not_in_every_frame_has_the_median_of_those_that_have_it(camera):
    test = PerformanceTest()
    for now in range(4):
        more = {"spotlights": 8.0} if now == 2 else {}
        test.advance(now, frame_of(geometry=1.0, **more), camera)
    assert result_of(test).milliseconds == {"geometry": 1.0, "spotlights": 8.0}


@pytest.mark.parametrize("calls", [0, 1])
def test_a_test_that_ends_at_once_has_no_frames_and_says_so(camera, calls):
    test = PerformanceTest()
    for _ in range(calls):
        test.advance(9.0, frame_of(), camera)
    result = result_of(test)
    assert (result.frames, result.seconds, result.frames_per_second) == (0, 0.0, 0.0)
    assert result.line() == (
        "performance test: 0 frames in 0.0 s, 0.0 frames/s at 64x48, 7 lights in view of 10 (driver)"
    )


def test_the_result_as_a_line_and_as_json():
    result = PerformanceResult(
        scene="forest",
        parameters={"fireflies": 400},
        settings=Settings(supersample=2),
        size=(800, 600),
        driver="llvmpipe (LLVM 15)",
        software=True,
        frames=412,
        seconds=30.04,
        lights=LightCounts(400, 391, 0),
        milliseconds={"geometry": 12.5},
    )
    assert result.line() == (
        "performance test: 412 frames in 30.0 s, 13.7 frames/s at 800x600, "
        "391 lights in view of 400 (llvmpipe (LLVM 15))"
    )
    assert result.as_dict() == {
        "scene": "forest",
        "parameters": {"fireflies": 400},
        "size": [800, 600],
        "driver": "llvmpipe (LLVM 15)",
        "software": True,
        "frames": 412,
        "seconds": 30.04,
        "frames_per_second": 412 / 30.04,
        "lights": {"in_scene": 400, "in_view": 391, "dropped": 0},
        "milliseconds": {"geometry": 12.5},
        "settings": Settings(supersample=2).as_dict(),
    }


@pytest.mark.parametrize("seconds", [1e-9, 0.5, 30, LONGEST])
def test_seconds_that_it_can_last(seconds):
    assert check_seconds(seconds) == seconds


@pytest.mark.parametrize("seconds", [0.0, -1.0, math.nan, math.inf, -math.inf, 3600.1])
def test_seconds_that_it_cannot_last(seconds):
    with pytest.raises(SettingsError, match="finite number of seconds above 0, at most 3600, got"):
        PerformanceTest(seconds)


class Ticks:
    """A clock that advances by a quarter of a second at each call."""

    def __init__(self, stop_at=math.inf):
        self.now, self.stop_at = 0.0, stop_at

    def __call__(self):
        self.now += 0.25
        if self.now >= self.stop_at:
            raise KeyboardInterrupt
        return self.now


@pytest.fixture
def run_on_glade(monkeypatch):
    """``run_on_glade(results, seconds, **options)`` runs headless by `Ticks`, which a test may replace."""

    def run(results, seconds=3.0, clock=None, parameters=None, **options):
        monkeypatch.setattr(main_loop, "perf_counter", clock or Ticks())
        parameters = {"fireflies": 5} if parameters is None else parameters
        run_headless(GLADE, seconds, parameters=parameters, report=results.append, size=(16, 12), **options)

    return run


def test_headless_draws_until_the_time_is_over(run_on_glade):
    results, told, settings = [], [], Settings(supersample=2)
    run_on_glade(results, settings=settings, progress=lambda *counts: told.append(counts))
    (result,) = results
    assert (result.frames, result.seconds) == (6, 3.0)  # two calls of the clock for each
    assert told == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert (result.scene, result.size, result.settings) == ("glade", (16, 12), settings)
    assert result.parameters == {"fireflies": 5, "seed": 7, "reach": 2.5, "glass": False, "dusk": True}
    assert result.lights.in_scene == 5
    assert 0 < result.lights.in_view <= 5
    assert result.milliseconds.keys() == {"geometry", "ambient", "point_lights", "resolve"}
    assert all(value > 0 for value in result.milliseconds.values())


def test_headless_turns_the_camera_while_time_passes(run_on_glade, monkeypatch):
    drawn = []

    class Watched(main_loop.Renderer):
        def draw(self, plan, read=True):
            drawn.append((plan.time, plan.view.view_to_world.copy(), plan.outputs, read))
            return super().draw(plan, read)

    monkeypatch.setattr(main_loop, "Renderer", Watched)
    run_on_glade([], seconds=15.0, time=4.0)
    times, eyes = [time for time, *_ in drawn], [matrix[3, :3] for _, matrix, *_ in drawn]
    assert times[0] == 4.0
    np.testing.assert_allclose(np.diff(times[1:]), 0.5, atol=1e-12)
    pivot = OrbitCamera(ball_scene(lights=0)).pivot
    # 31 frames: the first one and the next are seen from the scene's camera, and half a second is 6 degrees
    np.testing.assert_allclose(eyes[0], eyes[1], atol=1e-12)
    arms = np.array(eyes[1:])[:, :2] - pivot[:2]
    turned = np.unwrap(np.arctan2(arms[:, 1], arms[:, 0]))
    np.testing.assert_allclose(np.abs(np.diff(turned)), np.radians(6.0), atol=1e-9)
    assert {(outputs, read) for *_, outputs, read in drawn} == {(("color",), False)}


def test_ctrl_c_reports_what_was_measured_so_far(run_on_glade):
    results = []
    with pytest.raises(KeyboardInterrupt):
        run_on_glade(results, 30.0, Ticks(stop_at=2.2), {})
    (result,) = results
    assert (result.frames, result.seconds) == (3, 1.5)


def test_headless_passes_a_plan_s_warning_on_once(run_on_glade, recwarn):
    run_on_glade([], parameters={"glass": True}, settings=Settings(look="classic"))
    assert len([warning for warning in recwarn if "glass" in str(warning.message)]) == 1


def test_nothing_is_drawn_for_a_wrong_duration_or_scene():
    for name, seconds in ((GLADE, 0.0), ("swamp", 1.0)):
        with pytest.raises(FireflyError):
            run_headless(name, seconds, parameters={}, report=lambda _: pytest.fail("a result"))
