"""Image files of every kind against the samples that they were made of."""

from __future__ import annotations

import io
import struct
import warnings

import numpy as np
import pytest
from PIL import Image

from firefly_sample.model.gltf.pixels import decode_image, image_kind, image_size
from tests.model.png_files import CHANNELS, chunk, png

KINDS = [
    *((0, depth) for depth in (1, 2, 4, 8, 16)),
    *((2, depth) for depth in (8, 16)),
    *((3, depth) for depth in (1, 2, 4, 8)),
    *((4, depth) for depth in (8, 16)),
    *((6, depth) for depth in (8, 16)),
]
SIZE = 11, 13  # width, height: not of whole bytes at any depth, with every pass of interlacing


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
def test_samples_of_every_depth_are_rounded_once(color_type, depth, interlaced):
    samples = random_samples(color_type, depth)
    data = png(samples, color_type, depth, interlaced=interlaced)
    assert image_size(data) == SIZE
    np.testing.assert_array_equal(decode_image(data), expected(samples, color_type, depth))


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


def test_an_index_beyond_the_palette_is_opaque_black():
    data = png(np.array([[[0], [1], [2]]]), 3, 2, chunk(b"PLTE", bytes([9, 8, 7])))
    np.testing.assert_array_equal(decode_image(data)[0], [(9, 8, 7, 255), (0, 0, 0, 255), (0, 0, 0, 255)])


@pytest.mark.parametrize(("color_type", "depth"), [kind for kind in KINDS if kind[0] in (0, 2)])
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


@pytest.mark.parametrize(("color_type", "depth"), [kind for kind in KINDS if kind[0] != 3 and kind[1] <= 8])
def test_pillow_agrees_where_it_is_exact(color_type, depth):
    """A second program; it drops the low bytes of 16-bit samples."""
    data = png(random_samples(color_type, depth), color_type, depth, interlaced=True)
    np.testing.assert_array_equal(
        decode_image(data), np.asarray(Image.open(io.BytesIO(data)).convert("RGBA"))
    )


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
    assert (image_kind(data), image_size(data)) == ("JPEG", (40, 24))
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
    assert (image_kind(data), image_size(data)) == ("WebP", (40, 24))
    difference = np.abs(decode_image(data).astype(int) - np.asarray(image.convert("RGBA")))
    assert difference.max() <= (0 if "lossless" in options else 40)
    assert difference.mean() <= (0 if "lossless" in options else 6)


def test_sizes_are_read_from_headers_alone():
    data = bytearray(png(random_samples(2, 8), 2, 8))
    data[16:24] = struct.pack(">II", 2**30, 3)
    assert image_size(bytes(data)) == (2**30, 3)
    jpeg = bytearray(saved(smooth("RGB"), "JPEG"))
    place = jpeg.index(b"\xff\xc0") + 5
    jpeg[place : place + 4] = struct.pack(">HH", 60000, 50000)
    assert image_size(bytes(jpeg)) == (50000, 60000)


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_a_file_that_is_cut_short_is_an_error(kind):
    data = saved(smooth("RGB"), kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for keep in (0, 1, 7, 12, 20, 33, len(data) // 2, len(data) - 20):
            with pytest.raises(ValueError, match=r"\w"):
                decode_image(data[:keep])


def test_a_changed_byte_of_a_png_is_an_error():
    data = png(random_samples(2, 8), 2, 8)
    for place in range(8, len(data) - 12, 7):
        changed = bytearray(data)
        changed[place] ^= 0x10
        with pytest.raises(ValueError, match=r"\w"):
            decode_image(bytes(changed))


@pytest.mark.parametrize(
    ("data", "found"), [(b"GIF89a" + bytes(40), "GIF"), (b"\xabKTX 20\xbb", "KTX 2"), (b"", "b''")]
)
def test_other_kinds_are_named(data, found):
    with pytest.raises(ValueError, match=f"{found}.*not PNG, JPEG or WebP"):
        image_kind(data)


def test_pillows_own_limit_plays_no_part(monkeypatch):
    """But for WebP, whose largest images, of 268 megapixels, are above it."""
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 10)
    for data in (png(random_samples(2, 8), 2, 8), saved(smooth("RGB"), "JPEG")):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert decode_image(data).ndim == 3
