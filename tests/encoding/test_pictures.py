"""PNG, WebP and JPEG, read by a second library, and PNG as other tools write it anew."""

from __future__ import annotations

import io

import av
import imageio.v3 as imageio
import numpy as np
import PIL.Image
import pytest

from firefly_sample.encoding.format import Choices
from firefly_sample.encoding.pictures import Jpeg, Png, WebP
from firefly_sample.errors import OutputError
from tests.encoding.images import assert_same_bits, image_of, psnr, smooth_picture

NONE = Choices()


def by_ffmpeg(content, pixels):
    """The picture of a file as FFmpeg decodes it."""
    with av.open(io.BytesIO(content)) as file:
        (frame,) = file.decode(video=0)
        return frame.format.name, frame.to_ndarray(format=pixels)


@pytest.mark.parametrize("kind", [Png(), WebP()])
@pytest.mark.parametrize(("output", "pixels"), [("color", "rgb24"), ("color_alpha", "rgba")])
def test_other_libraries_read_the_same_codes(kind, output, pixels):
    image = image_of(output)
    content = kind.encode({output: image}, NONE)
    assert_same_bits(by_ffmpeg(content, pixels)[1], image)
    assert_same_bits(imageio.imread(content), image)


@pytest.mark.parametrize("output", ["color", "color_alpha"])
def test_the_bytes_of_png_are_pillows_own(output):
    image = image_of(output)
    file = io.BytesIO()
    PIL.Image.fromarray(image).save(file, format="PNG")
    assert Png().encode({output: image}, NONE) == file.getvalue()


def rewritten(image, mode, **options):
    """The PNG of a picture in another mode."""
    file = io.BytesIO()
    PIL.Image.fromarray(image).convert(mode).save(file, format="PNG", **options)
    return file.getvalue()


def test_pngs_that_tools_have_made_smaller_are_the_same_pictures():
    grey = np.repeat(np.arange(256, dtype=np.uint8).reshape(16, 16, 1), 3, axis=2)
    black = np.where(grey > 100, np.uint8(255), np.uint8(0))
    few = smooth_picture((8, 8))
    for image, mode in ((grey, "L"), (black, "1"), (few, "P"), (grey, "RGBA")):
        content = rewritten(few, "P", colors=64) if mode == "P" else rewritten(image, mode)
        wanted = np.asarray(PIL.Image.open(io.BytesIO(content)).convert("RGB"))
        if mode != "P":  # a palette of Pillow's own has other colours
            assert_same_bits(wanted, image)
        assert_same_bits(Png().decode(content, ("color",), NONE)["color"], wanted)
    opaque = np.dstack([grey, np.full((16, 16), 255, np.uint8)])
    for mode in ("RGB", "L", "LA"):
        decoded = Png().decode(rewritten(opaque, mode), ("color_alpha",), NONE)["color_alpha"]
        assert_same_bits(decoded, opaque)


def test_a_picture_with_holes_is_not_one_without():
    image = image_of("color_alpha")
    decoded = Png().decode(Png().encode({"color": image}, NONE), ("color",), NONE)["color"]
    assert decoded.shape == image.shape


@pytest.mark.parametrize("kind", [Png(), WebP(), Jpeg()])
def test_another_kind_of_picture_is_an_error(kind):
    other = WebP() if kind.name == "png" else Png()
    content = other.encode({"color": image_of("color")}, NONE)
    with pytest.raises(PIL.UnidentifiedImageError):
        kind.decode(content, ("color",), NONE)


@pytest.mark.parametrize(
    ("kind", "quality", "least"),
    [
        # JPEG's table K.1 at 95 has steps of 2 to 12: errors of up to half of 6 on average are 43 dB
        (Jpeg(), None, 40),
        (Jpeg(), 60, 30),
        # what reviewers of WebP call good, with colours of half the resolution
        (WebP(), 90, 33),
    ],
)
def test_pictures_with_loss_are_near(kind, quality, least):
    choices = Choices(quality)
    picture = smooth_picture()
    content = kind.encode({"color": picture}, choices)
    decoded = kind.decode(content, ("color",), choices)["color"]
    assert not kind.is_exact("color", choices)
    assert not np.array_equal(decoded, picture)
    assert psnr(decoded, picture) > least
    # decoders may round differently, and interpolate colours
    assert psnr(by_ffmpeg(content, "rgb24")[1], picture) > least - 3
    assert kind.encode({"color": picture}, choices) == content


def test_jpeg_has_a_colour_for_each_pixel():
    assert by_ffmpeg(Jpeg().encode({"color": smooth_picture()}, NONE), "rgb24")[0] == "yuvj444p"


def test_quality_changes_the_size():
    picture = smooth_picture()
    for kind in (Jpeg(), WebP()):
        sizes = [len(kind.encode({"color": picture}, Choices(quality))) for quality in (20, 60, 98)]
        assert sizes == sorted(sizes)
        assert sizes[0] < sizes[2] / 2


def test_webp_with_loss_keeps_alpha():
    picture = smooth_picture(channels=4)
    content = WebP().encode({"color_alpha": picture}, Choices(80))
    decoded = WebP().decode(content, ("color_alpha",), Choices(80))["color_alpha"]
    assert_same_bits(decoded[..., 3], picture[..., 3])


def test_an_opaque_picture_keeps_four_channels():
    picture = np.full((3, 4, 4), 255, np.uint8)
    for kind in (Png(), WebP()):
        content = kind.encode({"color_alpha": picture}, NONE)
        assert_same_bits(kind.decode(content, ("color_alpha",), NONE)["color_alpha"], picture)


@pytest.mark.parametrize(("kind", "largest"), [(WebP(), 16383), (Jpeg(), 65500)])
def test_the_largest_side(kind, largest):
    for shape in ((1, largest, 3), (largest, 1, 3)):
        content = kind.encode({"color": np.zeros(shape, np.uint8)}, NONE)
        assert kind.decode(content, ("color",), NONE)["color"].shape == shape
    message = (
        rf"^output 'color' has {largest + 1}x1 pixels: a side of a {kind.name} .* {largest}, choose png$"
    )
    with pytest.raises(OutputError, match=message):
        kind.encode({"color": np.zeros((1, largest + 1, 3), np.uint8)}, NONE)
