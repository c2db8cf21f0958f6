"""Ours against Panda3D itself: what hangs where, what is found, inherited, hidden, and bounded."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample.errors import NodeError
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.traversal import iter_visible
from tests.unit.panda_twins import EPS32, ROUNDINGS, Twins, columns, matrix_bound, trees, vectors

picks = st.integers(0, 20)
shapes = st.lists(picks, min_size=1, max_size=8)
"""A tree by the number of each node's parent."""


def plain_tree(parents: list[int]) -> Twins:
    twins = Twins()
    for number in parents:
        twins.attach(number % len(twins))
    return twins


# --- Building, moving, instancing, copying ---

EDITS = ("attach", "attach node", "reparent", "wrt", "instance", "detach", "copy", "child")
edits = st.lists(st.tuples(st.sampled_from(EDITS), picks, picks, st.integers(-2, 2)), max_size=15)


def has_one_top(path: NodePath) -> bool:
    """Whether at most one path begins at the node; of more, Panda3D would continue any one."""
    return sum(1 for step in path.node()._steps if step.parent is None) <= 1


def edit(twins: Twins, what: str, a: int, b: int, sort: int) -> None:
    """Do one thing to both; where ours refuses, to neither. A path that comes out of it joins the twins."""
    (path, other), (oracle, oracle_other) = twins.pick(a, b)
    if what == "attach":
        twins.attach(a % len(twins), sort=sort)
    elif what == "child":
        if path.get_num_children():
            number = b % path.get_num_children()
            twins.add(path.get_child(number), oracle.get_child(number))
    elif what == "detach":
        path.detach_node()
        oracle.detach_node()
    elif what in ("reparent", "wrt"):
        if other.node() in path.node().parents and len(path.node()._steps) > 1:
            return  # to the parent it has: Panda3D cuts off other paths through that parent, ours keeps them
        if path.get_top() != other.get_top():
            what = "reparent"
        name = {"reparent": "reparent_to", "wrt": "wrt_reparent_to"}[what]
        getattr(path, name)(other, sort)
        getattr(oracle, name)(oracle_other, sort)
    elif what == "instance":
        twins.add(path.instance_to(other, sort), oracle.instance_to(oracle_other, sort))
    elif what == "copy":
        twins.add(path.copy_to(other, sort), oracle.copy_to(oracle_other, sort))
    elif what == "attach node" and has_one_top(path) and other.node() not in path.node().parents:
        twins.add(other.attach_new_node(path.node(), sort), oracle_other.attach_new_node(oracle.node(), sort))


@settings(max_examples=500)
@given(shapes, edits)
def test_editing_leaves_the_same_graph_and_moves_the_same_paths(parents, steps):
    twins = plain_tree(parents)
    for step in steps:
        if sum(len(path.find_all_matches("**")) for path in twins.ours) > 500:
            break  # copies of copies
        try:
            edit(twins, *step)
        except NodeError as error:
            assert "cycle" in str(error) or "another instance" in str(error)  # noqa: PT017
        for ours, theirs in zip(twins.ours, twins.theirs, strict=True):
            assert str(ours) == str(theirs)
            assert [c.get_name() for c in ours.get_children()] == [
                c.get_name() for c in theirs.get_children()
            ]
            assert [c.get_sort() for c in ours.get_children()] == [
                c.get_sort() for c in theirs.get_children()
            ]
            assert len(ours.node().parents) == theirs.node().get_num_parents()
            assert ours.get_sort() == theirs.get_sort()


@pytest.mark.parametrize("what", ["reparent_to", "wrt_reparent_to", "instance_to"])
def test_both_refuse_a_cycle(what, capfd):
    twins = plain_tree([0, 1, 2])
    for one, error in ((twins.ours, NodeError), (twins.theirs, AssertionError)):
        with pytest.raises(error, match="cycle"):
            getattr(one[1], what)(one[3])
    assert "cycle" in capfd.readouterr().err  # Panda3D says so there


# --- Patterns ---

NAMES = ("a", "b", "ab", "A", "x")
ELEMENTS = ("*", "**", "**", "a", "b", "a*", "?", "[ab]", "[!a]", "+PandaNode", "-PandaNode", "+GeomNode")
TAG_ELEMENTS = ("=t", "=t=a", "=t=a*", "=t=?", "=t=", "=none")
flags = st.sampled_from(("", "", ";+i", ";-i", ";-h", ";+h", ";+i-h", ";+h-s", ";+s"))
patterns = (
    st.tuples(st.lists(st.sampled_from(ELEMENTS + TAG_ELEMENTS), min_size=1, max_size=4).map("/".join), flags)
    .map("".join)
    .filter(lambda pattern: not ("[" in pattern and "+i" in pattern))  # there Panda3D still tells a from A
)
found_nodes = st.tuples(
    picks,
    st.sampled_from(NAMES),
    st.booleans(),
    st.none() | st.sampled_from(NAMES),
    st.sampled_from((None, None, 0, 1)),
)


@given(st.lists(found_nodes, max_size=12), patterns, picks)
def test_patterns_find_the_same_nodes(nodes, pattern, start):
    twins = Twins()
    for parent, name, is_geom, tag, mask in nodes:
        kinds = (GeomNode, panda.GeomNode) if is_geom else (NodePath, panda.NodePath)
        both = [kind(name) for kind in kinds]
        parents = [one[0] for one in twins.pick(parent)]
        twins.add(
            *(p.attach_new_node(n if is_geom else n.node()) for p, n in zip(parents, both, strict=True))
        )
        for path in (twins.ours[-1], twins.theirs[-1]):
            if tag is not None:
                path.set_tag("t", tag)
            if mask is not None:
                path.hide(*([] if mask == 0 else [mask]))
    (path,), (oracle,) = twins.pick(start)
    ours, theirs = path.find_all_matches(pattern), list(oracle.find_all_matches(pattern))
    assert {i for i, one in enumerate(twins.ours) if one in ours} == {
        i for i, one in enumerate(twins.theirs) if one in theirs
    }
    assert len(set(ours)) == len(ours)
    lengths = [len(one.get_ancestors()) for one in ours]
    assert lengths == sorted(lengths)
    assert path.find(pattern).is_empty() == oracle.find(pattern).is_empty()
    if ours:
        assert path.find(pattern) == ours[0]
        assert lengths[0] == oracle.find(pattern).get_num_nodes()


# --- Attributes ---

colors = st.tuples(
    picks, st.tuples(*[st.integers(0, 8).map(lambda n: n / 8)] * 4) | st.none(), st.integers(-1, 2)
)


@given(shapes, st.lists(colors, max_size=8))
def test_colours_and_their_priorities(parents, changes):
    twins = plain_tree(parents)
    for number, color, priority in changes:
        (path,), (oracle,) = twins.pick(number)
        if color is None:
            path.clear_color()
            oracle.clear_color()
        else:
            path.set_color(color, priority)
            oracle.set_color(color, priority)
    for ours, theirs in zip(twins.ours, twins.theirs, strict=True):
        attribute = theirs.get_net_state().get_attrib(panda.ColorAttrib)
        assert ours.get_net_color() == (None if attribute is None else tuple(attribute.get_color()))
        assert ours.has_color() == theirs.has_color()
        if ours.has_color():
            assert ours.get_color() == tuple(theirs.get_color())


@given(shapes, st.lists(st.tuples(picks, st.sampled_from("ab"), st.sampled_from(["", "v", "w"])), max_size=6))
def test_tags(parents, tags):
    twins = plain_tree(parents)
    for number, key, value in tags:
        for path in (one[0] for one in twins.pick(number)):
            path.set_tag(key, value)
    for ours, theirs in zip(twins.ours, twins.theirs, strict=True):
        assert ours.get_tag_keys() == theirs.get_tag_keys()
        for key in "ab":
            assert ours.has_tag(key) == theirs.has_tag(key)
            assert ours.get_tag(key) == theirs.get_tag(key)
            assert ours.get_net_tag(key) == theirs.get_net_tag(key)
            assert ours.has_net_tag(key) == theirs.has_net_tag(key)
            found, expected = ours.find_net_tag(key), theirs.find_net_tag(key)
            assert found.is_empty() == expected.is_empty()
            assert found.is_empty() or str(found) == str(expected)


# --- Visibility ---

masks = st.sampled_from((None, 1, 2, 3, 0x7FFFFFFF, 0xFFFFFFFF))
hidings = st.lists(
    st.tuples(picks, st.sampled_from(("hide", "hide", "show", "show_through")), masks), max_size=10
)


def dress(twins: Twins, changes: list[tuple[int, str, int | None]]) -> None:
    for number, name, mask in changes:
        for path in (one[0] for one in twins.pick(number)):
            getattr(path, name)(*([] if mask is None else [mask]))


@given(shapes, hidings)
def test_hidden(parents, changes):
    twins = plain_tree(parents)
    dress(twins, changes)
    for ours, theirs in zip(twins.ours, twins.theirs, strict=True):
        for mask in (1, 2, 3, 4):
            assert ours.is_hidden(mask) == theirs.is_hidden(mask)
            if ours.is_hidden(mask):
                assert str(ours.get_hidden_ancestor(mask)) == str(theirs.get_hidden_ancestor(mask))


class Culler:
    """Panda3D's own culling, in its software renderer: which nodes does a camera with a mask draw?"""

    def __init__(self) -> None:
        panda.load_prc_file_data("", "load-display p3tinydisplay\naudio-library-name null")
        self.engine = panda.GraphicsEngine.get_global_ptr()
        pipes = panda.GraphicsPipeSelection.get_global_ptr()
        pipes.load_aux_modules()
        kinds = {kind.name: kind for kind in pipes.get_pipe_types()}
        assert "TinyOffscreenGraphicsPipe" in kinds, "Panda3D's software renderer needs libX11.so.6"
        properties = panda.FrameBufferProperties()
        properties.set_rgb_color(True)
        self.buffer = self.engine.make_output(
            pipes.make_pipe(kinds["TinyOffscreenGraphicsPipe"]),
            "buffer",
            0,
            properties,
            panda.WindowProperties.size(1, 1),
            panda.GraphicsPipe.BF_refuse_window,
        )
        self.camera = panda.NodePath(panda.Camera("camera"))
        self.buffer.make_display_region().set_camera(self.camera)

    def drawn(self, root: panda.NodePath, mask: int) -> list[str]:
        """The names of the nodes drawn; their own drawing is replaced by a note of the name."""
        names: list[str] = []
        callbacks = []
        for path in list(root.find_all_matches("**")):
            node = panda.CallbackNode(path.name)
            callback = panda.PythonCallbackObject(lambda _, name=path.name: names.append(name))
            node.set_draw_callback(callback)
            callbacks.append((path.attach_new_node(node), callback))
        self.camera.node().set_camera_mask(mask)
        self.camera.reparent_to(root)
        self.engine.render_frame()
        self.camera.detach_node()
        for path, _ in callbacks:
            path.node().clear_draw_callback()
            path.remove_node()
        return names

    def close(self) -> None:
        # Panda3D's engine outlives Python: what it still holds of ours, it would free into a dead interpreter
        self.engine.remove_all_windows()
        self.engine.render_frame()
        del self.buffer, self.camera


@pytest.fixture(scope="module")
def culler() -> Iterator[Culler]:
    culler = Culler()
    yield culler
    culler.close()


@given(parents=shapes, changes=hidings, mask=st.sampled_from((1, 2, 3, 4)))
def test_a_camera_sees_the_same_nodes(culler, parents, changes, mask):
    twins = plain_tree(parents)
    dress(twins, changes)
    seen = [visit.node.name for visit in iter_visible(twins.ours[0], mask)]
    assert sorted(seen) == sorted(culler.drawn(twins.theirs[0], mask))


# --- Bounds ---


def panda_mesh(points: np.ndarray) -> panda.GeomNode:
    data = panda.GeomVertexData("points", panda.GeomVertexFormat.get_v3(), panda.Geom.UH_static)
    writer = panda.GeomVertexWriter(data, "vertex")
    for point in points.tolist():
        writer.add_data3(*point)
    corners = panda.GeomTriangles(panda.Geom.UH_static)
    corners.add_vertices(0, 1, 2)
    geom = panda.Geom(data)
    geom.add_primitive(corners)
    node = panda.GeomNode("mesh")
    node.add_geom(geom)
    return node


meshes = st.lists(
    st.tuples(picks, st.lists(vectors(-10, 10), min_size=3, max_size=3), st.booleans()), max_size=4
)


@given(trees(4), meshes, picks, picks, st.booleans())
def test_tight_bounds(nodes, meshes_, a, b, to_other):
    twins = Twins.grown(nodes)
    for number, corners, hidden in meshes_:
        points = np.array(corners)
        (path,), (oracle,) = twins.pick(number)
        node = GeomNode("mesh")
        node.add_geom(Geom(points, [[0, 1, 2]], normals=np.ones((3, 3))))
        twins.add(path.attach_new_node(node), oracle.attach_new_node(panda_mesh(points)))
        if hidden:
            twins.ours[-1].hide()
            twins.theirs[-1].hide()
    (path, other), (oracle, oracle_other) = twins.pick(a, b)
    if not to_other:
        other, oracle_other = path.get_parent(), oracle.get_parent()
    ours = path.get_tight_bounds(*([other] if to_other else []))
    theirs = oracle.get_tight_bounds(*([oracle_other] if to_other else []))
    assert (ours is None) == (theirs is None)
    if ours is None:
        return
    # A vertex within 10 of its node's origin errs by the matrix's error along it, for the worst matrix below.
    places = [place for place in path.find_all_matches("**") if place.node().iter_local_points()]
    bound = max((np.array([10, 10, 10, 1]) @ matrix_bound(place, other) for place in places), key=np.max)
    bound = bound + ROUNDINGS * EPS32 * np.abs(ours).max()
    np.testing.assert_array_less(np.abs(ours[0] - theirs[0]), bound)
    np.testing.assert_array_less(np.abs(ours[1] - theirs[1]), bound)


@given(trees(), picks, picks)
def test_instances_and_copies_stand_where_panda3d_puts_them(nodes, a, b):
    twins = Twins.grown(nodes)
    (path, other), (oracle, oracle_other) = twins.pick(a, b)
    if not path.is_ancestor_of(other):
        twins.add(path.instance_to(other), oracle.instance_to(oracle_other))
    twins.add(path.copy_to(other), oracle.copy_to(oracle_other))
    for ours, theirs in zip(twins.ours, twins.theirs, strict=True):
        assert str(ours) == str(theirs)
        difference = columns(ours.get_net_mat()) - columns(theirs.get_net_transform().get_mat())
        assert (np.abs(difference) <= matrix_bound(ours, twins.ours[0])).all()
