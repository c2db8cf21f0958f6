"""The shadow maps as a picture: depths whose grey is known, in the tiles of a real plan."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from firefly_sample.pipeline import build_plan
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.settings import Settings
from firefly_sample.viewer.buffer_pictures import (
    DARKEST,
    EMPTY,
    particle_shadow_atlas_picture,
    shadow_atlas_picture,
)
from tests.clouds import cloud_scene, puff
from tests.viewer.workshop import workshop

FARTHEST = 255 * DARKEST


def plan_of(shadows=True, position="linear32f"):
    scene = workshop.build(shadows=shadows, lamps=0)
    settings = Settings(position_method=position)
    return build_plan(scene, settings, (80, 60), ("shadow_atlas",), 0.0, Capabilities())


def tile_of(image, shadow):
    """The part of an image with the first row on top that a map's tile is."""
    x, y, side = shadow.tile
    return image[image.shape[0] - y - side : image.shape[0] - y, x : x + side]


def atlas_of(plan, *distances):
    """An atlas in which each map holds distances in its middle column, and nothing else."""
    width, height = plan.shadows.size
    clear = 0.0 if plan.view.reverse else 1.0
    depth = np.full((height, width), clear, np.float32)
    for shadow in plan.shadows.maps:
        for row, distance in enumerate(distances):
            tile_of(depth, shadow)[row, shadow.tile.size // 2] = shadow.lens.depth_from_distance(distance)
    return depth


def test_the_scene_has_a_map_of_either_kind():
    maps = plan_of().shadows.maps
    assert [shadow.lens.perspective for shadow in maps] == [False, True]
    assert len({shadow.tile.size for shadow in maps}) == 2


@pytest.mark.parametrize("position", ["linear32f", "depth24"])
def test_each_map_is_grey_from_its_nearest_to_its_farthest(position):
    plan = plan_of(position=position)
    assert plan.view.reverse is (position != "depth24")
    picture, note = shadow_atlas_picture(atlas_of(plan, 2.0, 4.0, 8.0), plan, plan.shadows.size)
    assert picture.shape == (*plan.shadows.size[::-1], 3)
    for shadow in plan.shadows.maps:
        tile = tile_of(picture, shadow)
        middle = tile[:, shadow.tile.size // 2]
        assert (middle[:3] == middle[:3, :1]).all()
        near, between, far = middle[:3, 0].astype(int)
        # by ratio from a place, evenly from infinity
        half = 0.5 if shadow.lens.perspective else 1 / 3
        assert (near, far) == (255, pytest.approx(FARTHEST, abs=1))
        assert between == pytest.approx(255 * (1 - (1 - DARKEST) * half), abs=1)
        assert (middle[3:] == EMPTY).all()
        assert (np.delete(tile, shadow.tile.size // 2, axis=1) == EMPTY).all()
    width, height = plan.shadows.size
    assert note.startswith(f"2 maps, {width} x {height} texels: ")


def test_a_map_at_one_distance_is_white_and_an_empty_one_is_empty():
    plan = plan_of()
    for distances, colors in (((3.0,), {(255, 255, 255), EMPTY}), ((), {EMPTY})):
        picture, _ = shadow_atlas_picture(atlas_of(plan, *distances), plan, plan.shadows.size)
        for shadow in plan.shadows.maps:
            assert set(map(tuple, tile_of(picture, shadow).reshape(-1, 3).tolist())) == colors


@pytest.mark.parametrize("size", [(80, 60), (300, 20), (20, 300), (1000, 900), (1, 1)])
def test_it_fits_the_window_with_its_shape_kept(size):
    plan = plan_of()
    across, down = plan.shadows.size
    picture, _ = shadow_atlas_picture(atlas_of(plan), plan, size)
    assert picture.shape == (size[1], size[0], 3)
    drawn = picture.any(axis=-1)
    if min(size) < 10:
        return
    # the sun's tile is as wide as the atlas and lies at its lower edge
    sun = plan.shadows.maps[0].tile
    assert (sun.x, sun.y, sun.size) == (0, 0, across)
    scale = min(size[0] / across, size[1] / down)
    rows, columns = drawn.any(axis=1).nonzero()[0], drawn.any(axis=0).nonzero()[0]
    assert np.ptp(columns) + 1 == round(across * scale)
    assert np.ptp(rows) + 1 == pytest.approx(down * scale, abs=1)
    # in the middle of the window
    assert abs(columns.min() - (size[0] - 1 - columns.max())) <= 1
    assert abs(rows.min() - (size[1] - 1 - rows.max())) <= 1


def test_every_pixel_is_a_texel():
    """Nothing is averaged: there are no greys but those of the texels."""
    plan = plan_of()
    picture, _ = shadow_atlas_picture(atlas_of(plan, 2.0, 8.0), plan, (500, 450))
    colors = {tuple(color) for color in np.unique(picture.reshape(-1, 3), axis=0).tolist()}
    greys = colors - {(0, 0, 0), EMPTY, (255, 255, 255)}
    assert all(color == pytest.approx((FARTHEST,) * 3, abs=1) for color in greys)
    assert len(colors) <= 5


def test_a_tile_that_was_not_drawn_for_this_frame_is_black():
    plan = plan_of()
    sun, spot = plan.shadows.maps
    maps = (dataclasses.replace(sun, casters=None), spot)
    plan = dataclasses.replace(plan, shadows=dataclasses.replace(plan.shadows, maps=maps))
    picture, _ = shadow_atlas_picture(atlas_of(plan, 2.0, 8.0), plan, plan.shadows.size)
    assert not tile_of(picture, sun).any()
    assert tile_of(picture, spot).all()


def test_without_shadows_it_is_black_and_says_why():
    picture, note = shadow_atlas_picture(np.zeros((0, 0), np.float32), plan_of(shadows=False), (80, 60))
    np.testing.assert_array_equal(picture, np.zeros((60, 80, 3)))
    assert note == "no light casts shadows"


def test_slices_of_shadow_are_white_where_light_comes_through():
    scene = cloud_scene(puff(50))
    plan = build_plan(scene, Settings(), (80, 60), ("particle_shadow_atlas",))
    width, height = plan.particle_shadow.size
    taken = np.zeros((height, width, 3), np.float32)
    taken[: height // 2, :, 0] = np.log(2.0)  # the upper half lets half of the red through
    picture, note = particle_shadow_atlas_picture(taken, plan, (80, 60))
    assert note.startswith("64 slices of 128 texels")
    assert (picture[:, :10] == 0).all()  # as high as fits, in the middle
    assert (picture[31:, 12:68] == 255).all()
    assert (picture[:29, 12:68] == (188, 255, 255)).all()
    blend = build_plan(scene, Settings(particle_shadows="blend"), (80, 60), ("particle_shadow_atlas",))
    halves, _ = particle_shadow_atlas_picture(np.full_like(taken, 0.5), blend, (80, 60))
    assert (halves[:, 12:68] == 188).all()


def test_without_particles_there_are_no_slices():
    picture, note = particle_shadow_atlas_picture(np.zeros((0, 0, 3), np.float32), plan_of(), (8, 6))
    assert note == "no particles cast shadows"
    assert not picture.any()
