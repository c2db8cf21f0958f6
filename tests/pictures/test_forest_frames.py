"""The forest itself: right against float64, lit, and not a black frame."""

import numpy as np
import pytest

from firefly_sample.lab.reference.frame import render_classic
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.passes.test_point_lights import BOUNDS, against_reference


@pytest.fixture(scope="module")
def forest():
    return build_scene(find_scene("forest"), seed=7)


@pytest.mark.parametrize(
    ("position", "size"),
    [(position, (800, 600) if position == "linear32f" else (240, 180)) for position in BOUNDS],
)
def test_the_forest_is_what_float64_says(forest, position, size):
    """In full size as it is drawn by default; in small, by other ways to find positions."""
    dots = forest.root.find_all_matches("**/+Sprites")
    for path in dots:
        path.hide()  # the reference shades surfaces
    try:
        error = against_reference(forest, Settings(position_method=position), size, 5.0)
    finally:
        for path in dots:
            path.show()
    assert error <= BOUNDS[position]


def test_culling_and_volumes_change_nothing_in_the_forest(forest):
    pictures = []
    for changes in ({}, {"light_method": "loop"}, {"volume_depth_test": False}):
        with make_renderer((160, 120), Settings(**changes)) as renderer:
            pictures.append(renderer.render(forest, 5.0, ("radiance",)).radiance)
    for other in pictures[1:]:
        assert np.abs(pictures[0] - other).max() <= 5e-6 * np.percentile(pictures[0], 99.9)


def test_the_classic_forest_is_what_float64_says(forest):
    """With ambient light, dots and sky: each light's share is rounded alike, hundreds of them a pixel."""
    with make_renderer((160, 120), Settings(look="classic")) as renderer:
        frame = renderer.render(forest, 5.0, outputs := ("color", "albedo", "visibility"))
        plan = renderer.plan(forest, 5.0, outputs)
    expected = render_classic(plan, frame.visibility, albedo=frame.albedo)
    assert np.abs(frame.color.astype(int) - expected).max() <= 1
    assert (frame.color == expected).mean() >= 0.999


def test_five_hundred_lights_and_none_dropped(forest):
    with make_renderer((160, 120)) as renderer:
        frame = renderer.render(forest, 5.0, ("color", "id"))
    assert (frame.lights.in_scene, frame.lights.dropped) == (500, 0)
    assert frame.lights.in_view > 400
    assert len(set(np.unique(frame.id)) - {-1}) > 100


def test_the_picture_is_a_night_with_lights_in_it(forest):
    """Dark on the whole, with warm highlights, and no part of it black."""
    with make_renderer((400, 300)) as renderer:
        color = renderer.render(forest, 5.0).color.astype(float)
    assert 15 < color.mean() < 80
    assert (color.max(axis=2) > 200).mean() > 0.002
    assert (color.max(axis=2) < 3).mean() < 0.01
    bright = color[color.max(axis=2) > 150]
    assert bright[:, 0].mean() > 1.15 * bright[:, 2].mean()


def test_without_fireflies_and_moonlight_nothing_shines():
    """Ambient 0 is the original's black, sky included: no light comes from anywhere else."""
    scene = build_scene(find_scene("forest"), fireflies=0, ambient=0.0)
    with make_renderer((160, 120)) as renderer:
        plan = renderer.plan(scene, 5.0, ("radiance", "id"))
        frame = renderer.draw(plan)
    assert [step.name for step in plan.passes] == ["geometry", "resolve"]
    assert (frame.id >= 0).mean() > 0.9
    assert (frame.radiance == 0).all()


def test_frames_repeat_to_the_byte_and_follow_time_and_seed(forest):
    def picture(scene, time):
        with make_renderer((120, 90)) as renderer:
            return renderer.render(scene, time).color

    first = picture(forest, 5.0)
    assert np.array_equal(picture(forest, 5.0), first)
    assert not np.array_equal(picture(forest, 5.0 + 1 / 24), first)
    assert not np.array_equal(picture(build_scene(find_scene("forest"), seed=8), 5.0), first)
    # no memory of earlier frames: after another time, the same picture again
    with make_renderer((120, 90)) as renderer:
        renderer.render(forest, 99.0)
        assert np.array_equal(renderer.render(forest, 5.0).color, first)
