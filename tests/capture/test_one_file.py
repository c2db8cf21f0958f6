"""Captures that are refused before anything is drawn, and those that become one still picture."""

from __future__ import annotations

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from firefly_sample.capture.verify import verify_capture
from firefly_sample.errors import FireflyError, MissingPackageError, OutputError
from tests.capture.rolled import names_in, no_drawing, roll, without

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")
_ = no_drawing

REFUSED = {
    "alpha in MP4": ("x.mp4", {"outputs": ("color_alpha",)}, "has no alpha.*webp and .apng have alpha"),
    "alpha in GIF": ("x.gif", {"outputs": ("color_alpha",)}, "has one bit of alpha"),
    "alpha in JPEG": ("x.jpg", {"outputs": ("color_alpha",), "frames": 0}, "jpeg cannot hold.*has no alpha"),
    "data in a film": ("x.webm", {"outputs": ("depth",)}, "shows 8-bit pictures.*'depth'"),
    "two outputs": ("x.mp4", {"outputs": ("color", "color_alpha")}, "holds one image.*choose one of them"),
    "two arrays": ("x.npz", {"outputs": ("depth", "id"), "frames": 0}, "holds one image.*choose one of them"),
    "a picture in EXR": ("x.exr", {"outputs": ("color",), "frames": 0}, "exr cannot hold.*'radiance'"),
    "frames in a still": ("x.png", {}, "holds one frame, and 4 are asked for: name a folder, or a film"),
    "a sweep": ("x.mp4", {"sweep": {"bright": [1.0, 2.0]}}, "a sweep has many files.*name a folder"),
    "a data set": ("x.mp4", {"dataset": "nerf"}, "data set nerf has many files.*name a folder"),
    "a format": ("x.mp4", {"formats": "webp"}, "is a film, as its ending says: leave the formats out"),
    "another format": ("x.png", {"formats": "webp", "frames": 0}, "holds png or png16, as its ending says"),
    "odd sides": ("x.mp4", {"size": (31, 24)}, "H.264 needs even sides, not 31x24: .* or --pad"),
    "crf of WebP": ("x.webp", {"crf": 3}, r"crf is for .mp4 and .webm, not for .webp"),
    "crf of a picture": ("x.png", {"crf": 3, "frames": 0}, "--crf is for films"),
    "crf of a still WebP": ("x.webp", {"crf": 3, "frames": 0}, "--crf is for films"),
    "crf of a folder": ("folder", {"crf": 3}, "--crf is for films.*-o clip.mp4"),
    "pad of a folder": ("folder", {"pad": True}, "--pad is for films"),
    "a large crf": ("x.mp4", {"crf": 52}, "crf must be a whole number from 0 to 51"),
    "quality of MP4": ("x.mp4", {"quality": 80}, "quality is for .webp, not for .mp4"),
    "quality of PNG": ("x.png", {"quality": 80, "frames": 0}, "quality is 80, but no output is WebP or JPEG"),
    "scale of a film": ("x.mp4", {"depth_scale": 0.1}, "depth_scale is 0.1, but no output 'depth' is png16"),
    "too fast": ("x.gif", {"fps": 60.0}, "fps must be at most 50"),
    "far too slow": ("x.gif", {"fps": 1e-9}, "fps must be at least 1/600, got 1e-09"),
    "QuickTime": ("x.mov", {}, r"there is no format .mov.*films are .mp4, .*a folder needs a name without"),
    "only an ending": (".mp4", {}, r".mp4 is an ending without a name before it: .* for example clip\.mp4"),
    "TIFF": ("x.tif", {"frames": 0}, r"there is no format .tif.*pictures .png, .jpg"),
}


@pytest.mark.usefixtures("no_drawing")
@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_before_it_is_drawn(case, tmp_path):
    name, options, said = REFUSED[case]
    with pytest.raises(OutputError, match=said) as caught:
        roll(tmp_path / name, **options)
    assert "\n" not in str(caught.value)
    assert names_in(tmp_path) == []


@pytest.mark.usefixtures("no_drawing")
@pytest.mark.parametrize("way", [{}, {"resume": True}, {"overwrite": True}], ids=str)
def test_a_folder_in_the_place_of_a_film(way, tmp_path):
    (tmp_path / "clip.mp4").mkdir()
    with pytest.raises(OutputError, match=r"clip\.mp4 is a folder, and .* becomes one file: move the folder"):
        roll(tmp_path / "clip.mp4", **way)
    assert names_in(tmp_path) == ["clip.mp4"]


@pytest.mark.usefixtures("no_drawing")
def test_a_file_in_the_place_of_the_frames(tmp_path):
    (tmp_path / "clip.mp4.frames").touch()
    with pytest.raises(FireflyError, match=r"cannot write into folder .*clip\.mp4\.frames \(File exists\)"):
        roll(tmp_path / "clip.mp4")


MISSING = {
    "x.mp4": ("av", {}, "a .mp4 needs the package av .* run .*, or choose .webp, .apng, .gif"),
    "x.exr": ("OpenEXR", {"frames": 0}, "EXR files need the package OpenEXR .*: run "),
    "folder": ("OpenEXR", {"outputs": ("depth",), "formats": "exr"}, "EXR files need the package OpenEXR"),
}


@pytest.mark.usefixtures("no_drawing")
@pytest.mark.parametrize("name", MISSING)
def test_a_missing_package_is_said_before_anything_is_drawn(name, tmp_path, monkeypatch):
    package, options, said = MISSING[name]
    without(monkeypatch, package)
    with pytest.raises(MissingPackageError, match=said) as caught:
        roll(tmp_path / name, **options)
    assert "\n" not in str(caught.value)
    assert names_in(tmp_path) == []


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """One frame in a folder, with data in NumPy's files; not to be changed."""
    folder = tmp_path_factory.mktemp("drawn")
    roll(folder / "data", frames=2, outputs=("depth", "id", "radiance"))
    roll(folder / "picture", frames=2)
    return folder


def data(drawn, output):
    return np.load(drawn / "data" / f"{output}_000002.npz")[output]


def still(path, **options):
    """Capture one frame into one file, check that nothing else is left, and return its manifest."""
    manifest = roll(path, frames=2, **options)
    assert names_in(path.parent) == [path.name, f"{path.name}.json"]
    (entry,) = manifest["frames"]
    assert set(entry["files"].values()) == {path.name}
    assert manifest["file"] == {"name": path.name, "sha256": next(iter(entry["file_sha256"].values()))}
    assert verify_capture(path).ok
    return manifest


def test_a_png_and_a_webp_have_the_bits_of_the_frame(drawn, tmp_path):
    expected = np.asarray(Image.open(drawn / "picture" / "color_000002.png"))
    for name in ("one/x.png", "two/x.webp"):
        still(tmp_path / name)
        np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / name)), expected)


def test_the_quality_of_one_webp_counts(tmp_path):
    sizes = []
    for quality in (90, 10):
        path = tmp_path / str(quality) / "x.webp"
        assert still(path, quality=quality)["quality"] == quality
        sizes.append(path.stat().st_size)
    assert sizes[0] > sizes[1]


def test_a_depth_is_png_of_16_bits(drawn, tmp_path):
    """A code is a millimetre: half of it is lost, and nothing where nothing is drawn."""
    path = tmp_path / "depth.png"
    manifest = still(path, outputs=("depth",))
    assert (manifest["formats"], manifest["depth_scale"]) == ({"depth": "png16"}, 0.001)
    with Image.open(path) as picture:
        assert picture.mode == "I;16"
        codes = np.asarray(picture)
    depth = data(drawn, "depth")
    hit = np.isfinite(depth)
    assert hit.any()
    assert (codes[~hit] == 0).all()
    assert np.abs(codes[hit] * 0.001 - depth[hit].astype(float)).max() <= 0.0005 * (1 + 1e-9)


def test_one_exr_has_all_outputs_as_layers(drawn, tmp_path):
    path = tmp_path / "frame.exr"
    manifest = still(path, outputs=("radiance", "depth", "id"))
    assert manifest["formats"] == dict.fromkeys(("radiance", "depth", "id"), "exr")
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    np.testing.assert_array_equal(channels["Z"], data(drawn, "depth"))
    np.testing.assert_array_equal(channels["id.Y"].astype(np.int64) - 1, data(drawn, "id"))
    planes = np.stack([channels[letter] for letter in "RGB"], -1)
    np.testing.assert_array_equal(planes, data(drawn, "radiance"))


def test_one_exr_of_halves_and_the_usual_output(drawn, tmp_path):
    still(tmp_path / "one" / "frame.exr", formats="exr16")
    with OpenEXR.File(str(tmp_path / "one" / "frame.exr"), separate_channels=True) as file:
        red = file.channels()["R"].pixels
    assert red.dtype == np.float16
    np.testing.assert_array_equal(red, data(drawn, "radiance")[..., 0].astype(np.float16))


def test_one_npz_and_one_jpeg(drawn, tmp_path):
    still(tmp_path / "one" / "x.npz")
    np.testing.assert_array_equal(np.load(tmp_path / "one" / "x.npz")["depth"], data(drawn, "depth"))
    still(tmp_path / "two" / "x.JPG", quality=100)
    expected = np.asarray(Image.open(drawn / "picture" / "color_000002.png")).astype(int)
    found = np.asarray(Image.open(tmp_path / "two" / "x.JPG"))
    assert np.abs(found - expected).max() <= 4
