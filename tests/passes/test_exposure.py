"""Pictures at an automatic exposure: white paper has the same code whatever the light."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.plan.exposure import TARGET
from firefly_sample.scene.lights import DirectionalLight, PointLight
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb
from tests.conftest import make_renderer
from tests.scenes import wall_scene

WHITE = round(float(255 * linear_to_srgb(np.array(TARGET))))


@pytest.mark.parametrize("tone", ["exponential", "none"])
@pytest.mark.parametrize("color", [1e-6, 1e-3, 1.0, 1e5])
def test_paper_in_the_sun_is_nearly_white(render, color, tone):
    scene = wall_scene(color=(1.0, 1.0, 1.0, 1.0))
    scene.root.attach_new_node(DirectionalLight("sun", (color, 0.5 * color, 0.0)))
    picture = render(scene, Settings(exposure="auto", tone=tone), (16, 12)).color
    assert (np.abs(picture[..., 0].astype(int) - WHITE) <= 1).all()
    assert (picture[..., 1] < WHITE - 10).all()
    assert (picture[..., 2] == 0).all()


def test_pictures_under_dim_and_bright_lamps_are_the_same(render):
    pictures = []
    for color in (1e-3, 1e5):
        scene = wall_scene(color=(0.5, 0.6, 0.4, 1.0))
        lamp = PointLight("lamp", (color, 0.8 * color, 0.5 * color))
        lamp.set_attenuation((0, 0, 1))
        scene.root.attach_new_node(lamp).set_pos(2, 6, 1)
        pictures.append(render(scene, Settings(exposure="auto"), (64, 48)).color.astype(int))
    assert np.abs(pictures[0] - pictures[1]).max() <= 1
    assert pictures[0].max() > 150


def test_a_camera_that_moves_changes_no_brightness():
    """One plan after the other of one renderer, as on a turntable."""
    scene = wall_scene(color=(1.0, 1.0, 1.0, 1.0))
    scene.root.attach_new_node(DirectionalLight("sun", (300.0, 300.0, 300.0)))
    with make_renderer((16, 12), Settings(exposure="auto")) as renderer:
        for step in range(5):
            scene.camera.set_pos(0.4 * step, 0.5 * step, 0)
            picture = renderer.render(scene, time=step, outputs=("color",)).color
            assert (np.abs(picture.astype(int) - WHITE) <= 1).all()
