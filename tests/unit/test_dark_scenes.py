"""A picture that is black because nothing lights it says so; one that is dark on purpose does not."""

from __future__ import annotations

import pytest

from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.scenes import ball

NONE = (
    "the scene has no light, so that its surfaces are black: attach a PointLight, a DirectionalLight or an "
    "AmbientLight under its root"
)


def dark_scene(*nodes, material=None):
    scene = Scene(background=(0.2, 0.3, 0.4))
    node = GeomNode("ball")
    node.add_geom(ball(), material or Material())
    scene.root.attach_new_node(node).set_pos(0, 5, 0)
    for made in nodes:
        scene.root.attach_new_node(made)
    return scene


@pytest.mark.parametrize("outputs", [("color",), ("radiance",), ("depth", "color")])
@pytest.mark.parametrize("look", ["correct", "classic"])
def test_a_scene_without_any_light_says_so_in_its_picture(outputs, look):
    assert build_plan(dark_scene(), Settings(look=look), outputs=outputs).warnings == (NONE,)
    assert build_plan(dark_scene(PointLights("none")), Settings(look=look)).warnings == (NONE,)


def test_data_need_no_light():
    outputs = ("depth", "normal", "albedo", "id", "light", "emission")
    assert build_plan(dark_scene(), Settings(), outputs=outputs).warnings == ()


def test_a_background_alone_needs_no_light():
    assert build_plan(Scene(background=(0.2, 0.3, 0.4)), Settings()).warnings == ()


@pytest.mark.parametrize(
    "node",
    [
        AmbientLight("sky", (0.0, 0.0, 0.0)),
        PointLight("black", (0.0, 0.0, 0.0)),
        DirectionalLight("sun"),
        Spotlight("spot"),
        PointLights("far away", [(0, -900, 0)]),
        Sprites("dots", [(0, 4, 0)]),
    ],
    ids=lambda node: node.name,
)
def test_a_scene_with_a_light_is_as_dark_as_it_is(node):
    assert build_plan(dark_scene(node), Settings()).warnings == ()


def test_what_shines_needs_no_light():
    glow = Material("glow", emission=(0.0, 0.1, 0.0))
    scene = dark_scene(material=glow)
    assert build_plan(scene, Settings()).warnings == ()
    scene.root.find("ball").set_pos(0, -5, 0)  # behind the camera, where something else is not
    behind = GeomNode("wall")
    behind.add_geom(ball())
    scene.root.attach_new_node(behind).set_pos(0, 5, 0)
    assert build_plan(scene, Settings()).warnings == ()


def test_what_is_unlit_needs_no_light():
    scene = dark_scene(material=Material("sign", unlit=True))
    for look in ("correct", "panda3d"):
        assert build_plan(scene, Settings(look=look)).warnings == ()
    assert NONE in build_plan(scene, Settings(look="classic")).warnings  # which lights it


def test_hidden_and_detached_lights_do_not_count():
    scene = dark_scene(PointLight("lamp"), AmbientLight("sky"))
    scene.root.find("lamp").hide()
    assert build_plan(scene, Settings()).warnings == ()
    scene.root.find("sky").hide()
    (warning,) = build_plan(scene, Settings()).warnings
    assert warning.startswith("every light of the scene is hidden, so that its surfaces are black: show one,")
    for name in ("lamp", "sky"):
        scene.root.find(name).detach_node()
    assert build_plan(scene, Settings()).warnings == (NONE,)
    for node in (PointLights("lamps", [(0, 4, 0)]), AmbientLight("sky")):
        path = scene.root.attach_new_node(node)
        path.hide()
        assert build_plan(scene, Settings()).warnings == (warning,)
        path.detach_node()
