"""How a live view ends, and how it follows its window: with the program, with an error, by hand."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from tests.cli.command import environment
from tests.panda import live
from tests.panda.live import start_live
from tests.panda.oracle import start_display


@pytest.fixture(scope="module")
def call(tmp_path_factory):
    """``call(function, *arguments)`` in a process with a ShowBase that has a view."""
    messages = tmp_path_factory.mktemp("live") / "messages.txt"
    with start_live(messages) as run:
        run(live.start_plain)
        yield run
    told = [line for line in messages.read_text().splitlines() if "(error)" in line]  # also of OpenGL
    assert told == 2 * [":task(error): Exception occurred in PythonTask FireflyView"]


def test_the_picture_has_the_windows_size(call):
    assert call(live.resized, 200, 90) == ((200, 90), (90, 200, 3))


def test_what_is_not_drawn_is_named_once_when_it_comes(call):
    said = call(live.warned)
    assert [len(lines) for lines in said] == [1, 0, 1]
    for lines, name in zip(said[::2], ("first", "second"), strict=True):
        assert repr(name) in lines[0]


def test_a_warning_whose_numbers_and_names_change_is_told_once(call):
    first = "some triangles have no order (pairs: 1,034; circles: 2): exact needs none"
    second = "geoms 'a' reach 1.5 too far"
    again = first.replace("1,034", "33"), "geoms 'a b', 'c', and 12 more reach 3 too far"
    assert call(live.told, first, second, *again) == [first, second]


def test_each_camera_has_one_view(call):
    assert "the camera 'cam' has a view already" in call(live.refused)
    assert "has no active display region" in call(live.refused_without_region)


def test_two_views_show_two_halves_of_a_window(call):
    whole, left, right = call(live.two_halves)
    assert whole.shape[1] == left.shape[1] + right.shape[1]
    assert np.array_equal(whole, np.hstack([left, right]))
    assert not np.array_equal(left, right)


def test_without_the_view_panda3d_draws_as_before(call):
    before, after, again = call(live.closed)
    assert np.array_equal(before, after)
    assert not np.array_equal(before, again)


@pytest.mark.parametrize("where", ["thread", "graph"])
def test_an_error_ends_the_view_and_is_raised_once(call, where):
    said, is_open, own, picture = call(live.failed, where)
    assert said == "no picture today"
    assert not is_open
    assert np.array_equal(own, picture)


def test_a_view_whose_region_gets_another_camera_says_that_it_ends(call):
    is_open, said = call(live.another_camera)
    assert not is_open
    assert len(said) == 1
    assert "has ended: the region of the camera 'cam' shows the camera 'filter' now" in said[0]


def test_filters_that_are_made_before_the_view_filter_its_picture(call):
    shown, picture = call(live.inverted)
    assert np.array_equal(shown, 255 - picture)


@pytest.mark.parametrize("how", ["destroy", "remove the task", "close the window", "destroy the base"])
def test_a_view_ends_with(call, how):
    """And so does its thread."""
    is_open, threads = call(live.ended, how)
    assert not is_open
    assert "FireflyView" not in threads


PROGRAM = """
from panda3d import core
core.load_prc_file_data("", "win-size 64 48\\naudio-library-name null\\nnotify-level-device fatal")
from direct.showbase.ShowBase import ShowBase
from firefly_sample.interop.panda3d import FireflyView
base = ShowBase()
view = FireflyView(base)
base.task_mgr.do_method_later(0.1, lambda task: base.userExit(), "end")
base.run()
"""


def test_a_program_that_is_left_ends_quietly():
    with start_display() as display:
        done = subprocess.run(
            [sys.executable, "-W", "ignore::UserWarning", "-c", PROGRAM],
            env=environment(DISPLAY=display),
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
    assert done.returncode == 0
    assert [line for line in done.stderr.splitlines() if "Warning" in line or "Error" in line] == []
