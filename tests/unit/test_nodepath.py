"""NodePath: building, moving, instancing, copying, attributes, errors. Panda3D itself: test_panda_oracle."""

from __future__ import annotations

import gc
import math
import sys
import weakref

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from firefly_sample.errors import NodeError
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.nodepath import NodePath, net_matrix
from firefly_sample.scene.transform_state import TransformState

EPS = 2.0**-52

numbers = st.floats(-10, 10)
vectors = st.tuples(numbers, numbers, numbers)
angles = st.tuples(*[st.floats(-180, 180)] * 3)
sizes = st.floats(0.25, 4)
scales = st.tuples(*[sizes | sizes.map(lambda size: -size)] * 3)
shears = st.tuples(*[st.floats(-1, 1)] * 3)
states = st.builds(TransformState.make_pos_hpr_scale_shear, vectors, angles, scales, shears)


def names(paths: list[NodePath]) -> list[str]:
    return [str(path) for path in paths]


def tree(*paths: str) -> dict[str, NodePath]:
    """A tree from "a", "a/b", ...: every path by its text, the root being "root"."""
    found = {"root": NodePath("root")}
    for path in paths:
        parent, _, name = path.rpartition("/")
        found[path] = found[parent or "root"].attach_new_node(name)
    return found


def two_branches(up: list[TransformState], down: list[TransformState]) -> tuple[NodePath, NodePath]:
    """The ends of two chains of nodes with these transforms under one root."""
    root = NodePath("root")
    ends = []
    for name, chain in (("u", up), ("d", down)):
        path = root
        for index, state in enumerate(chain):
            path = path.attach_new_node(f"{name}{index}")
            path.set_transform(state)
        ends.append(path)
    return ends[0], ends[1]


def growth(*paths: NodePath) -> float:
    """How far a rounding in one matrix on these paths may grow: the product of the matrices' norms."""
    return math.prod(float(np.linalg.norm(p.get_mat())) for path in paths for p in path.get_ancestors())


def bound_between(other: NodePath, path: NodePath) -> float:
    """The rounding of a transform between two places: down to `path`, and up from `other` by an inverse."""
    return 64 * EPS * growth(other, path) * float(np.linalg.norm(np.linalg.inv(net_matrix(other))))


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


def test_a_node_class_that_does_not_say_how_to_copy_itself_is_not_copied():
    class Odd(PandaNode):
        pass

    with pytest.raises(NodeError, match=r"'strange'.*Odd needs make_copy"):
        NodePath(Odd("strange")).copy_to(NodePath("root"))


# --- Transforms ---


def test_numbers_come_one_by_one_or_as_one_sequence():
    t = tree("a", "b")
    a, b = t["a"], t["b"]
    b.set_pos(10, 0, 0)
    for arguments in ((1, 2, 3), ((1, 2, 3),), (np.array([1.0, 2, 3]),), ([1, 2, 3],)):
        a.clear_transform()
        a.set_pos(*arguments)
        assert a.get_pos().tolist() == [1, 2, 3]
        a.set_pos(b, *arguments)
        assert a.get_pos().tolist() == [11, 2, 3]
    a.set_scale(2)
    assert a.get_scale().tolist() == [2, 2, 2]
    a.set_scale(b, 3)
    assert a.get_scale().tolist() == [3, 3, 3]
    a.set_quat(2, 0, 0, 0)
    assert a.get_quat().tolist() == [1, 0, 0, 0]
    a.set_pos_hpr(1, 2, 3, 4, 5, 6)
    assert a.get_hpr().tolist() == [4, 5, 6]
    a.set_pos_hpr(b, (0, 0, 0), (7, 8, 9))
    assert a.get_pos().tolist() == [10, 0, 0]
    np.testing.assert_allclose(a.get_hpr(), (7, 8, 9), rtol=1e-14)


COMPONENTS = [
    *[("pos", index, name) for index, name in enumerate(("x", "y", "z"))],
    *[("hpr", index, name) for index, name in enumerate(("h", "p", "r"))],
    *[("scale", index, name) for index, name in enumerate(("sx", "sy", "sz"))],
    *[("shear", index, name) for index, name in enumerate(("shxy", "shxz", "shyz"))],
]


@pytest.mark.parametrize(("vector", "index", "name"), COMPONENTS)
def test_single_components(vector, index, name):
    up = TransformState.make_pos_hpr_scale_shear((1.0, 2.0, 3.0), (40.0, 30.0, 20.0), (2.0, 2.0, 2.0))
    down = TransformState.make_pos_hpr_scale_shear(
        (3.0, 2.0, 1.0), (10.0, 20.0, 30.0), (1.0, 2.0, 3.0), (0.1, 0.2, 0.3)
    )
    other, path = two_branches([up], [down])
    get_all, get_one = getattr(path, f"get_{vector}"), getattr(path, f"get_{name}")
    set_one = getattr(path, f"set_{name}")
    expected = get_all()
    set_one(0.5)
    expected[index] = 0.5
    assert get_all().tolist() == expected.tolist()
    assert get_one() == 0.5
    expected = get_all(other)
    set_one(other, 0.75)
    expected[index] = 0.75
    np.testing.assert_allclose(get_all(other), expected, atol=1e-12)
    assert get_one(other) == pytest.approx(0.75, abs=1e-12)


@given(st.lists(states, max_size=3), st.lists(states, min_size=1, max_size=3))
def test_matrices_are_products_from_the_node_to_the_root(up, down):
    other, path = two_branches(up, down)
    expected = np.eye(4)
    for place in path.get_ancestors():
        expected = expected @ place.get_mat()
    bound = 64 * EPS * growth(path)
    assert np.abs(net_matrix(path) - expected).max() <= bound
    assert np.abs(path.get_net_transform().get_mat() - expected).max() <= bound
    assert np.abs(path.get_mat(path.get_top()) - expected).max() <= bound
    assert np.abs(path.get_mat(NodePath()) - expected).max() <= bound
    error = np.abs(path.get_mat(other) @ net_matrix(other) - expected).max()
    assert error <= bound_between(other, path) * np.linalg.norm(net_matrix(other))
    assert (path.get_mat(path) == np.eye(4)).all()


@given(st.lists(states, min_size=1, max_size=2), st.lists(states, min_size=1, max_size=2))
def test_wrt_reparent_to_keeps_the_net_matrix(up, down):
    other, path = two_branches(up, down)
    before = net_matrix(path)
    scale = max(1.0, np.abs(before).max())
    conditions = [np.linalg.cond(net_matrix(place)) for place in (other, path)]
    assume(max(conditions) < 1e3)
    path.wrt_reparent_to(other)
    assert path.get_parent() == other
    assert np.abs(net_matrix(path) - before).max() <= 1e-12 * scale
    path.wrt_reparent_to(path.get_top())
    assert np.abs(path.get_mat() - before).max() <= 1e-12 * scale


def test_shear_from_a_stretched_parent_is_kept():
    stretched, turned = two_branches(
        [TransformState.make_pos_hpr_scale_shear(scale=(1.0, 2.0, 1.0))],
        [TransformState.make_pos_hpr_scale_shear(hpr=(45.0, 0.0, 0.0))],
    )
    assert turned.get_shear().tolist() == [0, 0, 0]
    turned.reparent_to(stretched)
    # X turned to (1, 1)/sqrt2 becomes (1, 2), Y turned to (-1, 1) becomes (-1, 2): cross shear 3/5 * |y|/|x|.
    x, y = np.array([1, 2]), np.array([-1, 2])
    y_length = np.hypot(*y)
    along = x @ y / y_length
    across = math.sqrt(x @ x - along**2)
    assert turned.get_shear(stretched.get_top())[0] == pytest.approx(along / across, rel=1e-14)
    turned.wrt_reparent_to(stretched.get_top())
    assert turned.get_shear()[0] == pytest.approx(along / across, rel=1e-14)


@given(states, states, vectors)
def test_a_relative_setter_keeps_the_other_local_components(up, down, value):
    other, path = two_branches([up], [down])
    before = [path.get_hpr().tolist(), path.get_scale().tolist(), path.get_shear().tolist()]
    path.set_pos(other, value)
    assert [path.get_hpr().tolist(), path.get_scale().tolist(), path.get_shear().tolist()] == before
    # There by the inverse of one matrix, and back by the inverse of the other.
    bound = bound_between(other, path) * np.linalg.norm(path.get_top().get_mat(other)) * 20
    assert np.abs(path.get_pos(other) - value).max() <= bound
    pos = path.get_pos().tolist()
    path.set_hpr(other, value)
    assert [path.get_pos().tolist(), path.get_scale().tolist(), path.get_shear().tolist()] == [
        pos,
        *before[1:],
    ]


@given(states, states, vectors, vectors)
def test_relative_points_and_vectors(up, down, point, vector):
    other, path = two_branches([up], [down])
    bound = bound_between(path, other) * 20  # the points lie within 20 of their origins
    expected = np.array([*point, 1.0]) @ other.get_mat(path)
    assert np.abs(path.get_relative_point(other, point) - expected[:3]).max() <= bound
    shifted = np.add(point, vector)
    difference = path.get_relative_point(other, shifted) - path.get_relative_point(other, point)
    assert np.abs(path.get_relative_vector(other, vector) - difference).max() <= bound
    assert path.get_distance(other) == pytest.approx(np.linalg.norm(path.get_pos(other)))


@given(states, states, vectors)
def test_look_at_points_the_y_axis(above, local, target):
    # A mirrored or sheared parent still sees the target along +Y: Y is a row of the matrix.
    parent, aim = two_branches([above], [TransformState.make_pos_hpr_scale_shear(target)])
    path = parent.attach_new_node("eye")
    path.set_transform(local)
    path.set_scale(np.abs(local.get_scale()))
    seen = aim.get_pos(parent) - path.get_pos()
    assume(np.linalg.norm(seen) > 0.1)
    path.look_at(aim)
    bound = bound_between(path, aim)
    there = path.get_relative_point(aim, (0, 0, 0))
    assert there[1] > 0
    assert np.abs(there[[0, 2]]).max() <= bound


def test_look_at_takes_points_and_places():
    t = tree("a", "b")
    t["b"].set_pos(5, 0, 0)
    t["a"].look_at(t["b"])
    np.testing.assert_allclose(t["a"].get_hpr(), (-90, 0, 0), atol=1e-13)
    t["a"].look_at(t["b"], (-5, 5, 0))
    np.testing.assert_allclose(t["a"].get_hpr(), (0, 0, 0), atol=1e-13)
    t["a"].look_at(0, 0, 2)
    np.testing.assert_allclose(t["a"].get_mat()[1, :3], (0, 0, 1), atol=1e-15)
    t["a"].look_at((0, 1, 0), (1, 0, 0))
    np.testing.assert_allclose(t["a"].get_hpr(), (0, 0, 90), atol=1e-13)


def test_tight_bounds_hold_every_vertex_also_of_hidden_nodes():
    t = tree("a", "a/b", "empty")
    mesh = GeomNode("mesh")
    mesh.add_geom(Geom([[0, 0, 0], [1, 0, 0], [0, 1, 2]], [[0, 1, 2]]))
    t["a"].attach_new_node(mesh).set_pos(0, 0, 1)
    t["a/b"].attach_new_node(mesh)
    t["a/b"].set_scale(1, 1, -2)
    t["a"].set_pos(10, 0, 0)
    low, high = t["a"].get_tight_bounds()
    assert [low.tolist(), high.tolist()] == [[10, 0, -6], [11, 1, 3]]
    low, high = t["a"].get_tight_bounds(t["a"])
    assert [low.tolist(), high.tolist()] == [[0, 0, -6], [1, 1, 3]]
    t["a/b"].hide()
    assert t["root"].get_tight_bounds()[0].tolist() == [10, 0, -6]
    assert t["empty"].get_tight_bounds() is None


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
        (lambda t: t["a"].set_tag("kind", 3), "'root/a'.*set_tag takes text"),
        (lambda t: t["a"].set_name(3), "'root/a'.*set_name takes text"),
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
    assert net_matrix(end)[3].tolist() == [1500, 0, 0, 1]
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
