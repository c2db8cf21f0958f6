"""The performance test by a clock of our own: what turns, what counts, how it ends, and what it says."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.errors import FireflyError, SettingsError
from firefly_sample.frame import Frame, LightCounts
from firefly_sample.settings import Settings
from firefly_sample.viewer import headless
from firefly_sample.viewer.clock import Clock
from firefly_sample.viewer.headless import run_headless
from firefly_sample.viewer.orbit import OrbitCamera
from firefly_sample.viewer.performance import (
    LONGEST,
    SECONDS,
    TURN_SECONDS,
    PerformanceResult,
    PerformanceTest,
    check_seconds,
)
from firefly_sample.viewer.stage import Stage
from firefly_sample.viewer.viewer import MESSAGE_SECONDS, RESULT_SECONDS, Viewer
from tests.cli.command import GLADE
from tests.conftest import make_renderer
from tests.scenes import ball_scene
from tests.viewer.workshop import workshop

SIZE = (64, 48)


def frame_of(in_view=7, size=SIZE, **milliseconds):
    return Frame({}, 0.0, size, milliseconds, LightCounts(10, in_view, 0), "driver", True)


def eye_of(camera):
    return camera.path.get_net_mat()[3, :3]


def result_of(test, frame=None):
    return test.result("lamps", {"lamps": 10}, Settings(), frame or frame_of())


def test_it_turns_once_in_half_a_minute_and_ends_where_it_began():
    test, camera = PerformanceTest(), OrbitCamera(ball_scene())
    start, pivot = camera.path.get_net_mat(), camera.pivot
    assert TURN_SECONDS == SECONDS == 30.0
    for now in np.arange(100.0, 115.1, 0.5):
        test.advance(now, frame_of(), camera)
        if now == 100.0:
            np.testing.assert_array_equal(camera.path.get_net_mat(), start)
    half = eye_of(camera)
    np.testing.assert_allclose(half[:2] + start[3, :2], 2 * pivot[:2], atol=1e-9)
    assert half[2] == pytest.approx(start[3, 2], abs=1e-12)
    for now in (121.0, 129.9):
        test.advance(now, frame_of(), camera)
        assert not test.done
    test.advance(130.0, frame_of(), camera)
    assert test.done
    np.testing.assert_allclose(camera.path.get_net_mat(), start, rtol=0, atol=1e-9)


def test_the_turn_goes_on_from_where_the_mouse_has_put_the_camera():
    turned, moved = OrbitCamera(ball_scene()), OrbitCamera(ball_scene())
    tests = PerformanceTest(), PerformanceTest()
    for now in (0.0, 2.0, 5.0):
        for test, camera in zip(tests, (turned, moved), strict=True):
            test.advance(now, frame_of(), camera)
        if now == 2.0:
            moved.turn(0.1, 0.05)
            moved.zoom(2)
    turned.turn(0.1, 0.05)
    turned.zoom(2)
    np.testing.assert_allclose(moved.path.get_net_mat(), turned.path.get_net_mat(), atol=1e-12)


def test_frames_are_counted_between_the_ends_of_the_first_and_the_last():
    test, camera = PerformanceTest(2.0), OrbitCamera(ball_scene())
    assert (test.began, test.elapsed) == (False, 0.0)
    test.advance(50.0, frame_of(10, geometry=900.0, compiling=900.0), camera)
    assert test.began
    for now, in_view, milliseconds in ((50.5, 4, 1.0), (51.0, 6, 2.0), (51.5, 8, 9.0), (52.25, 9, 3.0)):
        assert not test.done
        test.advance(now, frame_of(in_view, geometry=milliseconds), camera)
    assert test.done
    result = result_of(test)
    assert (result.frames, result.seconds, result.frames_per_second) == (4, 2.25, 4 / 2.25)
    assert (result.lights_in_scene, result.lights_in_view) == (10, 7)
    assert result.milliseconds == {"geometry": 2.5}
    assert test.text == "2 of 2 s"


def test_a_pass_that_is_not_in_every_frame_has_the_median_of_those_that_have_it():
    test, camera = PerformanceTest(), OrbitCamera(ball_scene())
    for now in range(4):
        more = {"spotlights": 8.0} if now == 2 else {}
        test.advance(now, frame_of(geometry=1.0, **more), camera)
    assert result_of(test).milliseconds == {"geometry": 1.0, "spotlights": 8.0}


@pytest.mark.parametrize("calls", [0, 1])
def test_a_test_that_ends_at_once_has_no_frames_and_says_so(calls):
    test = PerformanceTest()
    for _ in range(calls):
        test.advance(9.0, frame_of(), OrbitCamera(ball_scene()))
    result = result_of(test)
    assert (result.frames, result.seconds, result.frames_per_second) == (0, 0.0, 0.0)
    assert result.line() == (
        "performance test: 0 frames in 0.0 s, 0.0 frames/s at 64x48, 7 lights in view of 10 (driver)"
    )


RESULT = PerformanceResult(
    scene="forest",
    parameters={"fireflies": 400},
    settings=Settings(supersample=2),
    size=(800, 600),
    driver="llvmpipe (LLVM 15)",
    software=True,
    frames=412,
    seconds=30.04,
    lights_in_scene=400,
    lights_in_view=391,
    milliseconds={"geometry": 12.5},
)


def test_the_line():
    assert RESULT.line() == (
        "performance test: 412 frames in 30.0 s, 13.7 frames/s at 800x600, "
        "391 lights in view of 400 (llvmpipe (LLVM 15))"
    )


def test_the_result_for_programs():
    assert RESULT.as_dict() == {
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
    """A clock that goes on by a quarter of a second whenever somebody looks."""

    def __init__(self, stop_at=math.inf):
        self.now, self.stop_at = 0.0, stop_at

    def __call__(self):
        self.now += 0.25
        if self.now >= self.stop_at:
            raise KeyboardInterrupt
        return self.now


def run_on_glade(monkeypatch, clock, seconds=3.0, **options):
    monkeypatch.setattr(headless, "perf_counter", clock)
    results: list[PerformanceResult] = []
    try:
        run_headless(
            GLADE, seconds, parameters={"fireflies": 5}, report=results.append, size=(16, 12), **options
        )
    finally:
        assert len(results) == 1
    return results[0]


def test_headless_draws_until_the_time_is_over(monkeypatch):
    told = []
    settings = Settings(supersample=2)
    result = run_on_glade(
        monkeypatch, Ticks(), settings=settings, progress=lambda *counts: told.append(counts)
    )
    assert (result.frames, result.seconds) == (6, 3.0)  # two looks at the clock for each
    assert told == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert (result.scene, result.size, result.settings) == ("glade", (16, 12), settings)
    assert result.parameters == {"fireflies": 5, "seed": 7, "reach": 2.5, "glass": False, "dusk": True}
    assert result.lights_in_scene == 5
    assert 0 < result.lights_in_view <= 5
    assert result.milliseconds.keys() == {"geometry", "ambient", "point_lights", "resolve"}
    assert all(value > 0 for value in result.milliseconds.values())


def test_headless_turns_the_camera_and_lets_time_go_on(monkeypatch):
    drawn = []

    class Watched(headless.Renderer):
        def draw(self, plan, read=True):
            drawn.append((plan.time, plan.view.view_to_world.copy(), plan.outputs, read))
            return super().draw(plan, read)

    monkeypatch.setattr(headless, "Renderer", Watched)
    run_on_glade(monkeypatch, Ticks(), seconds=15.0, time=4.0)
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


def test_ctrl_c_reports_what_was_measured_so_far(monkeypatch):
    results = []
    monkeypatch.setattr(headless, "perf_counter", Ticks(stop_at=2.2))
    with pytest.raises(KeyboardInterrupt):
        run_headless(GLADE, 30.0, parameters={}, report=results.append, size=(8, 6))
    (result,) = results
    assert (result.frames, result.seconds) == (3, 1.5)


def test_headless_warns_once_of_what_a_plan_has_to_say(monkeypatch, recwarn):
    monkeypatch.setattr(headless, "perf_counter", Ticks())
    run_headless(GLADE, 3.0, parameters={"glass": True}, report=lambda _: None, size=(8, 6))
    assert len([warning for warning in recwarn if "glass" in str(warning.message)]) == 1


def test_nothing_is_drawn_for_a_wrong_duration_or_scene():
    for name, seconds in ((GLADE, 0.0), ("swamp", 1.0)):
        with pytest.raises(FireflyError):
            run_headless(name, seconds, parameters={}, report=lambda _: pytest.fail("a result"))


class Watching:
    """A `Viewer` on a renderer that has no window: what it presents is kept."""

    def __init__(self, renderer, monkeypatch, scene=workshop):
        self.results: list[PerformanceResult] = []
        self.layers = ()
        monkeypatch.setattr(renderer, "present", self._present)
        values = {parameter.name: parameter.default for parameter in scene.parameters}
        clock = Clock(0.0, 0.0)
        self.viewer = Viewer(Stage(scene, values), renderer, clock, Path(), self.results.append)
        self.now = 0.0

    def _present(self, plan, layers=()):
        self.plan, self.layers = plan, tuple(layers)

    def draw(self, seconds=0.5, count=1, size=SIZE):
        for _ in range(count):
            self.viewer.draw(size, 1.0, self.now)
            self.now += seconds
        return self.plan.view.view_to_world

    def press(self, key):
        self.viewer.key(key, False)

    def due(self):
        return self.viewer.due(self.now)


@pytest.fixture
def watching(monkeypatch):
    with make_renderer(SIZE) as renderer:
        yield Watching(renderer, monkeypatch)


def test_t_starts_and_stops(watching):
    first = watching.draw(count=3)
    watching.press("t")
    np.testing.assert_allclose(watching.draw(), first, rtol=0, atol=1e-12)  # it begins where the view is
    assert np.abs(watching.draw() - first).max() > 0.1
    watching.draw(count=3)
    assert watching.results == []
    assert watching.viewer.testing
    watching.press("t")
    (result,) = watching.results
    # five frames were drawn since; that the last one is finished, nobody has looked yet
    assert (result.frames, result.seconds) == (4, 2.0)
    assert (result.scene, result.size) == ("workshop", SIZE)
    stopped = watching.draw()
    np.testing.assert_array_equal(watching.draw(count=3), stopped)
    watching.press("r")
    np.testing.assert_allclose(watching.draw(), first, rtol=0, atol=1e-12)


def test_it_ends_by_itself(watching):
    watching.draw()
    watching.press("t")
    first = watching.draw()
    for _ in range(59):
        watching.draw()
        assert watching.viewer.testing
    last = watching.draw()
    assert not watching.viewer.testing
    assert not watching.viewer.closed
    (result,) = watching.results
    assert (result.frames, result.seconds) == (60, 30.0)
    np.testing.assert_allclose(last, first, rtol=0, atol=1e-9)


def test_escape_stops_the_test_and_then_leaves(watching):
    watching.draw()
    for key in ("t", "f1", "escape"):  # the help lies on top, it goes first
        watching.press(key)
        watching.draw()
    assert watching.viewer.testing
    watching.press("escape")
    assert (len(watching.results), watching.viewer.testing, watching.viewer.closed) == (1, False, False)
    watching.press("escape")
    assert (len(watching.results), watching.viewer.closed) == (1, True)


def test_r_begins_the_turn_anew_from_the_scene_s_camera(watching):
    first = watching.draw()
    watching.press("t")
    watching.draw(count=9)
    watching.press("r")
    turned = watching.draw()
    assert watching.viewer.testing
    away = np.array(turned[3, :3]) - first[3, :3]
    assert 0 < np.linalg.norm(away) < np.linalg.norm(watching.draw()[3, :3] - first[3, :3])


def test_a_pause_stops_time_but_not_the_test(watching):
    watching.draw()
    watching.press("p")
    watching.draw()
    assert not watching.due()
    watching.press("t")
    assert watching.due()
    before, time = watching.draw(), watching.plan.time
    assert np.abs(watching.draw() - before).max() > 0.1
    assert watching.plan.time == time
    watching.press("t")
    watching.draw()
    watching.now += RESULT_SECONDS
    assert watching.due()  # the result goes
    watching.draw()
    assert not watching.due()


def test_in_a_pause_a_frame_is_due_when_something_happens_and_when_a_message_ends(watching):
    assert watching.due()
    watching.draw()
    assert watching.due()  # time goes on
    watching.press("p")
    for happens in (
        lambda: None,
        lambda: watching.press("v"),
        lambda: watching.viewer.drag("left", 0.1, 0.0),
        lambda: watching.viewer.drag("right", 0.1, 0.0),
        lambda: watching.viewer.scroll(1.0),
    ):
        happens()
        assert watching.due()
        watching.draw()
        assert not watching.due()
    watching.now += 100.0
    assert not watching.due()
    watching.press("k")  # says what it has changed, from now on
    watching.draw(0.0)
    watching.now += 0.9 * MESSAGE_SECONDS
    assert not watching.due()
    shown = len(watching.layers)
    watching.now += 0.2 * MESSAGE_SECONDS
    assert watching.due()
    assert watching.due()  # as long as it is not drawn
    watching.draw()
    assert len(watching.layers) == shown - 1
    assert not watching.due()


def test_time_goes_on_from_where_it_was_however_long_nothing_was_drawn(watching):
    watching.draw(0.0)
    watching.press("p")
    watching.draw(0.0)
    watching.now += 50.0
    assert not watching.due()
    watching.press("p")
    watching.draw()
    assert watching.plan.time == 0.0


def test_a_test_from_the_start_leaves_at_its_end(watching):
    watching.viewer.start_test(2.0, then_leave=True)
    watching.draw(count=5)
    assert not watching.viewer.closed
    watching.draw()
    assert watching.viewer.closed
    (result,) = watching.results
    assert (result.frames, result.seconds) == (4, 2.0)  # the first of all, which compiles, is not among them


@pytest.mark.parametrize("end", ["t", "escape"])
def test_a_test_from_the_start_leaves_when_it_is_stopped(watching, end):
    watching.viewer.start_test(20.0, then_leave=True)
    watching.draw(count=5)
    watching.press(end)
    assert watching.viewer.closed
    assert [result.frames for result in watching.results] == [3]


def test_a_window_that_cannot_be_seen_ends_a_test_that_has_begun(watching):
    watching.viewer.start_test(20.0, then_leave=True)
    watching.viewer.hide()
    assert watching.viewer.testing
    watching.draw(count=3)
    watching.viewer.hide()
    assert not watching.viewer.testing
    assert len(watching.results) == 1


def test_the_result_is_the_window_s_message_and_wraps_into_it(watching):
    watching.draw()
    before = len(watching.layers)
    watching.press("t")
    watching.draw(size=(320, 240))
    assert len(watching.layers) == before
    watching.press("t")
    watching.draw(size=(320, 240))
    assert len(watching.layers) == before + 1
    plate = watching.layers[-1].pixels
    assert plate.shape[1] <= 300
    assert plate.shape[0] > 2 * 14 * 1.5
    watching.draw(seconds=20.0)
    watching.draw()
    assert len(watching.layers) == before


def test_the_corner_says_how_far_it_is(watching):
    watching.draw()
    watching.press("t")
    watching.draw(count=5)
    assert ("test", "2 of 30 s") in watching.viewer._rows
    watching.press("t")
    watching.draw()
    assert "test" not in dict(watching.viewer._rows)


def test_every_key_has_its_line_in_the_help(watching):
    rows = {binding.key: binding.help for binding in watching.viewer._own}
    assert re.search(r"performance test.* 30 s", rows["t"])
