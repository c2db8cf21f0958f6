from functools import partial

import numpy as np
import pytest

from firefly_sample.lab.reference.particles import add_sprites
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.scenes import geom_node, orthographic_wall, wall, wall_scene


@pytest.mark.parametrize("position", ["linear32f", "depth32f", "depth24"])
def test_a_dot_is_seen_before_geometry_and_hidden_behind_it(render, position):
    scene = wall_scene(distance=10.0, color=(0, 0, 0, 1), size=100.0)
    before = scene.root.attach_new_node(Sprites("before", [(-2, 9, 0)], (1, 2, 3), 0.5))
    scene.root.attach_new_node(Sprites("behind", [(2, 11, 0)], (1, 2, 3), 0.5))
    frame = render(scene, Settings(position_method=position), (129, 97), ("radiance",))
    x, _, _ = before.node().arrays.positions[0]
    half = np.tan(np.radians(30))
    column = int((x / (9 * half * 129 / 97) + 1) / 2 * 129)
    assert frame.radiance[48, column] == pytest.approx((1, 2, 3), rel=0.02)
    assert (frame.radiance[:, 65:] == 0).all()


@pytest.mark.parametrize("make", [wall_scene, orthographic_wall])
def test_a_dots_profile_is_the_documented_one(render, make):
    scene = make(distance=50.0)
    scene.root.find("wall").detach_node()
    scene.root.attach_new_node(Sprites("dot", [(0, 10, 0)], (1, 1, 1), 3.0))
    frame = render(scene, None, (128, 96), ("radiance",))
    lens = scene.lens.for_picture(128, 96)
    ndc = ((np.arange(128) + 0.5) / 64 - 1)[None], (1 - (np.arange(96) + 0.5) / 48)[:, None]
    place = lens.constants().view_from_distance(*ndc, 10.0)
    s = np.maximum(1 - (place[..., 0] ** 2 + place[..., 2] ** 2) / 9.0, 0)
    assert np.abs(frame.radiance[..., 0] - s**2).max() <= 1e-5


def test_dots_add_to_each_other_and_to_the_background(render):
    scene = Scene(background=(0.125, 0.25, 0.5))
    scene.root.attach_new_node(Sprites("dots", [(0, 10, 0)] * 3, (1, 1, 1), 50.0))
    frame = render(scene, None, (3, 3), ("radiance",))
    single = (frame.radiance[1, 1] - (0.125, 0.25, 0.5)) / 3
    assert single == pytest.approx((1, 1, 1), abs=1e-6)


def test_a_dot_smaller_than_a_pixel_keeps_its_light(render):
    """Far dots are drawn a pixel wide and as much fainter: the light of the picture does not jump."""
    totals = []
    for radius in (0.4, 0.04, 0.004):
        scene = Scene()
        scene.root.attach_new_node(Sprites("dot", [(0.013, 20, 0.017)], (1, 1, 1), radius))
        scene.root.attach_new_node(geom_node("wall", wall(1.0))).set_pos(0, 50, 0)
        totals.append(render(scene, None, (160, 120), ("radiance",)).radiance[..., 0].sum() / radius**2)
    # where a two-pixel disc falls on the grid changes its sum of samples by some per cent
    assert totals[1] == pytest.approx(totals[0], rel=0.25)
    assert totals[2] == pytest.approx(totals[1], rel=1e-3)


@pytest.mark.parametrize("make", [wall_scene, partial(orthographic_wall, film=(64 / 3, 12.0))])
def test_dots_of_a_few_pixels_are_where_float64_has_them(render, make):
    """All over a wide picture, where a rasterizer's own way to a pixel rounds most."""
    scene = make(distance=80.0)
    scene.root.find("wall").detach_node()
    rng = np.random.default_rng(3)
    places = rng.uniform((-12, 20, -8), (12, 60, 8), (300, 3))
    scene.root.attach_new_node(Sprites("dots", places, (1, 1, 1), 0.05))
    size = (1600, 900)
    plan = build_plan(scene, Settings(), size, ("radiance",))
    expected = np.zeros((size[1], size[0], 3))
    add_sprites(expected, plan.sprites, plan.view, np.full(expected.shape[:2], np.inf))
    radiance = render(scene, None, size, ("radiance",)).radiance
    assert np.count_nonzero(expected.any(axis=2)) > 1000
    assert np.abs(radiance - expected).max() <= 2e-6
