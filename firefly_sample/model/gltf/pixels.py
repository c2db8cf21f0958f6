"""Sizes and pixels of the image files that glTF models contain: PNG, JPEG and WebP.

The kind is found by the first bytes, because media types in files are often wrong. Sizes are read from the
headers alone, so that an image that is too large is refused before it is decoded. Colour profiles and
orientations are ignored, as glTF 2.0 says in section 3.8.3.
"""

from __future__ import annotations

import io
import struct
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from firefly_sample.model.gltf.png import SIGNATURE, decode_png, png_size

Kind = Literal["PNG", "JPEG", "WebP"]

_OTHERS = {
    b"GIF8": "GIF",
    b"BM": "BMP",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
    b"DDS ": "DDS",
    b"\xabKTX 20\xbb": "KTX 2",
    b"<svg": "SVG",
}


def image_kind(data: bytes) -> Kind:
    """Return the kind of an image by its first bytes; raise ValueError if it is none that is read."""
    if data.startswith(SIGNATURE):
        return "PNG"
    if data.startswith(b"\xff\xd8\xff"):
        return "JPEG"
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        return "WebP"
    other = next((kind for start, kind in _OTHERS.items() if data.startswith(start)), None)
    found = f"it is {other}" if other else f"its first bytes are {data[:8]!r}"
    raise ValueError(f"{found}, not PNG, JPEG or WebP")


def image_size(data: bytes) -> tuple[int, int]:
    """Return the width and height that an image's header gives; raise ValueError if it is damaged."""
    kind = image_kind(data)
    if kind == "PNG":
        return png_size(data)
    size = _jpeg_size(data) if kind == "JPEG" else _webp_size(data)
    if size is None or 0 in size:
        raise ValueError("its header is damaged")
    return size


def decode_image(data: bytes) -> NDArray[np.uint8]:
    """Return an image's pixels as sRGB codes and alpha, shape (height, width, 4), the first row on top.

    Raises
    ------
    ValueError
        If it is damaged, cut short, or too large for the memory.
    """
    kind = image_kind(data)
    try:
        return decode_png(data) if kind == "PNG" else _decode_by_pillow(kind, data)
    except MemoryError:
        raise ValueError("there is not enough memory for it") from None
    except Exception as error:  # decoders raise OSError, SyntaxError, struct.error, zlib.error and others
        raise ValueError(" ".join(str(error).split())[:200] or type(error).__name__) from error


def _decode_by_pillow(kind: Kind, data: bytes) -> NDArray[np.uint8]:
    """Decode JPEG and WebP. Their classes are called by themselves: `Image.open` has a limit of its own."""
    from PIL.JpegImagePlugin import JpegImageFile
    from PIL.WebPImagePlugin import SUPPORTED, WebPImageFile

    if kind == "WebP" and not SUPPORTED:
        raise ValueError("this Pillow was built without WebP")
    expected = image_size(data)
    with (JpegImageFile if kind == "JPEG" else WebPImageFile)(io.BytesIO(data)) as image:
        if image.size != expected:
            raise ValueError(f"its header gives two sizes, {expected} and {image.size}")
        return np.asarray(image.convert("RGBA"))


def _jpeg_size(data: bytes) -> tuple[int, int] | None:
    """Return the size in the frame header of a JPEG (ITU-T T.81, B.2.2)."""
    start = 2
    while start + 9 <= len(data):
        if data[start] != 0xFF:
            return None
        marker = data[start + 1]
        if marker == 0xFF:  # a fill byte
            start += 1
        elif marker == 0x01 or 0xD0 <= marker <= 0xD8:  # alone, without a segment
            start += 2
        elif 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack_from(">HH", data, start + 5)
            return width, height
        else:
            start += 2 + struct.unpack_from(">H", data, start + 2)[0]
    return None


def _webp_size(data: bytes) -> tuple[int, int] | None:
    """Return the canvas size of a WebP (RFC 9649)."""
    if len(data) < 30:
        return None
    if data[12:16] == b"VP8X":
        width, height = (int.from_bytes(data[place : place + 3], "little") + 1 for place in (24, 27))
        return width, height
    if data[12:16] == b"VP8L" and data[20] == 0x2F:
        bits = int.from_bytes(data[21:25], "little")
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    if data[12:16] == b"VP8 " and data[23:26] == b"\x9d\x01\x2a":
        width, height = struct.unpack_from("<HH", data, 26)
        return width & 0x3FFF, height & 0x3FFF
    return None
