"""Pixels of PNG images, each sample rounded once: from 1 to 16 bits, grey, colour or palette, with any alpha.

Pillow only undoes compression and filters; its own conversions drop the low bytes of 16-bit samples and
compare transparent colours in other units. The layout is that of the W3C's PNG specification.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

SIGNATURE = b"\x89PNG\r\n\x1a\n"

_GREY, _COLOR, _PALETTE, _GREY_ALPHA, _COLOR_ALPHA = 0, 2, 3, 4, 6
_DEPTHS = {
    _GREY: (1, 2, 4, 8, 16),
    _COLOR: (8, 16),
    _PALETTE: (1, 2, 4, 8),
    _GREY_ALPHA: (8, 16),
    _COLOR_ALPHA: (8, 16),
}
_CHANNELS = {_GREY: 1, _COLOR: 3, _PALETTE: 1, _GREY_ALPHA: 2, _COLOR_ALPHA: 4}
_UNPACKED = {
    (_GREY, 1): ("1", "1"),
    (_GREY, 2): ("L", "L;2"),
    (_GREY, 4): ("L", "L;4"),
    (_GREY, 8): ("L", "L"),
    (_GREY, 16): ("LA", "LA"),
    (_COLOR, 8): ("RGB", "RGB"),
    (_PALETTE, 1): ("P", "P;1"),
    (_PALETTE, 2): ("P", "P;2"),
    (_PALETTE, 4): ("P", "P;4"),
    (_PALETTE, 8): ("P", "P"),
    (_GREY_ALPHA, 8): ("LA", "LA"),
    (_GREY_ALPHA, 16): ("RGBA", "RGBA"),
    (_COLOR_ALPHA, 8): ("RGBA", "RGBA"),
}
"""Pillow's mode and raw mode by colour type and depth. The two bytes of a 16-bit sample are two channels."""
_HALVES = {
    _COLOR: ("RGB", "RGB;16B", "RGB;16L"),
    _COLOR_ALPHA: ("RGBA", "RGBA;16B", "RGBA;16L"),
}
"""Pillow's mode, and the raw modes that read the high and the low bytes, where pixels have six or eight."""


Samples = NDArray[np.unsignedinteger[Any]]


class _Header(NamedTuple):
    width: int
    height: int
    depth: int
    color_type: int
    interlaced: bool


def png_size(data: bytes) -> tuple[int, int]:
    """Return the width and height that a PNG's header gives; raise ValueError if it is damaged."""
    return _header(data)[:2]


def decode_png(data: bytes) -> NDArray[np.uint8]:
    """Return the pixels of a PNG, shape (height, width, 4), as they are stored: profiles are ignored.

    Raises
    ------
    ValueError
        If it is damaged or cut short, or a checksum is wrong.
    """
    header = _header(data)
    parts, palette, transparent = [], b"", None
    for kind, content in _chunks(data):
        if kind == b"IDAT":
            parts.append(content)
        elif kind == b"PLTE":
            palette = bytes(content)
        elif kind == b"tRNS":
            transparent = bytes(content)
    samples = _samples(header, b"".join(parts))
    if header.color_type == _PALETTE:
        return _from_palette(samples[..., 0], palette, transparent or b"")
    return _with_alpha(header, samples, transparent)


def _header(data: bytes) -> _Header:
    if data[: len(SIGNATURE)] != SIGNATURE or data[12:16] != b"IHDR" or len(data) < 33:
        raise ValueError("it does not begin with a header")
    width, height, depth, color_type, _, _, interlace = struct.unpack_from(">IIBBBBB", data, 16)
    if not (0 < width < 2**31 and 0 < height < 2**31 and interlace < 2):
        raise ValueError("its header is damaged")
    if depth not in _DEPTHS.get(color_type, ()):
        raise ValueError(f"there is no colour type {color_type} of {depth} bits")
    return _Header(width, height, depth, color_type, bool(interlace))


def _chunks(data: bytes) -> Iterator[tuple[bytes, memoryview]]:
    """Yield the kind and content of the chunks that define pixels, after checking their checksums."""
    start, view = len(SIGNATURE), memoryview(data)
    while start + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, start)
        end = start + 12 + length
        if kind == b"IEND":
            return
        if end > len(data):
            raise ValueError("it is cut short")
        if kind in (b"IHDR", b"PLTE", b"IDAT", b"tRNS"):
            if zlib.crc32(view[start + 4 : end - 4]) != struct.unpack_from(">I", data, end - 4)[0]:
                raise ValueError(f"the checksum of its chunk {kind.decode()} is wrong")
            yield kind, view[start + 8 : end - 4]
        start = end
    raise ValueError("it is cut short")


def _samples(header: _Header, packed: bytes) -> Samples:
    """Return the samples as they are stored, shape (height, width, channels)."""
    kind = header.color_type
    if header.depth == 16 and kind in _HALVES:
        mode, high, low = _HALVES[kind]
        bytes_high = _unfiltered(header, packed, mode, high).astype(np.uint16)
        return np.asarray(bytes_high * np.uint16(256) + _unfiltered(header, packed, mode, low))
    samples = _unfiltered(header, packed, *_UNPACKED[kind, header.depth])
    if header.depth == 16:
        return np.asarray(np.ascontiguousarray(samples).view(">u2"), np.uint16)
    if kind == _GREY:
        return np.asarray(samples // np.uint8(255 // (2**header.depth - 1)))  # Pillow has scaled them to 255
    return samples


def _unfiltered(header: _Header, packed: bytes, mode: str, raw_mode: str) -> NDArray[np.uint8]:
    from PIL import Image

    size = header.width, header.height
    image = Image.frombytes(mode, size, packed, "zip", raw_mode, int(header.interlaced))
    pixels = np.asarray(image)
    if pixels.dtype == bool:
        pixels = pixels.astype(np.uint8) * np.uint8(255)
    return pixels.reshape(header.height, header.width, -1)


def _with_alpha(header: _Header, samples: Samples, transparent: bytes | None) -> NDArray[np.uint8]:
    """Return RGBA of grey or coloured samples; `transparent` is the one colour that is not opaque."""
    rounded = _rounded(samples, header.depth)
    pixels = np.empty((header.height, header.width, 4), dtype=np.uint8)
    has_alpha = header.color_type in (_GREY_ALPHA, _COLOR_ALPHA)
    pixels[..., :3] = rounded[..., : -1 if has_alpha else None]
    pixels[..., 3] = rounded[..., -1] if has_alpha else 255
    if transparent is not None and not has_alpha:
        count = _CHANNELS[header.color_type]
        if len(transparent) < 2 * count:
            raise ValueError("its transparent colour is cut short")
        key = np.frombuffer(transparent, ">u2", count) & (2**header.depth - 1)
        pixels[(samples == key).all(axis=-1), 3] = 0
    return pixels


def _rounded(samples: Samples, depth: int) -> NDArray[np.uint8]:
    """Return samples as 8-bit codes, each the nearest to its share of the largest number of `depth` bits."""
    if depth == 8:
        return samples.astype(np.uint8)
    if depth < 8:
        return np.asarray(samples * (255 // (2**depth - 1)), np.uint8)
    # round(sample / 257): 65535 is 255 * 257
    return np.asarray((samples.astype(np.uint32) + 128) // 257, np.uint8)


def _from_palette(indices: Samples, palette: bytes, alphas: bytes) -> NDArray[np.uint8]:
    """Return RGBA of indices; those beyond the palette are opaque black."""
    if not palette or len(palette) % 3 or len(palette) > 768:
        raise ValueError("its palette is missing or damaged")
    table = np.zeros((256, 4), dtype=np.uint8)
    table[:, 3] = 255
    table[: len(palette) // 3, :3] = np.frombuffer(palette, np.uint8).reshape(-1, 3)
    table[: len(alphas), 3] = np.frombuffer(alphas, np.uint8)[:256]
    return np.asarray(table[indices])
