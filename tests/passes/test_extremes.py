"""Extremes of whole pictures; those with a number are cases of `firefly_sample.measure.stability`."""

import numpy as np

from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.scene.spotlight import Spotlight
from tests.scenes import wall_scene


def test_a_blinding_light_is_white(render):
    scene = wall_scene(cells=4, color=(1, 1, 1, 1))
    light = PointLight("l", (1e30,) * 3)
    light.set_attenuation((1, 0, 1))
    scene.root.attach_new_node(light).set_pos(0, 5, 0)
    frame = render(scene, None, (17, 13), ("radiance", "color"))
    assert np.isfinite(frame.radiance).all()
    assert (frame.color == 255).all()


def test_a_scene_of_lights_alone_is_its_background(render):
    scene = Scene(background=VerticalGradient((0.5, 0.25, 0.125), (0.5, 0.25, 0.125)))
    for light in (PointLight("p"), Spotlight("s"), DirectionalLight("d"), AmbientLight("a")):
        scene.root.attach_new_node(light)
    frame = render(scene, None, (8, 6), ("radiance", "light", "overdraw", "volumes", "shadow_atlas"))
    assert (frame.radiance == (0.5, 0.25, 0.125)).all()
    assert not frame.light.any()
    assert not frame.overdraw.any()
    assert not frame.volumes.any()
    assert frame.shadow_atlas.shape == (0, 0)
