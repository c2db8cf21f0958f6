"""Colour scales in the pictures of every look; tests/panda/test_color_scale.py has their rules."""

import numpy as np
import pytest

from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.settings import Settings
from tests.passes.test_panda3d_look import lit_wall
from tests.scenes import geom_node, wall, wall_scene


@pytest.mark.parametrize("look", ["correct", "classic", "pyrender", "flat"])
@pytest.mark.parametrize("metallic", [None, 0.3])
def test_a_scale_multiplies_colours_and_opacity(render, look, metallic):
    """Base colour, ambient reflectance, emission and opacity, as if the material had those; no highlights."""
    base, ambient, emission = (
        np.array([0.8, 0.6, 0.4, 0.9]),
        np.array([0.2, 0.8, 0.6]),
        np.array([0.1, 0.2, 0.0]),
    )
    scale = np.array([0.5, 0.75, 0.25, 0.5])
    phong = {"specular": (0.3, 0.3, 0.3), "shininess": 6.0} if metallic is None else {"metallic": metallic}
    frames = []
    for factor, scaled in ((np.ones(4), scale), (scale, None)):
        own = {"ambient": ambient * factor[:3]} if metallic is None else {}
        material = Material("m", base * factor, None, "blend", emission=emission * factor[:3], **own, **phong)
        scene = lit_wall(Material("behind", (0.9, 0.9, 0.9, 1.0)))
        front = scene.root.attach_new_node(geom_node("front", wall(4.0), material))
        front.set_pos(0, 8, 0)
        if scaled is not None:
            front.set_color_scale(*scaled)
        frames.append(render(scene, Settings(look=look), (9, 9)).color)
    assert (frames[0] == frames[1]).all()
    assert (frames[0] != 0).any()


def test_a_scaled_shadow_caster_that_lets_light_through_is_cut_out(render):
    """Its opacity decides, which the scale multiplies."""
    scene = wall_scene(material=Material("m", (0.9, 0.9, 0.9, 1.0)))
    sun = DirectionalLight("sun")
    sun.set_shadow_caster(True, 64)
    scene.root.attach_new_node(sun).set_h(30.0)
    leaf = Material("leaf", (0.5, 0.5, 0.5, 1.0), None, "mask", 0.4, double_sided=True)
    path = scene.root.attach_new_node(geom_node("leaf", wall(3.0), leaf))
    path.set_pos(-1.15, 8.0, 0.0)
    size = 33, 33
    shadowed = render(scene, Settings(), size).color
    path.set_alpha_scale(0.3)
    open_sky = render(scene, Settings(), size).color
    path.detach_node()
    assert (open_sky == render(scene, Settings(), size).color).all()
    assert (shadowed != open_sky).any()
