"""NodePath: where things stand, also relative to each other. Panda3D itself: test_panda_oracle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from firefly_sample.errors import NodeError
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.transform_state import TransformState
from tests.unit.trees import tree

EPS = 2.0**-52

numbers = st.floats(-10, 10)
vectors = st.tuples(numbers, numbers, numbers)
angles = st.tuples(*[st.floats(-180, 180)] * 3)
sizes = st.floats(0.25, 4)
scales = st.tuples(*[sizes | sizes.map(lambda size: -size)] * 3)
shears = st.tuples(*[st.floats(-1, 1)] * 3)
states = st.builds(TransformState.make_pos_hpr_scale_shear, vectors, angles, scales, shears)


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
    return 64 * EPS * growth(other, path) * float(np.linalg.norm(np.linalg.inv(other.get_net_mat())))


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
    for method, does in ((get_one, "Return the "), (set_one, "Set the ")):
        assert method.__qualname__ == f"PathNumbers.{method.__name__}"
        assert method.__doc__.startswith(does)
    with pytest.raises(NodeError, match=f"set_{name} takes 1 number, got 'far'"):
        set_one("far")


@given(st.lists(states, max_size=3), st.lists(states, min_size=1, max_size=3))
def test_matrices_are_products_from_the_node_to_the_root(up, down):
    other, path = two_branches(up, down)
    expected = np.eye(4)
    for place in path.get_ancestors():
        expected = expected @ place.get_mat()
    bound = 64 * EPS * growth(path)
    assert np.abs(path.get_net_mat() - expected).max() <= bound
    assert np.abs(path.get_net_transform().get_mat() - expected).max() <= bound
    assert np.abs(path.get_mat(path.get_top()) - expected).max() <= bound
    assert np.abs(path.get_mat(NodePath()) - expected).max() <= bound
    error = np.abs(path.get_mat(other) @ other.get_net_mat() - expected).max()
    assert error <= bound_between(other, path) * np.linalg.norm(other.get_net_mat())
    assert (path.get_mat(path) == np.eye(4)).all()


@given(st.lists(states, min_size=1, max_size=2), st.lists(states, min_size=1, max_size=2))
def test_wrt_reparent_to_keeps_the_net_matrix(up, down):
    other, path = two_branches(up, down)
    before = path.get_net_mat()
    scale = max(1.0, np.abs(before).max())
    conditions = [np.linalg.cond(place.get_net_mat()) for place in (other, path)]
    assume(max(conditions) < 1e3)
    path.wrt_reparent_to(other)
    assert path.get_parent() == other
    assert np.abs(path.get_net_mat() - before).max() <= 1e-12 * scale
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
