"""The fireflies' motion against exact rational arithmetic, its ranges, its speed, and who depends on what."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.errors import ParameterError
from firefly_sample.scene.random import uniform
from firefly_sample.scenes.fireflies import Fireflies

seeds = st.integers(0, 2**64 - 1)
times = st.floats(-1e9, 1e9) | st.floats(allow_nan=False, allow_infinity=False)


def twin(seed: int, k: int, time: float) -> tuple[list[mpmath.mpf], mpmath.mpf, list[mpmath.mpf]]:
    """Position, size and colour of firefly k: rationals where they suffice, 60 digits elsewhere."""
    u = [Fraction(float(uniform(seed, draw, k))) for draw in range(14)]

    def duration(draw: int, low: str, high: str) -> Fraction:
        first = Fraction(math.ceil(Fraction(low) * 2**20), 2**20)
        last = Fraction(math.floor(Fraction(high) * 2**20), 2**20)
        return first + (last - first) * Fraction(math.floor(u[draw] * 2**24), 2**24)

    out, back = duration(5, "7", "12"), duration(6, "7", "12")
    now = (Fraction(time) + u[7] * (out + back)) % (out + back)
    along = now / out if now <= out else 1 - (now - out) / back

    rest, swell, shrink = duration(8, "0.8", "1.5"), duration(9, "0.8", "1.5"), duration(10, "1", "2")
    now = (Fraction(time) + u[11] * (rest + swell + shrink)) % (rest + swell + shrink)
    if now < rest:
        size = Fraction("0.2")
    elif now < rest + swell:
        size = Fraction("0.2") + Fraction("0.8") * (now - rest) / swell
    else:
        size = 1 - Fraction("0.8") * (now - rest - swell) / shrink

    green = Fraction("0.8") + Fraction("0.2") * u[12]
    blue = min(green, Fraction("0.5") + Fraction("0.5") * u[13])

    def real(x: Fraction) -> mpmath.mpf:
        return mpmath.mpf(x.numerator) / x.denominator

    with mpmath.workdps(60):
        z = real(2 * u[3] - 1)
        angle = 2 * mpmath.pi * real(u[4])
        across = mpmath.sqrt(1 - z * z)
        direction = [across * mpmath.cos(angle), across * mpmath.sin(angle), z]
        start = [-50 + 100 * u[0], -100 + 250 * u[1], -10 + 90 * u[2]]
        position = [real(s) + 20 * d * real(along) for s, d in zip(start, direction, strict=True)]
        return position, real(size), [mpmath.mpf(1), real(green), real(blue)]


@settings(deadline=None)
@given(seeds, times)
def test_exact_twin(seed: int, time: float) -> None:
    count = 3
    positions, sizes, colors = Fireflies(seed, count).at(time)
    assert positions.dtype == sizes.dtype == colors.dtype == np.float64
    for k in range(count):
        position, size, color = twin(seed, k, time)
        assert max(abs(a - b) for a, b in zip(positions[k], position, strict=True)) < 1e-12
        assert abs(sizes[k] - size) < 1e-12
        assert max(abs(a - b) for a, b in zip(colors[k], color, strict=True)) < 1e-15


@pytest.mark.parametrize("time", [0.0, -0.0, -1e-300, -1.0, -123456.789, 1e9, -1e9, 1e9 + 1 / 3])
def test_exact_twin_at_marked_times(time: float) -> None:
    positions, sizes, _ = Fireflies(7, 50).at(time)
    for k in range(50):
        position, size, _ = twin(7, k, time)
        assert max(abs(a - b) for a, b in zip(positions[k], position, strict=True)) < 1e-12
        assert abs(sizes[k] - size) < 1e-12


@given(seeds, st.integers(0, 60), st.integers(0, 60), times)
def test_more_fireflies_leave_the_first_ones_alone(seed: int, few: int, many: int, time: float) -> None:
    few, many = sorted((few, many))
    for some, all_ in zip(Fireflies(seed, few).at(time), Fireflies(seed, many).at(time), strict=True):
        assert some.tobytes() == all_[:few].tobytes()


def test_thousand_begin_with_ten() -> None:
    for some, all_ in zip(Fireflies(7, 10).at(5.0), Fireflies(7, 1000).at(5.0), strict=True):
        assert some.tobytes() == all_[:10].tobytes()


def test_no_memory() -> None:
    flies = Fireflies(7, 100)
    first = flies.at(3.0)
    flies.at(1e6)
    again = flies.at(3.0)
    other = Fireflies(7, 100).at(3.0)
    for a, b, c in zip(first, again, other, strict=True):
        assert a.tobytes() == b.tobytes() == c.tobytes()


def test_seeds_differ() -> None:
    a, b = Fireflies(7, 500).at(0.0), Fireflies(8, 500).at(0.0)
    assert (np.linalg.norm(a.positions - b.positions, axis=1) > 1e-3).all()
    # All 64 bits of the seed count.
    assert not np.array_equal(Fireflies(7 + 2**63, 5).start, Fireflies(7, 5).start)


def test_ranges() -> None:
    flies = Fireflies(11, 20_000)
    assert (flies.start >= [-50, -100, -10]).all()
    assert (flies.start < [50, 150, 80]).all()
    np.testing.assert_allclose(np.linalg.norm(flies.step, axis=1), 20.0, rtol=1e-15)
    for seconds, low, high in [
        (flies.out, 7, 12),
        (flies.back, 7, 12),
        (flies.rest, 0.8, 1.5),
        (flies.swell, 0.8, 1.5),
        (flies.shrink, 1, 2),
    ]:
        assert low <= seconds.min() < low + 0.001 * (high - low)
        assert high - 0.001 * (high - low) < seconds.max() <= high
    assert (flies.colors[:, 0] == 1.0).all()
    assert 0.8 <= flies.colors[:, 1].min() < 0.8001
    assert 0.9999 < flies.colors[:, 1].max() < 1.0
    assert 0.5 <= flies.colors[:, 2].min() < 0.5001
    assert (flies.colors[:, 2] <= flies.colors[:, 1]).all()
    assert not flies.colors.flags.writeable
    for time in (0.0, 1.7, -40.0, 1e9):
        _, sizes, _ = flies.at(time)
        assert sizes.min() == 0.2
        assert 0.9999 < sizes.max() <= 1.0


def uniformity(values: np.ndarray) -> float:
    """Kolmogorov's distance of `values` in [0, 1] to uniform, times sqrt(n)."""
    n = len(values)
    ordered = np.sort(values)
    steps = np.arange(n + 1) / n
    return float(max((steps[1:] - ordered).max(), (ordered - steps[:-1]).max()) * np.sqrt(n))


def test_statistics() -> None:
    """Every quantity is uniform and independent of the others.

    P(D sqrt(n) > x) is at most 2 exp(-2 x^2) (Massart 1990): 1e-9 at x = 3.3. Correlations of
    independent columns have a standard error of 1/sqrt(n).
    """
    n = 20_000
    flies = Fireflies(3, n)
    directions = flies.step / 20.0
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    columns = {
        "x": (flies.start[:, 0] + 50) / 100,
        "y": (flies.start[:, 1] + 100) / 250,
        "z": (flies.start[:, 2] + 10) / 90,
        "height of direction": (directions[:, 2] + 1) / 2,
        "azimuth of direction": azimuth / (2 * np.pi) % 1.0,
        "out": (flies.out - 7) / 5,
        "back": (flies.back - 7) / 5,
        "flight phase": flies.flight_phase / (flies.out + flies.back),
        "rest": (flies.rest - 0.8) / 0.7,
        "swell": (flies.swell - 0.8) / 0.7,
        "shrink": flies.shrink - 1,
        "pulse phase": flies.pulse_phase / (flies.rest + flies.swell + flies.shrink),
        "green": (flies.colors[:, 1] - 0.8) / 0.2,
    }
    for name, values in columns.items():
        assert uniformity(values) < 3.3, name
    correlation = np.corrcoef(np.array(list(columns.values()))) - np.eye(len(columns))
    assert np.abs(correlation).max() < 6 / np.sqrt(n)


def test_speed_is_bounded_across_every_turn() -> None:
    """200 s of flight in small steps: 20/7 units a second at most, and each leg has a speed of its own."""
    flies = Fireflies(5, 200)
    dt = 1 / 64
    positions, sizes = zip(*[flies.at(t * dt)[:2] for t in range(-6400, 6400)], strict=True)
    speed = np.linalg.norm(np.diff(positions, axis=0), axis=2) / dt
    assert speed.max() <= 20 / 7 + 1e-9
    growth = np.diff(sizes, axis=0) / dt
    assert growth.max() <= 0.8 / 0.8 + 1e-9
    assert growth.min() >= -0.8 / 1.0 - 1e-9
    # Away from the turns every step has the speed of the leg it is on.
    legs = np.stack([20 / flies.out, 20 / flies.back])
    on_a_leg = (np.abs(speed[:, np.newaxis] - legs) < 1e-9).any(axis=1)
    assert 0.99 < on_a_leg.mean() < 1.0


@pytest.mark.parametrize("periods", [-(10**7), -1, 0, 1, 10**7])
def test_continuous_at_the_ends_of_periods(periods: int) -> None:
    """On both sides of the moment when a period ends, each firefly is home, or at its smallest."""
    flies = Fireflies(9, 40)
    for k in range(40):
        flight = float(flies.out[k] + flies.back[k])
        end = periods * flight - float(flies.flight_phase[k])
        for time in (np.nextafter(end, -np.inf), end, np.nextafter(end, np.inf)):
            away = np.linalg.norm(flies.at(time).positions[k] - flies.start[k])
            assert away <= 20 / 7 * 2 * np.spacing(abs(end)) + 1e-12
        pulse = float(flies.rest[k] + flies.swell[k] + flies.shrink[k])
        end = periods * pulse - float(flies.pulse_phase[k])
        for time in (np.nextafter(end, -np.inf), end, np.nextafter(end, np.inf)):
            assert flies.at(time).sizes[k] - 0.2 <= 2 * np.spacing(abs(end)) + 1e-12


def test_linear_like_panda3d() -> None:
    """Panda3D's own interval between start and far point, looped, is where our firefly is."""
    from direct.interval.IntervalGlobal import Sequence
    from panda3d.core import NodePath

    flies = Fireflies(2, 5)
    for k in range(5):
        insect = NodePath("insect")
        near, far = tuple(flies.start[k]), tuple(flies.start[k] + flies.step[k])
        flight = Sequence(
            insect.posInterval(float(flies.out[k]), far, near),
            insect.posInterval(float(flies.back[k]), near, far),
        )
        period = float(flies.out[k] + flies.back[k])
        for fraction in np.linspace(0.01, 0.99, 25):
            flight.setT(fraction * period)
            ours = flies.at(fraction * period - float(flies.flight_phase[k])).positions[k]
            # A Panda3D sequence rounds its times to milliseconds; the fastest leg makes 20/7 units a second.
            np.testing.assert_allclose(ours, insect.getPos(), rtol=0, atol=0.001 * 20 / 7)
        flight.pause()


def test_none_at_all() -> None:
    positions, sizes, colors = Fireflies(7, 0).at(5.0)
    assert positions.shape == (0, 3)
    assert sizes.shape == (0,)
    assert colors.shape == (0, 3)


@pytest.mark.parametrize("count", [-1, 2.5, "many", None])
def test_bad_counts(count: object) -> None:
    with pytest.raises(ParameterError, match="the count of fireflies must be a whole number of 0 or more"):
        Fireflies(7, count)  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", [-1, 2**64])
def test_bad_seeds(seed: int) -> None:
    with pytest.raises(ParameterError, match="seed must be"):
        Fireflies(seed, 1)


@pytest.mark.parametrize("time", [math.nan, math.inf, -math.inf])
def test_bad_times(time: float) -> None:
    with pytest.raises(ParameterError, match="time must be a finite number of seconds"):
        Fireflies(7, 1).at(time)
