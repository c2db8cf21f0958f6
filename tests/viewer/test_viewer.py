"""The keys of a `Viewer` without a window: the performance test, pauses, messages, and the corner's text."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.viewer.performance import PerformanceResult
from firefly_sample.viewer.shown_scene import Clock, ShownScene
from firefly_sample.viewer.viewer import MESSAGE_SECONDS, RESULT_SECONDS, Viewer
from tests.conftest import make_renderer
from tests.viewer.workshop import workshop

SIZE = (64, 48)


class Watching:
    """A `Viewer` on a renderer that has no window: what it presents is kept."""

    def __init__(self, renderer, monkeypatch):
        self.results: list[PerformanceResult] = []
        self.layers = ()
        monkeypatch.setattr(renderer, "present", self._present)
        shown = ShownScene(workshop, {parameter.name: parameter.default for parameter in workshop.parameters})
        self.viewer = Viewer(shown, renderer, Clock(0.0, 0.0), Path(), self.results.append)
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
    np.testing.assert_allclose(watching.draw(), first, rtol=0, atol=1e-12)  # it begins at the present view
    assert np.abs(watching.draw() - first).max() > 0.1
    watching.draw(count=3)
    assert watching.results == []
    assert watching.viewer.testing
    watching.press("t")
    (result,) = watching.results
    # five frames were drawn since; the last one is counted only at the next draw
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


def test_escape_stops_the_test_and_then_closes(watching):
    watching.draw()
    for key in ("t", "f1", "escape"):  # the help is on top and closes first
        watching.press(key)
        watching.draw()
    assert watching.viewer.testing
    watching.press("escape")
    assert (len(watching.results), watching.viewer.testing, watching.viewer.closed) == (1, False, False)
    watching.press("escape")
    assert (len(watching.results), watching.viewer.closed) == (1, True)


def test_r_begins_the_turn_again_from_the_scene_s_camera(watching):
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
    assert watching.due()  # the result disappears
    watching.draw()
    assert not watching.due()


def test_in_a_pause_a_frame_is_due_after_an_event_and_when_a_message_ends(watching):
    assert watching.due()
    watching.draw()
    assert watching.due()  # time passes
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
    watching.press("k")  # its message names the change, from now on
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


def test_time_continues_from_the_pause_however_long_nothing_was_drawn(watching):
    watching.draw(0.0)
    watching.press("p")
    watching.draw(0.0)
    watching.now += 50.0
    assert not watching.due()
    watching.press("p")
    watching.draw()
    assert watching.plan.time == 0.0


def test_a_test_from_the_start_closes_at_its_end(watching):
    watching.viewer.start_test(2.0, then_close=True)
    watching.draw(count=5)
    assert not watching.viewer.closed
    watching.draw()
    assert watching.viewer.closed
    (result,) = watching.results
    assert (result.frames, result.seconds) == (4, 2.0)  # without the first of all, which compiles


@pytest.mark.parametrize("end", ["t", "escape"])
def test_a_test_from_the_start_closes_when_it_is_stopped(watching, end):
    watching.viewer.start_test(20.0, then_close=True)
    watching.draw(count=5)
    watching.press(end)
    assert watching.viewer.closed
    assert [result.frames for result in watching.results] == [3]


def test_a_hidden_window_ends_a_test_that_has_begun(watching):
    watching.viewer.start_test(20.0, then_close=True)
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


def test_the_corner_states_the_test_s_progress(watching):
    watching.draw()
    watching.press("t")
    watching.draw(count=5)
    assert ("test", "2 of 30 s") in watching.viewer.status
    watching.press("t")
    watching.draw()
    assert "test" not in dict(watching.viewer.status)


def test_every_key_has_its_line_in_the_help(watching):
    assert all(binding.help for binding in watching.viewer.bindings.values())
    assert re.search(r"performance test.* 30 s", watching.viewer.bindings["t"].help)
