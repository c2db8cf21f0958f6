"""The default lights and the ground: where they are, and that the ground is the backdrop but for shadows."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample import (
    Geom,
    GeomNode,
    Material,
    Scene,
    Settings,
    add_default_lights,
    add_ground,
    frame_camera,
)
from firefly_sample.errors import SceneError
from firefly_sample.model.studio import AMBIENT, FILL, KEY
from tests.conftest import make_renderer


def card(color, scale=1.0, height=1.0):
    """A scene with a level square, seen from above."""
    corners = scale * np.array([(-1, -1, height), (1, -1, height), (1, 1, height), (-1, 1, height)])
    node = GeomNode("card")
    node.add_geom(Geom(corners, [(0, 1, 2), (0, 2, 3)]), Material("card", (*color, 1.0)))
    scene = Scene()
    scene.root.attach_new_node(node)
    frame_camera(scene)
    return scene


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_level_surface_has_the_radiance_of_all_lights_at_any_scale(render, scale):
    scene = card((0.5, 0.5, 0.5), scale)
    add_default_lights(scene)
    radiance = render(scene, outputs=("radiance",)).radiance[24, 32]
    sines = [np.sin(np.radians(light.elevation)) * np.array(light.color) for light in (KEY, FILL)]
    np.testing.assert_allclose(radiance, 0.5 * (np.array(AMBIENT) + sum(sines)), rtol=5e-3)


@pytest.mark.parametrize("azimuth", [0.0, 35.0, 200.0])
def test_the_key_light_comes_from_the_left_of_the_camera(azimuth):
    scene = card((1, 1, 1))
    frame_camera(scene, azimuth=azimuth)
    lights = add_default_lights(scene)
    shines = lights.find("key light").get_net_mat()[1, :3]
    across, ahead, up = scene.camera.get_net_mat()[:3, :3] @ shines
    assert across > 0.0  # to the right, so it stands at the left
    assert ahead > 0.0
    assert up < 0.0


@pytest.mark.parametrize("color", [(0.9, 0.9, 0.9), (0.02, 0.02, 0.02), (0.7, 0.05, 0.04)])
def test_the_ground_is_the_backdrop_except_for_the_shadow(render, color):
    scene = card(color)
    add_default_lights(scene)
    plain = render(scene, size=(160, 120)).color.astype(int)
    backdrop = plain[0, 0]
    ground = add_ground(scene, scene.root.find("card"))
    frame = render(scene, size=(160, 120), outputs=("color", "id"))
    names = list(frame.id_names)
    on_ground = frame.id == names.index("root/ground")
    seen = frame.color.astype(int)
    lit = on_ground & (np.abs(seen - backdrop).max(axis=2) <= 1)
    shadow = on_ground & (seen.sum(axis=2) < backdrop.sum() - 60)
    assert on_ground.sum() > 500
    assert (lit | shadow).sum() > 0.97 * on_ground.sum()  # the rest is the shadow's edge
    assert ground.get_pos()[2] < 1.0


def test_a_shadow_is_on_the_ground_under_a_floating_model(render):
    scene = card((0.9, 0.9, 0.9))
    add_default_lights(scene)
    scene.root.find("card").set_z(1.0)
    frame_camera(scene, scene.root.find("card"))
    ground = add_ground(scene, scene.root.find("card"))
    ground.set_z(ground.get_z() - 1.0)
    frame = render(scene, size=(160, 120))
    assert (frame.color.astype(int).sum(axis=2) < frame.color[0, 0].astype(int).sum() - 60).any()


def test_the_lights_can_be_removed():
    scene = card((1, 1, 1))
    lights = add_default_lights(scene)
    assert lights.get_parent() == scene.root
    lights.remove_node()
    assert scene.root.find_all_matches("**/+ShadowCaster") == []


@pytest.mark.parametrize("exposure", [0.3, 0.77, 1.0, 1.9])
@pytest.mark.parametrize("tone", ["exponential", "none"])
def test_the_grounds_edge_is_not_seen(exposure, tone):
    """In light, the ground has the very codes of the backdrop, at any exposure."""
    scene = card((0.5, 0.5, 0.5))
    add_default_lights(scene)
    add_ground(scene, scene.root.find("card"))
    with make_renderer((64, 48), Settings(exposure=exposure, tone=tone)) as renderer:
        frame = renderer.render(scene, outputs=("color", "id", "light"))
    ground = frame.id == list(frame.id_names).index("root/ground")
    lit = ground & (frame.light >= frame.light[ground].max(axis=0) * (1 - 1e-6)).all(axis=2)
    assert lit.sum() > 500
    assert (frame.color[lit] == frame.color[0, 0]).all()
    assert frame.id[0, 0] < 0


def test_no_ground_below_nothing():
    with pytest.raises(SceneError, match="nothing to frame"):
        add_ground(Scene())
