"""The G-buffer as pictures: values whose colour is known."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.reference.color import linear_to_srgb
from firefly_sample.viewer.buffers import BUFFERS, DARKEST, buffer_picture

NOTHING = {
    "albedo": np.zeros((2, 3, 3), np.float32),
    "normal": np.zeros((2, 3, 3), np.float32),
    "depth": np.full((2, 3), np.inf, np.float32),
    "position_world": np.full((2, 3, 3), np.nan, np.float32),
    "id": np.full((2, 3), -1, np.int32),
}


@pytest.mark.parametrize("output", BUFFERS)
def test_where_nothing_is_it_is_black(output):
    pixels, note = buffer_picture(output, NOTHING[output])
    assert pixels.dtype == np.uint8
    np.testing.assert_array_equal(pixels, np.zeros((2, 3, 3)))
    assert note


def test_albedo_is_encoded_as_srgb():
    albedo = np.linspace(0, 1, 3000, dtype=np.float32).reshape(100, 10, 3)
    pixels, _ = buffer_picture("albedo", albedo)
    assert np.abs(pixels - 255 * linear_to_srgb(albedo)).max() <= 0.75


def test_normals():
    normals = np.array([[[1, 0, 0], [0, -1, 0], [0, 0, 1]]], np.float32)
    pixels, _ = buffer_picture("normal", normals)
    np.testing.assert_array_equal(pixels, [[[255, 128, 128], [128, 0, 128], [128, 128, 255]]])


@pytest.mark.parametrize("output", ["albedo", "normal"])
def test_the_classic_look_is_shown_as_stored(output):
    stored = np.array([[[0.0, 51 / 255, 1.0]]], np.float32)
    pixels, note = buffer_picture(output, stored, classic=True)
    np.testing.assert_array_equal(pixels, [[[0, 51, 255]]])
    assert note == "as stored"


def test_depth_is_grey_by_ratio():
    depth = np.array([[10.0, 20.0, 40.0, 80.0, 160.0, np.inf]], np.float32)
    pixels, note = buffer_picture("depth", depth)
    assert (pixels == pixels[..., :1]).all()
    grey = pixels[0, :, 0].astype(int)
    assert grey[0] == 255
    assert grey[4] == pytest.approx(255 * DARKEST, abs=1)
    assert grey[5] == 0
    steps = -np.diff(grey[:5])
    assert steps.max() - steps.min() <= 1
    assert "10 (white) to 160 units" in note


def test_depth_of_one_distance_and_behind_an_orthographic_eye():
    pixels, _ = buffer_picture("depth", np.full((1, 2), 7.0, np.float32))
    assert (pixels == 255).all()
    pixels, _ = buffer_picture("depth", np.array([[-3.0, 0.0, 1.0, 4.0]], np.float32))
    assert pixels[0, :, 0].tolist() == [255, 255, 255, pytest.approx(255 * DARKEST, abs=1)]


def test_positions_repeat_after_a_power_of_ten():
    place = np.array([[[0.0, 0.0, 0.0], [25.0, -25.0, 5.0], [35.0, np.nan, np.nan]]], np.float32)
    place[0, 2] = [35.0, -15.0, 15.0]
    pixels, note = buffer_picture("position_world", place)
    np.testing.assert_array_equal(pixels[0, 1], [128, 128, 128])
    np.testing.assert_array_equal(pixels[0, 2], pixels[0, 1])
    assert "every 10 units" in note


def test_ids_have_colours_of_their_own():
    ids = np.arange(-1, 300, dtype=np.int32)[None]
    pixels, _ = buffer_picture("id", ids)
    assert len(np.unique(pixels[0], axis=0)) == 301
    neighbours = np.abs(np.diff(pixels[0].astype(int), axis=0)).max(axis=1)
    assert neighbours.min() >= 60
    # the colour of an id does not depend on what else is seen
    np.testing.assert_array_equal(buffer_picture("id", ids[:, :6])[0], pixels[:, :6])
