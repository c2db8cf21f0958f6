"""The strip of buffers: where thumbnails go, how large they are, and when there are none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.viewer.buffer_pictures import BUFFERS
from firefly_sample.viewer.overlay import text_plate
from firefly_sample.viewer.window_views import GAP, LABEL, SHARE, SMALLEST, Grid, buffer_strip, thumbnail_grid

sides = st.integers(1, 3000)


@given(sides, sides, st.integers(1, 20), st.sampled_from([1.0, 1.5, 2.0]))
def test_thumbnails_fit_and_leave_most_of_the_window_to_the_picture(width, height, count, scale):
    grid = thumbnail_grid((width, height), count, scale)
    if grid is None:
        return
    gap, rows = round(GAP * scale), math.ceil(count / grid.columns)
    assert grid.columns * (grid.size[0] + gap) + gap <= width
    assert rows * (grid.size[1] + gap) + gap <= SHARE * height
    assert grid.size[0] >= SMALLEST[0] * scale
    assert grid.size[1] >= SMALLEST[1] * scale
    # of the window's shape
    assert abs(grid.size[1] - grid.size[0] * height / width) <= 0.5


@pytest.mark.parametrize(
    ("window", "count", "grid"),
    [
        ((800, 600), 12, Grid(6, (126, 94))),
        ((800, 600), 9, Grid(5, (152, 114))),
        ((800, 600), 5, Grid(5, (152, 114))),
        ((480, 360), 12, Grid(6, (73, 55))),
        ((1920, 1080), 12, Grid(6, (313, 176))),
        ((1600, 300), 12, Grid(6, (259, 49))),
        ((300, 900), 12, None),
        ((320, 240), 12, None),
    ],
)
def test_the_largest_thumbnails_are_chosen(window, count, grid):
    assert thumbnail_grid(window, count, 1.0) == grid


def test_thumbnails_grow_with_the_scale_of_text():
    assert thumbnail_grid((400, 300), 12, 1.0) is None
    assert thumbnail_grid((480, 360), 12, 1.0) is not None
    assert thumbnail_grid((480, 360), 12, 2.0) is None


@pytest.mark.parametrize("window", [(1, 1), (100, 80), (1000, 3), (60, 2000)])
def test_a_window_too_small_has_no_strip(window):
    assert thumbnail_grid(window, 5, 1.0) is None


@pytest.mark.parametrize("window", [(800, 600), (480, 360), (1280, 720)])
def test_the_strip_shows_every_picture_whole_but_for_its_label(window):
    grid = thumbnail_grid(window, len(BUFFERS), 1.0)
    width, height = grid.size
    pictures = {name: np.full((height, width, 3), 18 * (i + 1), np.uint8) for i, name in enumerate(BUFFERS)}
    band = buffer_strip(pictures, grid, 1.0)
    assert window[0] - 12 <= band.shape[1] <= window[0]
    assert band.shape[0] == 2 * (height + GAP) + GAP
    for i, name in enumerate(BUFFERS):
        row, column = divmod(i, grid.columns)
        top, left = GAP + row * (height + GAP), GAP + column * (width + GAP)
        place = band[top : top + height, left : left + width]
        assert (place[..., 3] == 255).all()
        shown = (place[..., :3] == 18 * (i + 1)).all(axis=-1)
        assert shown.mean() > 0.6, name
        # the label is in the corner, and ends before the picture does
        assert shown[height // 2 :].all()
        assert shown[:, -1].all()
        assert not shown[: height // 3, : width // 4].all()
    outside = band[..., 3] != 255
    assert (band[outside] == (0, 0, 0, 150)).all()


def test_labels_are_of_one_size_and_shrink_together():
    grid = Grid(2, (60, 45))
    band = buffer_strip(
        {name: np.zeros((45, 60, 3), np.uint8) for name in ("id", "position_world")}, grid, 1.0
    )
    full = text_plate("", LABEL, title="id")
    longest = text_plate("", LABEL, title="position_world").shape[1]
    label = text_plate("", LABEL * (60 - GAP) / longest, title="id")
    assert label.shape[0] < full.shape[0]
    top, left = GAP + GAP // 2, GAP + GAP // 2
    seen = band[top : top + label.shape[0], left : left + label.shape[1], :3]
    assert np.abs(seen.astype(int) - label[..., :3]).max() <= 1
