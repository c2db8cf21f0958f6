"""The exact sum over particles against the same by hand, wherever the places are."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.lab.reference.particles import exact_sums
from firefly_sample.scene.lights import Spotlight
from firefly_sample.scene.particles import ParticleNode
from tests.clouds import ball_of, cloud_scene, puff, volume_of


def by_hand(particle_shadow, places, rows):
    """Every particle on every place."""
    across = places[:, None, :2] - particle_shadow.positions[None, :, :2]
    squares = (across**2).sum(axis=2) / particle_shadow.radii**2
    share = np.maximum(1.0 - squares, 0.0) ** 2
    share *= places[:, None, 2] > particle_shadow.positions[None, :, 2]
    share[rows[:, None] == np.arange(len(particle_shadow))] = 0.0
    return share @ particle_shadow.strengths


@given(st.integers(0, 999), st.integers(1, 60), st.floats(1e-30, 3.0))
def test_the_sum_is_that_over_all_particles(seed, count, size):
    rng = np.random.default_rng(seed)
    node = ParticleNode("c", ball_of(count, seed), size * rng.random(count), rng.random(count))
    particle_shadow = volume_of(cloud_scene(node))
    if particle_shadow is None:  # every one of them is nothing
        return
    free = np.column_stack([rng.uniform(-40, 168, (50, 2)), rng.uniform(-5, 70, 50)])
    places = np.concatenate([particle_shadow.positions, free])
    rows = np.concatenate([np.arange(len(particle_shadow)), np.full(50, -1)])
    np.testing.assert_allclose(
        exact_sums(particle_shadow, places, rows), by_hand(particle_shadow, places, rows), atol=1e-12
    )


def test_places_far_aside_or_nowhere_get_nothing_and_cost_nothing():
    particle_shadow = volume_of(cloud_scene(puff(100, radius=0.05), Spotlight("lamp")))
    places = np.array([[1e300, 0, 5], [-1e12, 64, 5], [np.nan, np.nan, 5], [np.inf, 64, 5], [64, 64, np.nan]])
    assert not exact_sums(particle_shadow, places).any()
    assert exact_sums(particle_shadow, np.array([[64.0, 64.0, 1e300]])).shape == (1, 3)
