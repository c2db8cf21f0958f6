"""Numbers of frames: each moment from each view, wherever a range of frames was enough before."""

from __future__ import annotations

import json
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.frames import (
    MAX_FRAMES,
    FrameNumbers,
    Shard,
    asked_numbers,
    check_clock,
    frame_numbers,
)
from firefly_sample.capture.merge import merge_capture
from firefly_sample.capture.records import Records
from firefly_sample.capture.template import check_same
from firefly_sample.capture.work import Part, Work
from firefly_sample.errors import OutputError
from tests.capture.described import DRIVER, job_of
from tests.capture.folders import draw

moments = st.builds(range, st.integers(0, 40), st.integers(0, 60), st.integers(1, 7))


@given(moments, st.integers(1, 9))
def test_they_are_the_list_of_moment_times_views_plus_view(moments, views):
    numbers = FrameNumbers(moments, views)
    expected = [moment * views + view for moment in moments for view in range(views)]
    assert list(numbers) == expected
    assert len(numbers) == len(expected)
    assert [numbers[place] for place in range(-len(expected), len(expected))] == expected * 2
    assert numbers[1::3] == expected[1::3]
    assert [number for number in range(-9, 60 * views + 9) if number in numbers] == expected
    assert [numbers.index(number) for number in expected] == list(range(len(expected)))
    assert [numbers.count(number) for number in expected] == [1] * len(expected)
    assert list(reversed(numbers)) == expected[::-1]


@given(moments)
def test_with_one_view_they_are_the_range(moments):
    numbers = FrameNumbers(moments)
    assert list(numbers) == list(moments)
    assert [place in numbers for place in range(-1, 61)] == [place in moments for place in range(-1, 61)]
    assert bool(numbers) == bool(moments)


def test_what_is_not_among_them():
    numbers = frame_numbers("2:8:3", 4)  # moments 2 and 5
    assert list(numbers) == [8, 9, 10, 11, 20, 21, 22, 23]
    assert numbers.index(21, 5) == 5
    for wrong in (0, 7, 12, 19, 24, -1):
        assert wrong not in numbers
        with pytest.raises(ValueError, match=f"frame {wrong} is not among"):
            numbers.index(wrong)
    with pytest.raises(ValueError, match="frame 21"):
        numbers.index(21, 6)
    for place in (8, -9):
        with pytest.raises(IndexError):
            numbers[place]
    assert "8" not in numbers
    assert 8.5 not in numbers


def test_they_are_a_value():
    numbers = frame_numbers(range(3), 24)
    assert numbers == FrameNumbers(range(3), 24) == pickle.loads(pickle.dumps(numbers))
    assert hash(numbers) == hash(FrameNumbers(range(3), 24))
    assert numbers != frame_numbers(range(3), 12)
    assert (str(numbers), str(frame_numbers("0:3"))) == ("0:3:1 from 24 views", "0:3:1")


def test_numbers_end_below_a_million():
    assert frame_numbers("0:41666", 24)[-1] == 999_983 < MAX_FRAMES
    with pytest.raises(
        OutputError,
        match=r"frames '0:50000' from 24 views each have numbers up to 1,199,999 \(49,999 x 24 \+ 23\), and "
        "they must be below 1,000,000: capture fewer frames or fewer views",
    ):
        frame_numbers("0:50000", 24)
    with pytest.raises(OutputError, match="up to 1,000,001 "):
        frame_numbers(1, 500_001)
    assert frame_numbers(1, 500_000)[-1] == MAX_FRAMES - 1


def test_a_journal_says_which_they_are():
    assert asked_numbers({"frames": [0, 6, 2], "views": 3}) == FrameNumbers(range(0, 6, 2), 3)
    assert asked_numbers({"frames": [0, 6, 1]}) == FrameNumbers(range(6))


def test_shards_share_out_the_views_of_a_moment_and_a_merge_misses_them(tmp_path):
    asked = {"frames": (1, 4, 2), "views": 3, "jobs": 1, "shard": ""}
    numbers, part = asked_numbers(asked), Part(job_of(), DRIVER, 0)
    assert list(numbers) == [3, 4, 5, 9, 10, 11]
    with CaptureFolder(tmp_path, asked, Shard(1, 2)) as place:
        assert draw(place, [part], numbers) == [3, 5, 10]
    with pytest.raises(OutputError, match=r"have yet to be drawn in .* \(4, 9, 11\)"):
        merge_capture(tmp_path)
    with CaptureFolder(tmp_path, asked, Shard(2, 2)) as place:
        assert place.records.asked[0]["views"] == 3
        check_same(place, [part], asked)
        with pytest.raises(OutputError, match="frames: 1:4:2 from 3 views, now 1:4:2"):
            check_same(place, [part], asked | {"views": 1})
        work = Work(place, [part], FrameNumbers(range(1, 2), 3))
        assert work.count_others() == 1  # frame 4
        assert draw(place, [part], numbers) == [4, 9, 11]
    with CaptureFolder(tmp_path, asked) as place:
        work = Work(place, [part], FrameNumbers(range(3, 4), 3))
        place.records.forget("", 4)
        assert work.count_forgotten() == 1
    assert [frame["index"] for frame in merge_capture(tmp_path)["frames"]] == list(numbers)


def test_a_run_without_a_whole_number_of_views_is_none(tmp_path):
    path = tmp_path / "journal.jsonl"
    for views, known in ((3, 1), (0, 0), (1.5, 0), ("3", 0), (True, 0), (None, 0)):
        line = {"run": 1, "frames": [0, 6, 1], "views": views, "jobs": 1, "shard": ""}
        path.write_text(json.dumps(line) + "\n")
        with Records([], [path]) as records:
            assert len(records.asked) == known


@pytest.mark.parametrize("fps", [1e-320, 5e-303])
def test_times_of_frames_are_finite(fps):
    with pytest.raises(OutputError, match=f"fps must be large enough .* got {fps}"):
        check_clock(fps, 0.0)
    check_clock(1e-300, 0.0)
