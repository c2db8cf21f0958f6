"""The graph itself: paths, transforms, masks, instances, levels of detail, billboards; and what changes."""

from __future__ import annotations

import numpy as np
import pytest
from panda3d import core

from firefly_sample.interop.panda3d import from_panda3d
from firefly_sample.model.panda3d.transforms import affine_matrix
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.traversal import iter_visible
from tests.panda.compare import agreement, draw_ours
from tests.panda.scenes import card, load
from tests.panda.small_graphs import add_camera, geom_nodes, tree, words


def test_paths_have_their_names_tags_and_net_transforms():
    root, camera = tree()
    scene = from_panda3d(root, camera)
    for theirs in (root, *root.find_all_matches("**")):
        pattern = str(theirs)[len(str(root)) + 1 :]
        ours = scene.root.find(pattern) if pattern else scene.root
        assert not ours.is_empty(), pattern
        expected = affine_matrix(theirs.get_net_transform().get_mat())
        assert np.allclose(ours.get_net_mat(), expected, rtol=0.0, atol=2e-6)
        assert ours.node().tags == {key: theirs.get_tag(key) for key in theirs.get_tag_keys()}
    assert str(scene.camera) == "render/camera"


def test_instances_are_one_node_for_each_path_and_share_their_geoms():
    scene = from_panda3d(*tree())
    first, second = (visit.node for visit in geom_nodes(scene))
    assert first is not second
    assert first.geoms[0][0] is second.geoms[0][0]


def test_hidden_nodes_are_there_and_are_not_seen():
    scene = from_panda3d(*tree())
    assert scene.root.find("hidden").is_hidden()
    assert [visit.node.name for visit in geom_nodes(scene)] == ["hand", "hand"]


@pytest.mark.parametrize("camera_bits", [0b01, 0b10, 0b11])
def test_masks_hide_from_the_same_cameras(camera_bits):
    root = core.NodePath("render")
    for name, bits in (("one", 0b01), ("two", 0b10), ("three", 0b11)):
        path = card(name)
        path.reparent_to(root)
        path.hide(core.BitMask32(bits))
    camera = add_camera(root)
    camera.node().set_camera_mask(core.BitMask32(camera_bits))
    hidden = {bits for bits in (0b01, 0b10, 0b11) if camera_bits & ~bits == 0}
    seen = {visit.node.name for visit in geom_nodes_of(from_panda3d(root, camera))}
    assert seen == {name for name, bits in (("one", 1), ("two", 2), ("three", 3)) if bits not in hidden}


def geom_nodes_of(scene):
    visits = iter_visible(scene.root, scene.camera_node.camera_mask)
    return [visit for visit in visits if isinstance(visit.node, GeomNode) and visit.node.geoms]


@pytest.mark.parametrize(("distance", "seen"), [(4.9, ["near"]), (5.0, ["far"]), (19.9, ["far"]), (20.0, [])])
def test_a_level_of_detail_is_that_of_the_cameras_distance(distance, seen):
    root = core.NodePath("render")
    levels = core.LODNode("levels")
    path = root.attach_new_node(levels)
    path.set_scale(2)
    for name, (far, near) in (("near", (5, 0)), ("far", (20, 5))):
        card(name).reparent_to(path)
        levels.add_switch(far, near)
    scene = from_panda3d(root, add_camera(root, -distance))
    assert [visit.node.name for visit in geom_nodes(scene)] == seen


def test_switches_and_sequences_show_one_child():
    root = core.NodePath("render")
    switch, sequence = core.SwitchNode("switch"), core.SequenceNode("sequence")
    for node in (switch, sequence):
        path = root.attach_new_node(node)
        for number in range(3):
            card(f"{node.get_name()} {number}").reparent_to(path)
    switch.set_visible_child(2)
    sequence.pose(1)
    scene = from_panda3d(root, add_camera(root))
    assert [visit.node.name for visit in geom_nodes(scene)] == ["switch 2", "sequence 1"]


# --- turned towards the camera, compared with Panda3D's picture ---

TURNED = {
    "eye": lambda path: path.set_billboard_point_eye(),
    "world": lambda path: path.set_billboard_point_world(),
    "axis": lambda path: path.set_billboard_axis(),
    "nearer": lambda path: path.set_billboard_point_eye(2.0),
    "compass": lambda path: path.set_compass(),
}


def turned(kind: str, seed: int):
    """A card with an effect, below a turned and scaled node, before a turned camera."""
    numbers = np.random.default_rng(seed)
    root = core.NodePath("render")
    parent = root.attach_new_node("parent")
    parent.set_pos(*numbers.uniform(-1, 1, 3))
    parent.set_hpr(*numbers.uniform(-40, 40, 3))
    parent.set_scale(1.3)
    path = card("card", (-1, 1, -0.5, 0.7))
    path.reparent_to(parent)
    path.set_pos(*numbers.uniform(-1, 1, 3))
    path.set_hpr(*numbers.uniform(-50, 50, 3))
    path.set_two_sided(True)
    TURNED[kind](path)
    camera = add_camera(root)
    camera.set_pos(*numbers.uniform(-3, 3, 3))
    camera.set_y(-9)
    camera.look_at(0, 0, 0)
    camera.set_r(17)
    return root, camera


@pytest.mark.parametrize("kind", TURNED)
def test_what_turns_towards_the_camera_covers_the_same_pixels(by_panda, kind):
    for seed in range(2):
        found = agreement(by_panda(turned, kind, seed), draw_ours(turned, kind, seed)[0])
        assert found.covered > 0.005
        assert found.strays == 0
        assert found.edges <= 6
        assert found.largest <= 1


def hidden_lights(which: str):
    """A card in the light of a lamp, which is hidden in some way, and so is what is below the lamp."""
    root = core.NodePath("render")
    card("card").reparent_to(root)
    arm = root.attach_new_node("arm")
    lamp = arm.attach_new_node(core.PointLight("lamp"))
    lamp.node().set_color((0.5, 0.4, 0.3, 1))
    lamp.set_pos(0.5, -3, 0)
    card("shade", (-0.2, 0.2, -0.2, 0.2)).reparent_to(lamp)
    root.set_light(lamp)
    {"lamp": lamp, "arm": arm}[which].hide()
    return root, add_camera(root)


@pytest.mark.parametrize("which", ["lamp", "arm"])
def test_hidden_lights_light_and_what_is_below_them_is_hidden(by_panda, which):
    found = agreement(by_panda(hidden_lights, which), draw_ours(hidden_lights, which)[0])
    assert found.covered > 0.02
    assert found.strays == found.edges == 0
    assert found.largest <= 1


def test_text_is_panda3ds(by_panda):
    ours, warned = draw_ours(words)
    assert [line for line in warned if "llvmpipe" not in line] == []
    found = agreement(by_panda(words), ours)
    assert found.covered > 0.1
    assert found.strays == 0
    assert found.mean <= 0.2


def backs():
    """Two balls, one of them mirrored, that show their backs alone, in the light of a sun."""
    root = core.NodePath("render")
    for x, mirrored in ((-1, False), (1, True)):
        ball = load("models/misc/smiley.egg.pz")
        ball.reparent_to(root)
        ball.set_x(x)
        ball.set_scale(1, -1 if mirrored else 1, 1)
        ball.set_attrib(core.CullFaceAttrib.make_reverse())
    sun = root.attach_new_node(core.DirectionalLight("sun"))
    sun.set_hpr(160, -30, 0)  # it meets the normals of what is seen, which are not turned
    root.set_light(sun)
    return root, add_camera(root)


def test_surfaces_that_show_their_backs_are_panda3ds(by_panda):
    found = agreement(by_panda(backs), draw_ours(backs)[0])
    assert found.covered > 0.02
    assert found.strays == 0
    assert found.largest <= 1


def decals():
    """A red card in the plane of the white one that it is a decal of."""
    root = core.NodePath("render")
    wall = card("wall")
    wall.reparent_to(root)
    wall.set_hpr(30, 20, 10)
    wall.set_effect(core.DecalEffect.make())
    stripe = card("stripe", (-0.61, 0.53, -0.47, 0.59))
    stripe.set_color(1, 0, 0, 1)
    stripe.reparent_to(wall)
    return root, add_camera(root, -5)


def test_decals_cover_what_they_lie_on_as_in_panda3d(by_panda):
    ours, warned = draw_ours(decals)
    assert [line for line in warned if "llvmpipe" not in line] == []
    found = agreement(by_panda(decals), ours)
    assert found.covered > 0.05
    assert found.strays == 0
    assert found.mean <= 0.2
