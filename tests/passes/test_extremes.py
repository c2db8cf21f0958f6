"""Extremes of whole pictures; those with a number are cases of `firefly_sample.lab.stability`."""

import numpy as np
import pytest

from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.settings import Settings
from tests.scenes import geom_node, wall, wall_scene


def test_a_blinding_light_is_white(render):
    scene = wall_scene(cells=4, color=(1, 1, 1, 1))
    light = PointLight("l", (1e30,) * 3)
    light.set_attenuation((1, 0, 1))
    scene.root.attach_new_node(light).set_pos(0, 5, 0)
    frame = render(scene, None, (17, 13), ("radiance", "color"))
    assert np.isfinite(frame.radiance).all()
    assert (frame.color == 255).all()


@pytest.mark.parametrize("color", [(1, 1, 1, 1), (1, 0, 0, 1), (0, 0, 0, 1)], ids=["white", "red", "black"])
@pytest.mark.parametrize("lights", ["volumes", "fullscreen", "clustered", "forward"])
def test_strength_times_colour_beyond_float32_is_no_infinity(render, lights, color):
    """1e30 at one unit times 1e10, twice; and, on the wall, a light whose fading float32 takes for 1 / 0."""
    scene = wall_scene(cells=4, color=color)
    scene.exposure = 1e-20
    for place, attenuation in (((0, 5, 0), (0, 0, 1e-30)), ((0, 9.99999, 0), (0, 0, 1e-30))):
        light = PointLight("l", (1e10,) * 3)
        light.set_attenuation(attenuation)
        scene.root.attach_new_node(light).set_pos(*place)
    frame = render(scene, Settings(light_method=lights), (17, 13), ("radiance", "color"))
    assert np.isfinite(frame.radiance).all()
    assert frame.radiance.max() <= 3e30
    assert (frame.color == np.array(color[:3]) * 255).all()


@pytest.mark.parametrize("lights", ["volumes", "forward"])
def test_a_highlight_of_no_colour_stays_dark_in_any_light(render, lights):
    material = Material("gloss", (0, 0, 0, 1), specular=(1, 0, 0), shininess=2)
    scene = wall_scene(cells=4, material=material)
    light = PointLight("l", (1e30,) * 3)
    light.set_attenuation((0, 0, 1e-30))
    scene.root.attach_new_node(light).set_pos(0, 5, 0)
    frame = render(scene, Settings(light_method=lights), (17, 13), ("radiance",))
    assert np.isfinite(frame.radiance).all()
    assert frame.radiance[6, 8, 0] == pytest.approx(1e30)
    assert not frame.radiance[..., 1:].any()


def test_a_red_particle_in_any_light_stays_red(render):
    scene = Scene()
    scene.root.attach_new_node(ParticleNode("puff", [(0, 5, 0)], 3.0, 1.0, (1, 0, 0)))
    light = PointLight("l", (1e10,) * 3)
    light.set_attenuation((0, 0, 1e-30))
    scene.root.attach_new_node(light).set_pos(0, 5, 1)
    radiance = render(scene, None, (17, 13), ("radiance",)).radiance
    assert np.isfinite(radiance).all()
    assert radiance[6, 8, 0] > 1e29
    assert not radiance[..., 1:].any()


@pytest.mark.parametrize("kind", [Spotlight, PointLight])
@pytest.mark.parametrize("half", [1e2, 1e5, 3e9])
def test_a_roof_that_is_too_wide_for_a_shadow_map_is_named(render, kind, half):
    """It lets light through, which no ordinary roof does."""
    scene, lamp = Scene(), kind("lamp", (1, 1, 1))
    for name, size, z in (("floor", 20.0, 0.0), ("roof", half, 20.0)):
        geom = wall(size)
        geom.name = name
        path = scene.root.attach_new_node(geom_node(name, geom, Material("m", double_sided=True)))
        path.set_pos_hpr(0.37 * size if name == "roof" else 0.0, 0.0, z, 11, -90, 0)
    lamp.set_attenuation((1, 0, 0))
    lamp.set_shadow_caster(True, 256)
    scene.root.attach_new_node(lamp).set_pos_hpr(0, 0, 30, 0, -90, 0)
    scene.camera.set_pos_hpr(0, -15, 10, 0, -35, 0)
    frame = render(scene, None, (40, 30), ("light",))
    said = [line for line in frame.warnings if "shine through" in line]
    assert [line.startswith("light 'lamp': geoms 'roof' have") for line in said] == [True] * (half > 1e6)
    if not said:
        assert not frame.light.any()


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
