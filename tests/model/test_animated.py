"""Models that move: their poses against plain loops, purity, copies, and nodes that the user changes."""

from __future__ import annotations

import copy
import gc
import pickle
import weakref

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.errors import NodeError, SceneError
from firefly_sample.model.animated import bind, is_posed
from firefly_sample.model.data import ModelData, NodeData
from firefly_sample.model.root import ModelRoot
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Scene
from tests.model.figures import bending_tube, bulging_tube, drawn_corners, make_model, posed_corners

TIMES = (0.0, 0.3, 0.75, 1.5, -0.6)


def pickled(thing):
    return pickle.loads(pickle.dumps(thing))


def copied_to(path):
    return path.copy_to(NodePath("elsewhere"))


WAYS = {"deepcopy": copy.deepcopy, "pickle": pickled, "copy": copy.copy, "copy_to": copied_to}
each_way = pytest.mark.parametrize("duplicate", WAYS.values(), ids=WAYS)
MODELS = {
    "skin": bending_tube,
    "flat skin": lambda: bending_tube(flat=True),
    "mirrored skin": lambda: bending_tube(mirrored=True),
    "flat mirrored skin": lambda: bending_tube(flat=True, mirrored=True),
    "morphs": bulging_tube,
    "flat morphs": lambda: bulging_tube(flat=True),
}
each_model = pytest.mark.parametrize("make", MODELS.values(), ids=MODELS)


def state(path):
    """All that an update sets, as bytes."""
    return {
        below.get_name(): (
            below.get_mat().tobytes(),
            [(geom.vertices.tobytes(), geom.normals.tobytes()) for geom, _ in geoms_of(below)],
        )
        for below in path.find_all_matches("**")
        if below != path
    }


def geoms_of(path):
    return getattr(path.node(), "geoms", [])


def revisions(path):
    return [
        (below.node().revision, [geom.revision for geom, _ in geoms_of(below)])
        for below in path.find_all_matches("**")
    ]


# --- Poses ---


@each_model
@pytest.mark.parametrize("time", TIMES)
def test_a_pose_is_that_of_plain_loops(make, time):
    data = make()
    model = make_model(data)
    model.node().update(time)
    found = drawn_corners(model)
    for (node, _), (points, normals) in posed_corners(data, time).items():
        vertices, turned = found[data.nodes[node].name]
        np.testing.assert_allclose(vertices, points, rtol=0, atol=1e-12)
        np.testing.assert_allclose(turned, normals, rtol=0, atol=1e-12)


@each_model
def test_the_pose_at_rest_is_that_of_the_file(make):
    data = make()
    model = make_model(data)
    model.node().update(0.7)
    model.node().play(None)
    model.node().update(0.7)
    found = drawn_corners(model)
    for (node, _), (points, _) in posed_corners(data, 0.0, None).items():
        np.testing.assert_allclose(found[data.nodes[node].name][0], points, rtol=0, atol=1e-12)


def test_triangles_of_a_mirrored_skin_still_face_outwards():
    for make in (bending_tube, lambda: bending_tube(mirrored=True)):
        model = make_model(make())
        model.node().update(0.4)
        ((geom, _),) = geoms_of(model.find("tube"))
        a, b, c = (geom.vertices[corner] for corner in geom.triangles.T)
        side = (np.cross(b - a, c - a) * geom.normals[geom.triangles].mean(axis=1)).sum(axis=1)
        assert (side > 0.0).all()


def test_a_skin_does_not_follow_its_node_nor_what_is_above_it():
    model = make_model(bending_tube())
    before = drawn_corners(model)["tube"][0]
    model.find("armature/tube").set_pos(100, 0, 0)
    model.node().update(0.0)
    assert np.array_equal(drawn_corners(model)["tube"][0], before)
    assert model.find("tube").get_mat().tolist() == np.eye(4).tolist()


def test_nodes_with_weights_of_their_own_share_no_geom():
    model = make_model(bulging_tube())
    (left, _), (right, _) = geoms_of(model.find("left"))[0], geoms_of(model.find("right"))[0]
    assert left is not right
    model.node().update(1.0)
    assert not np.allclose(left.vertices, right.vertices)


def test_a_joint_that_is_turned_by_hand_takes_the_skin_along():
    data = bending_tube()
    data.animations = []
    model = make_model(data)
    before = drawn_corners(model)["tube"][0]
    model.find("**/middle joint").set_r(40)
    model.node().update(0.0)
    bent = drawn_corners(model)["tube"][0]
    assert not np.allclose(before, bent)
    model.find("**/middle joint").set_r(0)
    model.node().update(0.0)
    np.testing.assert_allclose(drawn_corners(model)["tube"][0], before, rtol=0, atol=1e-13)


def test_a_vertex_that_follows_no_joint_of_the_skin_is_named():
    data = bending_tube()
    data.geoms[0].arrays["joints"][5, 1] = 3
    with pytest.raises(
        SceneError, match="geom 'tube': a vertex follows joint 3, but the skin 'spine' has 3 "
    ):
        make_model(data)


def test_joints_of_a_node_without_a_skin_are_ignored():
    data = bending_tube()
    data.nodes[4].skin = None
    assert not is_posed(data, 4, 0)
    assert geoms_of(make_model(data).find("armature/tube"))


def test_holders_show_one_geom_in_several_places():
    data = bulging_tube()
    root = ModelRoot("m")
    nodes = [NodePath(root).attach_new_node(made.name).node() for made in data.nodes]
    places = {index: [GeomNode("a"), GeomNode("b")] for index in range(2)}
    for node, below in zip(nodes, places.values(), strict=True):
        for place in below:
            node.add_child(place)
    material = object()
    bind(root, data, nodes, [material], places)
    (a, b), (c, _) = places.values()
    assert a.geoms == b.geoms != c.geoms
    assert a.geoms[0][1] is material


# --- Purity ---


@each_model
@settings(max_examples=20)
@given(times=st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=4))
def test_an_update_is_a_pure_function_of_time(make, times):
    fresh, used = make_model(make()), make_model(make())
    for time in times:
        used.node().update(time)
    fresh.node().update(times[-1])
    assert state(used) == state(fresh)


@each_model
def test_a_pose_that_stays_touches_nothing(make):
    model = make_model(make())
    for time in (0.0, 0.7):
        model.node().update(time)
        before, subtree = revisions(model), model.node().subtree_revision
        model.node().update(time)
        assert (revisions(model), model.node().subtree_revision) == (before, subtree)


def test_only_geoms_that_change_are_touched():
    model = make_model(bulging_tube())
    left, right = geoms_of(model.find("left"))[0][0], geoms_of(model.find("right"))[0][0]
    before = left.revision, right.revision
    model.node().update(0.5)
    assert left.revision > before[0]
    assert right.revision == before[1]


def test_what_somebody_else_has_moved_is_posed_again():
    fresh, model = make_model(bending_tube()), make_model(bending_tube())
    ((geom, _),) = geoms_of(model.find("tube"))
    geom.set_vertices(0.0 * geom.vertices)
    model.find("**/tip joint").set_pos(7, 7, 7)
    model.node().update(0.0)
    assert state(model) == state(fresh)


# --- What plays ---


def test_the_first_animation_plays_and_others_on_demand():
    model = make_model(bending_tube())
    root = model.node()
    assert (list(root.animations), root.playing) == (["bend", "twist"], "bend")
    assert root.animations["bend"].duration == 2.0
    root.update(0.4)
    root.play("twist")
    root.update(0.4)
    points, _ = posed_corners(bending_tube(), 0.4, 1)[4, 0]  # what "bend" moved is at rest again
    np.testing.assert_allclose(drawn_corners(model)["tube"][0], points, rtol=0, atol=1e-12)


def test_all_animations_play_at_once_and_the_last_counts():
    model, twist = make_model(bending_tube()), make_model(bending_tube())
    model.node().play("all")
    twist.node().play("twist")
    for path in (model, twist):
        path.node().update(0.8)
    tip = "**/tip joint"
    assert np.array_equal(model.find(tip).get_mat(), twist.find(tip).get_mat())
    assert not np.array_equal(
        model.find("**/middle joint").get_mat(), twist.find("**/middle joint").get_mat()
    )


def test_an_unknown_animation_is_named_with_those_there_are():
    root = make_model(bending_tube()).node()
    with pytest.raises(NodeError) as error:
        root.play("bent")
    assert str(error.value) == (
        "model 'tube' has no animation 'bent' (did you mean 'bend'?): it has 'bend', 'twist'"
    )
    assert root.playing == "bend"
    with pytest.raises(NodeError, match="model 'm' has no animation 'walk': it has none"):
        ModelRoot("m").play("walk")


def test_a_model_without_anything_to_move_is_a_plain_node():
    path = make_model(ModelData("still", [NodeData("a", -1)]))
    root = path.node()
    before = root.subtree_revision
    root.update(3.0)
    root.play(None)
    root.play("all")
    assert (root.subtree_revision, root.animations, root.warnings) == (before, {}, ())
    assert copy.copy(root).children[0] is root.children[0]


# --- Copies ---


@each_way
@each_model
def test_a_copy_moves_by_itself_and_leaves_the_original(duplicate, make):
    model = make_model(make())
    model.node().update(0.3)
    before = state(model)
    twin = duplicate(model)
    assert state(twin) == before
    twin.node().update(1.1)
    assert state(model) == before
    moved = state(twin)
    model.node().update(0.9)
    assert state(twin) == moved
    fresh = make_model(make())
    fresh.node().update(1.1)
    assert state(fresh) == moved


@each_way
def test_a_copy_plays_what_it_is_told_and_keeps_what_the_original_has(duplicate):
    model = make_model(bending_tube())
    model.node().warnings = ("one",)
    twin = duplicate(model)
    twin.node().play("twist")
    assert (model.node().playing, twin.node().playing) == ("bend", "twist")
    assert list(twin.node().animations) == list(model.node().animations)
    assert twin.node().warnings == ("one",)


@each_way
def test_a_still_copy_stays_untouched_by_its_first_update(duplicate):
    model = make_model(bending_tube())
    model.node().update(0.7)
    twin = duplicate(model)
    before = revisions(twin)
    twin.node().update(0.7)
    assert revisions(twin) == before


@each_way
def test_a_copy_of_a_tree_that_holds_models_holds_models_of_its_own(duplicate):
    top = NodePath("top")
    one = make_model(bending_tube())
    one.reparent_to(top)
    make_model(bulging_tube()).reparent_to(one.find("**/tip joint"))
    before = state(top)
    twin = duplicate(top)
    if duplicate is copy.copy:
        # as ever, the copy of a plain node has the same children
        assert twin.get_child(0).node() is one.node()
        return
    for path in twin.find_all_matches("**/+ModelRoot"):
        path.node().update(0.9)
    assert len(twin.find_all_matches("**/+ModelRoot")) == 2
    assert state(top) == before != state(twin)


def test_a_copy_of_a_part_shows_the_pose_of_the_model():
    model = make_model(bending_tube())
    part = model.find("tube").copy_to(NodePath("elsewhere"))
    model.node().update(0.7)
    assert geoms_of(part)[0][0] is geoms_of(model.find("tube"))[0][0]


def test_geoms_that_do_not_move_are_shared_by_copies_of_nodes():
    data = bending_tube()
    data.nodes.append(NodeData("still", -1, geoms=(0,)))
    model = make_model(data)
    twin = model.copy_to(NodePath("elsewhere"))
    assert geoms_of(twin.find("still"))[0][0] is geoms_of(model.find("still"))[0][0]
    assert geoms_of(twin.find("tube"))[0][0] is not geoms_of(model.find("tube"))[0][0]


@pytest.mark.parametrize("duplicate", [lambda path: path, *WAYS.values()], ids=["model", *WAYS])
@each_model
def test_a_model_that_nobody_holds_is_freed_at_once(duplicate, make):
    gc.collect()
    gc.disable()
    try:
        scene = Scene()
        model = duplicate(make_model(make()))
        model.reparent_to(scene.root)
        scene.update(0.5)
        kept = [weakref.ref(below.node()) for below in model.find_all_matches("**")]
        kept += [weakref.ref(geom) for below in model.find_all_matches("**") for geom, _ in geoms_of(below)]
        model.remove_node()
        assert [reference() for reference in kept if reference() is not None] == []
    finally:
        gc.enable()


# --- Nodes that the user changes ---


def test_renaming_and_removing_nodes_leaves_the_pose_as_it_is():
    changed, fresh = make_model(bending_tube()), make_model(bending_tube())
    changed.find("**/middle joint").set_name("elbow")
    changed.find("**/tip joint").remove_node()
    changed.find("armature/tube").remove_node()
    for time in (0.6, 1.3):
        for path in (changed, fresh):
            path.node().update(time)
        assert np.array_equal(drawn_corners(changed)["tube"][0], drawn_corners(fresh)["tube"][0])
    for duplicate in WAYS.values():
        twin = duplicate(changed)
        twin.node().update(0.4)
        fresh.node().update(0.4)
        assert np.array_equal(drawn_corners(twin)["tube"][0], drawn_corners(fresh)["tube"][0])


def test_a_removed_geom_breaks_nothing():
    model = make_model(bending_tube())
    model.find("tube").remove_node()
    model.node().update(0.6)
    geoms_of(make_model(bending_tube()).find("tube")).clear()
    copied_to(model).node().update(0.2)


def test_what_hangs_on_a_joint_goes_with_it():
    model = make_model(bending_tube())
    lamp = model.find("**/tip joint").attach_new_node("lamp")
    lamp.set_pos(0, 0, 0.5)
    model.node().update(0.0)
    before = lamp.get_pos(model)
    model.node().update(0.5)
    assert np.linalg.norm(lamp.get_pos(model) - before) > 0.1
