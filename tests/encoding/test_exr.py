"""OpenEXR files: layers by name and type, half floats, FFmpeg's reading, and what does not fit."""

from __future__ import annotations

import io
import sys

import av
import numpy as np
import OpenEXR
import pytest

from firefly_sample.encoding.exr import Exr, Exr16, channel_names, encode_layers
from firefly_sample.encoding.format import Choices
from firefly_sample.errors import MissingPackageError, OutputError
from firefly_sample.frame import OUTPUTS
from tests.encoding.images import FLOATS, assert_same_bits, image_of

NONE = Choices()
HELD = [output for output in OUTPUTS if not Exr().refusal(output)]


def small_image_of(output):
    """An image whose floats a half can hold."""
    image = image_of(output)
    if image.dtype == np.float32:
        image[np.isfinite(image) & (np.abs(image) > 65504)] = 65504
    return image


def by_ffmpeg(content, layer=""):
    """The planes of a layer as FFmpeg decodes them."""
    with av.open(io.BytesIO(content), format="exr_pipe") as file:
        file.streams.video[0].codec_context.options = {"layer": layer} if layer else {}
        (frame,) = file.decode(video=0)
        dtype = {"gbrpf32le": np.float32, "grayf32le": np.float32, "gbrpf16le": np.float16}[frame.format.name]
        planes = [
            np.frombuffer(plane, dtype).reshape(frame.height, -1)[:, : frame.width] for plane in frame.planes
        ]
    return planes[0] if len(planes) == 1 else np.stack([planes[2], planes[0], planes[1]], axis=-1)


def test_every_output_has_a_channel_for_each_number():
    data = [output for output, info in OUTPUTS.items() if info.dtype != "uint8"]
    assert [output for output in data if "atlas" not in output] == HELD
    names = [name for output in HELD for name in channel_names(output)]
    assert len(set(names)) == len(names) == sum(OUTPUTS[output].channels for output in HELD)
    assert channel_names("radiance") == ("R", "G", "B")
    assert channel_names("depth") == ("Z",)
    assert channel_names("normal_world") == ("normal_world.X", "normal_world.Y", "normal_world.Z")
    # Blender reads no channel whose last part is longer
    assert all(len(name.split(".")[-1]) == 1 for name in names)


def test_openexr_finds_the_layers():
    images = {output: small_image_of(output) for output in HELD}
    content = encode_layers(images, ["albedo"])
    with OpenEXR.File(io.BytesIO(content), separate_channels=True) as file:
        header = dict(file.header())
        assert len(file.parts) == 1
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION
    for window in ("dataWindow", "displayWindow"):
        assert [corner.tolist() for corner in header[window]] == [[0, 0], [23, 15]]
    # nothing in it depends on the day
    assert header.keys() == {
        *("channels", "compression", "dataWindow", "displayWindow", "lineOrder"),
        *("pixelAspectRatio", "screenWindowCenter", "screenWindowWidth", "type"),
    }
    assert channels.keys() == {name for output in HELD for name in channel_names(output)}
    for name, plane in channels.items():
        output = {"R": "radiance", "G": "radiance", "B": "radiance", "Z": "depth"}.get(
            name, name.split(".")[0]
        )
        whole = OUTPUTS[output].dtype == "int32"
        assert plane.dtype == ("uint32" if whole else "float16" if output == "albedo" else "float32")
    assert_same_bits(channels["G"], images["radiance"][..., 1].copy())
    assert_same_bits(channels["Z"], images["depth"])
    assert_same_bits(channels["normal.Z"], images["normal"][..., 2].copy())
    assert channels["id.Y"].ravel()[:4].tolist() == [0, 1, 2, 255]
    assert channels["visibility.Y"].ravel()[0] == images["visibility"][0, 0, 1] + 1
    assert channels["overdraw.Y"].ravel()[2] == images["overdraw"].ravel()[2]


def test_ffmpeg_reads_the_same_floats():
    images = {output: image_of(output) for output in HELD}
    content = Exr().encode(images, NONE)
    assert_same_bits(by_ffmpeg(content), images["radiance"])
    for output in ("albedo", "normal", "position_world", "shininess"):
        assert_same_bits(by_ffmpeg(content, output), images[output])


def test_ffmpeg_reads_the_same_halves():
    images = {output: small_image_of(output) for output in HELD}
    content = Exr16().encode(images, NONE)
    decoded = Exr16().decode(content, ("radiance", "emission"), NONE)
    for layer, output in (("", "radiance"), ("emission", "emission")):
        halves = by_ffmpeg(content, layer)
        assert halves.dtype == np.float16
        assert_same_bits(halves.astype(np.float32), decoded[output])


def test_halves_are_the_nearest():
    known = {
        0.0: 0.0,
        65504.0: 65504.0,
        -65519.0: -65504.0,  # the next half would be 65536
        1 + 2**-11: 1.0,  # a tie goes to the even one
        1 + 3 * 2**-11: 1 + 2**-9,
        2**-24: 2**-24,  # the smallest
        2**-26: 0.0,
        np.inf: np.inf,
        -np.inf: -np.inf,
    }
    depth = np.array([[*known, np.nan, -0.0]], np.float32)
    decoded = Exr16().decode(Exr16().encode({"depth": depth}, NONE), ("depth",), NONE)["depth"]
    assert decoded.dtype == np.float32
    assert decoded[0, :-2].tolist() == list(known.values())
    assert np.isnan(decoded[0, -2])
    assert np.signbit(decoded[0, -1])


@pytest.mark.parametrize("number", [65520, -1e6, 3.4e38])
def test_a_float_beyond_halves_is_an_error(number):
    image = np.zeros((4, 5, 3), np.float32)
    image[1, 2, 0], image[0, 0, 0] = number, np.inf
    with pytest.raises(OutputError) as caught:
        encode_layers({"radiance": image, "normal": image}, ["normal"])
    assert str(caught.value) == (
        f"output 'normal' has the value {number:.6g}, and exr16 ends at 65504: choose exr"
    )
    for output in ("radiance", "normal"):
        decoded = Exr().decode(Exr().encode({output: image}, NONE), (output,), NONE)
        assert_same_bits(decoded[output], image)


@pytest.mark.parametrize(("output", "least"), [("id", -1), ("visibility", -1), ("overdraw", 0)])
def test_a_number_below_the_least_is_an_error(output, least):
    image = np.full_like(image_of(output), least - 1)
    with pytest.raises(
        OutputError, match=rf"'{output}' has the value {least - 1}, and exr begins at {least}"
    ):
        Exr().encode({output: image}, NONE)


def test_images_that_are_views_of_others():
    """The library takes the memory behind an array and ignores its strides."""
    image = image_of("radiance", (8, 6))
    turned = image[::-1, ::2]
    decoded = Exr().decode(Exr().encode({"radiance": turned}, NONE), ("radiance",), NONE)
    assert_same_bits(decoded["radiance"], np.ascontiguousarray(turned))


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (300, 1)])
def test_narrow_pictures(size):
    images = {output: image_of(output, (max(size[0], len(FLOATS)), max(size[1], 1))) for output in ("depth",)}
    images = {output: image[: size[1], : size[0]] for output, image in images.items()}
    decoded = Exr().decode(Exr().encode(images, NONE), ("depth",), NONE)["depth"]
    assert_same_bits(decoded, np.ascontiguousarray(images["depth"]))


def test_a_layer_that_is_missing_or_of_another_type_is_an_error():
    content = encode_layers({"depth": image_of("depth")}, ())
    with pytest.raises(KeyError, match=r"id\.Y"):
        Exr().decode(content, ("id",), NONE)
    for name, pixels, output in (("Z", np.uint32, "depth"), ("id.Y", np.float32, "id")):
        file = io.BytesIO()
        OpenEXR.File({}, {name: np.zeros((4, 4), pixels)}).write(file)
        with pytest.raises(ValueError, match=f"the channels of {output} are {pixels.__name__}"):
            Exr().decode(file.getvalue(), (output,), NONE)


def test_damaged_files_print_nothing_to_the_standard_output(capfd):
    content = Exr().encode({"radiance": image_of("radiance", (64, 48))}, NONE)
    for damaged in (content[:500], content[:-100], content[:-1]):
        with pytest.raises((ValueError, RuntimeError)):
            Exr().decode(damaged, ("radiance",), NONE)
    assert capfd.readouterr().out == ""


def test_without_the_package(monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    for call in (
        Exr().require,
        lambda: Exr().encode({"depth": image_of("depth")}, NONE),
        lambda: Exr16().decode(b"", ("depth",), NONE),
    ):
        with pytest.raises(MissingPackageError, match=r"^EXR files need the package OpenEXR .*: run .*pip"):
            call()
