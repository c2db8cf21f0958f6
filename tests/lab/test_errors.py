"""Each measure of error on pictures whose errors are known."""

import json
import math

import numpy as np
import pytest

from firefly_sample.lab.trade_bench import mean_flip, picture_errors, scale_of

SHAPE = (20, 30)


def compared(radiance, reference, color=None, reference_color=None, **more):
    grey = np.full((*SHAPE, 3), 100, np.uint8)
    whole = np.ones(SHAPE, bool)
    arguments = {"covered": whole, "reference_covered": whole, "chosen": whole} | more
    return picture_errors(
        radiance,
        color=grey if color is None else color,
        reference=reference,
        reference_color=grey if reference_color is None else reference_color,
        **arguments,
    )


def test_equal_pictures_have_no_error():
    picture = np.random.default_rng(0).uniform(0, 2, (*SHAPE, 3))
    errors = compared(picture, picture, flip=True)
    assert (errors.largest, errors.percentile_99, errors.largest_relative) == (0, 0, 0)
    assert (errors.relmse, errors.bias, errors.not_finite, errors.uncovered, errors.codes) == (0, 0, 0, 0, 0)
    assert errors.psnr == math.inf
    assert errors.flip == 0
    assert json.loads(json.dumps(errors.as_dict()))["psnr"] is None


def test_a_scaled_picture_has_its_scale_as_bias_and_relative_error():
    picture = np.full((*SHAPE, 3), 4.0)
    errors = compared(picture * 0.9, picture)
    for value in (errors.largest, errors.percentile_99, errors.largest_relative, -errors.bias):
        assert math.isclose(value, 0.1, rel_tol=1e-12)
    assert math.isclose(errors.relmse, 0.16 / 16.01, rel_tol=1e-12)
    # one with a unit of its own, exposed to the same picture, errs as much
    exposed = compared(picture * 900, picture * 1000, exposure=(1e-3, 1e-3, 1e-3))
    assert math.isclose(exposed.relmse, errors.relmse, rel_tol=1e-12)


def test_one_wrong_value_is_the_largest_and_beyond_the_percentile():
    picture = np.ones((*SHAPE, 3))
    wrong = picture.copy()
    wrong[3, 4, 1] = 1.5
    errors = compared(wrong, picture)
    assert errors.largest == 0.5
    assert errors.percentile_99 == 0
    assert math.isclose(errors.bias, 0.5 / picture.size)


def test_in_the_dark_the_relative_error_has_a_floor():
    picture = np.ones((*SHAPE, 3))
    picture[0, 0] = 0.0
    wrong = picture.copy()
    wrong[0, 0] = 1e-4
    assert math.isclose(compared(wrong, picture).largest_relative, 0.1)


def test_what_is_no_number_is_counted_and_counts_as_black():
    picture = np.ones((*SHAPE, 3))
    wrong = picture.copy()
    wrong[0, 0] = np.nan, np.inf, 1.0
    errors = compared(wrong, picture)
    assert errors.not_finite == 2
    assert errors.largest == 1.0


def test_pixels_left_out_are_not_looked_at():
    picture, chosen = np.ones((*SHAPE, 3)), np.ones(SHAPE, bool)
    wrong, covered = picture.copy(), chosen.copy()
    wrong[2, 2], covered[2, 2], chosen[2, 2] = 9.0, False, False
    color, grey = np.full((*SHAPE, 3), 100, np.uint8), np.full((*SHAPE, 3), 100, np.uint8)
    color[2, 2] = 255
    errors = compared(wrong, picture, color, grey, covered=covered, chosen=chosen, flip=True)
    assert (errors.largest, errors.uncovered, errors.codes, errors.flip) == (0, 0, 0, 0)
    assert compared(wrong, picture, color, grey, covered=covered).uncovered == 1
    nothing = compared(wrong, picture, chosen=np.zeros(SHAPE, bool))
    assert nothing.largest == 0


def test_codes_and_psnr():
    color, grey = np.full((*SHAPE, 3), 100, np.uint8), np.full((*SHAPE, 3), 90, np.uint8)
    errors = compared(np.ones((*SHAPE, 3)), np.ones((*SHAPE, 3)), color, grey)
    assert errors.codes == 10
    assert math.isclose(errors.psnr, 20 * math.log10(255 / 10))


def test_flip_is_between_nothing_and_everything():
    black, white = np.zeros((*SHAPE, 3), np.uint8), np.full((*SHAPE, 3), 255, np.uint8)
    assert mean_flip(black, black) == 0
    assert mean_flip(white, black) == pytest.approx(1.0, abs=0.05)
    near = np.full((*SHAPE, 3), 3, np.uint8)
    assert 0 < mean_flip(near, black) < 0.2


def test_a_black_reference_has_the_scale_one():
    assert scale_of(np.zeros((4, 4, 3))) == 1.0
    assert scale_of(np.zeros((0, 3))) == 1.0
