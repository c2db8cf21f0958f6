"""`compare_captures`: what differs between two real captures, by which limits, and its pictures."""

from __future__ import annotations

import json
import os
import shutil

import numpy as np
import pytest
from PIL import Image

from firefly_sample import compare_captures
from firefly_sample.capture.files import pixel_hash
from firefly_sample.capture.manifest import read_manifest
from firefly_sample.errors import FireflyError
from tests.capture.edits import brighten, edit, edit_image, notes, redraw, texts
from tests.capture.usual_files import encode_image


@pytest.fixture
def pair(captured, tmp_path, monkeypatch):
    """Two equal captures, "ours" and "theirs", in the working folder."""
    for name in ("ours", "theirs"):
        shutil.copytree(captured / "one", tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def compare(**options):
    return compare_captures("ours", "theirs", **options)


def test_equal_captures(pair):
    report = compare(differences="pictures")
    assert (report.ok, report.frames, report.files, report.notes) == (True, 3, 18, [])
    assert not (pair / "pictures").exists()


def test_one_pixel(pair):
    redraw(pair / "theirs", 1, brighten)
    (problem,) = compare().problems
    assert (problem.kind, problem.frame, problem.output, problem.picture) == ("different", 1, "color", None)
    assert problem.figures == {"pixels": 1, "of": 1200, "largest": 2.0, "mean": 2 / 3600, "scale": None}
    for limits in ({"max_codes": 2}, {"max_share": 0.001}):
        report = compare(**limits)
        assert report.ok
        assert notes(report) == ["1 image differs, but within the limits"]
    assert not compare(max_codes=1).ok


def test_a_picture_that_was_edited_is_no_match_for_its_own_manifest(pair):
    """Both manifests say the same, so that only the files can tell."""
    edit_image(pair / "theirs" / "color_000001.png", brighten)
    kinds = [(problem.kind, problem.output) for problem in compare().problems]
    assert kinds == [("changed", "color"), ("different", "color")]
    edit_image(pair / "ours" / "color_000001.png", brighten)
    assert [problem.kind for problem in compare().problems] == ["changed", "changed"]


def test_frames_and_outputs_of_one_side(pair):
    edit(pair / "theirs", lambda manifest: manifest["frames"].pop(0))
    edit(pair / "ours", lambda manifest: manifest["frames"].pop(2))

    def without_depth(manifest):
        for key in ("files", "sha256", "file_sha256"):
            del manifest["frames"][1][key]["depth"]

    edit(pair / "ours", without_depth)
    report = compare()
    assert texts(report) == [
        "frame 0 is only in ours",
        "depth of frame 1 is only in theirs",
        "frame 2 is only in theirs",
    ]
    assert report.frames == 1


def test_many_missing_frames_are_one_line(pair):
    def many(manifest):
        (entry, *_) = manifest["frames"]
        manifest["frames"] = [entry | {"index": index} for index in range(100) if index % 10 not in (3, 4, 7)]

    edit(pair / "ours", many)
    shutil.rmtree("theirs")
    shutil.copytree("ours", "theirs")
    edit(pair / "theirs", lambda manifest: manifest.update(frames=manifest["frames"][:3]))
    assert texts(compare()) == ["frames 5 to 6, 8 to 12, 15 to 16 and 58 more are only in ours"]


def test_a_frame_that_failed_is_not_missing_as_well(pair):
    def fail(manifest):
        del manifest["frames"][1]
        manifest["failed"].append({"index": 1, "time": 5.04, "error": "no lamp"})

    edit(pair / "theirs", fail)
    assert texts(compare()) == ["theirs: frame 1 could not be drawn: no lamp"]


def test_another_driver_and_other_settings_are_notes(pair):
    def describe(manifest):
        manifest["driver"] = "softpipe"
        manifest["settings"]["exposure"] = 2.0
        manifest["parameters"]["reach"] = 9.0

    before = []
    edit(pair / "ours", lambda manifest: before.append(manifest["driver"]))
    edit(pair / "theirs", describe)
    report = compare()
    assert report.ok
    assert set(notes(report)) == {
        f"driver: {before[0]}, now softpipe",
        "reach: 2.5, now 9.0",
        "exposure: 1.0, now 2.0",
    }


def test_another_size(pair):
    path = pair / "theirs"
    with Image.open(path / "color_000000.png") as picture:
        half = np.asarray(picture)[::2, ::2]
    (path / "color_000000.png").write_bytes(encode_image("color", half))
    edit(path, lambda manifest: manifest["frames"][0]["sha256"].update(color=pixel_hash(half)))
    report = compare()
    assert texts(report) == [
        "frame 0: color has 40x30 pixels of 3 x uint8, now 20x15 pixels of 3 x uint8",
    ]
    assert [note.kind for note in report.notes] == ["rewritten"]


def test_ids_with_other_names_are_other_pixels(pair):
    def rename(manifest):
        manifest["id_names"][0] = "root/else"

    edit(pair / "theirs", rename)
    problems = compare().problems
    assert {(problem.kind, problem.output) for problem in problems} == {("different", "id")}
    assert len(problems) == 3

    def swap(manifest):
        manifest["id_names"] = manifest["id_names"][::-1]

    # the same instances with other numbers are the same
    last = len(read_manifest("ours")["id_names"]) - 1
    shutil.rmtree("theirs")
    shutil.copytree("ours", "theirs")
    edit(pair / "theirs", swap)

    def renumber(image):
        image[image >= 0] = last - image[image >= 0]

    for index in range(3):
        redraw(pair / "theirs", index, renumber, "id")
    assert compare().ok


def test_difference_pictures(pair):
    def move(image):
        image[5:9, 5:9] = 99

    for output in ("color", "depth", "id"):
        redraw(pair / "theirs", 2, move, output)
    stale = pair / "pictures" / "difference_color_000000.png"
    stale.parent.mkdir()
    stale.touch()
    (stale.parent / "own.png").touch()
    report = compare(differences="pictures")
    assert [problem.picture for problem in report.problems] == [
        f"pictures/difference_{output}_000002.png" for output in ("color", "depth", "id")
    ]
    assert {path.name for path in stale.parent.iterdir()} == {
        "own.png",
        *(f"difference_{output}_000002.png" for output in ("color", "depth", "id")),
    }
    for problem in report.problems:
        with Image.open(problem.picture) as picture:
            assert picture.mode == "RGB"
            sheet = np.asarray(picture)
        # three panels of 8 x 40 pixels, 8 x 30 high, below two lines; the changed pixels are in the third
        assert sheet.shape == (40 + 240 + 8, 3 * 328 + 8, 3)
        third = sheet[40:280, 664:984]
        marked = (third.max(axis=2) >= 56).reshape(30, 8, 40, 8).all(axis=(1, 3))
        assert marked.sum() == problem.figures["pixels"] > 0
        assert marked[5:9, 5:9].sum() == marked.sum()
    with Image.open("ours/color_000002.png") as picture:
        expected = np.asarray(picture).repeat(8, axis=0).repeat(8, axis=1)
    with Image.open(report.problems[0].picture) as picture:
        assert (np.asarray(picture)[40:280, 8:328] == expected).all()


def test_pictures_that_cannot_be_written_are_an_error(pair):
    redraw(pair / "theirs", 1, brighten)
    (pair / "pictures").touch()
    with pytest.raises(FireflyError, match=r"^cannot write into pictures: "):
        compare(differences="pictures")


def test_reports_are_plain_json(pair):
    redraw(pair / "theirs", 0, lambda image: image.__setitem__((0, 0), 1.0), "depth")
    os.remove("ours/id_000001.npz")
    told = json.loads(json.dumps(compare().as_dict(), allow_nan=False))
    assert told.keys() == {"ok", "folder", "other", "limits", "frames", "files", "problems", "notes"}
    first, second = told["problems"]
    assert first["figures"]["largest"] == "inf"
    assert second["kind"] == "missing"
