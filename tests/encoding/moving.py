"""Frames with known content, and readers of films that share no code with the writers."""

from __future__ import annotations

import io
import struct
from fractions import Fraction

import numpy as np

from firefly_sample.encoding.films import write_film


def moving(count=6, size=(64, 48), channels=3):
    """Frames whose pixels all differ from each other, with a square that moves; noise would not compress."""
    width, height = size
    row, column = np.mgrid[:height, :width]
    frames = []
    for k in range(count):
        frame = np.dstack([row * 3 % 256, column * 2 % 256, (row + column) % 64, column * 4 % 256])
        frame[5:15, 4 + 3 * k : 14 + 3 * k] = (250, 180 - 10 * k, 30, 255)
        frames.append(frame[..., :channels].astype(np.uint8))
    return frames


def written(path, frames, choices, suffix=None):
    """Write a film and return its path."""
    height, width = frames[0].shape[:2]
    write_film(path, suffix or path.suffix, iter(frames), (width, height), choices)
    return path


def boxes(content):
    """The names and contents of the boxes of an MP4, by the layout of ISO 14496-12."""
    place = 0
    while place < len(content):
        length, name = struct.unpack_from(">I4s", content, place)
        head = 8
        if length == 1:
            (length,) = struct.unpack_from(">Q", content, place + 8)
            head = 16
        yield name, content[place + head : place + length]
        place += length


def box(content, *names):
    """The content of a box in a box in an MP4."""
    for name in names:
        content = dict(boxes(content))[name]
    return content


def apng_delays(content):
    """The seconds of each frame of an APNG, from its chunks fcTL."""
    place = 8
    while place < len(content):
        length, name = struct.unpack_from(">I4s", content, place)
        if name == b"fcTL":
            yield Fraction(*struct.unpack_from(">2H", content, place + 8 + 20))
        place += 12 + length


def chunks(content):
    """The names and contents of the chunks of a RIFF."""
    place = 0
    while place < len(content):
        name, length = struct.unpack_from("<4sI", content, place)
        yield name, content[place + 8 : place + 8 + length]
        place += 8 + length + length % 2


def webp_frames(content):
    """The milliseconds and the pixels of each frame of an animated WebP, put together by hand."""
    import PIL.Image

    assert content[:4] == b"RIFF"
    assert struct.unpack_from("<I", content, 4)[0] == len(content) - 8
    canvas = None
    for name, data in chunks(content[12:]):
        if name != b"ANMF":
            continue
        milliseconds = int.from_bytes(data[12:15], "little")
        assert data[:6] == bytes(6)  # the whole canvas
        still = data[16:]
        head = b""
        if still[:4] == b"ALPH":
            head = b"VP8X" + struct.pack("<I", 10) + bytes([0x10, 0, 0, 0]) + data[6:12]
        riff = b"WEBP" + head + still
        with PIL.Image.open(io.BytesIO(b"RIFF" + struct.pack("<I", len(riff)) + riff)) as picture:
            pixels = np.array(picture.convert("RGBA"))
        replace = bool(data[15] & 0x02)
        if canvas is not None and not replace:
            assert np.isin(pixels[..., 3], (0, 255)).all()
            pixels = np.where(pixels[..., 3:] == 255, pixels, canvas)
        canvas = pixels
        yield milliseconds, pixels


def by_ffmpeg(path):
    """The times in seconds and the RGBA or RGB pixels of each frame, by FFmpeg's readers."""
    import av

    with av.open(str(path)) as container:
        for frame in container.decode(video=0):
            pixels = "rgba" if "a" in frame.format.name or frame.format.name == "pal8" else "rgb24"
            yield Fraction(frame.pts) * frame.time_base, frame.to_ndarray(format=pixels)


def psnr(first, second):
    """Decibels."""
    return 10 * np.log10(255**2 / np.mean((np.asarray(first, float) - second) ** 2))
