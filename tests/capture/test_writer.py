"""Frames written by threads: recorded in order and when they are whole, never too many, whatever happens."""

from __future__ import annotations

import threading
import time
import weakref

import pytest

from firefly_sample.capture import writer as module
from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.work import Part
from firefly_sample.capture.writer import FrameWriter
from firefly_sample.errors import FireflyError
from tests.capture.described import DRIVER, content_of, drawn_of, job_of

BOTH = ("color", "depth")
ASKED = {"frames": (0, 99, 1), "jobs": 1, "shard": ""}


def names_in(folder):
    return sorted(path.name for path in folder.iterdir() if path.suffix in (".png", ".npz"))


def names_of(indices):
    return sorted(name for i in indices for name in (f"color_{i:06d}.png", f"depth_{i:06d}.npz"))


@pytest.fixture
def part():
    return Part(job_of(outputs=BOTH), DRIVER, 0)


@pytest.fixture
def folder(tmp_path):
    with CaptureFolder(tmp_path / "out", ASKED) as made:
        yield made


@pytest.fixture
def slowly(monkeypatch):
    """Every frame takes some milliseconds to write, the first ones longest; the threads that wrote."""
    threads, write = [], module._write

    def later(contents, place):
        threads.append(threading.get_ident())
        time.sleep(0.03 / len(threads))
        write(contents, place)

    monkeypatch.setattr(module, "_write", later)
    return threads


def recorded(folder):
    return list(folder.records.indices(""))


def test_frames_are_recorded_in_order_and_files_hold_their_bytes(folder, part, slowly):
    with FrameWriter(folder) as writer:
        count = sum(writer.put(part, drawn_of(index, BOTH)) for index in range(12))
        before = recorded(folder)
        assert before == list(range(count))
        count += writer.finish()
    assert count == 12
    assert recorded(folder) == list(range(12))
    for index in range(12):
        drawn, frame = drawn_of(index, BOTH), folder.records.frame("", index)
        assert (frame["sha256"], frame["file_sha256"]) == (drawn.sha256, drawn.file_sha256)
        assert (frame["time"], frame["lights"]) == (drawn.time, drawn.lights)
        for output, name in frame["files"].items():
            assert (folder.path / name).read_bytes() == content_of(index, output)
    assert names_in(folder.path) == names_of(range(12))


def test_files_are_written_by_other_threads_that_end(folder, part, slowly):
    before = threading.active_count()
    with FrameWriter(folder) as writer:
        for index in range(6):
            writer.put(part, drawn_of(index))
    assert len(slowly) == 6
    assert threading.get_ident() not in slowly
    assert threading.active_count() == before


def test_a_record_means_that_the_files_are_there(folder, part, slowly):
    with FrameWriter(folder) as writer:
        for index in range(8):
            writer.put(part, drawn_of(index, BOTH))
            assert set(names_of(recorded(folder))) <= set(names_in(folder.path))


def test_no_more_frames_are_kept_than_the_bound(folder, part, slowly):
    alive, kept = [], []
    with FrameWriter(folder) as writer:
        for index in range(20):
            drawn = drawn_of(index)
            kept.append(weakref.ref(drawn))
            writer.put(part, drawn)
            del drawn
            waiting = index + 1 - len(recorded(folder))
            alive.append(waiting)
        bound = writer._bound
    assert max(alive) <= bound
    assert sum(one() is not None for one in kept) == 0


def test_a_file_that_cannot_be_written_is_one_error_and_every_other_file_is_whole(folder, part, slowly):
    (folder.path / "color_000002.png").mkdir()

    def run():
        with FrameWriter(folder) as writer:
            for index in range(20):
                writer.put(part, drawn_of(index, BOTH))

    with pytest.raises(FireflyError, match=r"^cannot write .*color_000002\.png: \S.*$"):
        run()
    (folder.path / "color_000002.png").rmdir()
    assert not [path for path in folder.path.iterdir() if path.name.endswith(".part")]
    whole = recorded(folder)
    assert whole[:2] == [0, 1]
    assert 2 not in whole
    assert set(names_of(whole)) <= set(names_in(folder.path))
    assert len(whole) < 20
    for index in whole:
        assert (folder.path / f"color_{index:06d}.png").read_bytes() == content_of(index)


@pytest.mark.parametrize(("ending", "whole"), [(RuntimeError, [0, 1]), (KeyboardInterrupt, [0])])
def test_after_an_error_elsewhere_all_is_recorded_and_after_ctrl_c_only_what_was_begun(
    folder, part, monkeypatch, ending, whole
):
    begun, write = threading.Event(), module._write

    def later(contents, place):
        begun.set()
        time.sleep(0.5)  # meanwhile the interruption must come, also on a busy machine
        write(contents, place)

    monkeypatch.setattr(module, "_write", later)
    monkeypatch.setattr(module, "thread_count", lambda: 1)

    def run():
        with FrameWriter(folder) as writer:
            writer.put(part, drawn_of(0, BOTH))
            writer.put(part, drawn_of(1, BOTH))
            begun.wait()
            raise ending

    with pytest.raises(ending):
        run()
    assert names_in(folder.path) == names_of(whole)
    assert recorded(folder) == whole


def test_warnings_and_names_of_ids_are_recorded_with_their_frame(folder, part):
    ids = Part(job_of(outputs=("id",)), DRIVER, 0)
    with FrameWriter(folder) as writer:
        writer.put(ids, drawn_of(0, ("id",), warnings=("glass",), id_names=("root/ball",)))
        writer.put(ids, drawn_of(1, ("id",)))
    assert folder.records.frame("", 0)["warnings"] == ["glass"]
    assert folder.records.frame("", 0)["id_names"] == ["root/ball"]
    assert folder.records.frame("", 1)["id_names"] == []
    assert "warnings" not in folder.records.frame("", 1)


def test_the_folder_of_a_combination_is_made(folder):
    part = Part(job_of(folder="a=1", values={"a": 1}), DRIVER, 0)
    with FrameWriter(folder) as writer:
        writer.put(part, drawn_of(3))
    assert (folder.path / "a=1" / "color_000003.png").read_bytes() == content_of(3)
    assert folder.records.frame("a=1", 3)["files"] == {"color": "a=1/color_000003.png"}
    (folder.path / "a=2").write_text("a file is in the way")
    part = Part(job_of(folder="a=2", values={"a": 2}), DRIVER, 1)
    with FrameWriter(folder) as writer, pytest.raises(FireflyError, match=r"^cannot make \S+a=2: "):
        writer.put(part, drawn_of(3))
