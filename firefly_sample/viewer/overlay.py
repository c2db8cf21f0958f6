"""Dark translucent plates of text over the picture, drawn with Pillow.

The functions that return plates are cached, so that a plate is drawn only when its text changes. A plate is a
read-only array of uint8, shape (height, width, 4), first row on top, colours multiplied by alpha. `scale` is
1 on an ordinary screen.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont, ImageFont

Pixels = NDArray[np.uint8]
Rows = tuple[tuple[str, str], ...]
Section = tuple[str, Rows]
"""A heading, and rows of (key, action)."""

PLATE = (10, 13, 20, 196)
DENSE_PLATE = (10, 13, 20, 228)
CAP = (58, 66, 84, 255)
BRIGHT = (238, 240, 235, 255)
DIM = (160, 170, 184, 255)
WARM = (255, 214, 120, 255)
SIZE = 14.0
PADDING, LINE, RADIUS, GAP = 0.8, 1.55, 0.55, 1.2
"""In sizes of the text: the plate's margin, a line's height, the corners' radius, the gap between columns."""
ROWS_WIDTH = 14.0
"""The least width of a plate of rows, in sizes of the text, so that it does not change with every digit."""


class _Sheet:
    """A plate to draw on; lengths are in sizes of the text, from the plate's top left corner."""

    def __init__(self, width: float, height: float, scale: float, fill: tuple[int, ...] = PLATE) -> None:
        from PIL import Image, ImageDraw

        self.unit = SIZE * scale
        size = max(1, round(width * self.unit)), max(1, round(height * self.unit))
        self._image = Image.new("RGBA", size, fill)
        self._draw = ImageDraw.Draw(self._image)

    def text(self, x: float, y: float, text: str, fill: tuple[int, ...], anchor: str = "l") -> None:
        """Draw text in the line whose top is `y`; its left end (l), middle (m) or right end (r) is at `x`."""
        point = (x * self.unit, (y + 0.5 * LINE) * self.unit)
        self._draw.text(point, text, font=_font(self.unit), fill=fill, anchor=anchor + "m")

    def cap(self, x: float, y: float, width: float) -> None:
        """Draw a key's cap in the line whose top is `y`."""
        box = (x, y + 0.14, x + width, y + LINE - 0.14)
        self._draw.rounded_rectangle([side * self.unit for side in box], 0.3 * self.unit, fill=CAP)

    def pixels(self) -> Pixels:
        """Return the plate with round corners, its colours multiplied by alpha."""
        straight = np.asarray(self._image, dtype=np.float32)
        alpha = straight[..., 3] * _rounded(straight.shape[:2], RADIUS * self.unit)
        straight = np.dstack([straight[..., :3] * (alpha[..., None] / 255.0), alpha])
        pixels = (straight + 0.5).astype(np.uint8)
        pixels.flags.writeable = False
        return pixels


def _rounded(shape: tuple[int, int], radius: float) -> NDArray[np.float32]:
    """Return 1 inside a rectangle with round corners, 0 outside, and values between on the edge."""
    y, x = (np.abs(np.arange(side, dtype=np.float32) + 0.5 - side / 2) - side / 2 for side in shape)
    beyond = np.hypot(np.maximum(y[:, None] + radius, 0.0), np.maximum(x[None, :] + radius, 0.0))
    return np.asarray(np.clip(radius - beyond + 0.5, 0.0, 1.0))


@lru_cache(maxsize=8)
def _font(size: float) -> FreeTypeFont | ImageFont:
    from PIL import ImageFont

    return ImageFont.load_default(size)


def _width(text: str) -> float:
    """Return a text's width in sizes of the text."""
    return float(_font(SIZE).getlength(text)) / SIZE


def _widest(texts: Iterable[str]) -> float:
    return max(map(_width, texts), default=0.0)


@lru_cache(maxsize=64)
def text_plate(text: str, scale: float, widest: float = math.inf, title: str = "") -> Pixels:
    """Return a plate of text, wrapped at a width of `widest` pixels; beside a title, the text is dimmer."""
    left = _width(title) + (0.6 if title and text else 0.0)
    lines = _wrapped(text, widest / (SIZE * scale) - left - 2 * PADDING)
    width, height = left + _widest(lines) + 2 * PADDING, len(lines) * LINE + 0.6 * PADDING
    sheet = _Sheet(width, height, scale)
    sheet.text(PADDING, 0.3 * PADDING, title, WARM)
    for number, line in enumerate(lines):
        sheet.text(PADDING + left, 0.3 * PADDING + number * LINE, line, DIM if title else BRIGHT)
    return sheet.pixels()


def _wrapped(text: str, widest: float) -> list[str]:
    """Split text into lines between words; a word wider than `widest` gets a line of its own."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".lstrip()
        if lines[-1] and _width(longer) > widest:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


@lru_cache(maxsize=4)
def rows_plate(title: str, rows: Rows, footer: str, scale: float) -> Pixels:
    """Return a plate of a title, rows of (name, value), and a footer."""
    names, values = _widest(name for name, _ in rows), _widest(value for _, value in rows)
    width = max(names + GAP + values, _widest((title, footer)), ROWS_WIDTH)
    sheet = _Sheet(width + 2 * PADDING, (len(rows) + 2) * LINE + 1.4 * PADDING, scale)
    y = 0.7 * PADDING
    sheet.text(PADDING, y, title, WARM)
    for name, value in rows:
        y += LINE
        sheet.text(PADDING, y, name, DIM)
        sheet.text(PADDING + width, y, value, BRIGHT, "r")
    sheet.text(PADDING, y + LINE, footer, DIM)
    return sheet.pixels()


@lru_cache(maxsize=4)
def columns_plate(columns: tuple[tuple[Section, ...], ...], footer: str, scale: float) -> Pixels:
    """Return a plate of columns of sections, whose rows are keys, drawn as caps, and their actions."""
    widths = [_column_width(sections) for sections in columns]
    lines = max(sum(len(rows) + 1 for _, rows in sections) + len(sections) - 1 for sections in columns)
    total = max(sum(width for width, _ in widths) + 2 * GAP * (len(columns) - 1), _width(footer))
    sheet = _Sheet(total + 4 * PADDING, (lines + 1.5) * LINE + 4 * PADDING, scale, DENSE_PLATE)
    x = 2 * PADDING
    for sections, (width, caps) in zip(columns, widths, strict=True):
        y = 2 * PADDING
        for heading, rows in sections:
            sheet.text(x, y, heading, WARM)
            for key, text in rows:
                y += LINE
                sheet.cap(x, y, caps)
                sheet.text(x + caps / 2, y, key, BRIGHT, "m")
                sheet.text(x + caps + 0.7, y, text, BRIGHT)
            y += 2 * LINE
        x += width + 2 * GAP
    sheet.text(2 * PADDING, 2 * PADDING + (lines + 0.5) * LINE, footer, DIM)
    return sheet.pixels()


def _column_width(sections: tuple[Section, ...]) -> tuple[float, float]:
    """Return the width of a column and of the key caps in it."""
    rows = [row for _, rows in sections for row in rows]
    caps = _widest(key for key, _ in rows) + 0.9
    texts = _widest(text for _, text in rows)
    return max(caps + 0.7 + texts, _widest(heading for heading, _ in sections)), caps


def blend(picture: Pixels, plate: Pixels, corner: tuple[int, int]) -> Pixels:
    """Return a copy of a picture, shape (height, width, 3), with a plate over it, cut off at the edges.

    `corner` is the number of pixels from the picture's left and top edge to the plate's.
    """
    result = picture.copy()
    left, top = corner
    rows = slice(max(top, 0), max(top + plate.shape[0], 0))
    columns = slice(max(left, 0), max(left + plate.shape[1], 0))
    below = result[rows, columns]
    above = plate[max(-top, 0) :, max(-left, 0) :][: below.shape[0], : below.shape[1]].astype(np.float32)
    below[...] = np.minimum(above[..., :3] + below * (1.0 - above[..., 3:] / 255.0) + 0.5, 255.0)
    return result
