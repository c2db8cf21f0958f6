"""The difference of two images: figures that are known beforehand, and the two limits."""

import math

import numpy as np
import pytest

from firefly_sample.capture.checking.comparing import Limits, by_name, measure
from firefly_sample.errors import OutputError

EXACT = Limits()


def codes(*changes):
    """Two pictures of 10 x 10 pixels, the second with other values at (row, column, channel)."""
    expected = np.full((10, 10, 3), 100, np.uint8)
    actual = expected.copy()
    for place, value in changes:
        actual[place] = value
    return expected, actual


def test_codes_are_counted_per_pixel():
    found = measure("color", *codes(((0, 0, 0), 103), ((0, 0, 1), 90), ((5, 5, 2), 101)), EXACT)
    assert (found.pixels, found.of, found.largest, found.scale) == (2, 100, 10.0, None)
    assert found.mean == pytest.approx((3 + 10 + 1) / 300)
    assert np.argwhere(found.over).tolist() == [[0, 0], [5, 5]]


@pytest.mark.parametrize(
    ("limits", "within"),
    [
        (Limits(), False),
        (Limits(max_codes=9), False),
        (Limits(max_codes=10), True),
        (Limits(max_share=0.01), False),
        (Limits(max_share=0.02), True),
        (Limits(max_codes=9, max_share=0.01), True),  # one of both pixels is within 9 codes
        (Limits(max_error=1e9), False),  # which is for float images
    ],
)
def test_a_pixel_or_few_may_be_over_the_limit(limits, within):
    images = codes(((0, 0, 0), 110), ((5, 5, 2), 91))
    assert measure("color", *images, limits).is_within(limits) == within


def test_values_that_wrap_around_differ_by_all_codes():
    found = measure("color", np.zeros((1, 1, 3), np.uint8), np.full((1, 1, 3), 255, np.uint8), EXACT)
    assert (found.largest, found.mean) == (255.0, 255.0)


def test_a_float_error_is_relative_to_the_bright_part_of_the_expected_image():
    """One highlight of 1e6 does not make the limit coarse."""
    expected = np.full((100, 100), 8.0, np.float32)
    expected[0, 0] = 1e6
    actual = expected.copy()
    actual[3, 4] += 0.5
    found = measure("depth", expected, actual, EXACT)
    assert (found.pixels, found.largest, found.scale) == (1, 0.5, 8.0)
    assert not found.is_within(EXACT)
    for error, within in ((0.0624, False), (0.0626, True)):
        limits = Limits(max_error=error)
        assert measure("depth", expected, actual, limits).is_within(limits) == within


def test_nothing_drawn_is_the_same_as_nothing_drawn_and_else_an_infinite_difference():
    expected = np.array([[np.nan, np.inf, 1.0, np.inf]], np.float32)
    assert measure("depth", expected, expected.copy(), EXACT).pixels == 0
    actual = np.array([[np.nan, 2.0, np.nan, -np.inf]], np.float32)
    found = measure("depth", expected, actual, Limits(max_error=1e9))
    assert (found.pixels, found.largest, found.mean) == (3, math.inf, 0.0)
    assert measure("depth", expected * np.nan, expected * np.nan, EXACT).pixels == 0


def test_whole_numbers_are_equal_or_not():
    expected = np.zeros((10, 10, 2), np.int32)
    actual = expected.copy()
    actual[0, 0] = 5, 6
    found = measure("visibility", expected, actual, Limits(max_codes=255, max_error=9))
    assert (found.pixels, found.of, found.largest, found.mean) == (1, 100, None, None)
    assert not found.is_within(EXACT)
    assert found.is_within(Limits(max_share=0.01))


def test_images_without_pixels_are_the_same():
    for output, shape in (("shadow_atlas", (0, 0)), ("particle_shadow_atlas", (0, 0, 3))):
        empty = np.zeros(shape, np.float32)
        assert measure(output, empty, empty, EXACT).is_within(EXACT)


def test_ids_are_compared_by_the_names_behind_them():
    ours = np.array([[0, 1, 2, -1, 7]], np.int32), ["root/floor", "root/ball", "root/cat"]
    theirs = np.array([[1, 0, 2, -1, 7]], np.int32), ["root/ball", "root/floor", "root/dog"]
    found = measure("id", *by_name(*ours, *theirs), EXACT)
    assert np.argwhere(found.over).tolist() == [[0, 2]]
    found = measure("id", *by_name(ours[0], [], ours[0], ours[1]), EXACT)
    assert np.argwhere(~found.over).tolist() == [[0, 3], [0, 4]]


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({"max_codes": -1}, "max_codes must be a number from 0 to 255, got -1"),
        ({"max_codes": "2"}, "max_codes must be a number from 0 to 255, got '2'"),
        ({"max_share": 1.5}, "max_share must be a number from 0 to 1, got 1.5"),
        ({"max_error": math.nan}, "max_error must be a number, 0 or more, got nan"),
    ],
)
def test_limits_are_checked(limits, said):
    with pytest.raises(OutputError) as caught:
        Limits(**limits)
    assert str(caught.value) == said
