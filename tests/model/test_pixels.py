"""Image files of every kind against the samples that they were made of."""

from __future__ import annotations

import io
import struct
import warnings
import zlib

import numpy as np
import pytest
from PIL import Image

from firefly_sample.errors import ModelError
from firefly_sample.model.pixels import GLTF_FORMATS, open_image
from tests.model.png_files import CHANNELS, chunk, png

KINDS = [
    *((0, depth) for depth in (1, 2, 4, 8, 16)),
    *((2, depth) for depth in (8, 16)),
    *((3, depth) for depth in (1, 2, 4, 8)),
    *((4, depth) for depth in (8, 16)),
    *((6, depth) for depth in (8, 16)),
]
SIZE = 11, 13  # width, height: not of whole bytes at any depth, with every pass of interlacing


def opened(data: bytes, formats=GLTF_FORMATS):
    return open_image(data, "image", "image 'a'", 1e6, formats)


def image_size(data: bytes):
    return opened(data).size


def decode_image(data: bytes):
    return opened(data).decode()


def random_samples(color_type: int, depth: int) -> np.ndarray:
    rng = np.random.default_rng(depth * 10 + color_type)
    return rng.integers(0, 2**depth, (SIZE[1], SIZE[0], CHANNELS[color_type]))


def codes(samples: np.ndarray, depth: int) -> np.ndarray:
    """The nearest of 256 codes, in exact arithmetic; halves, which only exact doubles have, go up."""
    top = 2**depth - 1
    return (2 * samples * 255 + top) // (2 * top)


def expected(samples: np.ndarray, color_type: int, depth: int) -> np.ndarray:
    shares = codes(samples, depth)
    pixels = np.full((SIZE[1], SIZE[0], 4), 255)
    if color_type in (4, 6):
        pixels[..., 3] = shares[..., -1]
        shares = shares[..., :-1]
    pixels[..., :3] = shares
    return pixels


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize(("color_type", "depth"), [kind for kind in KINDS if kind[0] != 3])
def test_samples_of_every_depth(color_type, depth, interlaced):
    """To the nearest code; of 16 bits Pillow keeps the high byte, but for grey ones without alpha."""
    samples = random_samples(color_type, depth)
    data = png(samples, color_type, depth, interlaced=interlaced)
    assert image_size(data) == SIZE
    difference = np.abs(decode_image(data).astype(int) - expected(samples, color_type, depth))
    assert difference.max() <= (1 if depth == 16 and color_type else 0)


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize("depth", [1, 2, 4, 8])
def test_a_palette_gives_colour_and_alpha(depth, interlaced):
    samples = random_samples(3, depth)
    colors = np.random.default_rng(depth).integers(0, 256, (2**depth, 4)).astype(np.uint8)
    colors[2**depth // 2 + 1 :, 3] = 255  # a table of alphas may be shorter
    more = (
        chunk(b"PLTE", colors[:, :3].tobytes()),
        chunk(b"tRNS", colors[: 2**depth // 2 + 1, 3].tobytes()),
    )
    data = png(samples, 3, depth, *more, interlaced=interlaced)
    np.testing.assert_array_equal(decode_image(data), colors[samples[..., 0]])


@pytest.mark.parametrize(("color_type", "depth"), [*((0, depth) for depth in (1, 2, 4, 8, 16)), (2, 8)])
def test_one_colour_may_be_transparent(color_type, depth):
    """It is compared in the file's own depth: with 16 bits its neighbours have the same eight high bits."""
    samples = random_samples(color_type, depth)
    key = samples[5, 7].copy()
    samples[5, 8] = key
    if depth == 16:
        samples[2, 2] = key ^ 1
    data = png(samples, color_type, depth, chunk(b"tRNS", key.astype(">u2").tobytes()))
    alpha = decode_image(data)[..., 3]
    np.testing.assert_array_equal(alpha, np.where((samples == key).all(axis=-1), 0, 255))
    assert (alpha == 0).any()


def test_profiles_and_gamma_change_nothing():
    samples = random_samples(2, 8)
    more = chunk(b"gAMA", struct.pack(">I", 100000)), chunk(b"iCCP", b"x\0\0damaged"), chunk(b"sRGB", b"\0")
    np.testing.assert_array_equal(decode_image(png(samples, 2, 8, *more)), expected(samples, 2, 8))


def saved(image: Image.Image, kind: str, **options) -> bytes:
    file = io.BytesIO()
    image.save(file, kind, **options)
    return file.getvalue()


def smooth(mode: str) -> Image.Image:
    """A picture that lossy files keep to a few codes."""
    y, x = np.mgrid[:24, :40] / 40.0
    planes = [255 * x, 255 * y, 255 * (1 - x), 128 * y][: len(Image.new(mode, (1, 1)).getbands())]
    return Image.fromarray(np.stack(planes, axis=-1).astype(np.uint8).squeeze(), mode)


@pytest.mark.parametrize("mode", ["L", "RGB", "CMYK"])
@pytest.mark.parametrize("progressive", [False, True])
def test_jpeg(mode, progressive):
    image = smooth(mode)
    data = saved(image, "JPEG", quality=95, progressive=progressive, subsampling=0)
    assert image_size(data) == (40, 24)
    pixels = decode_image(data)
    assert (pixels[..., 3] == 255).all()
    wanted = np.asarray(image.convert("RGB")).astype(int)
    assert np.abs(pixels[..., :3] - wanted).max() <= (12 if mode == "CMYK" else 6)


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_the_orientation_of_a_camera_is_ignored(orientation):
    """As glTF 2.0 says: the first pixel transferred is the upper left one."""
    exif = Image.Exif()
    exif[0x0112] = orientation
    plain, turned = saved(smooth("RGB"), "JPEG"), saved(smooth("RGB"), "JPEG", exif=exif)
    assert image_size(turned) == (40, 24)
    np.testing.assert_array_equal(decode_image(turned), decode_image(plain))


@pytest.mark.parametrize("options", [{"lossless": True}, {"quality": 90}])
@pytest.mark.parametrize("mode", ["RGB", "RGBA"])
def test_webp(mode, options):
    image = smooth(mode)
    data = saved(image, "WEBP", exact=True, **options)
    assert image_size(data) == (40, 24)
    difference = np.abs(decode_image(data).astype(int) - np.asarray(image.convert("RGBA")))
    assert difference.max() <= (0 if "lossless" in options else 40)
    assert difference.mean() <= (0 if "lossless" in options else 6)


def test_a_size_is_read_from_the_header_alone():
    data = bytearray(png(random_samples(2, 8), 2, 8))
    data[16:24] = struct.pack(">II", 30000, 40000)
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    with pytest.raises(ModelError, match="30000x40000 pixels, more than max_texture_megapixels=64"):
        open_image(bytes(data), "a", "image 'a'", 64.0)
    jpeg = bytearray(saved(smooth("RGB"), "JPEG"))
    place = jpeg.index(b"\xff\xc0") + 5
    jpeg[place : place + 4] = struct.pack(">HH", 60000, 50000)
    assert image_size(bytes(jpeg)) == (50000, 60000)


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_a_file_that_is_cut_short_is_an_error(kind):
    data = saved(smooth("RGB"), kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for keep in (0, 1, 7, 12, 20, 33, len(data) // 2):
            with pytest.raises(ModelError, match=r"image 'a' (cannot be read|is damaged): \S"):
                decode_image(data[:keep])


@pytest.mark.parametrize("data", [b"GIF89a" + bytes(40), b"\xabKTX 20\xbb", b"", saved(smooth("RGB"), "BMP")])
def test_other_kinds_are_refused(data):
    with pytest.raises(ModelError, match=r"its first bytes are .* one of PNG, JPEG, WEBP are expected"):
        opened(data)


def test_pillows_own_limit_plays_no_part(monkeypatch):
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 10)
    for kind in GLTF_FORMATS:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert decode_image(saved(smooth("RGB"), kind)).shape == (24, 40, 4)
    assert Image.MAX_IMAGE_PIXELS == 10
