"""Films that are verified: against their manifests, and with other captures of the same frames."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from PIL import Image, ImageSequence

from firefly_sample.capture.merge import merge_capture
from firefly_sample.capture.verify import compare_captures, verify_capture
from firefly_sample.errors import FireflyError, MissingPackageError, OutputError
from tests.capture.edits import edit
from tests.capture.rolled import without

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")


@pytest.fixture
def clip(rolled, tmp_path):
    """A copy of a film without loss, which may be changed."""
    for name in ("clip.apng", "clip.apng.json"):
        shutil.copy(rolled / name, tmp_path)
    return tmp_path / "clip.apng"


def kinds(report):
    return [problem.kind for problem in report.problems]


def saved(path, change):
    """Write a film anew by Pillow."""
    with Image.open(path) as film:
        images = [np.array(frame.convert("RGB")) for frame in ImageSequence.Iterator(film)]
    first, *others = map(Image.fromarray, change(images))
    first.save(path, "PNG", save_all=True, append_images=others, duration=42, compress_level=1)


def brighter(images):
    images[2][5, 5] += 1
    return images


@pytest.mark.parametrize("name", ["clip.apng", "clip.mp4", "clip.apng.json"])
def test_a_film_is_whole(name, rolled):
    report = verify_capture(rolled / name)
    assert (report.ok, report.notes, report.frames, report.files) == (True, [], 4, 1)


def test_a_film_that_another_program_wrote_anew(clip):
    saved(clip, lambda images: images)
    report = verify_capture(clip)
    assert report.ok
    assert [(note.kind, note.files) for note in report.notes] == [("rewritten", (str(clip),))]


def test_a_film_that_was_changed(clip):
    saved(clip, brighter)
    (problem,) = verify_capture(clip).problems
    assert problem.kind == "changed"
    assert problem.text == f"{clip} is another file than its manifest says: it has other pixels"
    saved(clip, lambda images: images[:3])
    (problem,) = verify_capture(clip).problems
    assert problem.text.endswith("it has 3 frames")


def test_a_film_that_is_damaged_missing_or_no_file(clip):
    content = clip.read_bytes()
    clip.write_bytes(content[: len(content) // 2])
    assert kinds(verify_capture(clip)) == ["damaged"]
    assert kinds(compare_captures(clip, clip)) == ["damaged", "damaged"]
    clip.unlink()
    assert kinds(verify_capture(clip)) == ["missing"]
    clip.mkdir()
    with pytest.raises(FireflyError, match=r"holds no capture: there is no manifest\.json"):
        verify_capture(clip)
    assert kinds(verify_capture(f"{clip}.json")) == ["missing"]


def test_a_film_without_a_manifest_or_unfinished(clip):
    folder = clip.with_name("clip.apng.frames")
    folder.mkdir()
    (folder / "journal.jsonl").touch()
    assert kinds(verify_capture(clip)) == ["unfinished"]
    clip.with_name("clip.apng.json").unlink()
    with pytest.raises(
        FireflyError, match=r"clip\.apng is not finished, as .*clip\.apng\.frames shows: .*--resume"
    ):
        verify_capture(clip)
    shutil.rmtree(folder)
    with pytest.raises(FireflyError, match=r"clip\.apng is a file: .* has clip\.apng\.json beside it"):
        verify_capture(clip)
    clip.unlink()
    with pytest.raises(FireflyError, match=r"there is no file .*clip\.apng"):
        verify_capture(clip)


@pytest.mark.parametrize("about", [None, 5, [], {}])
def test_a_film_that_its_manifest_does_not_name_is_not_whole(about, clip):
    edit(clip.parent, lambda manifest: manifest.update(file=about), "clip.apng.json")
    report = verify_capture(clip)
    assert kinds(report) == ["manifest"] * 4
    assert report.problems[0].text.endswith("frame 0: files and hashes do not have the same outputs")


MANIFESTS = {
    "no outputs": (lambda m: m.update(outputs=[]), "is damaged"),
    "no size": (lambda m: m.update(size=3), "is damaged"),
    "no output": (lambda m: m.update(outputs=["smell"], formats={}), "no outputs were asked for"),
}


@pytest.mark.parametrize("case", MANIFESTS)
def test_a_damaged_manifest_of_a_film_is_one_line(case, clip, rolled):
    change, said = MANIFESTS[case]
    edit(clip.parent, change, "clip.apng.json")
    with pytest.raises(FireflyError, match=said) as caught:
        compare_captures(clip, rolled / "color")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("clip.apng", "color"),
        ("color", "clip.webp"),
        ("clip.webp", "clip.apng"),
        ("alpha.apng", "alpha"),
        ("clip.mp4", "clip.mp4"),
    ],
)
def test_films_and_folders_of_the_same_frames_are_the_same(one, other, rolled):
    calls = []
    report = compare_captures(rolled / one, rolled / other, progress=lambda *call: calls.append(call))
    assert (kinds(report), report.frames) == ([], 4)
    assert calls == [] or calls[-1] == (4, 4)


def test_a_lossy_film_is_within_limits(rolled, tmp_path):
    report = compare_captures(rolled / "color", rolled / "clip.mp4", differences=tmp_path)
    assert set(kinds(report)) == {"different"}
    assert all(problem.picture for problem in report.problems)
    largest = max(problem.figures["largest"] for problem in report.problems)
    report = compare_captures(rolled / "color", rolled / "clip.mp4", max_codes=largest)
    assert report.ok
    assert report.notes[-1].text == "4 images differ, but within the limits"


def test_frames_are_joined_by_their_numbers(rolled):
    report = compare_captures(rolled / "color", rolled / "late.apng")
    assert [problem.text for problem in report.problems] == [
        f"frames 0 to 1 are only in {rolled / 'color'}",
        f"frames 4 to 5 are only in {rolled / 'late.apng'}",
    ]


def test_outputs_that_a_film_lacks_are_named(rolled):
    report = compare_captures(rolled / "frames", rolled / "clip.apng")
    assert [problem.text for problem in report.problems] == [
        f"color_alpha of frames 0 to 3 is only in {rolled / 'frames'}"
    ]


def test_a_picture_that_is_missing_beside_a_film(rolled, tmp_path):
    folder = shutil.copytree(rolled / "color", tmp_path / "color")
    (folder / "color_000001.png").unlink()
    (folder / "color_000002.png").write_bytes(b"no picture")
    assert kinds(compare_captures(rolled / "clip.apng", folder)) == ["missing", "damaged"]


def test_a_padded_film_is_compared_without_its_padding(rolled):
    assert set(kinds(compare_captures(rolled / "small", rolled / "padded.mp4"))) == {"different"}
    assert compare_captures(rolled / "small", rolled / "padded.mp4", max_codes=32.0).ok


def test_a_missing_package_is_said_when_frames_are_needed(rolled, monkeypatch):
    without(monkeypatch, "av")
    assert verify_capture(rolled / "clip.mp4").ok
    assert compare_captures(rolled / "clip.mp4", rolled / "clip.mp4").ok
    with pytest.raises(MissingPackageError, match=r"a \.mp4 needs the package av"):
        compare_captures(rolled / "color", rolled / "clip.mp4")


def test_shards_of_a_film_are_not_merged_by_verify(rolled):
    with pytest.raises(OutputError, match=r"clip\.mp4 is one file: firefly capture .* --resume writes it"):
        merge_capture(rolled / "clip.mp4")
