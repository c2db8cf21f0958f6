"""The reach of lights against 60 digits, in every degenerate case."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.plan.lights.reach import budget_thresholds, light_reach
from firefly_sample.scene.light import Attenuation


def exact(attenuation, intensity, threshold):
    """The positive root in 400 digits, which no cancellation of floats exhausts."""
    with mpmath.workdps(400):
        kc, kl, kq, i, t = (mpmath.mpf(float(x)) for x in (*attenuation, intensity, threshold))
        if i == 0:
            return mpmath.mpf(0)
        if t == 0:
            return mpmath.inf
        k = i / t - kc
        if k <= 0:
            return mpmath.mpf(0)
        if kq == 0:
            return mpmath.inf if kl == 0 else k / kl
        return (mpmath.sqrt(kl * kl + 4 * kq * k) - kl) / (2 * kq)


def relative_error(attenuation, intensity, threshold):
    (found,) = light_reach([attenuation], [intensity], threshold)
    expected = exact(attenuation, intensity, threshold)
    if expected == 0 or mpmath.isinf(expected):
        return 0.0 if found == float(expected) else np.inf
    return float(abs(mpmath.mpf(float(found)) / expected - 1))


coefficient = st.just(0.0) | st.floats(-30, 30).map(lambda e: 10.0**e)
positive = st.floats(-30, 30).map(lambda e: 10.0**e)


@settings(max_examples=500, deadline=None)
@given(st.tuples(coefficient, coefficient, coefficient).filter(any), positive, positive)
def test_the_root_is_right_over_sixty_orders_of_magnitude(attenuation, intensity, threshold):
    assert relative_error(attenuation, intensity, threshold) <= 1e-14


@settings(max_examples=300, deadline=None)
@given(coefficient, coefficient, st.floats(0.1, 10), st.floats(1e-6, 10), st.integers(-60, 60))
def test_a_light_that_is_hardly_above_its_threshold_keeps_its_digits(kl, kq, kc, threshold, ulps):
    """Where I/t and Kc agree, the difference of their rounded values would be noise."""
    intensity = threshold * kc
    intensity += ulps * np.spacing(intensity)
    assert relative_error((kc, kl, kq), intensity, threshold) <= 1e-14


@pytest.mark.parametrize(
    ("attenuation", "intensity", "threshold", "reach"),
    [
        ((1, 0, 0), 1, 0.5, np.inf),  # never fades
        ((1, 0.09, 0), 1, 0.5, 1 / 0.09),  # only linear
        ((1, 0, 1), 1, 0.1, 3.0),  # only quadratic
        ((2, 0, 1), 1, 0.5, 0.0),  # at its threshold already
        ((2, 0, 1), 1, 0.6, 0.0),  # below it
        ((1, 0, 0), 1, 1.5, 0.0),
        ((1, 0, 1), 0, 0.1, 0.0),  # black
        ((1, 0, 1), 1, 0.0, np.inf),  # nothing is cut off
        ((0, 0, 1), 1e30, 1e-6, 1e18),
        ((0, 2, 0), 1e30, 1, 5e29),
        ((1, 0, 1e-300), 1, 0.5, 1e150),
    ],
)
def test_degenerate_cases(attenuation, intensity, threshold, reach):
    assert light_reach([attenuation], [intensity], threshold)[0] == pytest.approx(reach, rel=1e-14, abs=0)


def test_the_slides_light_volume():
    """(1, 0.09, 0.032) at 5/256 and at 0.01, by the slides' own formula."""
    for threshold in (5 / 256, 0.01):
        kc, kl, kq = Attenuation.FIFTY_UNITS
        slides = (-kl + np.sqrt(kl**2 - 4 * kq * (kc - 1 / threshold))) / (2 * kq)
        (found,) = light_reach([Attenuation.FIFTY_UNITS], [1.0], threshold)
        assert found == pytest.approx(slides, rel=1e-12)
        d = found
        assert 1 / (kc + kl * d + kq * d * d) == pytest.approx(threshold, rel=1e-14)


@given(st.lists(st.just(0.0) | positive, max_size=30), st.floats(0, 1))
def test_a_budgets_shares_add_up_to_it(intensity, budget):
    shares = budget_thresholds(intensity, budget)
    assert len(shares) == len(intensity)
    assert shares.sum() <= budget * (1 + 1e-12)
    if any(intensity):
        assert shares.sum() == pytest.approx(budget, rel=1e-12)


def test_a_budgets_shares_light_the_least_area():
    """Moving a part of one light's share to another makes the sum of R^2 grow."""
    intensity = np.array([0.1, 1.0, 7.0, 30.0])
    inverse_square = np.tile([0.0, 0.0, 1.0], (4, 1))
    shares = budget_thresholds(intensity, 1e-3)

    def area(thresholds):
        return (light_reach(inverse_square, intensity, thresholds) ** 2).sum()

    for a in range(4):
        for b in range(4):
            if a != b:
                moved = shares.copy()
                moved[a] -= 0.01 * shares.min()
                moved[b] += 0.01 * shares.min()
                assert area(moved) > area(shares)
