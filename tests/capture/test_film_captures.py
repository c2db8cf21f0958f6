"""Captures that become one film: read back by other libraries, resumed, overwritten, and refused."""

from __future__ import annotations

import hashlib
import json
import logging

import numpy as np
import pytest
from PIL import Image, ImageSequence

from firefly_sample.capture import one_file
from firefly_sample.capture.manifest import read_manifest
from firefly_sample.capture.one_file import earlier_settings
from firefly_sample.capture.work import Share
from firefly_sample.errors import FireflyError, OutputError
from tests.capture.rolled import film_pictures, luma_psnr, names_in, no_drawing, pictures, roll

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")
_ = no_drawing


@pytest.fixture
def clip(rolled, tmp_path):
    """A film of four frames with its manifest, in a folder of its own."""
    for name in ("clip.mp4", "clip.mp4.json"):
        (tmp_path / name).write_bytes((rolled / name).read_bytes())
    return tmp_path / "clip.mp4"


LOSSLESS = ("exact.mp4", "exact.webm", "clip.webp", "clip.apng", "alpha.webp", "alpha.apng")


@pytest.mark.parametrize("name", LOSSLESS)
def test_other_libraries_read_the_bits_of_the_frames(name, rolled):
    output, mode = ("color_alpha", "rgba") if name.startswith("alpha") else ("color", "rgb24")
    found = film_pictures(rolled / name, mode)
    np.testing.assert_array_equal(np.stack(found), np.stack(pictures(rolled / "frames", output)))
    assert len(found) == 4
    left = [other for other in names_in((rolled / name).parent) if name in other]
    assert left == [name, f"{name}.json"]


def test_the_manifest_beside_a_film_describes_its_frames(rolled):
    manifest = read_manifest(rolled / "clip.mp4.json")
    digest = hashlib.sha256((rolled / "clip.mp4").read_bytes()).hexdigest()
    expected = {"name": "clip.mp4", "sha256": digest, "fps": "24", "crf": None, "quality": None, "pad": False}
    assert manifest["file"] == expected
    frames = read_manifest(rolled / "frames")["frames"]
    for entry, frame in zip(manifest["frames"], frames, strict=True):
        assert entry["sha256"] == {"color": frame["sha256"]["color"]}
        assert entry["camera"] == frame["camera"]
        assert (entry["index"], entry["time"]) == (frame["index"], frame["time"])
        assert entry["files"] == entry["file_sha256"] == {}


@pytest.mark.parametrize("name", ["clip.mp4", "clip.webm"])
def test_the_best_lossy_film_is_close_to_the_frames(name, rolled, tmp_path):
    """A step of 3.5 codes, twice that of H.264's quantiser 9, errs by 3.5²/12 = 1 code²: 48 dB."""
    roll(tmp_path / name, crf=1)
    assert luma_psnr(pictures(rolled / "frames"), film_pictures(tmp_path / name)) > 48


@pytest.mark.parametrize("name", ["clip.mp4", "clip.webm", "clip.gif"])
def test_the_usual_film_shows_each_frame_in_its_place(name, rolled):
    """30 dB is a mean error of 8 codes; the next frame of the ball is much farther away."""
    expected, found = pictures(rolled / "frames"), film_pictures(rolled / name)
    assert luma_psnr(expected, found) > 30
    errors = [[-luma_psnr([one], [other]) for other in expected] for one in found]
    assert np.argmin(errors, axis=1).tolist() == [0, 1, 2, 3]


def test_a_gif_keeps_time_to_half_a_hundredth_of_a_second(rolled):
    with Image.open(rolled / "clip.gif") as film:
        ends = np.cumsum([frame.info["duration"] for frame in ImageSequence.Iterator(film)])
    assert np.abs(ends - 1000 * np.arange(1, 5) / 24).max() <= 5


def test_padding_repeats_the_last_column_and_row(rolled):
    found = film_pictures(rolled / "padded.mp4")
    assert {one.shape for one in found} == {(24, 32, 3)}
    edges = (0, 1), (0, 1), (0, 0)
    assert luma_psnr([np.pad(one, edges, mode="edge") for one in pictures(rolled / "small")], found) > 48


@pytest.mark.usefixtures("no_drawing")
def test_what_is_there_is_not_replaced_unasked(clip):
    before = {name: (clip.parent / name).read_bytes() for name in names_in(clip.parent)}
    with pytest.raises(OutputError, match=r"clip\.mp4 is there already: use --overwrite"):
        roll(clip)
    assert {name: (clip.parent / name).read_bytes() for name in names_in(clip.parent)} == before
    clip.unlink()
    with pytest.raises(OutputError, match=r"clip\.mp4\.json is there already: use --overwrite"):
        roll(clip)


def test_overwriting_keeps_the_film_until_the_new_one_is_whole(clip, monkeypatch, caplog):
    before = clip.read_bytes()
    real = one_file.write_film

    def full(file, *arguments):
        real(file, *arguments)
        assert clip.read_bytes() == before
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(one_file, "write_film", full)
    with pytest.raises(FireflyError, match=r"cannot write .*clip\.mp4: No space left on device"):
        roll(clip, overwrite=True, time=77.0)
    assert f"4 of 4 frames are whole in {clip}.frames; to go on, use --resume" in caplog.text
    assert clip.read_bytes() == before
    assert names_in(clip.parent) == ["clip.mp4", "clip.mp4.frames", "clip.mp4.json"]
    with pytest.raises(OutputError, match=r"a capture in .*clip\.mp4\.frames already: use --resume"):
        roll(clip, time=77.0)
    assert earlier_settings(clip) == read_manifest(f"{clip}.frames")["settings"]
    monkeypatch.undo()
    roll(clip, resume=True, time=77.0)
    assert clip.read_bytes() != before
    assert names_in(clip.parent) == ["clip.mp4", "clip.mp4.json"]


@pytest.mark.usefixtures("no_drawing")
def test_a_whole_film_is_not_drawn_again(clip, caplog):
    """Also if an earlier process was killed while it removed the frames."""
    caplog.set_level(logging.INFO)
    left = clip.with_name("clip.mp4.frames")
    left.mkdir()
    (left / "color_000003.png").touch()
    (clip.parent / ".clip.mp4.12-0.part").touch()
    (clip.parent / ".clip.mp4.json.12-0.part").touch()
    (clip.parent / ".other.mp4.12-0.part").touch()
    manifest = roll(clip, resume=True)
    assert manifest == read_manifest(f"{clip}.json")
    assert f"{clip} is whole already" in caplog.text
    assert earlier_settings(clip) == manifest["settings"]
    assert names_in(clip.parent) == [".other.mp4.12-0.part", "clip.mp4", "clip.mp4.json"]


def damage(clip):
    clip.write_bytes(clip.read_bytes()[:-1])


CHANGES = {
    "crf": ({"crf": 30}, None, "crf: None, now 30"),
    "fps": ({"fps": 2.0}, None, "fps: 24.0, now 2.0"),
    "frames": ({"frames": "1:4"}, None, "its frames are others"),
    "scene": ({"parameters": {"bright": 0.5}}, None, "bright: 1.0, now 0.5"),
    "file": ({}, damage, "the file has been changed"),
    "missing": ({}, lambda clip: clip.unlink(), "it is missing"),
}


@pytest.mark.parametrize("case", CHANGES)
def test_another_film_is_drawn_and_the_reason_said(case, clip, caplog):
    options, harm, reason = CHANGES[case]
    if harm is not None:
        harm(clip)
    manifest = roll(clip, resume=True, **options)
    assert f"{clip} is drawn again ({reason})" in caplog.text
    assert manifest["file"]["sha256"] == hashlib.sha256(clip.read_bytes()).hexdigest()
    assert names_in(clip.parent) == ["clip.mp4", "clip.mp4.json"]
    assert len(film_pictures(clip)) == len(manifest["frames"]) == (3 if case == "frames" else 4)


NO_MANIFESTS = {
    "none": (None, r"clip\.mp4\.json is missing: use --overwrite"),
    "nonsense": ("{", r"is not a manifest: .*: use --overwrite"),
    "of something else": ('{"frames": []}', r"is not the manifest of .*clip\.mp4: use --overwrite"),
}


@pytest.mark.usefixtures("no_drawing")
@pytest.mark.parametrize("case", NO_MANIFESTS)
def test_a_film_that_nobody_describes_is_not_replaced_by_resuming(case, clip):
    text, said = NO_MANIFESTS[case]
    path = clip.with_name("clip.mp4.json")
    path.unlink() if text is None else path.write_text(text)
    before = clip.read_bytes()
    with pytest.raises(OutputError, match=said):
        roll(clip, resume=True)
    assert clip.read_bytes() == before


def test_frames_of_an_earlier_run_are_in_no_film_that_did_not_ask_for_them(tmp_path, monkeypatch):
    clip = tmp_path / "clip.apng"

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(one_file, "write_film", stop)
    with pytest.raises(KeyboardInterrupt):
        roll(clip, frames="0:6")
    monkeypatch.undo()
    manifest = roll(clip, frames="1:4", resume=True)
    assert [entry["index"] for entry in manifest["frames"]] == [1, 2, 3]
    assert len(film_pictures(clip)) == 3
    assert names_in(tmp_path) == ["clip.apng", "clip.apng.json"]


def test_a_frame_that_fails_leaves_no_film_and_the_others(tmp_path):
    deadly = {"scene": "tests.capture.deadly:deadly", "fps": 1.0, "time": 4.0, "frames": "0:2"}
    with pytest.warns(UserWarning, match="frame 0 cannot be drawn: no frame 4"):
        manifest = roll(tmp_path / "clip.apng", **deadly)
    assert "file" not in manifest
    assert [entry["index"] for entry in manifest["failed"]] == [0]
    assert names_in(tmp_path) == ["clip.apng.frames"]
    assert names_in(tmp_path / "clip.apng.frames") == ["color_000001.png", "manifest.json"]
    with pytest.warns(UserWarning, match="frame 0 cannot be drawn"):  # it is tried again
        whole = roll(tmp_path / "clip.apng", **(deadly | {"frames": "1:2"}), resume=True)
    assert whole["failed"] == []
    assert len(film_pictures(tmp_path / "clip.apng")) == 1


def test_the_last_shard_makes_the_film(rolled, tmp_path):
    clip = tmp_path / "clip.mp4"
    assert roll(clip, shard="2/5") == Share(1, 0)
    for shard in ("1/5", "4/5"):
        assert isinstance(roll(clip, shard=shard), Share)
    assert names_in(tmp_path) == ["clip.mp4.frames"]
    manifest = roll(clip, shard="3/5")
    assert clip.read_bytes() == (rolled / "clip.mp4").read_bytes()
    assert manifest == read_manifest(rolled / "clip.mp4.json")
    assert roll(clip, shard="5/5") == Share(0, 0)  # which has no frame
    assert roll(clip, shard="1/5", resume=True) == manifest
    assert names_in(tmp_path) == ["clip.mp4", "clip.mp4.json"]


def test_progress_goes_on_while_the_film_is_written(tmp_path):
    calls = []
    roll(tmp_path / "clip.apng", progress=lambda *call: calls.append(call))
    drawn = [(done, 4) for done in range(5)]
    assert calls == drawn + drawn[1:]


def test_the_folder_of_the_frames_stays_if_somebody_uses_it(tmp_path, caplog):
    caplog.set_level(logging.INFO)
    (tmp_path / "clip.apng.frames").mkdir()
    (tmp_path / "clip.apng.frames" / "notes.txt").write_text("mine")
    roll(tmp_path / "clip.apng")
    assert names_in(tmp_path / "clip.apng.frames") == ["notes.txt"]
    assert "clip.apng.frames stays, because notes.txt is in it" in caplog.text


def test_the_manifest_is_json_of_one_line_a_frame(rolled):
    text = (rolled / "clip.mp4.json").read_text()
    assert len(json.loads(text)["frames"]) == text.count('\n    {"index": ') == 4
