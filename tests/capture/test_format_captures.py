"""Captures in each format: read back by other libraries, verified, damaged, and compared with each other."""

from __future__ import annotations

import hashlib
import io
import shutil

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from firefly_sample.capture.manifest import read_manifest
from firefly_sample.capture.verify import compare_captures, verify_capture
from firefly_sample.errors import MissingPackageError, OutputError
from tests.capture.rolled import names_in, pictures, roll, without

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")
DATA = ("depth", "id", "radiance", "normal")
TWO = {"frames": "1:3"}


@pytest.fixture(scope="module")
def formats(tmp_path_factory):
    """The same two frames in many formats; not to be changed."""
    folder = tmp_path_factory.mktemp("formats")
    for name in ("png", "webp", "jpeg"):
        roll(folder / name, formats=name, **TWO)
    for name in ("npz", "exr", "exr16"):
        roll(folder / name, formats=name, outputs=DATA, **TWO)
    roll(folder / "png16", formats="png16", outputs=("depth", "id"), **TWO)
    return folder


@pytest.fixture
def copied(formats, tmp_path):
    """``copied(name)`` gives a copy of a capture, which may be changed."""
    return lambda name: shutil.copytree(formats / name, tmp_path / name)


def data(formats, output, index=1):
    return np.load(formats / "npz" / f"{output}_{index:06d}.npz")[output]


def channels(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


def kinds(report):
    return [problem.kind for problem in report.problems]


@pytest.mark.parametrize(
    ("name", "files"),
    [("png", 2), ("webp", 2), ("jpeg", 2), ("npz", 8), ("exr", 2), ("exr16", 2), ("png16", 4)],
)
def test_a_capture_in_each_format_is_whole(name, files, formats):
    report = verify_capture(formats / name)
    assert (report.ok, report.notes, report.frames, report.files) == (True, [], 2, files)
    assert len(names_in(formats / name)) == files + 1


def test_webp_has_the_bits_of_png(formats):
    np.testing.assert_array_equal(pictures(formats / "webp"), pictures(formats / "png"))
    report = compare_captures(formats / "png", formats / "webp")
    assert report.ok
    assert [note.text for note in report.notes] == ["format of color: png, now webp"]


def test_layers_of_an_exr_are_the_outputs(formats):
    found = channels(formats / "exr" / "layers_000001.exr")
    np.testing.assert_array_equal(found["Z"], data(formats, "depth"))
    np.testing.assert_array_equal(found["id.Y"].astype(np.int64) - 1, data(formats, "id"))
    for letters, output in ((("R", "G", "B"), "radiance"), (("normal.X", "normal.Y", "normal.Z"), "normal")):
        np.testing.assert_array_equal(np.stack([found[one] for one in letters], -1), data(formats, output))
    assert compare_captures(formats / "npz", formats / "exr").ok


def test_halves_of_an_exr_are_the_outputs_rounded(formats):
    found = channels(formats / "exr16" / "layers_000001.exr")
    np.testing.assert_array_equal(found["Z"], data(formats, "depth").astype(np.float16))
    np.testing.assert_array_equal(found["id.Y"].astype(np.int64) - 1, data(formats, "id"))
    # a half has 11 bits: it is off by at most 2**-12 of a number, and no number here is above the scale
    assert not compare_captures(formats / "npz", formats / "exr16").ok
    report = compare_captures(formats / "npz", formats / "exr16", max_error=2.0**-11)
    assert report.ok
    assert "images differ, but within the limits" in [note.text for note in report.notes][-1]


def test_png16_holds_ids_and_depths_to_half_a_code(formats):
    codes = np.asarray(Image.open(formats / "png16" / "id_000001.png")).astype(int)
    np.testing.assert_array_equal(codes - 1, data(formats, "id"))
    codes = np.asarray(Image.open(formats / "png16" / "depth_000001.png"))
    depth = data(formats, "depth").astype(float)
    hit = np.isfinite(depth)
    assert (codes[~hit] == 0).all()
    assert np.abs(codes[hit] * 0.001 - depth[hit]).max() <= 0.0005 * (1 + 1e-9)
    report = compare_captures(formats / "npz", formats / "png16")
    assert {problem.output for problem in report.problems} == {"depth", "radiance", "normal"}
    assert {problem.kind for problem in report.problems} == {"different", "only"}


def test_the_hash_in_a_manifest_is_that_of_what_a_jpeg_decodes_to(formats):
    for entry in read_manifest(formats / "jpeg")["frames"]:
        decoded = np.asarray(Image.open(formats / "jpeg" / entry["files"]["color"]))
        assert entry["sha256"]["color"] == hashlib.sha256(decoded.tobytes()).hexdigest()
    assert set(kinds(compare_captures(formats / "png", formats / "jpeg"))) == {"different"}
    off = np.abs(np.stack(pictures(formats / "jpeg")).astype(int) - np.stack(pictures(formats / "png"))).max()
    assert 0 < off < 32
    assert compare_captures(formats / "png", formats / "jpeg", max_codes=float(off)).ok
    assert not compare_captures(formats / "png", formats / "jpeg", max_codes=float(off - 1)).ok


def as_picture(change=lambda pixels: pixels, **options):
    def write(path):
        image = change(np.array(Image.open(path)))
        Image.fromarray(image).save(path, **options)

    return write


def as_exr(change=lambda pixels: pixels):
    def write(path):
        content = channels(path)
        header = {"compression": OpenEXR.PIZ_COMPRESSION, "type": OpenEXR.scanlineimage}
        content["Z"] = change(content["Z"])
        with OpenEXR.File(header, content) as file:
            file.write(str(path))

    return write


def one_more(pixels):
    pixels[5, 5] = pixels[5, 5] + 1 if np.isfinite(pixels[5, 5]).all() else 7
    return pixels


FIRST = {
    "png": "color_000001.png",
    "webp": "color_000001.webp",
    "exr": "layers_000001.exr",
    "png16": "depth_000001.png",
}
REWRITTEN = {
    "png": as_picture(compress_level=1),
    "webp": as_picture(lossless=True, exact=True, method=6),
    "exr": as_exr(),
    "png16": as_picture(compress_level=1),
}
CHANGED = {
    "png": as_picture(one_more),
    "webp": as_picture(one_more, lossless=True, exact=True),
    "exr": as_exr(one_more),
    "png16": as_picture(one_more),
}


@pytest.mark.parametrize("name", REWRITTEN)
def test_a_file_that_another_program_wrote_anew_is_a_note(name, copied):
    folder = copied(name)
    before = (folder / FIRST[name]).read_bytes()
    REWRITTEN[name](folder / FIRST[name])
    assert (folder / FIRST[name]).read_bytes() != before
    report = verify_capture(folder)
    assert report.ok
    assert [(note.kind, note.files) for note in report.notes] == [("rewritten", (str(folder / FIRST[name]),))]


@pytest.mark.parametrize("name", CHANGED)
def test_a_changed_pixel_is_found(name, copied):
    folder = copied(name)
    CHANGED[name](folder / FIRST[name])
    (problem,) = verify_capture(folder).problems
    assert (problem.kind, problem.frame) == ("changed", 1)
    if name == "exr":
        assert problem.output == "depth"
        assert problem.text.endswith("layers_000001.exr: depth has other pixels than its manifest says")


def test_another_quality_of_a_jpeg_is_found(copied):
    folder = copied("jpeg")
    as_picture(quality=50)(folder / "color_000001.jpg")
    assert kinds(verify_capture(folder)) == ["changed"]


def test_a_file_with_layers_is_missing_or_damaged_once(copied):
    folder = copied("exr")
    (folder / "layers_000001.exr").unlink()
    path = folder / "layers_000002.exr"
    path.write_bytes(path.read_bytes()[:-200])
    first, second = verify_capture(folder).problems
    assert (first.kind, first.frame, first.output) == ("missing", 1, None)
    assert (second.kind, second.frame, second.output) == ("damaged", 2, None)
    assert len(compare_captures(folder, folder).problems) == 4  # two of each side


def test_resuming_draws_just_the_damaged_layers_again(copied, formats):
    folder = copied("exr")
    (folder / "layers_000001.exr").write_bytes(b"no picture")
    calls = []
    roll(folder, formats="exr", outputs=DATA, **TWO, resume=True, progress=lambda *call: calls.append(call))
    assert calls == [(1, 2), (2, 2)]
    for name in names_in(folder):
        assert (folder / name).read_bytes() == (formats / "exr" / name).read_bytes()


def test_a_missing_package_is_not_a_damage(copied, monkeypatch):
    folder = copied("exr")
    without(monkeypatch, "OpenEXR")
    assert verify_capture(folder).ok  # the hashes of the files suffice
    path = folder / "layers_000001.exr"
    path.write_bytes(path.read_bytes() + b"\0")
    with pytest.raises(MissingPackageError, match="EXR files need the package OpenEXR"):
        verify_capture(folder)


def test_a_missing_package_is_said_when_pixels_are_compared(formats, monkeypatch):
    without(monkeypatch, "OpenEXR")
    with pytest.raises(MissingPackageError, match="EXR files need the package OpenEXR"):
        compare_captures(formats / "exr", formats / "exr16")


def test_a_depth_that_does_not_fit_names_frame_and_way_out(tmp_path):
    with pytest.raises(
        OutputError, match=r"^frame 1: output 'depth': the largest depth is .* set depth_scale"
    ):
        roll(tmp_path / "x", formats="png16", outputs=("depth",), depth_scale=1e-6, **TWO, fail_fast=True)
    assert names_in(tmp_path) == []


def test_a_picture_of_an_npz_is_read_by_numpy_alone(formats):
    content = io.BytesIO((formats / "npz" / "id_000001.npz").read_bytes())
    assert np.load(content, allow_pickle=False)["id"].dtype == np.int32
