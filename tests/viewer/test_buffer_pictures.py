"""Buffers as pictures: values whose colour is known."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.frame import OUTPUTS
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear
from firefly_sample.viewer.buffer_pictures import BUFFERS, DARKEST, HEAT, buffer_picture, buffers_of

PICTURES = BUFFERS[:-2]  # the last, the atlases, have tests of their own
NOTHING = {
    "albedo": np.zeros((2, 3, 3), np.float32),
    "normal": np.zeros((2, 3, 3), np.float32),
    "depth": np.full((2, 3), np.inf, np.float32),
    "position_world": np.full((2, 3, 3), np.nan, np.float32),
    "id": np.full((2, 3), -1, np.int32),
    "specular": np.zeros((2, 3, 3), np.float32),
    "emission": np.zeros((2, 3, 3), np.float32),
    "light": np.zeros((2, 3, 3), np.float32),
    "overdraw": np.zeros((2, 3), np.int32),
    "volumes": np.zeros((2, 3, 3), np.uint8),
    "wireframe": np.zeros((2, 3, 3), np.uint8),
}


def test_every_buffer_is_an_output_and_keeps_its_name_and_place():
    assert (
        *("albedo", "normal", "depth", "position_world", "id", "specular", "emission", "light"),
        *("overdraw", "volumes", "wireframe", "shadow_atlas", "particle_shadow_atlas"),
    ) == BUFFERS
    assert set(BUFFERS) <= OUTPUTS.keys()
    assert buffers_of("correct") == BUFFERS
    missing = set(BUFFERS) - set(buffers_of("classic"))
    assert missing == {"specular", "emission", "shadow_atlas", "particle_shadow_atlas"}


@pytest.mark.parametrize("output", PICTURES)
def test_where_nothing_is_it_is_black(output):
    pixels, note = buffer_picture(output, NOTHING[output])
    assert pixels.dtype == np.uint8
    np.testing.assert_array_equal(pixels, np.zeros((2, 3, 3)))
    assert note


@pytest.mark.parametrize("output", ["albedo", "specular"])
def test_reflectances_are_encoded_as_srgb(output):
    albedo = np.linspace(0, 1, 3000, dtype=np.float32).reshape(100, 10, 3)
    pixels, _ = buffer_picture(output, albedo)
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


@pytest.mark.parametrize("output", ["light", "emission"])
def test_radiance_goes_through_exposure_tone_curve_and_srgb(output):
    radiance = np.geomspace(1e-4, 50.0, 3000, dtype=np.float32).reshape(100, 10, 3)
    exposure = (0.5, 1.0, 4.0)
    pixels, note = buffer_picture(output, radiance, exposure=exposure)
    expected = 255 * linear_to_srgb(-np.expm1(-radiance.astype(float) * exposure))
    assert np.abs(pixels - expected).max() <= 0.75
    assert "1 - exp(-x) and sRGB" in note


def test_radiance_beyond_all_bounds_is_white():
    light = np.array([[[1e30, np.inf, np.nan]]], np.float32)
    np.testing.assert_array_equal(buffer_picture("light", light)[0], [[[255, 255, 255]]])


def test_classic_light_is_in_display_codes():
    light = np.array([[[0.0, 51 / 255, 3.0]]], np.float32)
    pixels, note = buffer_picture("light", light, classic=True)
    np.testing.assert_array_equal(pixels, [[[0, 51, 255]]])
    assert "display codes" in note


@pytest.mark.parametrize("output", ["volumes", "wireframe"])
def test_pictures_are_shown_as_they_are(output):
    given = np.arange(18, dtype=np.uint8).reshape(2, 3, 3)
    np.testing.assert_array_equal(buffer_picture(output, given)[0], given)


def test_more_overdraw_is_always_lighter_from_black_to_white():
    counts = np.arange(60, dtype=np.int32)[None]
    pixels, note = buffer_picture("overdraw", counts)
    lightness = lightness_of(pixels[0])
    assert note.endswith("white 59")
    assert (lightness[0], lightness[-1]) == (0, pytest.approx(100, abs=1e-3))
    steps = np.diff(lightness)
    # equal steps of the count are steps of lightness that differ by a factor of 4 at most
    assert 0 < steps.max() < 4 * steps.min()


def test_a_single_layer_of_overdraw_is_the_largest_count():
    pixels, note = buffer_picture("overdraw", np.array([[0, 1]], np.int32))
    np.testing.assert_array_equal(pixels, [[HEAT[0], HEAT[-1]]])
    assert note.endswith("white 1")
    assert "no light" in buffer_picture("overdraw", np.zeros((2, 2), np.int32))[1]


def lightness_of(codes):
    """CIE L* of display codes."""
    luminance = srgb_to_linear(codes / 255) @ [0.2126, 0.7152, 0.0722]
    return np.where(luminance > (6 / 29) ** 3, 116 * np.cbrt(luminance) - 16, luminance * (29 / 3) ** 3)


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


def test_a_plane_through_a_whole_period_has_one_colour():
    """A floor at height 0, which is reconstructed a little above and below it."""
    place = np.zeros((1, 3, 3), np.float32)
    place[0, :, 2] = [-1e-6, 0.0, 1e-6]
    place[0, :, 0] = [-30.0, 0.0, 30.0]
    pixels, _ = buffer_picture("position_world", place)
    np.testing.assert_array_equal(pixels[0, :, 2], [0, 0, 0])


def test_ids_have_colours_of_their_own():
    ids = np.arange(-1, 300, dtype=np.int32)[None]
    pixels, _ = buffer_picture("id", ids)
    assert len(np.unique(pixels[0], axis=0)) == 301
    neighbours = np.abs(np.diff(pixels[0].astype(int), axis=0)).max(axis=1)
    assert neighbours.min() >= 60
    # the colour of an id does not depend on what else is seen
    np.testing.assert_array_equal(buffer_picture("id", ids[:, :6])[0], pixels[:, :6])
