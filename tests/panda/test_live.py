"""A Panda3D program drawn live: the example of docs/panda3d.md, driven in a process of its own."""

from __future__ import annotations

import numpy as np
import pytest

from tests.panda import live
from tests.panda.live import EXAMPLE, SIZE, start_live


@pytest.fixture(scope="module")
def call(tmp_path_factory):
    """``call(function, *arguments)`` in the process where the example runs."""
    messages = tmp_path_factory.mktemp("live") / "messages.txt"
    with start_live(messages) as run:
        run(live.start_example)
        yield run
    assert "(error)" not in (said := messages.read_text()), said  # also of OpenGL


def test_the_example_is_short():
    assert len(EXAMPLE.read_text().splitlines()) < 40


def test_the_page_has_the_example():
    assert f"```py\n{EXAMPLE.read_text()}```\n" in (EXAMPLE.parents[1] / "panda3d.md").read_text()


def test_the_window_has_panda3ds_layer_over_our_picture(call):
    call(live.step)
    black, white = call(live.layer, True)
    for one, other in zip((black, white), call(live.layer, False), strict=True):
        assert np.array_equal(one, other)
    bare = ((black == 0) & (white == 255)).all(axis=2)
    opaque = (black == white).all(axis=2)
    assert 0.0005 < opaque.mean() < 0.1
    assert bare.mean() > 0.9
    shown = call(live.pictures)
    assert shown.view.shape == (SIZE[1], SIZE[0], 3)
    assert np.array_equal(shown.window[bare], shown.view[bare])
    assert np.array_equal(shown.window[opaque], black[opaque])
    assert np.array_equal(shown.view, shown.alone)
    assert len(np.unique(shown.view.reshape(-1, 3), axis=0)) > 500


def test_a_change_shows_in_the_next_frame(call):
    found = call(live.changes)
    before = None
    for what, after in found.items():
        assert np.array_equal(after.view, after.alone), what
        assert before is None or not np.array_equal(after.view, before), what
        before = after.view


def test_a_click_into_the_window_presses_panda3ds_button(call):
    assert call(live.press, SIZE[0] // 2, round(0.94 * SIZE[1])) == 1.0
