"""Colour scales of nodes by Panda3D's rules, beside its own classes, and what pictures make of them."""

from __future__ import annotations

import panda3d.core as panda
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.errors import NodeError
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.traversal import iter_visible

NUMBER = st.sampled_from((0.0, 0.5, 1.0, 2.0))  # few products are rounded to 1024ths
SCALE = st.tuples(NUMBER, NUMBER, NUMBER, NUMBER)
PRIORITY = st.integers(-2, 2)
WHOLE = ("set_color_scale", "compose_color_scale")
CALLS = st.one_of(
    st.tuples(st.sampled_from(WHOLE), SCALE, PRIORITY),
    st.tuples(st.sampled_from(WHOLE), SCALE).map(lambda call: (call[0], *call[1])),
    st.tuples(st.sampled_from(("set_all_color_scale", "set_alpha_scale")), NUMBER, PRIORITY),
    st.tuples(st.sampled_from(("set_sr", "set_sg", "set_sb", "set_sa")), NUMBER),
    st.tuples(st.just("set_color_scale_off"), PRIORITY),
    st.tuples(st.just("clear_color_scale")),
)


@given(st.lists(st.lists(CALLS, max_size=3), min_size=1, max_size=3))
def test_scales_are_inherited_as_in_panda3d(levels):
    ours, theirs = NodePath("top"), panda.NodePath("top")
    path, other = ours, theirs
    for calls in levels:
        path, other = path.attach_new_node("below"), other.attach_new_node("below")
        for name, *arguments in calls:
            getattr(path, name)(*arguments)
            getattr(other, name)(*arguments)
        assert path.has_color_scale() == other.has_color_scale()
        assert path.get_color_scale() == tuple(other.get_color_scale())
        for name in ("get_sr", "get_sg", "get_sb", "get_sa"):
            assert getattr(path, name)() == getattr(other, name)()
        net = other.get_net_state().get_attrib(panda.ColorScaleAttrib)
        visits = {visit.node: visit for visit in iter_visible(ours)}
        assert visits[path.node()].color_scale == ((1, 1, 1, 1) if net is None else tuple(net.get_scale()))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (((-1, 1, 1, 1),), "node 'glow': color scale must be four numbers in 0..1e"),
        ((float("nan"), 1, 1, 1), "color scale must be four numbers"),
        ((1, 1, 1), "set_color_scale takes four numbers, then a whole number as priority"),
        ((), "set_color_scale takes four numbers"),
        (((1, 1, 1, 1), 2, 3), "set_color_scale takes four numbers"),
        ((1, 1, 1, 1, 0.5), "a priority must be a whole number, got 0.5"),
    ],
)
def test_a_wrong_scale_is_refused(arguments, says):
    path = NodePath("glow")
    with pytest.raises(NodeError, match=says):
        path.set_color_scale(*arguments)
    assert not path.has_color_scale()
