"""NodePath: building, instancing, copying, attributes, patterns. Panda3D itself: test_panda_oracle_graph."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.errors import NodeError
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.nodepath import NodePath
from tests.unit.trees import names, tree

# --- Building and moving ---


def test_children_are_ordered_by_sort_and_then_by_coming():
    root = NodePath("root")
    for name, sort in [("a", 0), ("b", 5), ("c", -1), ("d", 0), ("e", 5)]:
        root.attach_new_node(name, sort)
    assert names(root.get_children()) == ["root/c", "root/a", "root/d", "root/b", "root/e"]
    root.find("a").reparent_to(root)  # again: it comes last among its equals
    assert [child.get_name() for child in root.get_children()] == ["c", "d", "a", "b", "e"]
    root.find("d").reparent_to(root, 9)
    assert [child.get_sort() for child in root.get_children()] == [-1, 0, 5, 5, 9]
    assert root.get_child(4) == root.find("d")
    assert root.get_num_children() == 5


def test_paths_to_one_place_move_together():
    t = tree("a", "b", "a/x")
    same = t["root"].find("**/x")
    kept = {same: "found"}
    t["a/x"].reparent_to(t["b"])
    assert str(same) == "root/b/x"
    assert same == t["a/x"]
    assert kept[t["a/x"]] == "found"
    t["b"].reparent_to(t["a"])
    assert str(same) == "root/a/b/x"


def test_a_path_made_before_its_node_is_attached_follows_it():
    t = tree("a", "a/b")
    node = PandaNode("n")
    early = NodePath(node)
    below = early.attach_new_node("below")
    assert t["a"].attach_new_node(node) == early
    assert names([early, below]) == ["root/a/n", "root/a/n/below"]
    assert str(t["a/b"].attach_new_node(node)) == "root/a/b/n"  # a second parent
    assert names([early, NodePath(node)]) == ["root/a/n", "root/a/n"]


def test_instancing_to_a_parent_it_has_changes_nothing():
    t = tree("a", "b")
    assert t["a"].instance_to(t["root"], sort=5) == t["a"]
    assert [(c.get_name(), c.get_sort()) for c in t["root"].get_children()] == [("a", 0), ("b", 0)]


def test_detach_keeps_the_path_and_remove_empties_it():
    t = tree("a", "a/x")
    same = t["root"].find("a/x")
    t["a/x"].detach_node()
    assert str(t["a/x"]) == "x"
    assert not t["a/x"].has_parent()
    assert t["a"].get_num_children() == 0
    t["a/x"].reparent_to(t["root"])
    t["a/x"].remove_node()
    assert t["a/x"].is_empty()
    assert not t["a/x"]
    assert str(same) == "x"
    assert t["root"].find("**/x").is_empty()
    assert NodePath() == t["a/x"]


def test_reparenting_to_an_empty_path_detaches():
    t = tree("a")
    t["a"].set_pos(1, 2, 3)
    t["a"].reparent_to(NodePath())
    assert t["a"].get_parent().is_empty()
    assert t["a"].get_pos().tolist() == [1, 2, 3]


def test_ancestors():
    t = tree("a", "a/b", "a/b/c", "a/d")
    assert names(t["a/b/c"].get_ancestors()) == ["root/a/b/c", "root/a/b", "root/a", "root"]
    assert t["a/b/c"].get_top() == t["root"]
    assert t["a/b/c"].get_common_ancestor(t["a/d"]) == t["a"]
    assert t["a"].is_ancestor_of(t["a/b/c"])
    assert t["a"].is_ancestor_of(t["a"])
    assert not t["a/d"].is_ancestor_of(t["a/b/c"])
    assert NodePath("other").get_common_ancestor(t["a"]).is_empty()


# --- Instancing and copying ---


def test_an_instanced_node_has_a_path_for_each_parent():
    t = tree("a", "b")
    model = NodePath("model")
    wheel = model.attach_new_node("wheel")
    wheel.set_pos(0, 0, 1)
    for side, x in (("a", 1), ("b", 2)):
        t[side].set_pos(x, 0, 0)
        model.instance_to(t[side])
    assert names(t["root"].find_all_matches("**/wheel")) == ["root/a/model/wheel", "root/b/model/wheel"]
    first, second = t["root"].find_all_matches("**/wheel")
    assert first.node() is second.node() is wheel.node()
    assert first != second
    assert len({first, second, t["a"].find("*/wheel")}) == 2
    assert first.get_pos(second).tolist() == [-1, 0, 0]
    assert [first.get_pos(t["root"]).tolist(), second.get_pos(t["root"]).tolist()] == [[1, 0, 1], [2, 0, 1]]
    assert str(model) == "model"  # the path that was instanced stays what it was
    wheel.set_pos(0, 0, 5)
    assert second.get_pos(t["b"]).tolist() == [0, 0, 5]
    assert t["a"].find("model") == model.instance_to(t["a"])  # there already
    assert t["a"].get_num_children() == 1


def test_detaching_one_instance_leaves_the_other():
    t = tree("a", "b")
    model = NodePath("model")
    model.attach_new_node("part")
    here, there = model.instance_to(t["a"]), model.instance_to(t["b"])
    part_here, part_there = here.find("part"), there.find("part")
    here.detach_node()
    assert names([here, part_here, there, part_there]) == [
        "model",
        "model/part",
        "root/b/model",
        "root/b/model/part",
    ]
    assert t["a"].get_num_children() == 0
    assert there.node().parents == [t["b"].node()]


def test_an_instance_does_not_move_onto_another_of_the_same_node():
    t = tree("a", "b")
    model = NodePath("model")
    here, there = model.instance_to(t["a"]), model.instance_to(t["b"])
    with pytest.raises(NodeError, match=r"'root/a/model'.*'root/b'.*another instance"):
        here.reparent_to(t["b"])
    assert names([here, there]) == ["root/a/model", "root/b/model"]


def test_an_instanced_child_comes_last_again_and_keeps_its_paths():
    t = tree("a", "b", "a/m", "a/m/x", "a/m/y")
    there = t["a/m"].instance_to(t["b"]).find("x")
    t["a/m/x"].reparent_to(t["a/m"])
    assert names(t["a/m"].get_children()) == ["root/a/m/y", "root/a/m/x"]
    assert names([t["a/m/x"], there]) == ["root/a/m/x", "root/b/m/x"]


def test_copy_to_copies_nodes_once_and_shares_geoms():
    t = tree("a", "a/b", "target")
    geom = Geom(np.eye(3), [[0, 1, 2]])
    material = Material("bark")
    node = GeomNode("mesh")
    node.add_geom(geom, material)
    t["a"].attach_new_node(node, sort=3)
    t["a/b"].attach_new_node(node)
    t["a"].set_pos_hpr_scale((1, 2, 3), (4, 5, 6), (7, 8, 9))
    t["a"].set_color(0.1, 0.2, 0.3, 0.4, 5)
    t["a"].set_material(material, 6)
    t["a"].set_tag("kind", "tree")
    t["a"].hide()
    copy = t["a"].copy_to(t["target"])
    assert str(copy) == "root/target/a"
    assert [type(place.node()) for place in copy.find_all_matches("**")] == [
        PandaNode,
        PandaNode,
        GeomNode,
        GeomNode,
    ]
    assert copy.find("mesh").node() is copy.find("b/mesh").node() is not node
    assert copy.find("mesh").node().geoms == [(geom, material)]
    assert copy.find("mesh").node().geoms[0][0] is geom
    assert copy.find("mesh").get_sort() == 3
    assert (copy.get_mat() == t["a"].get_mat()).all()
    assert copy.get_color() == (0.1, 0.2, 0.3, 0.4)
    assert copy.node().flat_color_priority == 5
    assert copy.get_material() is material
    assert copy.get_tag("kind") == "tree"
    assert copy.is_hidden()
    copy.set_tag("kind", "other")
    copy.set_pos(0, 0, 0)
    assert t["a"].get_tag("kind") == "tree"
    assert t["a"].get_pos().tolist() == [1, 2, 3]


# --- Attributes ---


def test_colour_and_material_are_inherited_and_a_higher_priority_above_wins():
    t = tree("a", "a/b")
    a, b = t["a"], t["a/b"]
    red, green = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 0.5)
    bark, moss = Material("bark"), Material("moss")
    assert b.get_net_color() is None
    assert b.get_net_material() is None
    a.set_color(1, 0, 0)
    a.set_material(bark)
    assert (b.get_net_color(), b.get_net_material()) == (red, bark)
    assert not b.has_color()
    assert b.get_color() == (1, 1, 1, 1)
    b.set_color(green)
    b.set_material(moss)
    assert (b.get_net_color(), b.get_net_material()) == (green, moss)
    a.set_color(red, 1)
    a.set_material(bark, 1)
    assert (b.get_net_color(), b.get_net_material()) == (red, bark)
    b.set_color(*green, 1)
    b.set_material(moss, 1)
    assert (b.get_net_color(), b.get_net_material()) == (green, moss)
    b.clear_color()
    b.clear_material()
    assert (b.get_net_color(), b.get_net_material()) == (red, bark)


def test_tags():
    t = tree("a", "a/b")
    t["a"].set_tag("kind", "tree")
    t["a"].set_tag("age")
    assert t["a"].get_tag_keys() == ("kind", "age")
    assert t["a/b"].get_tag("kind") == ""
    assert t["a/b"].get_net_tag("kind") == "tree"
    assert t["a/b"].find_net_tag("age") == t["a"]
    assert t["a/b"].has_net_tag("age")
    t["a"].clear_tag("age")
    t["a"].clear_tag("never there")
    assert not t["a"].has_tag("age")
    assert t["a/b"].find_net_tag("age").is_empty()


def test_hide_with_no_mask_is_for_every_camera():
    t = tree("a", "a/b")
    t["a"].hide()
    assert t["a/b"].is_hidden()
    assert t["a/b"].get_hidden_ancestor() == t["a"]
    t["a"].show()
    t["a"].hide(0b10)
    assert t["a/b"].is_hidden(0b10)
    assert not t["a/b"].is_hidden(0b11)
    assert not t["a/b"].is_hidden()
    t["a"].hide(0x7FFFFFFF)
    assert t["a/b"].is_hidden()


# --- Patterns ---


@pytest.mark.parametrize(
    ("pattern", "element"),
    [
        ("a//b", "''"),
        ("", "''"),
        ("a/..", "'..'"),
        ("**/@@x", "'@@x'"),
        ("+Nothing", r"'\+Nothing'"),
        ("x;+q", r"'\+q'"),
    ],
)
def test_a_pattern_that_is_not_understood_is_named(pattern, element):
    with pytest.raises(NodeError, match=element):
        NodePath("root").find_all_matches(pattern)


def test_matches_come_once_and_in_the_order_of_length_and_children():
    t = tree("a", "b", "a/x", "b/x", "x", "a/x/x")
    matches = names(t["root"].find_all_matches("**/**/x"))
    assert matches == ["root/x", "root/a/x", "root/b/x", "root/a/x/x"]
    assert str(t["root"].find("**/x")) == "root/x"
