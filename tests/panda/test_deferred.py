"""Graphs that are lit by shaders of their own, as scenes of ours."""

import numpy as np
import pytest
from panda3d import core

from firefly_sample.errors import SceneError
from firefly_sample.interop.panda3d.deferred import from_deferred
from firefly_sample.scene.light import Falloff
from firefly_sample.scene.lights import PointLight
from firefly_sample.scene.points import Sprites

MODELS, LIGHTS, PLAIN = 1, 2, 4
SHADER = core.Shader.make(
    core.Shader.SL_GLSL, "uniform vec4 wind; void main() {}", "uniform vec4 lightcolor; void main() {}"
)


def graph(light_camera=True):
    """A graph with its three cameras, and a wall for the models' camera."""
    root = core.NodePath("render")
    kinds = [("models", MODELS, True, False), ("plain", PLAIN, False, False)]
    if light_camera:
        kinds.append(("lights", LIGHTS, True, True))
    for name, mask, has_shader, adds in kinds:
        camera = core.Camera(name)
        camera.set_camera_mask(core.BitMask32(mask))
        state = core.NodePath("state")
        if has_shader:
            state.set_shader(SHADER)
            state.set_shader_input("wind", 1.0)
        if adds:
            state.set_attrib(core.ColorBlendAttrib.make(core.ColorBlendAttrib.M_add))
        camera.set_initial_state(state.get_state())
        root.attach_new_node(camera)
    card(root, "wall").hide(core.BitMask32(LIGHTS | PLAIN))
    return root


def card(parent, name, half=1.0):
    maker = core.CardMaker(name)
    maker.set_frame(-half, half, -half, half)
    return parent.attach_new_node(maker.generate())


def fly(parent, name, ball, color=(1.0, 0.5, 0.25)):
    """A node with a ball, which the lights' camera alone sees."""
    made = parent.attach_new_node(name)
    made.set_shader_input("lightcolor", *color, 1.0)
    ball.instance_to(made.attach_new_node("glow"))
    made.find("glow").hide(core.BitMask32(MODELS | PLAIN))
    return made


def lights_of(scene):
    nodes = [path for path in scene.root.find_all_matches("**") if isinstance(path.node(), PointLight)]
    return {path.get_name(): path for path in nodes}


def test_a_light_has_its_nodes_place_color_and_scale():
    """A node at (1, 2, 3), under one with twice the size that is turned by 90 degrees and at (10, 0, 0)."""
    root = graph()
    swarm = root.attach_new_node("swarm")
    swarm.set_pos_hpr_scale((10, 0, 0), (90, 0, 0), (2, 2, 2))
    ball = card(core.NodePath("loose"), "ball")
    for name, x in (("first", 1), ("second", 5)):
        made = fly(swarm, name, ball)
        made.set_pos(x, 2, 3)
        made.find("glow").set_scale(7)
    result = from_deferred(root)
    lights = lights_of(result.scene)
    assert set(lights) == {"first", "second"}
    assert (result.models, result.lights, result.dots) == (1, 2, 0)
    np.testing.assert_allclose(lights["first"].get_pos(), (10 - 2 * 2, 2 * 1, 2 * 3), atol=1e-5)
    np.testing.assert_allclose(lights["second"].get_pos(), (10 - 2 * 2, 2 * 5, 2 * 3), atol=1e-5)
    light = lights["first"].node()
    assert light.falloff is Falloff.RAMP_SQUARED
    np.testing.assert_allclose(light.get_max_distance(), 14, rtol=1e-6)
    np.testing.assert_allclose(light.get_color(), (1.0, 0.5, 0.25))


@pytest.mark.parametrize(("operand", "share"), [("O_one", 1.0), ("O_incoming_alpha", 0.5)])
def test_what_is_added_to_the_picture_becomes_dots(operand, share):
    root = graph()
    made = fly(root, "fly", card(core.NodePath("loose"), "ball"))
    made.set_pos(0, 5, 1)
    spark = card(made, "spark", half=0.5)
    spark.set_scale(3)
    spark.set_color(0.5, 1.0, 0.25, 0.5)
    spark.hide(core.BitMask32(MODELS | LIGHTS))
    blend = core.ColorBlendAttrib
    spark.set_attrib(blend.make(blend.M_add, getattr(blend, operand), blend.O_one))
    result = from_deferred(root)
    (dots,) = (path.node() for path in result.scene.root.get_children() if isinstance(path.node(), Sprites))
    assert result.dots == 1
    np.testing.assert_allclose(dots.arrays.positions, [(0, 5, 1)], atol=1e-6)
    np.testing.assert_allclose(dots.arrays.radii, [1.5])
    np.testing.assert_allclose(dots.arrays.colors, share * np.array([(0.5, 1.0, 0.25)]))


def test_models_are_lit_and_seen_by_their_camera_alone():
    root = graph()
    fly(root, "fly", card(core.NodePath("loose"), "ball"))
    scene = from_deferred(root).scene
    assert scene.camera.get_name() == "models"
    assert scene.camera_node.camera_mask == MODELS
    ((_, material),) = scene.root.find("wall").node().geoms
    assert not material.unlit
    assert scene.root.find("**/ball").is_empty()


def test_a_model_below_a_light_is_drawn():
    root = graph()
    body = card(fly(root, "fly", card(core.NodePath("loose"), "ball")), "body")
    body.hide(core.BitMask32(LIGHTS | PLAIN))
    result = from_deferred(root)
    assert result.models == 2
    assert not result.scene.root.find("**/body").is_empty()


def test_what_is_not_drawn_is_named():
    root = graph()
    ball = card(core.NodePath("loose"), "ball")
    made = fly(root, "fly", ball)
    made.set_shader_input("speed", 2.0)
    fly(root, "dark fly", ball).find("glow").hide()
    card(root, "label").hide(core.BitMask32(MODELS | LIGHTS))
    card(root, "unseen").hide()
    assert from_deferred(root).lines[:4] == [
        "shaders of cameras are not run: the look takes their place: 'created-shader'",
        "shader inputs are not used: 'wind', 'one that no shader reads'",
        "geometry that the models' camera does not see is not drawn: 'label'",
        "nodes without a ball that the lights' camera sees give no light: 'dark fly'",
    ]


def test_the_graph_is_the_same_afterwards():
    root = graph()
    fly(root, "fly", card(core.NodePath("loose"), "ball"))
    states = [path.node().get_initial_state() for path in root.find_all_matches("**/+Camera")]
    before = [str(path) for path in root.find_all_matches("**")]
    from_deferred(root)
    assert [str(path) for path in root.find_all_matches("**")] == before
    assert [path.node().get_initial_state() for path in root.find_all_matches("**/+Camera")] == states


def test_graphs_of_other_kinds_are_refused():
    with pytest.raises(SceneError, match="no camera with a shader adds up lights"):
        from_deferred(graph(light_camera=False))
    with pytest.raises(SceneError, match=r"no lights: .* 'lightcolor'"):
        from_deferred(graph())
