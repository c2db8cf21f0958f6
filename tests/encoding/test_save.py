"""Frames that save themselves."""

from __future__ import annotations

import numpy as np
import PIL.Image
import pytest

from firefly_sample.encoding.exr import Exr
from firefly_sample.encoding.format import Choices
from firefly_sample.encoding.png16 import Png16
from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.frame import Frame, LightCounts
from tests.encoding.images import assert_same_bits, image_of
from tests.scenes import plain_camera


def frame_of(*outputs):
    images = {output: image_of(output) for output in outputs}
    if "depth" in images:
        images["depth"] = np.full_like(images["depth"], 2.5)
    return Frame(
        images=images,
        time=0.0,
        size=(24, 16),
        camera=plain_camera((24, 16)),
        milliseconds={},
        lights=LightCounts(0, 0, 0),
        driver="none",
        software=True,
    )


@pytest.mark.parametrize(
    ("outputs", "output", "written"),
    [
        (("depth", "color_alpha", "color"), None, "color"),
        (("depth", "color_alpha", "volumes"), None, "color_alpha"),
        (("wireframe",), None, "wireframe"),
        (("color", "wireframe"), "wireframe", "wireframe"),
    ],
)
@pytest.mark.parametrize("suffix", ["png", "webp", "PNG"])
def test_a_picture(tmp_path, outputs, output, written, suffix):
    frame = frame_of(*outputs)
    path = tmp_path / f"frame.{suffix}"
    frame.save(path, output)
    assert [found.name for found in tmp_path.iterdir()] == [path.name]
    with PIL.Image.open(path) as picture:
        assert_same_bits(np.asarray(picture), frame[written])


@pytest.mark.parametrize("suffix", ["jpg", "jpeg", "webp"])
def test_quality(tmp_path, suffix):
    frame = frame_of("color")
    for quality in (10, 90):
        frame.save(str(tmp_path / f"a{quality}.{suffix}"), quality=quality)
    small, large = ((tmp_path / f"a{quality}.{suffix}").stat().st_size for quality in (10, 90))
    assert small < large


def test_depth_and_ids_as_png(tmp_path):
    frame = frame_of("color", "depth", "id")
    frame.images["id"] = frame["id"].clip(-1, 65534)
    frame.save(tmp_path / "depth.png", "depth", depth_scale=0.01)
    frame.save(tmp_path / "id.png", "id")
    with PIL.Image.open(tmp_path / "depth.png") as picture:
        assert np.unique(np.asarray(picture)).tolist() == [250]
    decoded = Png16().decode((tmp_path / "id.png").read_bytes(), ("id",), Choices())
    assert_same_bits(decoded["id"], frame["id"])


def test_all_data_in_one_file(tmp_path):
    frame = frame_of("color", "radiance", "depth", "id", "normal")
    frame.save(tmp_path / "frame.npz")
    frame.save(tmp_path / "frame.exr")
    data = ("radiance", "depth", "id", "normal")
    with np.load(tmp_path / "frame.npz") as arrays:
        assert tuple(arrays) == data
        for output in data:
            assert_same_bits(arrays[output], frame[output])
    for output, image in Exr().decode((tmp_path / "frame.exr").read_bytes(), data, Choices()).items():
        assert_same_bits(image, frame[output])
    frame.save(tmp_path / "one.npz", "normal")
    with np.load(tmp_path / "one.npz") as arrays:
        assert tuple(arrays) == ("normal",)


@pytest.mark.parametrize(
    ("outputs", "name", "options", "message"),
    [
        (
            ["color"],
            "a.tif",
            {},
            r"a.tif: the suffix '.tif' is .*: choose .png, .webp, .jpg, .jpeg, .npz, .exr$",
        ),
        (["color"], "a", {}, r"the suffix '' is no picture's or data's"),
        (["color"], "a.png", {"output": "depth"}, r"this frame has no 'depth'"),
        (["color"], "a.png", {"output": "colour"}, r"did you mean 'color'"),
        (
            ["color"],
            "a.npz",
            {},
            r"a.npz: npz is for .*, and this frame has only color: choose .png, or render",
        ),
        (
            ["color"],
            "a.exr",
            {"output": "color"},
            r"exr cannot hold the output 'color': .*; choose .png, .webp",
        ),
        (
            ["color_alpha"],
            "a.jpg",
            {},
            r"jpeg cannot hold .*'color_alpha': it has no alpha; choose .png, .webp$",
        ),
        (["normal"], "a.png", {}, r"png cannot hold the output 'normal': .*; choose .npz, .exr$"),
        (["normal"], "a.webp", {}, r"webp cannot hold the output 'normal': .*; choose .npz, .exr$"),
        (["depth", "shadow_atlas"], "a.exr", {}, r"cannot hold the output 'shadow_atlas': .*; choose .npz$"),
        (
            ["depth", "id"],
            "a.exr",
            {"output": ["depth", "id"]},
            r"a.exr: the output is one name, or None for all that fit, got \['depth', 'id'\]$",
        ),
        (["depth", "id"], "a.png", {}, r"a.png: name the output to save, one of depth, id$"),
        (["color"], "a.png", {"quality": 50}, r"quality is 50, but no output is WebP or JPEG"),
        (["depth"], "a.npz", {"depth_scale": 1.0}, r"depth_scale is 1, but no output 'depth' is png16"),
        (
            ["depth"],
            "a.png",
            {"depth_scale": 1e-6},
            r"'depth': the largest depth is 2.5, .* set depth_scale to",
        ),
    ],
)
def test_what_is_refused(tmp_path, outputs, name, options, message):
    with pytest.raises(OutputError, match=message):
        frame_of(*outputs).save(tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_written_leaves_nothing(tmp_path):
    frame = frame_of("color")
    with pytest.raises(FireflyError, match=r"^cannot write .*missing.*: No such file or directory$"):
        frame.save(tmp_path / "missing" / "a.png")
    (tmp_path / "a.png").mkdir()
    with pytest.raises(FireflyError, match=r"^cannot write .*a.png: Is a directory$"):
        frame.save(tmp_path / "a.png")
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
