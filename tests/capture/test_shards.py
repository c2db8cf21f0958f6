"""Shards of one capture are one capture, in whatever order and number they are drawn."""

from __future__ import annotations

import logging

import pytest

from firefly_sample.capture.manifest import Manifest, read_manifest
from firefly_sample.capture.work import Share
from firefly_sample.cli import main
from firefly_sample.errors import OutputError
from firefly_sample.settings import Settings
from tests.capture.captures import GLADE, capture, content, touched

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    capture(folder)
    return folder


def test_three_shards_in_any_order_are_one_capture(tmp_path, undisturbed, caplog):
    for shard in ("3/3", "1/3"):
        with caplog.at_level(logging.INFO):
            assert capture(tmp_path, shard=shard) == Share(2, 0)
    assert caplog.messages == [
        f"there is no manifest yet: frames of other shards have yet to be drawn ({count})" for count in (4, 2)
    ]
    assert "manifest.json" not in content(tmp_path)
    assert capture(tmp_path, shard=(2, 3)) == read_manifest(undisturbed)
    assert content(tmp_path) == content(undisturbed)


def test_a_shard_that_is_run_twice_is_refused_or_gone_on_with(tmp_path, undisturbed):
    capture(tmp_path, shard="1/2")
    before = touched(tmp_path)
    with pytest.raises(OutputError, match=r"^there is a capture in \S+ already: use --resume"):
        capture(tmp_path, shard="1/2")
    assert isinstance(capture(tmp_path, shard="1/2", resume=True), Share)
    assert touched(tmp_path) == before
    assert isinstance(capture(tmp_path, shard="2/2"), Manifest)
    assert content(tmp_path) == content(undisturbed)


def test_more_shards_or_none_go_on_with_what_fewer_began(tmp_path, undisturbed):
    capture(tmp_path, shard="1/2")
    (tmp_path / "color_000004.png").unlink()
    with pytest.raises(OutputError, match=r"^there is a capture in"):
        capture(tmp_path, shard="1/3")
    for shard in ("3/3", "2/3"):
        assert isinstance(capture(tmp_path, shard=shard, resume=True), Share)
    before = touched(tmp_path)
    assert set(before) == {f"color_{index:06d}.png" for index in (0, 1, 2, 4, 5)}
    assert isinstance(capture(tmp_path, resume=True), Manifest)
    assert content(tmp_path) == content(undisturbed)
    assert {name: time for name, time in touched(tmp_path).items() if name in before} == before


def test_a_shard_alone_goes_on_with_a_finished_capture(tmp_path, undisturbed):
    assert isinstance(capture(tmp_path, shard="1/1"), Manifest)
    (tmp_path / "color_000001.png").unlink()
    (tmp_path / "color_000002.png").unlink()
    capture(tmp_path, shard="1/2", resume=True)
    assert content(tmp_path) == content(undisturbed)


def test_a_file_of_a_shard_that_has_ended_is_mended_by_the_last_one(tmp_path, undisturbed, caplog):
    capture(tmp_path, shard="1/2")
    (tmp_path / "color_000002.png").write_bytes(b"something else")
    assert isinstance(capture(tmp_path, shard="2/2"), Manifest)
    assert any("files were changed while others were drawn" in text for text in caplog.messages)
    assert content(tmp_path) == content(undisturbed)


DIFFERENT = {
    "parameters": ({"parameters": {"fireflies": 4}}, "fireflies: 3, now 4"),
    "settings": ({"settings": Settings(supersample=1)}, "supersample: 2, now 1"),
    "frames": ({"frames": "0:8"}, "frames: 0:6:1, now 0:8:1"),
    "size": ({"size": (9, 6)}, r"size: \[8, 6\], now \[9, 6\]"),
    "a sweep": ({"sweep": {"fireflies": [3, 4]}}, "combinations: 1, now 2"),
}


def test_shards_of_other_settings_are_refused(tmp_path, undisturbed):
    capture(tmp_path, shard="1/2")
    before = content(tmp_path)
    for options, said in DIFFERENT.values():
        match = rf"^(other shards of the capture in|in) .*({said}|a capture without a sweep)"
        with pytest.raises(OutputError, match=match):
            capture(tmp_path, shard="2/2", **options)
        assert content(tmp_path) == before
    capture(tmp_path, shard="2/2")
    assert content(tmp_path) == content(undisturbed)


def test_shards_are_drawn_again_with_other_settings_one_after_the_other(tmp_path, undisturbed):
    for shard in ("1/2", "2/2"):
        capture(tmp_path, shard=shard, parameters={"fireflies": 5})
    assert isinstance(capture(tmp_path, shard="1/2", resume=True), Share)
    assert isinstance(capture(tmp_path, shard="2/2", resume=True), Manifest)
    assert content(tmp_path) == content(undisturbed)


def test_there_may_be_more_shards_than_frames(tmp_path):
    capture(tmp_path / "one", frames="0:1")
    for shard in ("3/3", "1/3", "2/3"):
        result = capture(tmp_path / "out", frames="0:1", shard=shard)
        assert isinstance(result, Manifest) if shard == "1/3" else result == Share(0, 0)
    assert content(tmp_path / "out") == content(tmp_path / "one")


def test_shards_of_a_sweep_share_what_they_have_measured(tmp_path):
    """Each combination has one frame, so that each exposure is measured by one shard only."""
    options = {"sweep": {"fireflies": [1, 5]}, "frames": "0:1", "settings": Settings(exposure="auto")}
    options["parameters"] = {"dusk": False}
    whole = capture(tmp_path / "whole", **options)
    exposures = [each["exposure"] for each in whole["captures"]]
    assert len({*exposures, None}) == 3
    for shard in ("1/2", "2/2"):
        capture(tmp_path / "out", **options, shard=shard)
    assert content(tmp_path / "out") == content(tmp_path / "whole")


def test_a_frame_that_fails_in_a_shard_of_its_own_does_not_keep_the_manifest_away(tmp_path):
    failing = {"scene": "tests.cli.glade:failing", "frames": "2:4", "parameters": {}}
    with pytest.warns(UserWarning, match=r"^frame 3 cannot be drawn: no fourth frame$"):
        assert capture(tmp_path, **failing, shard="2/2") == Share(0, 1)
    manifest = capture(tmp_path, **failing, shard="1/2")
    assert [frame["index"] for frame in manifest["frames"]] == [2]
    assert [frame["index"] for frame in manifest["failed"]] == [3]


def test_shards_on_the_command_line(tmp_path, capsys):
    words = ["capture", GLADE, "--size", "8x6", "--frames", "0:2", "-o", str(tmp_path)]
    for wrong in ("0/2", "3/2", "x"):
        assert main([*words, "--shard", wrong]) == 1
        assert "a shard is I/N" in capsys.readouterr().err
    assert main([*words, "--shard", "1/2"]) == 0
    assert capsys.readouterr().out == f"1 frame (color) in {tmp_path}\n"
    assert main([*words, "--shard", "2/2"]) == 0
    assert capsys.readouterr().out == f"2 frames (color) in {tmp_path}\n"
