"""`verify_capture` and `compare_captures`: each fault of a real capture is named, and nothing else is."""

from __future__ import annotations

import io
import os
import shutil

import numpy as np
import pytest
from PIL import Image

from firefly_sample import compare_captures, verify_capture
from firefly_sample.errors import FireflyError
from tests.capture.edits import brighten, edit, edit_image, notes, redraw, texts
from tests.capture.usual_files import decode_image, encode_image


@pytest.fixture
def one(captured, tmp_path, monkeypatch):
    """A copy of the capture, in "one" of the working folder."""
    shutil.copytree(captured / "one", tmp_path / "one")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "one"


# --- One capture ---


def test_a_whole_capture(one):
    seen = []
    report = verify_capture("one", lambda done, total: seen.append((done, total)))
    assert (report.ok, report.frames, report.files) == (True, 3, 9)
    assert (report.problems, report.notes) == ([], [])
    assert seen == [(1, 3), (2, 3), (3, 3)]
    assert verify_capture(one / "manifest.json").ok


def test_each_faulty_file_is_named(one):
    os.remove(one / "color_000000.png")
    whole = (one / "depth_000000.npz").read_bytes()
    (one / "depth_000000.npz").write_bytes(whole[:-100])
    (one / "id_000000.npz").write_bytes(b"")
    edit_image(one / "color_000001.png", brighten)
    (one / "depth_000001.npz").unlink()
    (one / "depth_000001.npz").mkdir()
    os.remove(one / "id_000001.npz")
    os.mkfifo(one / "id_000001.npz")
    shutil.copy(one / "color_000001.png", one / "color_000002.png")
    (one / "depth_000002.npz").write_bytes(encode_image("id", np.zeros((30, 40), np.int32)))
    report = verify_capture("one")
    assert texts(report) == [
        "one/color_000000.png is missing",
        "one/depth_000000.npz is damaged: it cannot be decoded",
        "one/id_000000.npz is damaged: it is empty",
        "one/color_000001.png has other pixels than its manifest says",
        "one/depth_000001.npz is not a file",
        "one/id_000001.npz is not a file",
        "one/color_000002.png has other pixels than its manifest says",
        "one/depth_000002.npz is damaged: it cannot be decoded",
    ]
    first = report.problems[0]
    assert (first.kind, first.file, first.frame, first.output) == (
        "missing",
        "one/color_000000.png",
        0,
        "color",
    )
    assert report.files == 9


def test_an_image_of_another_shape_with_the_same_bytes_is_another_one(one):
    path = one / "color_000000.png"
    image = decode_image("color", path.read_bytes())
    path.write_bytes(encode_image("color", np.concatenate([image, image[..., :1]], axis=2)))
    assert texts(verify_capture("one")) == ["one/color_000000.png has other pixels than its manifest says"]


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "L", "P"])
def test_the_same_pixels_in_another_file_are_a_note(one, mode):
    def three_greys(image):
        image[:] = np.arange(30)[:, None, None] // 10 * 100

    redraw(one, 1, three_greys)
    path = one / "color_000001.png"
    with Image.open(path) as picture:
        file = io.BytesIO()
        (picture.convert("L") if mode == "P" else picture).convert(mode).save(
            file, format="PNG", compress_level=1
        )
    path.write_bytes(file.getvalue())
    report = verify_capture("one")
    assert report.ok
    assert notes(report) == ["one/color_000001.png is written anew by another program, with the same pixels"]
    assert compare_captures("one", "one").ok


def test_files_that_are_not_in_the_manifest_are_a_note(one):
    for name in (
        "color_000003.png",
        "depth_000004.npz",
        "normal_000000.npz",
        ".color_000000.png.9-1.part",
        "a.png",
    ):
        (one / name).touch()
    edit(one, lambda manifest: manifest["frames"].pop(1))
    report = verify_capture("one")
    assert (report.ok, report.frames) == (True, 2)
    (note,) = report.notes
    first = "one/.color_000000.png.9-1.part, color_000001.png, color_000003.png"
    assert note.text == f"{first} and 4 more are not in the manifest of one"
    assert len(note.files) == 7


def test_frames_that_failed_and_no_frames_at_all_are_problems(one):
    edit(
        one, lambda manifest: manifest["failed"].append({"index": 3, "time": 5.1, "error": "no\x1b[2J lamp"})
    )
    assert texts(verify_capture("one")) == [r"one: frame 3 could not be drawn: no\x1b[2J lamp"]
    edit(one, lambda manifest: manifest.update(frames=[], failed=[]))
    assert texts(verify_capture("one")) == ["one/manifest.json lists no frame"]


def test_an_unfinished_capture_says_how_to_end_it(one, tmp_path):
    (one / "journal.jsonl").touch()
    assert texts(verify_capture("one")) == [
        "the capture in one is not finished, as journal.jsonl shows: "
        "firefly capture with the same options and --resume ends it"
    ]
    os.rename(one / "manifest.json", one / "manifest.previous.json")
    os.rename(one / "journal.jsonl", one / "journal-2-of-8.jsonl")
    with pytest.raises(FireflyError, match="all its shards are done, firefly verify --merge does"):
        verify_capture("one")
    os.remove(one / "journal-2-of-8.jsonl")
    for folder, said in (
        ("one", "one holds no capture: there is no manifest.json"),
        ("none", "there is no folder none"),
        (
            one / "color_000000.png",
            f"{one}/color_000000.png is a file: give the folder of a capture, in which",
        ),
    ):
        with pytest.raises(FireflyError) as caught:
            verify_capture(folder)
        assert str(caught.value).startswith(said)


def test_a_sweep_has_all_its_captures_checked(captured, tmp_path, monkeypatch):
    shutil.copytree(captured / "sweep", tmp_path / "sweep")
    monkeypatch.chdir(tmp_path)
    report = verify_capture("sweep")
    assert (report.ok, report.frames, report.notes) == (True, 4, [])
    os.remove("sweep/reach=2.5/color_000001.png")
    (tmp_path / "sweep/reach=2.0/color_000002.png").touch()
    report = verify_capture("sweep")
    assert texts(report) == ["sweep/reach=2.5/color_000001.png is missing"]
    assert notes(report) == ["sweep/reach=2.0/color_000002.png is not in the manifest of sweep/reach=2.0"]
    report = compare_captures("sweep", captured / "sweep")
    assert texts(report) == ["sweep/reach=2.5/color_000001.png is missing"]
    shutil.copytree(captured / "one", tmp_path / "one")
    assert texts(compare_captures("sweep", "one"))[0] == "reach=2.0: 2 frames are only in sweep"


# --- Damaged and hostile manifests ---


@pytest.mark.parametrize("name", ["../../etc/passwd", "/etc/passwd", "a/../../b.png", "", "a\0b"])
def test_files_outside_the_folder_are_refused_by_name(one, name):
    edit(one, lambda manifest: manifest["frames"][1]["files"].update(color=name))
    (text,) = texts(verify_capture("one"))
    assert text.startswith("one/manifest.json: entry 2 of its frames is damaged: ")
    assert repr(name) in text


def without(key):
    return lambda manifest: manifest["frames"][0].pop(key)


ENTRIES = {
    "no files": (without("files"), "frame 0 has no 'files'"),
    "no hash": (without("sha256"), "frame 0 has no 'sha256'"),
    "no index": (without("index"), "it has no 'index'"),
    "a text": (lambda m: m["frames"].__setitem__(0, "frame"), "it has no 'index'"),
    "a list": (lambda m: m["frames"][0].update(files=[]), "'files' is wrong"),
    "a number": (lambda m: m["frames"][0]["files"].update(color=3), "'files' is wrong"),
    "no digest": (lambda m: m["frames"][0]["sha256"].update(color="abc"), "'abc' is not a SHA-256"),
    "other outputs": (lambda m: m["frames"][0]["sha256"].pop("color"), "do not have the same outputs"),
    "twice": (lambda m: m["frames"].append(m["frames"][2]), "it is not in order"),
    "names": (lambda m: m.update(id_names=3), "'id_names' are not names"),
    "failed": (lambda m: m.update(failed=["?"]), "an entry of 'failed' has no 'index'"),
}


@pytest.mark.parametrize("case", ENTRIES)
def test_damaged_parts_of_a_manifest_are_named(one, case):
    change, said = ENTRIES[case]
    edit(one, change)
    report = verify_capture("one")
    assert {problem.kind for problem in report.problems} == {"manifest"}
    assert said in texts(report)[0]
    assert not compare_captures("one", "one").ok


WHOLES = {
    "no JSON": "{",
    "no object": "[]",
    "no frames": "{}",
    "frames": '{"frames": 3}',
    "captures": '{"captures": 3}',
    "texts": '{"captures": ["frames"]}',
    "outside": '{"captures": [{"folder": "../up", "frames": []}]}',
    "no folder": '{"captures": [{"frames": []}]}',
    "twice": '{"captures": [{"folder": "a", "frames": []}, {"folder": "a", "frames": []}]}',
    "deep": "[" * 100_000,
    "bytes": "\udcff",
}


@pytest.mark.parametrize("case", WHOLES)
def test_a_file_that_is_no_manifest_is_one_line(one, case):
    (one / "manifest.json").write_bytes(WHOLES[case].encode(errors="surrogateescape"))
    with pytest.raises(FireflyError, match=r"^one/manifest\.json is (not a manifest|damaged): ") as caught:
        verify_capture("one")
    assert len(str(caught.value)) < 200


def test_a_line_of_a_frame_that_is_cut_off(one):
    path = one / "manifest.json"
    lines = path.read_text().splitlines()
    place = next(i for i, line in enumerate(lines) if '{"index": 1,' in line)
    lines[place] = lines[place][:100]
    path.write_text("\n".join(lines))
    report = verify_capture("one")
    (text,) = texts(report)
    assert text.startswith("one/manifest.json: entry 2 of its frames is damaged: ")
    assert report.frames == 2


def test_a_manifest_of_version_0_1_0_has_its_pixels_checked(one):
    """Without hashes of files, on several lines, and in any order."""

    def old(manifest):
        for entry in manifest["frames"]:
            del entry["file_sha256"]
        manifest["frames"].reverse()
        later = ("failed", "sources", "size", "outputs", "formats", "quality", "depth_scale", "dataset")
        for key in (*later, "fps", "time", "views"):
            del manifest[key]

    edit(one, old)
    report = verify_capture("one")
    assert (report.ok, report.frames, report.notes) == (True, 3, [])
    edit_image(one / "color_000001.png", brighten)
    assert texts(verify_capture("one")) == ["one/color_000001.png has other pixels than its manifest says"]
