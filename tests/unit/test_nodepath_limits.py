"""NodePath: what it refuses and what it says, revisions, great depth, memory."""

from __future__ import annotations

import gc
import math
import sys
import weakref

import numpy as np
import pytest

from firefly_sample.errors import NodeError
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.nodepath import NodePath
from tests.unit.trees import names, tree

# --- Errors ---


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda t: t["a"].reparent_to(t["a/b"]), "'a'.*'b'.*cycle"),
        (lambda t: t["root"].instance_to(t["a/b"]), "'root'.*'b'.*cycle"),
        (lambda t: t["a"].attach_new_node(t["a"].node()), "'a'.*'a'.*cycle"),
        (lambda t: t["a"].wrt_reparent_to(t["a/b"]), "'a'.*'b'.*cycle"),
        (lambda t: t["a"].get_pos(NodePath("alone")), "'root/a'.*no common root with 'alone'"),
        (lambda t: t["a"].set_mat(NodePath("alone"), np.eye(4)), "'alone'.*no common root with 'root'"),
        (lambda t: t["a"].wrt_reparent_to(NodePath("alone")), "'root/a'.*no common root with 'alone'"),
        (lambda t: t["a"].get_pos(t["flat/c"]), "'root/flat': its scale flattens space"),
        (lambda t: t["a"].set_hpr(t["a"], 0, 0, math.inf), "'root/a'.*set_hpr.*finite.*inf"),
        (lambda t: t["flat/c"].set_pos(t["a"], 1, 2, 3), "'root/flat': its scale flattens space"),
        (lambda t: t["a"].wrt_reparent_to(t["flat/c"]), "'root/flat': its scale flattens space"),
        (lambda t: t["a"].set_pos(0, math.nan, 0), "'root/a'.*set_pos.*finite.*nan"),
        (lambda t: t["a"].set_pos(1, 2), "'root/a'.*set_pos takes 3 numbers, got 1, 2"),
        (lambda t: t["a"].set_x("left"), "'root/a'.*set_x takes 1 number, got 'left'"),
        (lambda t: t["a"].set_scale(), "'root/a'.*set_scale takes 3 numbers, got nothing"),
        (lambda t: t["a"].set_quat(0, 0, 0, 0), "'root/a'.*set_quat.*not zero"),
        (lambda t: t["a"].set_mat(np.eye(3)), r"'root/a'.*set_mat.*\(4, 4\)"),
        (lambda t: t["a"].set_mat(np.full((4, 4), np.nan)), "'root/a'.*set_mat.*finite"),
        (lambda t: t["a"].set_mat(np.eye(4) + np.eye(4, k=3)), "'root/a'.*set_mat.*last column"),
        (lambda t: t["a"].set_pos_hpr(1, 2, 3), "'root/a'.*set_pos_hpr takes 2 vectors or 6 numbers"),
        (lambda t: t["a"].set_transform(np.eye(4)), "'root/a'.*set_transform takes a TransformState"),
        (lambda t: t["a"].look_at(), "'root/a'.*look_at takes"),
        (lambda t: t["a"].look_at(t["root"], (0, 0, 0), (0, 0, math.nan)), "'root/a'.*look_at's up.*finite"),
        (lambda t: t["a"].set_color(1, 2), "'root/a'.*set_color takes 4 numbers"),
        (lambda t: t["a"].set_color((1, 1, 1, 1), "high"), "'root/a'.*set_color.*priority"),
        (lambda t: t["a"].set_material("bark"), "'root/a'.*set_material takes a Material"),
        (lambda t: t["a"].set_tag("kind", 3), "'a'.*set_tag takes text"),
        (lambda t: t["a"].set_name(3), "'a'.*set_name takes text"),
        (lambda t: t["a"].hide(2**32), "'root/a'.*camera mask"),
        (lambda t: t["a"].get_child(1), "'root/a'.*1 children.*no number 1"),
        (lambda t: t["a"].attach_new_node(7), "name must be text, got 7"),
        (lambda t: t["a"].node().remove_child(t["flat"].node()), "'flat' is not a child of 'a'"),
        (lambda _: NodePath().set_pos(1, 2, 3), "NodePath is empty"),
        (lambda t: t["a"].find("nowhere").get_children(), "NodePath is empty"),
    ],
)
def test_errors_name_the_node_and_change_nothing(act, message):
    t = tree("a", "a/b", "flat", "flat/c")
    t["flat"].set_scale(1, 0, 1)
    t["flat"].set_h(20)
    t["a"].set_pos_hpr_scale((1, 2, 3), (4, 5, 6), (7, 8, 9))
    before = {place: place.get_mat().tolist() for place in t["root"].find_all_matches("**")}
    with pytest.raises(NodeError, match=message):
        act(t)
    assert {place: place.get_mat().tolist() for place in t["root"].find_all_matches("**")} == before
    assert names(t["root"].find_all_matches("**")) == [
        "root",
        "root/a",
        "root/flat",
        "root/a/b",
        "root/flat/c",
    ]


def test_numbers_too_large_for_float64_do_not_become_nan_in_the_graph():
    t = tree("a", "a/b", "c")
    t["a"].set_scale(1e200)
    t["a/b"].set_scale(1e100, 1e100, 2e100)
    for act in (
        lambda: t["c"].set_pos(t["a/b"], 0, 0, 1e10),
        lambda: t["c"].set_mat(t["a/b"], np.diag([1e10, 1e10, 1e10, 1])),
    ):
        with pytest.raises(NodeError, match=r"'root/c'.*relative to 'root/a/b' is too large"):
            act()
    assert (t["c"].get_mat() == np.eye(4)).all()


# --- Revisions, depth, memory ---


def test_every_change_shows_in_all_subtrees_that_hold_it():
    t = tree("a", "b", "a/m")
    mesh = GeomNode("mesh")
    t["a/m"].instance_to(t["b"])
    place = t["a/m"].attach_new_node(mesh)
    material = Material("bark")
    changes = [
        lambda: place.set_pos(1, 2, 3),
        lambda: place.set_h(4),
        lambda: place.set_color(1, 0, 0),
        lambda: place.clear_color(),
        lambda: place.set_material(material),
        lambda: place.clear_material(),
        lambda: place.hide(),
        lambda: place.show(2),
        lambda: place.set_tag("a", "b"),
        lambda: place.clear_tag("a"),
        lambda: place.set_name("other"),
        lambda: mesh.add_geom(Geom(np.eye(3), [[0, 1, 2]])),
        lambda: mesh.remove_all_geoms(),
        lambda: place.attach_new_node("child"),
        lambda: place.find("child").remove_node(),
    ]
    above = [t["root"].node(), t["a"].node(), t["b"].node(), t["a/m"].node()]
    for change in changes:
        before = [node.subtree_revision for node in above], mesh.revision, [node.revision for node in above]
        change()
        assert [node.subtree_revision for node in above] == [number + 1 for number in before[0]]
        assert mesh.revision == before[1] + 1
        assert [node.revision for node in above] == before[2]


def test_a_change_costs_one_step_for_each_ancestor_and_not_for_each_path():
    # Sixty diamonds on top of each other: 2**60 paths to the lowest node.
    root = PandaNode("root")
    bottom = root
    nodes = [root]
    for _ in range(60):
        left, right, end = PandaNode("left"), PandaNode("right"), PandaNode("end")
        for side in (left, right):
            bottom.add_child(side)
            side.add_child(end)
        bottom = end
        nodes += [left, right, end]
    before = [node.subtree_revision for node in nodes]
    bottom.mark_changed()
    assert [node.subtree_revision for node in nodes] == [number + 1 for number in before]
    with pytest.raises(NodeError, match="cycle"):
        bottom.add_child(root)
    assert len(list(root.iter_descendants())) == len(nodes)


def test_chains_deeper_than_the_recursion_limit():
    assert sys.getrecursionlimit() < 1500
    root = NodePath("root")
    end = root
    for _ in range(1500):
        end = end.attach_new_node("n")
        end.set_pos(1, 0, 0)
    assert end.get_pos(root).tolist() == [1500, 0, 0]
    assert end.get_net_mat()[3].tolist() == [1500, 0, 0, 1]
    copy = root.copy_to(NodePath("elsewhere"))
    assert len(copy.find_all_matches("**/n")) == 1500
    assert root.get_tight_bounds() is None
    end.wrt_reparent_to(root)
    assert end.get_pos().tolist() == [1500, 0, 0]
    assert len(end.get_ancestors()) == 2


def test_a_scene_that_nobody_holds_is_freed_at_once():
    gc.disable()
    try:
        root = NodePath("root")
        model = root.attach_new_node("a").attach_new_node(GeomNode("mesh"))
        model.instance_to(root.attach_new_node("b"))
        root.find_all_matches("**")
        watched = [weakref.ref(node) for node in root.node().iter_descendants()]
        del root
        assert all(reference() is not None for reference in watched)  # a path below holds what is above it
        del model
        assert [reference() for reference in watched if reference() is not None] == []
    finally:
        gc.enable()
