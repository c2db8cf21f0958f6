"""Captures of several views: numbers of frames, and the same bytes by every way of drawing them."""

from __future__ import annotations

import json
import logging
import shutil

import numpy as np
import pytest

from firefly_sample.capture.sequence import capture_frames
from firefly_sample.capture.verify import compare_captures
from firefly_sample.errors import OutputError
from tests.capture.captures import content

PARADE = "tests.capture.scenes:parade"
SMALL = {"size": (16, 12), "fps": 2.0, "time": 0.0, "outputs": ("color", "depth")}


def capture(folder, views: str | None = "orbit:6", frames="0:4", **options):
    return capture_frames(PARADE, folder, views=views, frames=frames, **{**SMALL, **options})


@pytest.fixture(scope="module")
def orbit(tmp_path_factory):
    """Four moments from six views; not to be changed."""
    folder = tmp_path_factory.mktemp("orbit") / "capture"
    capture(folder)
    return folder


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """The first 24 moments from the scene's own camera; not to be changed."""
    folder = tmp_path_factory.mktemp("plain") / "capture"
    capture(folder, None, "0:24")
    return folder


def pictures(folder):
    return {name: file for name, file in content(folder).items() if name != "manifest.json"}


def frames_of(folder):
    return json.loads((folder / "manifest.json").read_text())["frames"]


def test_frames_are_numbered_by_moment_and_view(orbit, plain):
    frames = frames_of(orbit)
    assert [frame["index"] for frame in frames] == list(range(24))
    assert [(frame["time"], frame["view"]) for frame in frames] == [
        (i / 2, v) for i in range(4) for v in range(6)
    ]
    # a few see nothing
    assert len({file for name, file in pictures(orbit).items() if name.startswith("depth")}) > 20
    for moment, frame in enumerate(frames_of(plain)[:4]):
        assert "view" not in frame
        assert frame["camera"] == frames[6 * moment]["camera"]
        assert frame["sha256"] == frames[6 * moment]["sha256"]
    here, behind = (np.array(frames[index]["camera"]["camera_to_world"]["opencv"]) for index in (0, 3))
    np.testing.assert_allclose(behind[:2, :3], -here[:2, :3], atol=1e-12)
    np.testing.assert_array_equal(behind[2], here[2])


def test_workers_draw_the_same(orbit, tmp_path):
    capture(tmp_path, workers=2)
    assert content(tmp_path) == content(orbit)


def test_shards_draw_the_same(orbit, tmp_path):
    for shard in ("2/2", "1/2"):
        assert not (tmp_path / "manifest.json").exists()
        capture(tmp_path, shard=shard)
    assert content(tmp_path) == content(orbit)


def test_an_interrupted_capture_goes_on(orbit, tmp_path):
    def stop(done, total):
        assert total == 24
        if done == 9:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        capture(tmp_path, progress=stop)
    assert not (tmp_path / "manifest.json").exists()
    capture(tmp_path, resume=True)
    assert content(tmp_path) == content(orbit)


@pytest.mark.parametrize(("to", "frames"), [(None, "0:24"), ("orbit:3", "0:8")])
def test_other_views_are_drawn_again_and_say_so(to, frames, orbit, plain, tmp_path, caplog):
    """The frames keep their numbers, so that they show other moments."""
    folder = shutil.copytree(orbit, tmp_path / "copy")
    capture(folder, to, "0:2", resume=True)
    assert f"drawn again: 24 of other settings (views: orbit:6, now {to or 'none'})" in caplog.text
    if to is None:
        assert content(folder) == content(plain)
    else:
        capture(tmp_path / "fresh", to, frames)
        assert content(folder) == content(tmp_path / "fresh")


def test_views_where_there_were_none_are_drawn(orbit, plain, tmp_path, caplog):
    folder = shutil.copytree(plain, tmp_path / "copy")
    capture(folder, resume=True)
    assert "views: none, now orbit:6" in caplog.text
    assert content(folder) == content(orbit)


def test_frames_of_other_views_are_not_missed(tmp_path, caplog):
    caplog.set_level(logging.INFO)

    def stop(done, total):
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        capture(tmp_path, progress=stop)
    capture(tmp_path, None, "0:12", resume=True)
    assert "of other settings (views: orbit:6, now none)" in caplog.text
    assert "earlier run" not in caplog.text


def test_a_manifest_is_a_file_of_views(orbit, tmp_path, caplog):
    """All of its cameras see each moment, each once."""
    first = tmp_path / "first"
    capture(first, frames=1)
    again = capture(tmp_path / "again", str(first / "manifest.json"), "1")
    assert pictures(tmp_path / "again") == pictures(first)
    assert [frame["camera"] for frame in again["frames"]] == [frame["camera"] for frame in frames_of(first)]
    for name, file in pictures(first).items():
        assert file == (orbit / name).read_bytes()
    written = json.loads((first / "manifest.json").read_text())
    written["frames"][2]["camera"]["near"] *= 1.5
    (tmp_path / "other.json").write_text(json.dumps(written))
    capture(tmp_path / "again", str(tmp_path / "other.json"), "1", resume=True)
    assert "drawn again: 6 of other settings (views: 6 poses, now other 6 poses)" in caplog.text


def test_a_sweep_has_all_views_in_each_folder(orbit, tmp_path):
    manifest = capture(tmp_path, "orbit:2", "0:2", sweep={"more": [0, 1]})
    for part in manifest.captures():
        assert [frame["view"] for frame in part["frames"]] == [0, 1, 0, 1]
    assert manifest["views"] == {"orbit": 2}
    assert (tmp_path / "more=0/color_000001.png").read_bytes() == (orbit / "color_000003.png").read_bytes()


def test_shards_of_other_views_are_refused(tmp_path):
    capture(tmp_path, "orbit:2", shard="1/2", frames="0:2")
    for other, changed in (("orbit:3", "0:2:1 from 3 views"), (None, "0:2:1;")):
        with pytest.raises(OutputError, match=rf"\(frames: 0:2:1 from 2 views, now {changed}"):
            capture(tmp_path, other, shard="2/2", frames="0:2")


def test_cameras_may_differ_in_their_last_bit(orbit, tmp_path):
    """As those that other processors have computed."""
    folder = shutil.copytree(orbit, tmp_path / "copy")
    text = (folder / "manifest.json").read_text()
    number = frames_of(folder)[1]["camera"]["camera_to_world"]["opencv"][0][0]
    changed = text.replace(json.dumps(number), json.dumps(float(np.nextafter(number, 2))))
    assert changed != text
    (folder / "manifest.json").write_text(changed)
    report = compare_captures(orbit, folder)
    assert report.ok
    assert report.notes == []
