"""Frames written by threads: in order, never too many at a time, and whole, whatever happens."""

import threading
import time
import weakref

import numpy as np
import pytest
from PIL import Image

from firefly_sample.capture import writers
from firefly_sample.capture.files import FrameWriter, pixel_hash, write_image
from firefly_sample.errors import FireflyError
from firefly_sample.frame import Frame, LightCounts


def frame_of(index, size=(8, 6)):
    width, height = size
    images = {
        "color": np.full((height, width, 3), index, np.uint8),
        "depth": np.full((height, width), index, np.float32),
    }
    return Frame(images, float(index), size, {}, LightCounts(0, 0, 0), "", True)


def names_in(folder):
    return sorted(path.name for path in folder.iterdir())


def names_of(indices):
    return sorted(name for i in indices for name in (f"color_{i:06d}.png", f"depth_{i:06d}.npz"))


@pytest.fixture
def slowly(monkeypatch):
    """Every write takes some milliseconds, the first ones longest; the threads that wrote."""
    threads = []

    def write(path, output, image):
        threads.append(threading.get_ident())
        time.sleep(0.03 / len(threads))
        write_image(path, output, image)

    monkeypatch.setattr(writers, "write_image", write)
    return threads


def test_entries_come_in_order_and_files_hold_the_frames(tmp_path, slowly):
    with FrameWriter(tmp_path, threads=3) as writer:
        entries = [entry for index in range(12) for entry in writer.put(index, frame_of(index))]
        entries += writer.finish()
    assert [entry["index"] for entry in entries] == list(range(12))
    for entry in entries:
        made = frame_of(entry["index"])
        assert entry["sha256"] == {output: pixel_hash(image) for output, image in made.images.items()}
        with Image.open(tmp_path / entry["files"]["color"]) as image:
            assert np.array_equal(np.asarray(image), made.color)
        with np.load(tmp_path / entry["files"]["depth"]) as arrays:
            assert np.array_equal(arrays["depth"], made.depth)
    assert names_in(tmp_path) == names_of(range(12))


def test_images_are_encoded_and_hashed_by_other_threads(tmp_path, slowly, monkeypatch):
    def hashed(image):
        slowly.append(threading.get_ident())
        return pixel_hash(image)

    monkeypatch.setattr(writers, "pixel_hash", hashed)
    before = threading.active_count()
    with FrameWriter(tmp_path, threads=2) as writer:
        for index in range(6):
            writer.put(index, frame_of(index))
    assert len(slowly) == 24
    assert len(set(slowly)) == 2
    assert threading.get_ident() not in slowly
    assert threading.active_count() == before


def test_an_entry_means_that_the_files_are_there(tmp_path, slowly):
    with FrameWriter(tmp_path, threads=2) as writer:
        for index in range(8):
            for entry in writer.put(index, frame_of(index)):
                assert set(names_of([entry["index"]])) <= set(names_in(tmp_path))


def test_no_more_frames_are_kept_than_the_bound(tmp_path, slowly):
    alive = []
    with FrameWriter(tmp_path, threads=2) as writer:
        kept = []
        for index in range(20):
            frame = frame_of(index)
            kept.append(weakref.ref(frame.images["color"]))
            writer.put(index, frame)
            del frame
            alive.append(sum(image() is not None for image in kept))
    assert writer.bound == 3
    assert 2 <= max(alive) <= writer.bound + 2  # a thread lets go a moment after it is done


def test_a_file_that_cannot_be_written_is_one_error_and_every_other_file_is_whole(tmp_path, slowly):
    in_the_way = tmp_path / "color_000002.png"
    in_the_way.mkdir()

    def run():
        with FrameWriter(tmp_path, threads=2) as writer:
            for index in range(20):
                writer.put(index, frame_of(index))

    with pytest.raises(FireflyError, match=r"^cannot write .*color_000002\.png: \S.*$"):
        run()
    left = names_in(tmp_path)
    assert not [name for name in left if name.endswith(".part")]
    frames = len(left) // 2
    assert 3 <= frames <= 2 + 3 + 1  # those before, what was under way, and what was put before it showed
    assert left == names_of(range(frames))


def test_after_an_error_elsewhere_what_was_put_is_written(tmp_path, slowly):
    def run():
        with FrameWriter(tmp_path, threads=1) as writer:
            for index in range(2):
                writer.put(index, frame_of(index))
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        run()
    assert names_in(tmp_path) == names_of(range(2))


def test_after_ctrl_c_only_what_was_begun_is_written(tmp_path, monkeypatch):
    begun = threading.Event()

    def write(path, output, image):
        begun.set()
        time.sleep(1.0)  # meanwhile the interruption must come, also on a busy machine
        write_image(path, output, image)

    monkeypatch.setattr(writers, "write_image", write)

    def run():
        with FrameWriter(tmp_path, threads=1) as writer:
            writer.put(0, frame_of(0))
            writer.put(1, frame_of(1))
            begun.wait()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run()
    assert names_in(tmp_path) == ["color_000000.png"]
