"""What is lit in a graph of Panda3D, and what changes in one that is followed."""

from __future__ import annotations

import numpy as np
import pytest
from panda3d import core

from firefly_sample import Renderer, Settings
from firefly_sample.errors import SceneError
from firefly_sample.interop.panda3d import GraphMirror, from_panda3d
from firefly_sample.model.panda3d.transforms import affine_matrix
from tests.panda.compare import agreement, draw_ours
from tests.panda.oracle import SIZE
from tests.panda.scenes import card
from tests.panda.small_graphs import add_camera, geom_nodes, tree, words

# --- what is lit ---


def lit_in_part(off: bool = False):
    """Two cards side by side, beside a lamp that is set on the left one alone."""
    root = core.NodePath("render")
    for name, x in (("left", -2), ("right", 2)):
        path = card(name)
        path.reparent_to(root)
        path.set_x(x)
        path.set_color(0.8, 0.6, 0.4, 1)
    lamp = root.attach_new_node(core.DirectionalLight("lamp"))
    lamp.node().set_color((0.5, 0.5, 0.5, 1))
    if off:
        root.set_light_off()
    root.find("left").set_light(lamp)
    return root, add_camera(root)


@pytest.mark.parametrize("off", [False, True])
def test_where_every_light_is_set_the_rest_is_unlit_as_in_panda3d(by_panda, off):
    ours, warned = draw_ours(lit_in_part, off)
    assert [line for line in warned if "llvmpipe" not in line] == []
    found = agreement(by_panda(lit_in_part, off), ours)
    assert found.covered > 0.05
    assert found.strays == 0
    assert found.largest <= 1


def unlit(scene) -> dict[str, bool]:
    return {visit.node.name: visit.node.geoms[0][1].unlit for visit in geom_nodes(scene)}


def test_a_light_that_is_not_set_lights_everything():
    root, camera = lit_in_part()
    mirror = GraphMirror(root, camera)
    assert unlit(mirror.update()) == {"left": False, "right": True}
    assert mirror.losses.lines() == []
    spare = root.attach_new_node(core.PointLight("spare"))
    assert unlit(mirror.update()) == {"left": False, "right": False}
    assert "lamp" in mirror.losses.lines()[0]
    spare.remove_node()
    root.find("left").hide()  # what is not drawn now does not make a light one that nobody has set
    assert unlit(mirror.update()) == {"right": True}
    root.find("left").clear_light()
    assert unlit(mirror.update())["right"]


def test_a_node_without_a_name_is_named_by_what_is_above_it():
    root, camera = core.NodePath("render"), None
    model = root.attach_new_node("model.egg")
    path = card("").copy_to(model.attach_new_node(""))
    path.set_fog(core.Fog("mist"))
    mirror = GraphMirror(root, camera)
    mirror.update()
    assert mirror.losses.lines() == ["fog is not drawn: 'model.egg'"]


# --- what changes ---


def test_an_update_follows_what_moved_came_and_went():
    root, camera = tree()
    mirror = GraphMirror(root, camera)
    scene = mirror.update()
    arm, hand = scene.root.find("arm"), scene.root.find("arm/hand")
    geom = hand.node().geoms[0][0]
    root.find("arm").set_x(7)
    card("new").reparent_to(root.find("arm"))
    root.find("hand").remove_node()
    assert mirror.update() is scene
    assert arm.get_x() == 7
    assert scene.root.find("hand").is_empty()
    assert not scene.root.find("arm/new").is_empty()
    assert scene.root.find("arm/hand").node().geoms[0][0] is geom
    root.find("arm").reparent_to(root.find("hidden"))
    mirror.update()
    assert str(scene.root.find("hidden/arm/hand")) == "render/hidden/arm/hand"
    assert scene.root.find("hidden/arm/hand").node().geoms[0][0] is geom


def test_an_update_without_changes_changes_nothing():
    mirror = GraphMirror(*tree())
    scene = mirror.update()
    before = scene.root.node().subtree_revision
    mirror.update()
    assert scene.root.node().subtree_revision == before


def test_vertices_that_move_are_changed_in_place():
    root, camera = tree()
    mirror = GraphMirror(root, camera)
    scene = mirror.update()
    ((geom, _),) = scene.root.find("arm/hand").node().geoms
    data = root.find("arm/hand").node().modify_geom(0).modify_vertex_data()
    writer = core.GeomVertexWriter(data, "vertex")
    writer.set_data3(9, 0, 9)
    mirror.update()
    ((same, _),) = scene.root.find("arm/hand").node().geoms
    assert same is geom
    assert same.vertices[0].tolist() == [9, 0, 9]


def test_an_update_follows_the_lens_and_the_mask_of_the_camera():
    root, camera = tree()
    mirror = GraphMirror(root, camera)
    before = mirror.update().lens.get_projection_mat()
    lens, node = camera.node().get_lens(), camera.node()
    lens.set_fov(lens.get_fov()[0] + 1e-5)
    node.set_camera_mask(core.BitMask32(4))
    scene = mirror.update()
    assert not np.array_equal(scene.lens.get_projection_mat(), before)
    assert scene.camera_node.camera_mask == 4


def test_a_camera_of_another_graph_is_where_it_is_there():
    root, _ = tree()
    rig = core.NodePath("rig")
    rig.set_pos(1, 2, 3)
    camera = add_camera(rig)
    scene = from_panda3d(root, camera)
    expected = affine_matrix(camera.get_net_transform().get_mat())
    assert np.allclose(scene.camera.get_net_mat(), expected, rtol=0.0, atol=2e-6)


@pytest.mark.parametrize(
    ("root", "camera", "said"),
    [
        (None, None, "NodePath that is not empty, got None"),
        (core.NodePath(), None, "not empty"),
        (core.NodePath("render"), core.NodePath("rig"), "to a Camera"),
    ],
)
def test_wrong_arguments_are_named(root, camera, said):
    with pytest.raises(SceneError, match=said):
        from_panda3d(root, camera)


def test_the_rig_of_a_camera_gets_a_hint():
    rig = core.NodePath("camera")
    add_camera(rig)
    with pytest.raises(SceneError, match=r"base\.cam, not base\.camera"):
        from_panda3d(core.NodePath("render"), rig)


def test_a_light_that_was_set_is_off_where_it_is_set_no_more(by_panda):
    """As lights of a disco: each is set and cleared again and again."""
    root, camera = disco((True, True))
    mirror = GraphMirror(root, camera)
    lamps = [root.find(name) for name in ("red", "blue")]
    with Renderer(SIZE, Settings(look="panda3d")) as renderer:
        for on in ((True, True), (True, False), (False, False), (False, True), (True, True)):
            for lamp, is_on in zip(lamps, on, strict=True):
                root.set_light(lamp) if is_on else root.clear_light(lamp)
            ours = renderer.render(mirror.update(), outputs=("color", "depth"))
            found = agreement(by_panda(disco, on), ours)
            assert found.covered > 0.02
            assert found.largest <= 1


def disco(on):
    """A card under two lamps, of which some are set."""
    root = core.NodePath("render")
    card("card").reparent_to(root)
    for name, is_on, x in zip(("red", "blue"), on, (-1, 1), strict=True):
        lamp = root.attach_new_node(core.PointLight(name))
        lamp.node().set_color((0.6, 0, 0, 1) if name == "red" else (0, 0, 0.6, 1))
        lamp.set_pos(x, -2, 0)
        if is_on:
            root.set_light(lamp)
    return root, add_camera(root)


def test_an_update_follows_a_text():
    root, camera = words()
    mirror = GraphMirror(root, camera)
    count = len(geom_nodes(mirror.update()))
    root.find("words").node().set_text("")
    assert len(geom_nodes(mirror.update())) < count
    root.find("words").node().set_text("flies")
    assert len(geom_nodes(mirror.update())) >= 1
