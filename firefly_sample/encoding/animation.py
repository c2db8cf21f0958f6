"""Animated WebP, APNG and GIF: each frame is encoded by Pillow, and put into its container here.

Pillow's own writers of animations keep all frames in memory until the end, and merge equal ones, so that a
reader counts fewer. Here a frame is written when it comes, and each frame of the film is a frame of the file.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterable, Iterator
from fractions import Fraction
from itertools import count
from pathlib import Path
from typing import IO, Any

import numpy as np

from firefly_sample.encoding.film import Pixels
from firefly_sample.errors import FireflyError


def write_animation(
    file: IO[bytes],
    suffix: str,
    frames: Iterable[Pixels],
    size: tuple[int, int],
    rate: Fraction,
    quality: int | None,
) -> None:
    """Write frames of shape (height, width, 3 or 4) into an empty file; they are repeated for ever."""
    if suffix == ".webp":
        _write_webp(file, frames, size, rate, quality)
    elif suffix == ".apng":
        _write_apng(file, frames, rate)
    else:
        _write_gif(file, frames, size, rate)


def read_animation(path: Path) -> Iterator[Pixels]:
    """Yield the frames of an animation: RGB where a frame is opaque, else RGBA."""
    import PIL.Image
    import PIL.ImageSequence

    with PIL.Image.open(path) as film:
        for picture in PIL.ImageSequence.Iterator(film):
            rgba = np.asarray(picture.convert("RGBA"))
            yield rgba if (rgba[..., 3] != 255).any() else rgba[..., :3]


def animation_facts(path: Path) -> tuple[int, tuple[int, int], Fraction, str]:
    """Return the number of frames, the size, the mean number of frames per second and the codec."""
    import PIL.Image
    import PIL.ImageSequence

    with PIL.Image.open(path) as film:
        codec = {"PNG": "apng"}.get(str(film.format), str(film.format).lower())
        milliseconds = []
        for picture in PIL.ImageSequence.Iterator(film):
            picture.load()
            milliseconds.append(picture.info.get("duration", 0))
        total = Fraction(sum(milliseconds))
        rate = 1000 * len(milliseconds) / total if total else Fraction(0)
        return len(milliseconds), film.size, rate, codec


def durations(rate: Fraction, ticks: int) -> Iterator[int]:
    """Yield how long each frame is shown, in ticks of which a second has `ticks`, without end.

    Frame k begins at ``round(k * ticks / rate)``, so that roundings do not add up.
    """
    for number in count():
        yield round((number + 1) * ticks / rate) - round(number * ticks / rate)


# WebP: https://developers.google.com/speed/webp/docs/riff_container


def _write_webp(
    file: IO[bytes], frames: Iterable[Pixels], size: tuple[int, int], rate: Fraction, quality: int | None
) -> None:
    file.write(b"RIFF\0\0\0\0WEBP")
    sides = _three_bytes(size[0] - 1) + _three_bytes(size[1] - 1)
    _write_riff_chunk(file, b"VP8X", bytes([_WEBP_ALPHA | _WEBP_ANIMATION, 0, 0, 0]) + sides)
    _write_riff_chunk(file, b"ANIM", struct.pack("<IH", 0, 0))
    before: Pixels | None = None
    for image, milliseconds in zip(frames, durations(rate, 1000), strict=False):
        picture, flags = image, _WEBP_REPLACE
        if quality is None and image.shape[2] == 3 and before is not None:
            # what stays is transparent; it takes fewer bytes than to draw it again
            picture = np.dstack([image, np.uint8(255) * _changed(before, image)])
            flags = 0
        before = image
        corner = bytes(6)
        head = corner + sides + _three_bytes(milliseconds) + bytes([flags])
        _write_riff_chunk(file, b"ANMF", head + _webp_picture(picture, quality, exact=flags != 0))
    _end_riff(file)


_WEBP_ALPHA, _WEBP_ANIMATION, _WEBP_REPLACE = 0x10, 0x02, 0x02


def _webp_picture(image: Pixels, quality: int | None, exact: bool) -> bytes:
    """Return the chunks of one picture; unless `exact`, colours under transparent pixels may change."""
    import PIL.Image

    # for a forest at night, method 0 makes files that are a third larger; method 2 takes half as long again,
    # and saves 0.3 %
    options: dict[str, Any] = {"quality": quality, "method": 4}
    if quality is None:
        options = {"lossless": True, "method": 1}
    still = io.BytesIO()
    PIL.Image.fromarray(image).save(still, "WEBP", exact=exact, **options)
    content = still.getvalue()
    chunks = []
    place = len(b"RIFF\0\0\0\0WEBP")
    while place < len(content):
        name, length = struct.unpack_from("<4sI", content, place)
        end = place + 8 + length + length % 2
        if name in (b"ALPH", b"VP8 ", b"VP8L"):
            chunks.append(content[place:end])
        place = end
    return b"".join(chunks)


def _write_riff_chunk(file: IO[bytes], name: bytes, content: bytes) -> None:
    file.write(struct.pack("<4sI", name, len(content)) + content + bytes(len(content) % 2))


def _end_riff(file: IO[bytes]) -> None:
    """Write the length of the whole into the header."""
    length = file.tell() - 8
    if length >= 2**32 - 10:
        raise FireflyError("an animated WebP has at most 4 GiB: choose fewer frames, a quality, or .webm")
    file.seek(4)
    file.write(struct.pack("<I", length))
    file.seek(0, io.SEEK_END)


def _three_bytes(number: int) -> bytes:
    return struct.pack("<I", number)[:3]


# APNG: https://www.w3.org/TR/png-3/#apng-frame-based-animation


def _write_apng(file: IO[bytes], frames: Iterable[Pixels], rate: Fraction) -> None:
    import PIL.Image

    # a delay is a fraction, so that it is exact
    exact = max(rate.numerator, rate.denominator) < 2**16
    sequence = count()
    number, place_of_count = 0, 0
    for image, milliseconds in zip(frames, durations(rate, 1000), strict=False):
        still = io.BytesIO()
        PIL.Image.fromarray(image).save(still, "PNG")
        chunks = list(_png_chunks(still.getvalue()))
        if number == 0:
            file.write(_PNG_SIGNATURE)
            _write_png_chunk(file, b"IHDR", b"".join(data for name, data in chunks if name == b"IHDR"))
            place_of_count = file.tell()
            _write_png_chunk(file, b"acTL", bytes(8))
        delay = (rate.denominator, rate.numerator) if exact else (milliseconds, 1000)
        control = struct.pack(">5I2H2B", next(sequence), image.shape[1], image.shape[0], 0, 0, *delay, 0, 0)
        _write_png_chunk(file, b"fcTL", control)
        pixels = b"".join(data for name, data in chunks if name == b"IDAT")
        if number == 0:
            _write_png_chunk(file, b"IDAT", pixels)
        else:
            _write_png_chunk(file, b"fdAT", struct.pack(">I", next(sequence)) + pixels)
        number += 1
    if number:
        _write_png_chunk(file, b"IEND", b"")
        file.seek(place_of_count)
        _write_png_chunk(file, b"acTL", struct.pack(">II", number, 0))
        file.seek(0, io.SEEK_END)


_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"


def _png_chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    place = len(_PNG_SIGNATURE)
    while place < len(content):
        length, name = struct.unpack_from(">I4s", content, place)
        yield name, content[place + 8 : place + 8 + length]
        place += 12 + length


def _write_png_chunk(file: IO[bytes], name: bytes, content: bytes) -> None:
    file.write(struct.pack(">I", len(content)) + name + content)
    file.write(struct.pack(">I", zlib.crc32(content, zlib.crc32(name))))


# GIF: https://www.w3.org/Graphics/GIF/spec-gif89a.txt


def _write_gif(file: IO[bytes], frames: Iterable[Pixels], size: tuple[int, int], rate: Fraction) -> None:
    from PIL.GifImagePlugin import getdata

    # no colours for all frames: each has its own; 0x70 says that a channel has 8 bits
    file.write(b"GIF89a" + struct.pack("<2H3B", *size, 0x70, 0, 0))
    file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\0\0\0")
    before: Pixels | None = None
    for image, hundredths in zip(frames, durations(rate, 100), strict=False):
        codes, palette = _with_256_colors(image)
        options: dict[str, Any] = {"duration": 10 * hundredths, "disposal": _GIF_KEEP}
        if before is not None:
            # what stays is transparent: dithering would make it flicker, and it takes fewer bytes
            codes[~_changed(before, image)] = _GIF_TRANSPARENT
            options["transparency"] = _GIF_TRANSPARENT
        before = image
        for part in getdata(_indexed(codes, palette), include_color_table=True, **options):
            file.write(part)
    file.write(b"\x3b")


_GIF_KEEP = 1
_GIF_TRANSPARENT = 255


def _with_256_colors(image: Pixels) -> tuple[Pixels, bytes]:
    """Return the codes of a picture's pixels, shape (height, width), and the colours of 256 codes.

    Code 255 is left free. The octree keeps colours that few pixels have, such as those of fireflies and red
    mushrooms, which Pillow's median cut merges with others; dithering keeps the sky free of bands.
    """
    import PIL.Image

    picture = PIL.Image.fromarray(image)
    found = picture.quantize(_GIF_TRANSPARENT, PIL.Image.Quantize.FASTOCTREE).getpalette() or [0, 0, 0]
    palette = bytes(found + found[-3:] * (256 - len(found) // 3))
    colors = _indexed(np.zeros((1, 1), np.uint8), palette)
    codes = np.array(picture.quantize(palette=colors, dither=PIL.Image.Dither.FLOYDSTEINBERG))
    last = len(found) // 3 - 1
    return np.minimum(codes, last), palette


def _indexed(codes: Pixels, palette: bytes) -> Any:
    """Return a picture of Pillow's mode P."""
    import PIL.Image

    picture = PIL.Image.fromarray(codes)
    picture.putpalette(palette)
    return picture


def _changed(before: Pixels, after: Pixels) -> Any:
    """Return where two pictures differ: bool, shape (height, width)."""
    return (before != after).any(axis=2)
