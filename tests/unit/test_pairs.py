"""Pairs of a pixel and a light are counted by tiles, and come out as if each had been measured."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.lab.reference.shade import PAIRS_LIGHTS, PAIRS_TILE, OneLight, count_pairs, pairs_in_reach
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.scene.light import Falloff


def light_set(positions, reaches, kind="point", **columns):
    positions = np.asarray(positions, dtype=np.float64)
    reaches = np.broadcast_to(np.asarray(reaches, dtype=np.float64), len(positions)).copy()
    colors = np.ones_like(positions)
    return LightSet.make(kind, Falloff.RAMP_SQUARED, colors, positions=positions, reaches=reaches, **columns)


def measured(position, lights):
    """Every pair by itself."""
    place = position.reshape(-1, 3)
    place = place[np.isfinite(place).all(axis=1)]
    return sum(int(OneLight(lights, row).in_reach(place).sum()) for row in range(len(lights)))


def landscape(width, height, seed=0, holes=True):
    """Positions of an uneven ground seen from above it, some of the pixels empty."""
    rng = np.random.default_rng(seed)
    x, z = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-0.9, -0.2, height))
    y = (6.0 + np.round(rng.random((height, width)))) / np.maximum(-z, 0.2) / 6
    position = np.stack([x * y, y, z * y], axis=-1)
    if holes:
        position[rng.random((height, width)) < 0.2] = np.nan
        position[: PAIRS_TILE[0] + 3, : PAIRS_TILE[1] + 1] = np.nan
    return position


@given(
    seed=st.integers(0, 10_000),
    width=st.integers(1, 70),
    height=st.integers(1, 40),
    count=st.integers(0, 60),
    scale=st.sampled_from([1e-6, 1.0, 1e6]),
    away=st.sampled_from([0.0, 1e3, 1e7]),
)
def test_they_are_those_of_measuring_each(seed, width, height, count, scale, away):
    rng = np.random.default_rng(seed)
    position = landscape(width, height, seed) * scale + away * scale
    positions = rng.uniform((-4, 0, -2), (4, 8, 2), (count, 3)) * scale + away * scale
    reaches = rng.choice([0.0, 0.3, 1.5, 40.0, 1e30, np.inf], count) * scale
    lights = light_set(positions, reaches)
    assert pairs_in_reach(position, lights) == measured(position, lights)


@pytest.mark.parametrize("away", [0.0, 3.0, 1e5])
def test_distances_that_are_the_reach_are_told_apart_as_when_measured(away):
    """A light at each pixel's own distance, and a rounding more or less: only the last digits differ."""
    position = landscape(24, 20, holes=False) + away
    lamp = np.array([0.3, 4.0, 0.7]) + away
    distances = np.linalg.norm(position.reshape(-1, 3) - lamp, axis=1)
    reaches = np.concatenate([distances, np.nextafter(distances, 0), np.nextafter(distances, np.inf)])
    lights = light_set(np.broadcast_to(lamp, (len(reaches), 3)), reaches)
    found = pairs_in_reach(position, lights)
    assert found == measured(position, lights)
    assert 0 < found < len(reaches) * len(distances)


def test_more_lights_than_are_multiplied_at_once():
    position = landscape(20, 18)
    rng = np.random.default_rng(3)
    lights = light_set(rng.uniform((-2, 1, -2), (2, 6, 0), (2 * PAIRS_LIGHTS + 5, 3)), 1.0)
    assert pairs_in_reach(position, lights) == measured(position, lights) > 0


def test_pixels_may_come_in_any_shape_and_none_at_all():
    position = landscape(31, 17)
    lights = light_set([(0, 4, -1), (1, 3, -1)], 2.0)
    whole = pairs_in_reach(position, lights)
    assert whole == pairs_in_reach(position.reshape(-1, 3), lights) > 0
    assert pairs_in_reach(np.full((5, 7, 3), np.nan), lights) == 0
    assert pairs_in_reach(np.zeros((0, 3)), lights) == 0


def test_directional_lights_reach_every_pixel_and_spotlights_their_cones():
    position = landscape(31, 17)
    covered = int(np.isfinite(position).all(axis=-1).sum())
    point = light_set([(0, 4, -1)], 2.0)
    suns = light_set(np.zeros((3, 3)), np.inf, "directional")
    axis = np.array([[0.0, -1.0, 0.0]])
    spots = [
        light_set([(0, 4, -1)], 2.0, "spot", directions=axis, cones=np.array([[0.0, opened, 0.0]]))
        for opened in (0.0, 1.0, 2.0)
    ]
    counts = [count_pairs(position, [spot]) for spot in spots]
    assert counts[0] < counts[1] < counts[2] == count_pairs(position, [point])
    assert count_pairs(position, [suns, point]) == 3 * covered + counts[2]
