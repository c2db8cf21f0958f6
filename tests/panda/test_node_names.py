"""Panda3D's names of paths, nodes and tags on ours, beside Panda3D itself."""

from __future__ import annotations

import copy
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample import (
    GeomNode,
    NodePath,
)
from firefly_sample.errors import NodeError
from firefly_sample.scene.listing import tree_lines
from tests.unit.panda_twins import Twins


def walks(paths):
    """Of each path, all that leads up and down from it, by name."""
    return [
        (
            path.name,
            path.parent.name if path.parent else None,
            path.get_parent().is_empty(),
            [child.name for child in path.children],
            [above.name for above in path.ancestors],
            [node.name for node in path.nodes],
            [path.get_node(index).name for index in range(path.get_num_nodes())],
            path.get_ancestor(path.get_num_nodes() - 1).name,
            path.get_top_node().name,
            path.sort,
            path.is_singleton(),
            path.count_num_descendants(),
            [path.is_same_graph(other) for other in paths],
            path.node().get_num_children(),
            [path.node().get_child(index).name for index in range(path.node().get_num_children())],
            [path.node().find_child(other.node()) for other in paths],
            path.node().get_num_parents(),
            [path.node().get_parent(index).name for index in range(path.node().get_num_parents())],
        )
        for path in paths
    ]


edits = st.lists(st.tuples(st.sampled_from("pdi"), st.integers(0, 20), st.integers(0, 20)), max_size=6)


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(-2, 2)), min_size=1, max_size=6), edits)
def test_ways_up_and_down(nodes, changes):
    twins = Twins()
    for parent, sort in nodes:
        twins.attach(parent % len(twins), sort=sort)
    for kind, a, b in changes:
        (path, other), (oracle, oracle_other) = twins.pick(a, b)
        if kind == "d":
            path.detach_node()
            oracle.detach_node()
        elif not path.is_ancestor_of(other) and kind == "p":
            path.reparent_to(other)
            oracle.reparent_to(oracle_other)
    assert walks(twins.ours) == walks(twins.theirs)


def test_the_parent_of_a_root_is_none_and_get_parent_an_empty_path():
    for library in (NodePath, panda.NodePath):
        root = library("root")
        assert root.parent is None
        assert root.get_parent().is_empty()
        assert not root.get_parent()
        assert root.attach_new_node("a").parent == root


@given(st.text(st.characters(codec="ascii", exclude_categories=("Cc",)), max_size=5))
def test_names(name):
    for library in (NodePath, panda.NodePath):
        path = library("a")
        path.name = name
        assert path.name == path.getName() == path.node().name == path.node().getName() == name
        path.node().setName("b")
        assert path.name == "b"


def test_collections_do_the_same_with_each_path():
    for library in (NodePath, panda.NodePath):
        root, other = library("root"), library("other")
        for name in "aab":
            root.attach_new_node(name)
        found = root.findAllMatches("a")
        assert (found.get_num_paths(), len(found), found.is_empty()) == (2, 2, False)
        assert found.getPath(1) == found[1]
        assert found.has_path(root.get_child(0))
        found.hide()
        assert [child.is_hidden() for child in root.children] == [True, True, False]
        found.show()
        found.set_color(1, 0, 0, 1)
        assert [child.has_color() for child in root.children] == [True, True, False]
        found.reparent_to(other)
        assert (root.get_num_children(), other.get_num_children()) == (1, 2)
        found.detach()
        assert other.get_num_children() == 0
        assert root.find_all_matches("nothing").is_empty()


# --- Tags ---

keys = st.sampled_from(("a", "b", "c"))
tag_edits = st.lists(
    st.tuples(
        st.sampled_from(("set_tag", "clear_tag", "set_python_tag", "clear_python_tag")),
        keys,
        st.integers(0, 20),
        st.text("xyz", max_size=2),
        st.booleans(),
    ),
    max_size=12,
)


@given(st.lists(st.integers(0, 20), min_size=1, max_size=4), tag_edits)
def test_tags(parents, changes):
    twins = Twins()
    for parent in parents:
        twins.attach(parent % len(twins))
    for method, key, number, value, by_node in changes:
        for (path,) in twins.pick(number):
            values = (value,) if method.startswith("set") else ()
            getattr(path.node() if by_node else path, method)(key, *values)

    def read(path):
        node = path.node()
        rows = [
            (
                path.get_tag(key), path.has_tag(key), path.get_net_tag(key), path.has_net_tag(key),
                str(path.find_net_tag(key)) if path.has_net_tag(key) else "",
                path.get_python_tag(key), path.has_python_tag(key), path.get_net_python_tag(key),
                path.has_net_python_tag(key),
                str(path.find_net_python_tag(key)) if path.has_net_python_tag(key) else "",
                node.get_tag(key), node.has_tag(key), node.get_python_tag(key), node.has_python_tag(key),
            )
            for key in "abc"
        ]  # fmt: skip
        keys = set(path.get_tag_keys()), set(path.get_python_tag_keys()), set(node.get_tag_keys())
        return rows, keys, node.has_tags(), dict(path.tags.items()), dict(node.python_tags)

    assert [read(path) for path in twins.ours] == [read(path) for path in twins.theirs]


def test_a_copy_shares_the_values_of_python():
    value = object()
    for library in (NodePath, panda.NodePath):
        path, other = library("a"), library("other")
        path.set_python_tag("key", value)
        made = path.copy_to(other)
        assert made.get_python_tag("key") is value
        made.clear_python_tag("key")
        assert path.has_python_tag("key")


def test_tags_survive_pickle_and_refuse_what_is_no_text():
    path = NodePath("a")
    path.set_python_tag("speed", [1, 2])
    for made in (pickle.loads(pickle.dumps(path)), copy.deepcopy(path)):
        assert made.get_python_tag("speed") == [1, 2]
    with pytest.raises(NodeError, match=r"'a'.*set_python_tag takes text"):
        path.set_python_tag(1, 2)


# --- What is printed ---


@given(
    st.lists(
        st.tuples(st.integers(0, 20), st.integers(0, 3), st.lists(keys, unique=True, max_size=2)), max_size=5
    )
)
def test_ls_prints_as_panda_does(nodes):
    twins = Twins()
    for parent, kind, tags in nodes:
        number = twins.attach(parent % len(twins))
        for path in (twins.ours[number], twins.theirs[number]):
            for key in tags:
                path.set_tag(key, "x")
            for setter in ("set_pos", "set_hpr", "set_scale")[:kind]:
                getattr(path, setter)(number, 2, 3)
            if kind == 2:
                path.set_scale(number + 1)
    stream = panda.LineStream()
    twins.theirs[0].ls(stream)
    expected = []
    while stream.is_text_available():
        expected.append(stream.get_line().rstrip())
    assert [line.rstrip() for line in tree_lines(twins.ours[0].node())] == expected


def test_ls_prints(capsys):
    path = NodePath("a")
    path.set_color(1, 0, 0)
    path.attach_new_node(GeomNode("g"))
    path.ls()
    assert capsys.readouterr().out == "PandaNode a S:(color)\n  GeomNode g (0 geoms)\n"
