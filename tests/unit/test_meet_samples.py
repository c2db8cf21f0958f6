"""Which lights fall between all lines of sight, and which do not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.plan.lights.bounds import meet_samples
from firefly_sample.plan.lights.light_set import ROUNDING
from tests.unit.test_clusters import LENSES, SIZE, balls, cones, perspective, points_of, view_of

EPSILON = 1e-9


def at_sample(view, column, row, y):
    """The view-space place at a distance, in samples from the lower left; a centre is at a half."""
    return points_of(view, np.array([column - 0.5]), np.array([row - 0.5]), np.array([y]))[0]


def sample_of(view, y):
    """Return the width of a sample at some distances."""
    return 2.0 / (view.lens.a * SIZE[0]) * (np.abs(y) if view.lens.perspective else np.ones_like(y))


@pytest.mark.parametrize(
    ("column", "row", "samples", "met"),
    [
        (30.5, 40.5, 1e-6, True),  # on a line of sight
        (30.0, 40.5, 0.4, False),  # between two of a row
        (30.0, 40.5, 0.51, True),
        (30.5, 41.0, 0.4, False),  # between two of a column
        (30.0, 41.0, 0.4, False),  # between four
        (0.0, 40.5, 0.4, False),  # before the first
        (0.0, 40.5, 0.51, True),
        (200.0, 40.5, 0.4, False),  # behind the last
        (200.0, 40.5, 0.51, True),
        (30.5, 120.0, 0.4, False),  # above the highest
    ],
)
def test_a_light_as_wide_as_some_samples(column, row, samples, met):
    view = view_of(perspective())
    y = 100.0
    one = 2.0 * y / (view.lens.a * SIZE[0])  # both ways: the samples of this lens are almost square
    lights = balls([at_sample(view, column, row, y)], samples * one)
    assert meet_samples(lights, view).tolist() == [met]


@settings(max_examples=100, deadline=None)
@given(LENSES, st.integers(0, 2**32 - 1), st.booleans())
def test_no_light_is_left_out_that_a_line_of_sight_meets(lens, seed, spots):
    """Against the plain definition: the places nearest to a light on the lines of sight around it."""
    rng, view, n = np.random.default_rng(seed), view_of(lens), 400
    low, high = max(view.near, -20.0), min(view.far, 400.0)
    y = low + (high - low) * rng.random(n) ** 2
    column, row = rng.uniform(-1.0, SIZE[0] + 1.0, n), rng.uniform(-1.0, SIZE[1] + 1.0, n)
    places = points_of(view, column - 0.5, row - 0.5, y)
    sample = sample_of(view, y)
    reaches = sample * 10.0 ** rng.uniform(-3.0, 0.5, n)
    axes = rng.normal(size=(n, 3))
    lights = cones(places, reaches, axes, rng.uniform(1.0, 180.0, n)) if spots else balls(places, reaches)
    met = meet_samples(lights, view)

    across, up = (steps.ravel()[:, None] for steps in np.mgrid[-5:6, -5:6])
    k, j = np.floor(column) + across, np.floor(row) + up
    line, light = np.nonzero((k >= 0) & (k < SIZE[0]) & (j >= 0) & (j < SIZE[1]))
    k, j, place, reach, far = k[line, light], j[line, light], places[light], reaches[light], y[light]
    one, other = points_of(view, k, j, far), points_of(view, k, j, far + sample_of(view, far))
    way = (other - one) / np.linalg.norm(other - one, axis=1, keepdims=True)
    nearest = one + way * np.einsum("nc,nc->n", place - one, way)[:, None]
    close = np.linalg.norm(nearest - place, axis=1) < reach
    light, way, nearest, place, reach = (values[close] for values in (light, way, nearest, place, reach))
    found = np.zeros(n, dtype=bool)
    for along in (-0.7, -0.3, 0.0, 0.3, 0.7):
        to = nearest + along * reach[:, None] * way - place
        distance = np.linalg.norm(to, axis=1)
        inside = distance < reach * (1.0 - EPSILON)
        if spots:
            axis, outer = lights.directions[light], lights.cones[light, 1]
            inside &= np.einsum("nc,nc->n", to, axis) >= (1.0 - outer) * distance
        found[light[inside]] = True
    assert not (found & ~met).any()
    if not spots:  # what is neither wide enough nor near a centre is left out: little is kept in vain
        slant = np.linalg.norm(places, axis=1) / np.abs(y) if view.lens.perspective else 1.0
        safe = reaches + ROUNDING * np.abs(places).max(axis=1)
        high = sample * view.lens.a * SIZE[0] / (view.lens.c * SIZE[1])  # a sample may be wider than high
        narrow = np.zeros(n, dtype=bool)
        for place, size in ((column, sample), (row, high)):
            narrow |= 1.05 * slant * safe / size + 0.1 < np.abs(place - np.floor(place) - 0.5)
        distant = 1e3 * safe < np.abs(y) if view.lens.perspective else True
        assert not met[narrow & distant].any()
        assert (narrow & distant).sum() > 20
