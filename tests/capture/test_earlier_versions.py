"""Journals of versions that had no cameras, formats, views and data sets: they are merged, or drawn again."""

from __future__ import annotations

import json
import re
import shutil

import pytest

from firefly_sample.capture.job import key_of
from firefly_sample.capture.merge import merge_capture
from firefly_sample.capture.sequence import capture_frames
from firefly_sample.capture.verify import verify_capture
from tests.capture.captures import content

PARADE = "tests.capture.scenes:parade"
SMALL = {"size": (16, 12), "fps": 1.0, "time": 0.0, "frames": "0:2", "outputs": ("color", "depth")}
NEW = ("formats", "quality", "depth_scale", "dataset", "views")


@pytest.fixture(scope="module")
def new(tmp_path_factory):
    """A capture that was ended before its manifest; not to be changed."""
    folder = tmp_path_factory.mktemp("new") / "capture"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("firefly_sample.capture.run.write_records", None)
        with pytest.raises(TypeError):
            capture_frames(PARADE, folder, **SMALL)
    return folder


@pytest.fixture
def old(new, tmp_path):
    """The same as an earlier version would have left it."""
    folder = shutil.copytree(new, tmp_path / "old")
    lines = [json.loads(line) for line in (folder / "journal.jsonl").read_text().splitlines()]
    keys = {}
    for line in lines:
        if "is" in line:
            described = {name: value for name, value in line["is"].items() if name not in NEW}
            keys[line["about"]] = key_of(described)
            line["is"] = described
        line.pop("views", None)
        line.pop("camera", None)
        if "about" in line:
            line["about"] = keys[line["about"]]
    (folder / "journal.jsonl").write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    return folder


def test_they_are_merged(old, new, tmp_path):
    manifest = merge_capture(old)
    assert not any("camera" in frame for frame in manifest["frames"])
    assert verify_capture(old).ok
    whole = shutil.copytree(new, tmp_path / "whole")
    merge_capture(whole)
    before, now = content(whole), content(old)
    assert before.keys() == now.keys()
    assert all(before[name] == now[name] for name in before if name != "manifest.json")


def test_they_are_drawn_again_and_it_is_said(old, new, tmp_path, caplog):
    whole = shutil.copytree(new, tmp_path / "whole")
    capture_frames(PARADE, whole, resume=True, **SMALL)
    assert "drawn again" not in caplog.text
    capture_frames(PARADE, old, resume=True, **SMALL)
    assert re.search(r"drawn again: 2 of other settings \(cameras: not recorded by an earlier", caplog.text)
    assert content(old) == content(whole)
