"""Plates of text, the strip of buffers, and putting them over a picture."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firefly_sample.viewer.overlay import BRIGHT, PLATE, blend, columns_plate, rows_plate, text_plate

ROWS = (("lights", "489 in view of 500"), ("frame", "24 fps"))
PLATES = {
    "line": lambda scale=1.0: text_plate("saved forest_0001.png", scale, 1000),
    "title": lambda scale=1.0: text_plate("white to dark", scale, title="depth"),
    "rows": lambda scale=1.0: rows_plate("forest", ROWS, "F1 shows the keys", scale),
    "columns": lambda scale=1.0: columns_plate(
        ((("Scene", ROWS), ("Mouse", ROWS)), (("Window", ROWS),)), "driver", scale
    ),
}


@pytest.mark.parametrize("name", PLATES)
def test_a_plate_is_dark_translucent_and_carries_bright_text(name):
    pixels = PLATES[name]()
    assert pixels.dtype == np.uint8
    assert pixels.shape[2] == 4
    assert (pixels[..., :3] <= pixels[..., 3:]).all()  # multiplied by alpha
    corners = pixels[[0, 0, -1, -1], [0, -1, 0, -1], 3]
    assert (corners < 40).all()
    alpha = pixels[..., 3]
    body = np.median(alpha)
    assert PLATE[3] <= body < 255
    assert (alpha == 255).sum() > 50  # the text hides what is behind it
    assert (pixels[..., 0] > 200).any()


@pytest.mark.parametrize("name", PLATES)
def test_a_plate_is_drawn_once(name):
    pixels = PLATES[name]()
    assert PLATES[name]() is pixels
    with pytest.raises(ValueError, match="read-only"):
        pixels[0, 0, 0] = 1


@pytest.mark.parametrize("name", PLATES)
def test_a_plate_grows_with_the_scale(name):
    small, large = PLATES[name](1.0), PLATES[name](2.0)
    np.testing.assert_allclose(large.shape[:2], 2 * np.array(small.shape[:2]), atol=2)


def test_text_stays_inside_its_plate():
    """No text touches the margin: the outermost columns and rows are plain plate."""
    for make in PLATES.values():
        pixels = make()
        middle = pixels[pixels.shape[0] // 2, 1]
        for edge in (pixels[12:-12, 1], pixels[12:-12, -2], pixels[1, 12:-12], pixels[-2, 12:-12]):
            assert (edge == middle).all()


def test_other_text_is_another_plate():
    assert not np.array_equal(text_plate("lamps 11", 1.0, 500), text_plate("lamps 17", 1.0, 500))


LONG = "no window is too small for a message that is as long as this one, however long it is"


@pytest.mark.parametrize("widest", [60, 150, 400])
@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_long_text_wraps_between_words(widest, scale):
    line = text_plate("word", scale, 10_000)
    pixels = text_plate(LONG, scale, round(widest * scale))
    longest = max(text_plate(word, scale, 10_000).shape[1] for word in LONG.split())
    assert pixels.shape[1] <= max(round(widest * scale) + 1, longest)
    assert pixels.shape[0] > 1.5 * line.shape[0]
    assert text_plate(LONG, scale, 10_000).shape[0] == line.shape[0]


def test_a_long_note_wraps_beside_its_title():
    wide, narrow = (text_plate(LONG, 1.0, widest, title="depth") for widest in (math.inf, 300))
    assert narrow.shape[1] <= 300 < wide.shape[1]
    assert narrow.shape[0] > 1.5 * wide.shape[0]
    title = np.abs(narrow[: wide.shape[0] - 12, :40].astype(int) - wide[:-12, :40])
    assert title.max() == 0


def test_the_corner_does_not_jump_with_its_digits():
    widths = {rows_plate("forest", (("frame", text),), "", 1.0).shape[1] for text in ("9.1 fps", "31 fps")}
    assert len(widths) == 1


def test_blending():
    picture = np.full((4, 5, 3), 200, np.uint8)
    plate = np.zeros((2, 2, 4), np.uint8)
    plate[0, 0] = (0, 0, 0, 0)
    plate[0, 1] = (*BRIGHT[:3], 255)
    plate[1] = (10, 20, 30, 51)
    before = picture.copy()
    result = blend(picture, plate, (3, 1))
    np.testing.assert_array_equal(picture, before)
    np.testing.assert_array_equal(result[1, 3], (200, 200, 200))
    np.testing.assert_array_equal(result[1, 4], BRIGHT[:3])
    np.testing.assert_array_equal(result[2, 3], (170, 180, 190))
    result[1:3, 3:5] = 200
    np.testing.assert_array_equal(result, before)


@pytest.mark.parametrize("corner", [(-1, -1), (4, 3), (5, 0), (0, 4), (-2, 0), (0, -9), (99, 99)])
def test_blending_cuts_off_what_lies_outside(corner):
    picture = np.zeros((4, 5, 3), np.uint8)
    plate = np.full((2, 2, 4), 255, np.uint8)
    expected = np.zeros((4, 5), bool)
    for y in range(corner[1], corner[1] + 2):
        for x in range(corner[0], corner[0] + 2):
            if 0 <= x < 5 and 0 <= y < 4:
                expected[y, x] = True
    np.testing.assert_array_equal(blend(picture, plate, corner).any(axis=-1), expected)
