"""iter_visible against a plain walk over NodePaths, and what it shares and skips."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample.errors import NodeError
from firefly_sample.scene.color_scale import scaled_further
from firefly_sample.scene.depth_offset import DepthOffset
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import ALL_CAMERAS, OVERALL_BIT
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.render_mode import PLAIN
from firefly_sample.scene.traversal import Visit, iter_visible

MATERIALS = [Material("bark"), Material("moss")]
picks = st.integers(0, 20)
values = st.tuples(*[st.floats(-5, 5)] * 3)
masks = st.sampled_from((None, 1, 2, 3))
EDITS = {
    "attach": st.just(()),
    "instance": picks,
    "set_pos": values,
    "set_hpr": values,
    "set_scale": values,
    "hide": masks,
    "show": masks,
    "show_through": masks,
    "set_color": st.tuples(st.tuples(*[st.floats(0, 1)] * 3), st.integers(0, 2)),
    "set_color_scale": st.tuples(st.tuples(*[st.floats(0, 2)] * 4), st.integers(0, 2)),
    "set_material": st.tuples(st.sampled_from(MATERIALS), st.integers(0, 2)),
    "set_render_mode_thickness": st.tuples(st.integers(1, 9), st.integers(0, 2)),
    "set_depth_offset": st.tuples(st.integers(-3, 3), st.integers(0, 2)),
}
CALLED_WITH_MORE = (
    "set_color",
    "set_color_scale",
    "set_material",
    "set_render_mode_thickness",
    "set_depth_offset",
)
edits = st.sampled_from(sorted(EDITS)).flatmap(lambda what: st.tuples(picks, st.just(what), EDITS[what]))


def grown(steps) -> list[NodePath]:
    paths = [NodePath("root")]
    for number, what, value in steps:
        path = paths[number % len(paths)]
        if what == "attach":
            paths.append(path.attach_new_node(f"n{len(paths)}"))
        elif what == "instance":
            other = paths[value % len(paths)]
            if other.node() is not path.node() and path.node() not in other.node().iter_ancestors():
                paths.append(path.instance_to(other))
        elif what in CALLED_WITH_MORE:
            getattr(path, what)(*value)
        elif value is None:
            getattr(path, what)()
        else:
            getattr(path, what)(value)
    return paths


def plain_walk(path: NodePath, camera: int) -> list[Visit]:
    """The definition: each place by itself, all that it inherits looked up from the root."""
    mask, mode, priority, offset = OVERALL_BIT | ALL_CAMERAS, PLAIN, -(2**31), DepthOffset(0, -(2**31))
    scale = None
    for place in reversed(path.get_ancestors()):
        node = place.node()
        mask = (mask & ~node.draw_control) | (node.draw_control & node.draw_show)
        if node.render_mode is not None and node.render_mode_priority >= priority:
            mode, priority = node.render_mode, node.render_mode_priority
        own = node.depth_offset
        if own is not None and own.priority >= offset.priority:
            offset = DepthOffset(offset.bias + own.bias, own.priority)
        if node.color_scale is not None:
            scale = scaled_further(scale, node.color_scale)
    seen = []
    if mask & OVERALL_BIT and mask & camera & ALL_CAMERAS:
        net = path.get_net_mat()
        look = path.get_net_color(), path.get_net_material()
        look = *look, str(path), mode, offset.bias, scale.scale if scale else (1, 1, 1, 1)
        seen.append(Visit(path.node(), net, *look))
    for child in path.get_children():
        seen += plain_walk(child, camera)
    return seen


@given(st.lists(edits, max_size=25), picks, st.sampled_from((1, 2, 3, 4, ALL_CAMERAS)))
def test_it_is_the_plain_walk(steps, start, camera):
    paths = grown(steps)
    root = paths[start % len(paths)]
    found, expected = list(iter_visible(root, camera)), plain_walk(root, camera)
    assert [visit.path for visit in found] == [visit.path for visit in expected]
    for ours, plain in zip(found, expected, strict=True):
        assert ours.node is plain.node
        assert (ours.color, ours.material) == (plain.color, plain.material)
        assert (ours.render_mode, ours.depth_offset) == (plain.render_mode, plain.depth_offset)
        assert ours.color_scale == plain.color_scale
        # The same product in another order of brackets.
        bound = 64 * 2.0**-52 * max(1.0, np.abs(plain.net).max()) * 10.0 ** len(plain.path.split("/"))
        assert np.abs(ours.net - plain.net).max() <= bound


def test_order_is_depth_first_with_children_as_they_are_sorted():
    root = NodePath("root")
    b = root.attach_new_node("b", sort=1)
    a = root.attach_new_node("a")
    for parent in (a, b):
        parent.attach_new_node("x")
        parent.attach_new_node("y")
    assert [visit.path for visit in iter_visible(root)] == [
        "root", "root/a", "root/a/x", "root/a/y", "root/b", "root/b/x", "root/b/y",
    ]  # fmt: skip


def test_a_node_without_a_transform_shares_the_matrix_above_it():
    root = NodePath("root")
    moved = root.attach_new_node("moved")
    moved.set_pos(1, 2, 3)
    moved.attach_new_node("still").attach_new_node("still too")
    visits = {visit.node.name: visit.net for visit in iter_visible(root)}
    assert visits["still"] is visits["moved"]
    assert visits["still too"] is visits["moved"]
    assert visits["moved"][3].tolist() == [1, 2, 3, 1]


def test_what_stands_above_the_start_counts():
    root = NodePath("root")
    start = root.attach_new_node("a").attach_new_node("start")
    root.set_pos(1, 0, 0)
    root.set_color((1, 0, 0, 1))
    (visit,) = iter_visible(start)
    assert visit.net[3].tolist() == [1, 0, 0, 1]
    assert visit.color == (1, 0, 0, 1)
    assert visit.path == "root/a/start"
    root.hide()
    assert list(iter_visible(start)) == []


def test_a_node_shown_through_is_met_below_a_hidden_one_and_takes_its_transform():
    root = NodePath("root")
    hidden = root.attach_new_node("hidden")
    hidden.set_pos(1, 0, 0)
    hidden.attach_new_node("plain")
    shown = hidden.attach_new_node("between").attach_new_node("shown")
    hidden.hide()
    assert [visit.path for visit in iter_visible(root)] == ["root"]
    shown.show_through()
    visits = list(iter_visible(root))
    assert [visit.path for visit in visits] == ["root", "root/hidden/between/shown"]
    assert visits[1].net[3].tolist() == [1, 0, 0, 1]


def test_equal_names_get_paths_of_their_own_and_hiding_renames_nobody():
    root = NodePath("root")
    trees = [root.attach_new_node("tree") for _ in range(3)]
    for tree in trees:
        tree.attach_new_node("leaf")
    assert [visit.path for visit in iter_visible(root)] == [
        "root", "root/tree", "root/tree/leaf",
        "root/tree#2", "root/tree#2/leaf", "root/tree#3", "root/tree#3/leaf",
    ]  # fmt: skip
    trees[0].hide()
    assert [visit.path for visit in iter_visible(root)][1:] == [
        "root/tree#2", "root/tree#2/leaf", "root/tree#3", "root/tree#3/leaf",
    ]  # fmt: skip


@given(st.lists(st.tuples(picks, st.sampled_from(["a", "b", "", "a#2", "a#3", "#2"])), max_size=20))
def test_no_two_paths_are_equal_whatever_the_names_are(steps):
    paths = [NodePath("a")]
    for number, name in steps:
        paths.append(paths[number % len(paths)].attach_new_node(name))
    found = [visit.path for visit in iter_visible(paths[0])]
    assert len(set(found)) == len(found) == len(paths)


def test_an_empty_path_has_nothing_to_walk():
    with pytest.raises(NodeError, match="empty"):
        list(iter_visible(NodePath()))


@pytest.mark.parametrize(
    ("hidden_from", "camera", "seen"),
    [
        (0b01, 0b01, False),
        (0b01, 0b10, True),
        (0b01, 0b11, True),  # the camera has another bit, from which nothing is hidden
        (0b11, 0b11, False),
        (0b11, 0b10, False),
        (0b01, ALL_CAMERAS, True),
        (ALL_CAMERAS, ALL_CAMERAS, False),
        (None, ALL_CAMERAS, False),
    ],
)
def test_a_camera_sees_what_is_not_hidden_from_all_of_its_bits(hidden_from, camera, seen):
    """As the documentation of `hide` says, and as Panda3D's cull traverser does: draw mask & camera mask."""
    theirs, ours = panda.NodePath("root"), NodePath("root")
    for root in (theirs, ours):
        root.attach_new_node("a").hide(*([] if hidden_from is None else [hidden_from]))
    control = theirs.find("a").node().get_draw_control_mask()
    shown = theirs.find("a").node().get_draw_show_mask()
    everything = panda.DrawMask(OVERALL_BIT | ALL_CAMERAS)
    running = (everything & ~control) | (shown & control)
    mask = panda.DrawMask(camera)
    overall = panda.PandaNode.get_overall_bit()
    assert (not (running & overall).is_zero() and not (running & mask).is_zero()) == seen
    assert ("root/a" in [visit.path for visit in iter_visible(ours, camera)]) == seen
