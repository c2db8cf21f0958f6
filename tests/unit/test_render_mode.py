"""Render modes of nodes, by Panda3D's rules: beside its own classes, on generated chains of nodes."""

from __future__ import annotations

import panda3d.core as panda
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample import Geom, GeomNode, NodePath
from firefly_sample.errors import NodeError, SceneError
from firefly_sample.scene.traversal import iter_visible

MODES = {
    panda.RenderModeAttrib.M_unchanged: "unchanged",
    panda.RenderModeAttrib.M_filled: "filled",
    panda.RenderModeAttrib.M_wireframe: "wireframe",
}
NUMBERS = {name: number for number, name in MODES.items()}
PRIORITY = st.integers(-2, 2)
CALLS = st.one_of(
    st.tuples(
        st.just("set_render_mode"),
        st.sampled_from(["filled", "wireframe", *map(int, list(MODES)[1:])]),
        st.integers(1, 9),
        PRIORITY,
    ),
    st.tuples(st.just("set_render_mode_wireframe"), PRIORITY),
    st.tuples(st.just("set_render_mode_filled"), PRIORITY),
    st.tuples(st.just("set_render_mode_thickness"), st.integers(1, 9), PRIORITY),
    st.tuples(st.just("clear_render_mode")),
)


@given(st.lists(st.lists(CALLS, max_size=4), min_size=1, max_size=4))
def test_modes_are_inherited_as_in_panda3d(levels):
    ours, theirs = NodePath("top"), panda.NodePath("top")
    path, other = ours, theirs
    for calls in levels:
        path, other = path.attach_new_node("below"), other.attach_new_node("below")
        for name, *arguments in calls:
            getattr(path, name)(*arguments)
            getattr(other, name)(*(NUMBERS.get(argument, argument) for argument in arguments))
        assert path.has_render_mode() == other.has_render_mode()
        assert path.get_render_mode() == MODES[other.get_render_mode()]
        assert path.get_render_mode_thickness() == other.get_render_mode_thickness()
        net = other.get_net_state().get_attrib(panda.RenderModeAttrib)
        visits = {visit.node: visit for visit in iter_visible(ours)}
        mode, thickness = visits[path.node()].render_mode
        assert mode == ("filled" if net is None else MODES[net.mode])
        assert thickness == (1.0 if net is None else net.thickness)


@pytest.mark.parametrize("thickness", [0.0, -1.0, float("nan"), 1e9, "thick"])
def test_a_wrong_thickness_is_refused(thickness):
    with pytest.raises(NodeError, match="node 'dots': a thickness must be a number of pixels"):
        NodePath("dots").set_render_mode_thickness(thickness)
    with pytest.raises(NodeError, match="node 'dots': a thickness must be a number of pixels"):
        NodePath("dots").set_render_mode("filled", thickness)


@pytest.mark.parametrize("mode", ["point", "unchanged", 3, None])
def test_an_unknown_mode_is_refused(mode):
    path = NodePath("dots")
    with pytest.raises(NodeError, match="node 'dots': a render mode must be 'filled' or 'wireframe', or"):
        path.set_render_mode(mode, 1.0)
    assert not path.has_render_mode()


def test_lines_and_points_have_no_triangles():
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
    lines, points = Geom.lines(corners, [(0, 1), (1, 2)]), Geom.points(corners)
    assert (lines.mode, lines.indices.tolist(), len(lines.triangles)) == ("lines", [[0, 1], [1, 2]], 0)
    assert (points.mode, points.indices.tolist(), len(points.triangles)) == ("points", [[0], [1], [2]], 0)
    assert not lines.normals.any()  # they face the camera
    assert repr(lines) == "Geom('lines', 3 vertices, 2 lines)"


def test_wrong_elements_are_refused():
    with pytest.raises(SceneError, match=r"lines must have shape \(m, 2\)"):
        Geom.lines([(0, 0, 0)] * 3, [(0, 1, 2)])
    with pytest.raises(SceneError, match=r"a line index lies outside 0..2: line 0 has 3"):
        Geom.lines([(0, 0, 0)] * 3, [(0, 3)])
    with pytest.raises(SceneError, match="mode must be one of triangles, lines, points"):
        Geom([(0, 0, 0)], [(0,)], mode="dots")


def test_a_node_may_hold_all_modes():
    node = GeomNode("all")
    node.add_geom(Geom.points([(0, 0, 0)]))
    node.add_geom(Geom.lines([(0, 0, 0), (1, 1, 1)], [(0, 1)]))
    low, high = NodePath(node).get_tight_bounds()
    assert (tuple(low), tuple(high)) == ((0, 0, 0), (1, 1, 1))
