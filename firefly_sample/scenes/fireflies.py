"""Motion, pulse and colours of fireflies as a pure function of (seed, time).

The motion is that of Panda3D's sample: from a start 20 units along a direction and back, repeatedly, while
the size rests, swells and shrinks. All random numbers of firefly k depend on (seed, k) alone, so adding
fireflies never moves the first ones.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ParameterError
from firefly_sample.scene.random import check_seed, uniform
from firefly_sample.settings import to_whole

Float64 = NDArray[np.float64]

START_LOW = (-50.0, -100.0, -10.0)
START_HIGH = (50.0, 150.0, 80.0)
TRAVEL = 20.0
FLIGHT_SECONDS = (7.0, 12.0)
REST_SECONDS = (0.8, 1.5)
SWELL_SECONDS = (0.8, 1.5)
SHRINK_SECONDS = (1.0, 2.0)
SIZE_SMALL = 0.2
SIZE_LARGE = 1.0
GREEN = (0.8, 1.0)
BLUE = (0.5, 1.0)

_DRAWS = 14
"""Random numbers per firefly: start 3, direction 2, flight 3, pulse 4, colour 2."""


class FireflyState(NamedTuple):
    """All fireflies at one time.

    Attributes
    ----------
    positions : ndarray of float64, shape (n, 3)
        World space, scene units.
    sizes : ndarray of float64, shape (n,)
        0.2 at rest to 1 at the peak of the pulse.
    colors : ndarray of float64, shape (n, 3)
        Linear; red is 1, blue at most green. Read-only, the same at all times.
    """

    positions: Float64
    sizes: Float64
    colors: Float64


class Fireflies:
    """Fireflies 0 to count - 1 of a seed; the first ones are the same for every count, bit for bit.

    Attributes
    ----------
    start, step : ndarray of float64, shape (n, 3)
        The nearest and the farthest point of the flight are ``start`` and ``start + step``.
    out, back, flight_phase : ndarray of float64, shape (n,)
        Seconds from the start to the far point, from there back, and of the flight passed at time 0.
    rest, swell, shrink, pulse_phase : ndarray of float64, shape (n,)
        The same for the pulse: small for `rest`, growing for `swell`, shrinking for `shrink` seconds.
    colors : ndarray of float64, shape (n, 3)
        Linear.

    Raises
    ------
    ParameterError
        If the seed or the count is out of range or not a whole number.
    """

    def __init__(self, seed: int, count: int) -> None:
        self.seed = check_seed(seed)
        whole = to_whole(count)
        if whole is None or whole < 0:
            raise ParameterError(f"the count of fireflies must be a whole number of 0 or more, got {count!r}")
        self.count = whole
        u = uniform(self.seed, np.arange(_DRAWS)[:, np.newaxis], np.arange(self.count))

        self.start: Float64 = _between(u[0:3].T, np.array(START_LOW), np.array(START_HIGH))
        self.step: Float64 = TRAVEL * _direction(u[3], u[4])
        self.out = _seconds(u[5], FLIGHT_SECONDS)
        self.back = _seconds(u[6], FLIGHT_SECONDS)
        self.flight_phase: Float64 = u[7] * (self.out + self.back)

        self.rest = _seconds(u[8], REST_SECONDS)
        self.swell = _seconds(u[9], SWELL_SECONDS)
        self.shrink = _seconds(u[10], SHRINK_SECONDS)
        self.pulse_phase: Float64 = u[11] * (self.rest + self.swell + self.shrink)

        green = _between(u[12], *GREEN)
        blue = np.minimum(green, _between(u[13], *BLUE))
        self.colors: Float64 = np.stack([np.ones(self.count), green, blue], axis=1)
        self.colors.flags.writeable = False

    def at(self, time: float) -> FireflyState:
        """Return positions and sizes at `time` (seconds; any finite number, including negative ones).

        They are within 1e-12 of exact arithmetic at any time: see `_seconds` and `_since`.

        Raises
        ------
        ParameterError
            If `time` is not finite.
        """
        if not math.isfinite(time):
            raise ParameterError(f"time must be a finite number of seconds, got {time!r}")

        # the minimum of a rising and a falling line is a triangle wave
        flight = self.out + self.back
        now = _since(time, self.flight_phase, flight)
        along = np.minimum(now / self.out, (flight - now) / self.back)

        pulse = self.rest + self.swell + self.shrink
        now = _since(time, self.pulse_phase, pulse)
        swollen = np.maximum(np.minimum((now - self.rest) / self.swell, (pulse - now) / self.shrink), 0.0)

        return FireflyState(
            self.start + self.step * along[:, np.newaxis],
            SIZE_SMALL + (SIZE_LARGE - SIZE_SMALL) * swollen,
            self.colors,
        )


def _between(u: Float64, low: Float64 | float, high: Float64 | float) -> Float64:
    return low + (high - low) * u


def _direction(u: Float64, v: Float64) -> Float64:
    """Return unit vectors, uniform on the sphere: by Archimedes, z is uniform on -1..1."""
    z = 2.0 * u - 1.0
    across = np.sqrt(4.0 * u * (1.0 - u))
    angle = 2.0 * math.pi * v
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)


def _seconds(u: Float64, limits: tuple[float, float]) -> Float64:
    """Return durations, uniform between `limits`, on a grid of 2**-44 seconds.

    The limits are moved inwards to multiples of 2**-20 s and `u` is cut to 24 bits: every product and sum
    of these, and so a period made of several, is exact in float64. A period that is off by 1e-15 s would
    be off by 1e-7 s after 1e9 s.
    """
    low = math.ceil(limits[0] * 2**20) / 2**20
    high = math.floor(limits[1] * 2**20) / 2**20
    return low + (high - low) * (np.floor(u * 2**24) / 2**24)


def _since(time: float, phase: Float64, period: Float64) -> Float64:
    """Return the seconds since the period began, 0 to `period`, if `phase` of it had passed at time 0.

    The remainder of `time` is taken before the phase is added: fmod is exact, and a sum with 1e9 is not.
    """
    now = np.fmod(time, period) + phase
    now = np.where(now < 0.0, now + period, now)
    return np.where(now >= period, now - period, now)
