"""The buffers side by side along the lower edge of the window, in as many rows as show them best."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.viewer.overlay import blend, title_plate

Pixels = NDArray[np.uint8]

GAP = 6
"""Pixels between thumbnails, and around them, at scale 1."""
SMALLEST = 60, 24
"""Width and height in pixels, at scale 1, of thumbnails that are shown: with less, no label can be read."""
SHARE = 0.45
"""Of the window's height that the strip may cover: most is the picture's."""
LABEL = 0.8
"""Of the size of other text, where there is room."""


class Grid(NamedTuple):
    """How thumbnails lie: how many in a row, and the size of each."""

    columns: int
    size: tuple[int, int]


def thumbnail_grid(window: tuple[int, int], count: int, scale: float) -> Grid | None:
    """The largest thumbnails of the window's shape for `count` buffers; None if there is no room for them."""
    gap, best = round(GAP * scale), None
    for rows in range(1, count + 1):
        columns = math.ceil(count / rows)
        width = (window[0] - gap * (columns + 1)) // columns
        height = round(width * window[1] / window[0])
        if rows * (height + gap) + gap <= SHARE * window[1] and (best is None or width > best.size[0]):
            best = Grid(columns, (width, height))
    if best is None or best.size[0] < SMALLEST[0] * scale or best.size[1] < SMALLEST[1] * scale:
        return None
    return best


def buffer_strip(pictures: dict[str, Pixels], grid: Grid, scale: float) -> Pixels:
    """Labelled thumbnails on a dark band, shape (height, width, 4), colours multiplied by alpha.

    Parameters
    ----------
    pictures : dict of str to ndarray of uint8, shape (height, width, 3)
        By label, all of the grid's size, in order.
    """
    gap, (width, height) = round(GAP * scale), grid.size
    rows = math.ceil(len(pictures) / grid.columns)
    band = np.zeros((rows * (height + gap) + gap, grid.columns * (width + gap) + gap, 4), dtype=np.uint8)
    band[..., 3] = 150
    labels = _labels(pictures, width - gap, scale)
    for index, (picture, label) in enumerate(zip(pictures.values(), labels, strict=True)):
        row, column = divmod(index, grid.columns)
        top, left = gap + row * (height + gap), gap + column * (width + gap)
        place = band[top : top + height, left : left + width]
        place[..., :3] = blend(picture, label, (gap // 2, gap // 2))
        place[..., 3] = 255
    return band


def _labels(names: dict[str, Pixels], widest: int, scale: float) -> list[Pixels]:
    """A plate for each name, all of one size of text, which the longest decides."""
    size = LABEL * scale
    longest = max(title_plate(name, "", size).shape[1] for name in names)
    size *= min(1.0, widest / longest)
    return [title_plate(name, "", size) for name in names]
