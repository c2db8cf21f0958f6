"""The folder of a capture, without a driver: what is there, what is kept, what is removed and refused."""

from __future__ import annotations

import logging
import os

import pytest

from firefly_sample.capture.closing import write_records
from firefly_sample.capture.frames import Shard
from firefly_sample.capture.manifest import read_manifest
from firefly_sample.capture.work import Part, Work
from firefly_sample.capture.writer import FrameWriter
from firefly_sample.errors import FireflyError, OutputError
from tests.capture.described import DRIVER, content_of, drawn_of, failed_of, job_of
from tests.capture.folders import draw, finish, finished, names_in, opened, parts_of
from tests.cli.permissions import obeyed_permissions

PICTURES = [f"color_{index:06d}.png" for index in range(4)]


# --- What is wrong with files ---


def test_frames_that_are_not_as_they_were_written_are_counted_by_what_is_wrong(tmp_path):
    parts = finished(tmp_path)
    (tmp_path / PICTURES[0]).unlink()
    (tmp_path / PICTURES[1]).write_bytes(content_of(1)[:-1])
    with opened(tmp_path) as place:
        work = Work(place, parts, range(5))
        survey = work.check()
        assert (survey.whole, dict(survey.wrong)) == (2, {"missing": 1, "damaged": 1})
        assert str(survey) == "2 frames are whole already; drawn again: 1 missing, 1 damaged"
        assert [task.index for task in work.missing()] == [0, 1, 4]
        assert work.count() == (2, 5)


def test_swapped_files_are_both_damaged(tmp_path):
    parts = finished(tmp_path)
    first, second = tmp_path / PICTURES[0], tmp_path / PICTURES[1]
    one, other = first.read_bytes(), second.read_bytes()
    first.write_bytes(other)
    second.write_bytes(one)
    with opened(tmp_path) as place:
        survey = Work(place, parts, range(4)).check()
    assert (survey.whole, dict(survey.wrong)) == (2, {"damaged": 2})


def test_frames_of_other_settings_are_drawn_again_and_what_differs_is_named(tmp_path):
    finished(tmp_path)
    parts = parts_of(size=(8, 7), parameters={"fireflies": 3, "seed": 8})
    with opened(tmp_path) as place:
        survey = Work(place, parts, range(4)).check()
    assert (survey.whole, dict(survey.wrong)) == (0, {"of other settings": 4})
    assert str(survey) == (
        "0 frames are whole already; drawn again: 4 of other settings "
        "(seed: 7, now 8; size: [8, 6], now [8, 7])"
    )


def test_frames_that_failed_are_tried_again_only_when_asked(tmp_path):
    parts = parts_of()
    with opened(tmp_path) as place:
        place.add(parts[0].description, failed_of(1))
        work = Work(place, parts, range(2))
        assert not work.check().wrong
        assert [task.index for task in work.missing()] == [0]
        assert dict(work.check(retry=True).wrong) == {"that failed before": 1}
        assert [task.index for task in work.missing()] == [0, 1]


def test_frames_of_earlier_runs_that_are_damaged_are_drawn_again_too(tmp_path):
    parts = finished(tmp_path)
    (tmp_path / PICTURES[3]).unlink()
    with opened(tmp_path, frames=2) as place:
        work = Work(place, parts, range(1, 2))
        work.check()
        assert [task.index for task in work.missing()] == [3]
        assert work.count() == (3, 4)


def test_an_older_frame_in_a_later_shards_share_is_mended_by_whoever_is_last(tmp_path):
    """The file of another shard is damaged after that shard has ended."""
    parts = parts_of()
    first, second = Shard(1, 2), Shard(2, 2)
    with opened(tmp_path, first) as place:
        assert draw(place, parts_of()) == [0, 2]
    (tmp_path / PICTURES[2]).write_bytes(b"other")
    with opened(tmp_path, second) as place:
        work = Work(place, parts, range(4))
        with FrameWriter(place) as writer:
            for task in work.missing():
                writer.put(parts[0], drawn_of(task.index))
        assert place.become_alone()
        place.reread()
        assert work.count_others() == 0
        assert dict(work.check(everything=True).wrong) == {"damaged": 1}
        assert [task.index for task in work.missing()] == [2]


# --- Refusals ---


def refused(place):
    """A shard must not overwrite what others draw."""
    with pytest.raises(OutputError, match=r"^there is a capture in \S+ already: ") as caught:
        place.check_free()
    assert "--resume" in str(caught.value)
    assert ("--overwrite" in str(caught.value)) == (place.shard is None)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("left", ["manifest.json", "manifest.previous.json", "journal"])
def test_a_folder_with_a_capture_is_refused(tmp_path, left):
    if left == "journal":
        with opened(tmp_path) as place:
            draw(place, parts_of())
        for name in PICTURES:
            (tmp_path / name).unlink()
    else:
        finished(tmp_path / "made")
        (tmp_path / "made" / "manifest.json").rename(tmp_path / left)
    before = names_in(tmp_path)
    with opened(tmp_path) as place:
        refused(place)
    assert names_in(tmp_path) == before


@pytest.mark.parametrize("name", ["notes.txt", "color.png", "color_1.png", "journal.txt", ".firefly.lock"])
def test_a_folder_with_other_files_is_free(tmp_path, name):
    (tmp_path / name).touch()
    (tmp_path / "folder").mkdir()
    for shard in (None, Shard(1, 2)):
        with opened(tmp_path, shard) as place:
            place.check_free()


def test_shards_of_one_capture_are_free_and_others_are_refused(tmp_path):
    with opened(tmp_path, Shard(1, 2)) as place:
        draw(place, parts_of())
    for shard, free in ((Shard(2, 2), True), (Shard(1, 2), False), (Shard(1, 3), False), (None, False)):
        with opened(tmp_path, shard) as place:
            if free:
                place.check_free()
            else:
                refused(place)


def test_a_second_capture_into_the_folder_is_refused(tmp_path):
    with opened(tmp_path) as place:
        draw(place, parts_of())
        before = names_in(tmp_path)
        for shard, overwrite in ((None, False), (None, True), (Shard(1, 2), False)):
            match = rf"^another capture is writing into \S+ \(process {os.getpid()} on \S+\)$"
            with pytest.raises(OutputError, match=match), opened(tmp_path, shard, overwrite):
                pass
        assert names_in(tmp_path) == before
    with opened(tmp_path, Shard(1, 2)), opened(tmp_path, Shard(2, 2)):
        match = r"^shard 1/2 of the capture in \S+ is being drawn already \(process"
        with pytest.raises(OutputError, match=match), opened(tmp_path, Shard(1, 2)):
            pass
        with pytest.raises(OutputError, match=r"^another capture is writing"), opened(tmp_path):
            pass
    assert not [name for name in names_in(tmp_path) if "lock" in name]


def test_a_folder_that_cannot_be_written_is_one_line_and_kept(tmp_path):
    folder = tmp_path / "kept"
    folder.mkdir(mode=0o555)
    match = r"^cannot write into folder \S+kept \(Permission denied\): choose another one$"
    with obeyed_permissions(), pytest.raises(FireflyError, match=match), opened(folder):
        pass
    assert names_in(tmp_path) == ["kept"]


def test_a_new_folder_is_removed_if_nothing_was_written(tmp_path):
    with pytest.raises(RuntimeError), opened(tmp_path / "new" / "folder"):
        raise RuntimeError
    assert names_in(tmp_path) == []


# --- Overwriting ---


def test_overwriting_keeps_other_files_and_removes_all_of_the_old_capture(tmp_path):
    """Also of a sweep, of other outputs, and pictures of which nobody knows any more."""
    jobs = [
        Part(job_of(folder=name, values={"a": name}, outputs=("color", "id")), DRIVER, place)
        for place, name in enumerate(("a=x", "a=y"))
    ]
    with opened(tmp_path) as place:
        draw(place, jobs)
        finish(place, jobs)
    mine = [tmp_path / "notes.txt", tmp_path / "a=y" / "mine.png", tmp_path / "b=1" / PICTURES[0]]
    mine[2].parent.mkdir()
    for path in mine:
        path.write_text("mine")
    for stray in ("depth_000077.npz", "a=x/color_000009.png"):  # a kill came before its record
        (tmp_path / stray).touch()
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    with opened(tmp_path, overwrite=True) as place:
        assert place.records.folders() == []
        (tmp_path / ".firefly.lock").unlink()
        assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before
        parts = parts_of()
        assert draw(place, parts) == [0, 1, 2, 3]
        finish(place, parts)
    assert all(path.read_text() == "mine" for path in mine)
    assert names_in(tmp_path) == sorted([*PICTURES, "a=y", "b=1", "manifest.json", "notes.txt"])
    assert names_in(tmp_path / "a=y") == ["mine.png"]


def test_overwriting_does_away_with_a_damaged_manifest(tmp_path):
    finished(tmp_path)
    (tmp_path / "manifest.json").write_text("{")
    (tmp_path / "color_000099.png").touch()
    with opened(tmp_path, overwrite=True) as place:
        parts = parts_of()
        with pytest.warns(UserWarning, match=r"^\S+ is not a manifest: .*; only pictures in \S+ itself"):
            draw(place, parts, version=1)
        finish(place, parts)
    assert names_in(tmp_path) == [*PICTURES, "manifest.json"]
    assert (tmp_path / PICTURES[1]).read_bytes() == content_of(1, version=1)


# --- What others have left ---


def test_what_killed_writers_left_is_removed_also_in_folders_of_a_sweep(tmp_path):
    (tmp_path / "a=1").mkdir()
    (tmp_path / "closed").mkdir(mode=0)
    left = [".color_000000.png.123-4.part", "a=1/.id_000000.npz.123-5.part", ".manifest.json.77-0.part"]
    for name in left:
        (tmp_path / name).touch()
    (tmp_path / "a=1" / "mine.part").touch()
    with obeyed_permissions(), opened(tmp_path):
        pass
    assert sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")) == [
        "a=1",
        "a=1/mine.part",
        "closed",
    ]


def test_only_what_is_a_captures_own_is_read_or_removed(tmp_path, caplog):
    """Another process may be capturing into a folder in this one, and people call their files journals."""
    kept = [
        tmp_path / "journal.txt.jsonl",
        tmp_path / "journal-of-a-night.jsonl",
        tmp_path / "forest" / ".color_000001.png.4711-3.part",
        tmp_path / "a=2" / ".color_000001.png.4711-3.part",
    ]
    for path in kept:
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine")
    (tmp_path / "a=2" / ".firefly.lock").touch()  # held by the process that writes there
    with opened(tmp_path) as place:
        parts = parts_of()
        draw(place, parts)
        (tmp_path / "color_000009.png").write_text("of nobody")
        with caplog.at_level(logging.INFO):
            finish(place, parts)
    assert [path.read_text() for path in kept] == ["mine"] * len(kept)
    assert caplog.messages == [f"removed from {tmp_path}, because no frame has them: color_000009.png (1)"]


def test_locks_of_shards_that_were_killed_are_removed_at_the_end(tmp_path):
    for name in (".firefly.lock", ".firefly-1-of-8.lock", ".firefly-2-of-8.lock"):
        (tmp_path / name).touch()
    with opened(tmp_path, Shard(1, 1)) as place:
        draw(place, parts_of())
        assert place.become_alone()
        finish(place, parts_of())
    assert names_in(tmp_path) == [*PICTURES, "manifest.json"]


def test_a_combination_of_which_no_frame_could_be_drawn_has_no_folder(tmp_path):
    jobs = [Part(job_of(folder=name, values={"a": name}), DRIVER, n) for n, name in enumerate(("a=x", "a=y"))]
    with opened(tmp_path) as place:
        place.add(jobs[0].description, failed_of(0))
        assert draw(place, jobs, range(1)) == [0]
        finish(place, jobs)
    failed, whole = read_manifest(tmp_path)["captures"]
    assert (len(failed["frames"]), failed["failed"]) == (0, [failed_of(0)])
    assert (len(whole["frames"]), whole["failed"]) == (1, [])
    assert names_in(tmp_path) == ["a=y", "manifest.json"]


def test_the_earlier_manifest_is_put_aside_until_the_end(tmp_path):
    parts = finished(tmp_path)
    before = (tmp_path / "manifest.json").read_bytes()
    with opened(tmp_path) as place:
        draw(place, parts, range(6))
        assert names_in(tmp_path)[-2:] == ["journal.jsonl", "manifest.previous.json"]
        assert (tmp_path / "manifest.previous.json").read_bytes() == before
    with opened(tmp_path) as place:
        assert list(place.records.indices("")) == list(range(6))
        finish(place, parts)
    assert [frame["index"] for frame in read_manifest(tmp_path)["frames"]] == list(range(6))
    assert names_in(tmp_path)[-2:] == ["color_000005.png", "manifest.json"]


def test_a_run_that_writes_no_frame_leaves_the_folder_as_it_was(tmp_path):
    parts = finished(tmp_path)
    before = {name: (tmp_path / name).read_bytes() for name in names_in(tmp_path)}
    in_the_way = tmp_path / "color_000004.png"
    in_the_way.mkdir()

    def run():
        with opened(tmp_path) as place:
            draw(place, parts, range(5))

    with pytest.raises(FireflyError, match=r"^cannot write"):
        run()
    in_the_way.rmdir()
    assert {name: (tmp_path / name).read_bytes() for name in names_in(tmp_path)} == before
    with opened(tmp_path) as place:
        draw(place, parts, range(5))
        place.begin()
    with opened(tmp_path) as place:  # whose journal has frames of an earlier run
        place.begin()
    assert {"journal.jsonl", "manifest.previous.json"} <= set(names_in(tmp_path))


def test_a_manifest_is_not_put_back_beside_a_file_that_was_replaced(tmp_path):
    outputs = ("color", "depth")
    finished(tmp_path, outputs=outputs)
    (tmp_path / "depth_000000.npz").unlink()
    (tmp_path / "depth_000000.npz").mkdir()
    parts = parts_of(outputs=outputs, size=(9, 6))

    def run():
        with opened(tmp_path) as place:
            work = Work(place, parts, range(1))
            work.check()
            with FrameWriter(place) as writer:
                writer.put(parts[0], drawn_of(0, outputs, version=1))
                writer.finish()

    with pytest.raises(FireflyError, match=r"^cannot write \S+depth_000000.npz"):
        run()
    assert (tmp_path / PICTURES[0]).read_bytes() == content_of(0, version=1)
    assert {"journal.jsonl", "manifest.previous.json"} <= set(names_in(tmp_path))
    assert "manifest.json" not in names_in(tmp_path)


def test_a_crash_between_the_new_manifest_and_the_end_loses_nothing(tmp_path):
    parts = finished(tmp_path)
    with opened(tmp_path) as place:
        draw(place, parts, range(6))
        write_records(place.path, place.records, [parts[0].description])
    expected = read_manifest(tmp_path).as_dict()
    assert {"journal.jsonl", "manifest.json", "manifest.previous.json"} <= set(names_in(tmp_path))
    with opened(tmp_path) as place:
        assert not Work(place, parts, range(6)).check().wrong
        finish(place, parts)
    assert read_manifest(tmp_path) == expected
    assert names_in(tmp_path) == [*PICTURES, "color_000004.png", "color_000005.png", "manifest.json"]
