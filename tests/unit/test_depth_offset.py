"""Depth offsets of nodes, by Panda3D's rules: beside its own classes, on generated chains of nodes."""

from __future__ import annotations

import panda3d.core as panda
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample import NodePath
from firefly_sample.errors import NodeError
from firefly_sample.scene.traversal import iter_visible

CALLS = st.one_of(
    st.tuples(st.just("set_depth_offset"), st.integers(-9, 9), st.integers(-2, 2)),
    st.tuples(st.just("set_depth_offset"), st.integers(-9, 9)),
    st.tuples(st.just("clear_depth_offset")),
)


@given(st.lists(st.lists(CALLS, max_size=3), min_size=1, max_size=5))
def test_offsets_add_up_as_in_panda3d(levels):
    ours, theirs = NodePath("top"), panda.NodePath("top")
    path, other = ours, theirs
    for calls in levels:
        path, other = path.attach_new_node("below"), other.attach_new_node("below")
        for name, *arguments in calls:
            getattr(path, name)(*arguments)
            getattr(other, name)(*arguments)
        assert path.has_depth_offset() == other.has_depth_offset()
        assert path.get_depth_offset() == other.get_depth_offset()
        net = other.get_net_state().get_attrib(panda.DepthOffsetAttrib)
        visits = {visit.node: visit for visit in iter_visible(ours)}
        assert visits[path.node()].depth_offset == (0 if net is None else net.offset)


@pytest.mark.parametrize("bias", [1.5, "near", None, True, 2**31, -(2**31)])
def test_a_wrong_offset_is_refused(bias):
    with pytest.raises(NodeError, match="node 'decal': a depth offset must be a whole number of steps"):
        NodePath("decal").set_depth_offset(bias)


def test_a_wrong_priority_is_refused():
    with pytest.raises(NodeError, match="node 'decal': a priority must be a whole number"):
        NodePath("decal").set_depth_offset(1, 0.5)
