"""PNG files of every kind, written here byte by byte, so that the decoder has a known answer."""

from __future__ import annotations

import struct
import zlib

import numpy as np

CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
"""The first column and row, and the steps, of each pass."""


def chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def packed_rows(samples: np.ndarray, depth: int) -> bytes:
    """The rows of an image or of a pass, each with the filters of the specification in turn."""
    if 0 in samples.shape:
        return b""
    height, _, channels = samples.shape
    if depth == 16:
        rows = samples.astype(">u2").reshape(height, -1).view(np.uint8)
    elif depth == 8:
        rows = samples.astype(np.uint8).reshape(height, -1)
    else:
        bits = (samples.reshape(height, -1, 1) >> np.arange(depth)[::-1]) & 1
        rows = np.packbits(bits.reshape(height, -1).astype(np.uint8), axis=1)
    step = max(1, channels * depth // 8)
    rows = rows.astype(int)
    parts = []
    for number, row in enumerate(rows):
        above = rows[number - 1] if number else np.zeros_like(row)
        left, corner = (np.concatenate([np.zeros(step, int), line])[: len(row)] for line in (row, above))
        kind = number % 5
        guess = (0 * row, left, above, (left + above) // 2, paeth(left, above, corner))[kind]
        parts.append(bytes([kind]) + ((row - guess) % 256).astype(np.uint8).tobytes())
    return b"".join(parts)


def paeth(left: np.ndarray, above: np.ndarray, corner: np.ndarray) -> np.ndarray:
    target = left + above - corner
    to_left, to_above, to_corner = abs(target - left), abs(target - above), abs(target - corner)
    nearest = np.where(to_above <= to_corner, above, corner)
    return np.where((to_left <= to_above) & (to_left <= to_corner), left, nearest)


def png(samples: np.ndarray, color_type: int, depth: int, *more: bytes, interlaced: bool = False) -> bytes:
    """A file of samples of shape (height, width, channels); `more` are chunks before the pixels."""
    height, width, _ = samples.shape
    passes = [samples]
    if interlaced:
        passes = [samples[y::dy, x::dx] for x, y, dx, dy in ADAM7]
    header = struct.pack(">IIBBBBB", width, height, depth, color_type, 0, 0, int(interlaced))
    rows = zlib.compress(b"".join(packed_rows(part, depth) for part in passes))
    half = len(rows) // 2
    data = (chunk(b"IHDR", header), *more, chunk(b"IDAT", rows[:half]), chunk(b"IDAT", rows[half:]))
    return b"\x89PNG\r\n\x1a\n" + b"".join(data) + chunk(b"IEND", b"")
