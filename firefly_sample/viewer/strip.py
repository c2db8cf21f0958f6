"""The buffers side by side along the lower edge of the window."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.viewer.overlay import blend, title_plate

__all__ = ["buffer_strip", "thumbnail_size"]

Pixels = NDArray[np.uint8]

GAP = 8
"""Pixels between thumbnails, and around them, at scale 1."""
SMALLEST = 24
"""Thumbnails that would be smaller, in pixels, are not shown."""


def thumbnail_size(window: tuple[int, int], count: int, scale: float) -> tuple[int, int] | None:
    """The size of each of `count` thumbnails side by side in a window; None if there is no room for them."""
    gap = round(GAP * scale)
    width = (window[0] - gap * (count + 1)) // count
    height = round(width * window[1] / window[0])
    return (width, height) if min(width, height) >= SMALLEST and height + 2 * gap <= window[1] else None


def buffer_strip(pictures: dict[str, Pixels], scale: float) -> Pixels:
    """Labelled thumbnails on a dark band, shape (height, width, 4), colours multiplied by alpha.

    Parameters
    ----------
    pictures : dict of str to ndarray of uint8, shape (height, width, 3)
        By label, all of one size, in order.
    """
    gap = round(GAP * scale)
    height, width = next(iter(pictures.values())).shape[:2]
    band = np.zeros((height + 2 * gap, len(pictures) * (width + gap) + gap, 4), dtype=np.uint8)
    band[..., 3] = 150
    for index, (label, picture) in enumerate(pictures.items()):
        left = gap + index * (width + gap)
        plate = title_plate(label, "", 0.85 * scale)
        band[gap : gap + height, left : left + width, :3] = blend(picture, plate, (gap // 2, gap // 2))
        band[gap : gap + height, left : left + width, 3] = 255
    return band
