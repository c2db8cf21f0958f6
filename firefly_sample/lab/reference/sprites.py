"""float64 twin of ``shaders/plain.vert`` and ``plain.frag``: soft round dots, added to the radiance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frame_plan import SpriteSet
from firefly_sample.plan.view import View

Float64 = NDArray[np.float64]

SMALLEST = 1.0
"""Radius in pixels: a dot that would be smaller is drawn as large and as much fainter."""


@dataclass(frozen=True, eq=False)
class Square:
    """The pixels that a dot may touch.

    Attributes
    ----------
    box : (slice, slice)
        Rows and columns, the first row on top.
    across, up : ndarray of float64
        From the dot's centre, in radii, of the columns and of the rows.
    radius : float
        Scene units: the dot's own, or that of `SMALLEST`.
    fainter : float
        What is left of its strength.
    """

    box: tuple[slice, slice]
    across: Float64
    up: Float64
    radius: float
    fainter: float

    def profile(self) -> Float64:
        """(1 - r^2)^2 of each pixel, 0 outside."""
        squares: Float64 = np.maximum(1.0 - (self.across**2 + self.up[:, None] ** 2), 0.0)
        return squares * squares


def square_of(view: View, place: Float64, radius: float) -> Square | None:
    """The square of a dot at a place in view space; None where there is nothing of it in the picture."""
    lens, (width, height) = view.lens, view.size
    x, y, z = place.tolist()
    if not view.near <= y <= view.far:
        return None  # its square stands upright: the planes cut all of it away, or nothing
    w = y if lens.perspective else 1.0
    pixels = radius * lens.c * (height / 2) / max(w, 1e-30)
    grow = max(SMALLEST / max(pixels, 1e-30), 1.0)
    size = radius * grow
    columns = _span(lens.a * x / w + lens.x_offset, lens.a * size / w, width)
    rows = _span(-(lens.c * z / w + lens.z_offset), lens.c * size / w, height)
    if not (columns and rows):
        return None
    ndc_x = (np.arange(columns.start, columns.stop) + 0.5) / (width / 2) - 1.0
    ndc_y = 1.0 - (np.arange(rows.start, rows.stop) + 0.5) / (height / 2)
    across = ((ndc_x - lens.x_offset) / lens.a * w - x) / size
    up = ((ndc_y - lens.z_offset) / lens.c * w - z) / size
    box = np.s_[rows.start : rows.stop, columns.start : columns.stop]
    return Square(box, across, up, size, 1.0 / (grow * grow))


def add_sprites(radiance: Float64, dots: SpriteSet, view: View, distance: Float64) -> None:
    """Add all dots, one after the other, each to the pixels of its square.

    Parameters
    ----------
    radiance : ndarray of float64, shape (height, width, 3)
        Changed in place; the first row on top.
    dots : SpriteSet
        View space.
    view : View
    distance : ndarray of float64, shape (height, width)
        Of the surfaces along the view axis, infinite where there is none: a dot is hidden by what is nearer
        than its centre.
    """
    for index in range(len(dots)):
        add_sprite(radiance, dots, index, view, distance)


def add_sprite(radiance: Float64, dots: SpriteSet, index: int, view: View, distance: Float64) -> None:
    """Add one of the dots; see `add_sprites`."""
    made = light_of_sprite(dots, index, view, distance)
    if made is not None:
        box, light = made
        radiance[box] += light


def light_of_sprite(
    dots: SpriteSet, index: int, view: View, distance: Float64
) -> tuple[tuple[slice, slice], Float64] | None:
    """Return the rows and columns that one of the dots touches, and what it adds; see `add_sprites`."""
    place, color = dots.positions[index], dots.colors[index]
    square = square_of(view, place, float(dots.radii[index]))
    if square is None:
        return None
    strength = np.where(distance[square.box] >= place[1], square.profile(), 0.0)
    return square.box, strength[..., None] * (color * square.fainter)


def _span(middle: float, half: float, count: int) -> range:
    """Which of `count` pixels have their centres within an interval of NDC, and perhaps one more a side."""
    low = max(math.floor((max(middle - half, -2.0) + 1.0) * (count / 2) - 0.5), 0)
    high = min(math.ceil((min(middle + half, 2.0) + 1.0) * (count / 2) - 0.5), count - 1)
    return range(low, high + 1)
