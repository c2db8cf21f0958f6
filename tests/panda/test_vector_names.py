"""Vectors and transforms beside Panda3D's."""

from __future__ import annotations

import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample import NodePath, PandaNode
from firefly_sample.errors import NodeError
from firefly_sample.scene.transform_state import IDENTITY, SingularTransformError, TransformState
from firefly_sample.scene.vector import Vector
from tests.unit.panda_twins import EPS32, INTERNED, ROUNDINGS, float32s, positive_scales, vectors

numbers = vectors(-8, 8)
few = st.tuples(*[st.sampled_from((0.0, 1.0, -2.0))] * 3)


# --- Vectors ---


@given(few, few)
def test_whole_vectors_are_compared(a, b):
    ours, theirs = Vector(a), panda.LPoint3(*a)
    assert bool(ours == b) == (theirs == panda.LPoint3(*b)) == (a == b)
    assert bool(ours != b) == (theirs != panda.LPoint3(*b)) == (a != b)
    assert bool(ours == Vector(b)) == (a == b)
    assert bool(b == ours) == bool(ours == list(b)) == bool(ours == np.array(b)) == (a == b)
    assert (ours == b).all() == (a == b)  # one bool of NumPy's, as callers of arrays expect


@pytest.mark.parametrize("other", [1.0, (1, 2), None, "a", (1, 2, 3, 4), ((1, 2, 3),), {}])
def test_what_is_no_vector_is_not_equal(other):
    assert not Vector(1, 2, 3) == other  # noqa: SIM201
    assert Vector(1, 2, 3) != other
    if not isinstance(other, float) and other not in ({}, ((1, 2, 3),)):
        assert not panda.LPoint3(1, 2, 3) == other  # noqa: SIM201


def test_getters_compare_with_tuples():
    path = NodePath("a")
    below = path.attach_new_node("b")
    for library in (path, panda.NodePath("a")):
        library.set_pos_hpr_scale((1, 2, 3), (10, 20, 30), (2, 2, 2))
        assert library.get_pos() == (1, 2, 3)
        assert library.getScale() == (2, 2, 2)
        assert library.get_pos() != (1, 2, 4)
        assert library.get_pos().x == 1
        assert library.get_pos().getZ() == 3
    path.set_hpr(0, 0, 0)
    assert below.get_relative_point(path.get_parent(), (3, 2, 3)) == (1, 0, 0)
    assert below.get_relative_vector(path.get_parent(), (2, 0, 0)) == (1, 0, 0)
    assert path.get_pos() == pytest.approx((1, 2, 3 + 1e-9))


@given(numbers, numbers, float32s(0.25, 4))
def test_arithmetic(a, b, factor):
    ours, theirs = (Vector(a), Vector(b)), (panda.LVector3(*a), panda.LVector3(*b))
    step = (1, 2, 3)
    for function in (
        lambda a, b: a + b,
        lambda a, b: a - b,
        lambda a, b: -a,
        lambda a, b: a * factor,
        lambda a, b: a / factor,
        lambda a, b: a.cross(b),
        lambda a, b: a + step,
    ):
        found = function(*ours)
        assert type(found) is Vector
        np.testing.assert_allclose(found, tuple(function(*theirs)), rtol=0, atol=2048 * EPS32)
    assert ours[0].dot(ours[1]) == pytest.approx(theirs[0].dot(theirs[1]), abs=2048 * EPS32)
    assert ours[0].length() == pytest.approx(theirs[0].length(), abs=64 * EPS32)
    assert ours[0].lengthSquared() == pytest.approx(theirs[0].length_squared(), abs=2048 * EPS32)


@given(numbers)
def test_normalize(a):
    assume(a == (0, 0, 0) or math.hypot(*a) > 1e-3)  # Panda3D squares in float32
    ours, theirs = Vector(a), panda.LVector3(*a)
    np.testing.assert_allclose(ours.normalized(), tuple(theirs.normalized()), atol=16 * EPS32)
    assert (ours.normalize(), theirs.normalize()) in ((True, True), (False, False))
    np.testing.assert_allclose(ours, tuple(theirs), atol=16 * EPS32)


def test_they_change_in_place_and_getters_return_copies():
    path = NodePath("a")
    path.set_pos(1, 2, 3)
    for pos in (path.get_pos(), panda.LPoint3(1, 2, 3)):
        pos.setX(5)
        pos.set_y(6)
        pos.z = 7
        pos *= 2
        assert pos == (10, 12, 14)
        assert (pos.get_x(), pos.get_y(), pos.z) == (10, 12, 14)
    assert path.get_pos() == (1, 2, 3)


def test_they_are_arrays():
    pos = Vector(1, 2, 3)
    assert isinstance(pos, np.ndarray)
    assert pos.dtype == np.float64
    shifted, turned = np.zeros((5, 3)) - pos, np.eye(4)[:, :3] @ pos
    for plain in (pos < 2, shifted, turned, np.equal(pos, (1, 0, 3)), np.asarray(pos)):
        assert type(plain) is np.ndarray
    assert (pos[:2] == [1, 0]).tolist() == [True, False]
    assert (pos[None] == pos[None]).shape == (1, 3)
    assert isinstance(pos.sum(), float)
    assert isinstance(np.linalg.norm(pos), float)
    np.testing.assert_array_equal(pos, [1, 2, 3])
    with pytest.raises(AssertionError):
        np.testing.assert_array_equal(pos, [1, 2, 4])
    assert np.array_equal(pos, [1, 2, 3])
    for made in (copy.copy(pos), copy.deepcopy(pos), pickle.loads(pickle.dumps(pos))):
        assert type(made) is Vector
        assert made == pos
    assert {"length", "normalize", "x"} <= set(dir(pos))
    assert "lengthSquared" not in dir(pos)
    with pytest.raises(ValueError, match="three numbers, got 1, 2"):
        Vector(1, 2)
    with pytest.raises(TypeError, match="unhashable"):
        hash(pos)


# --- Transforms ---

MAKERS = {
    "make_identity": st.just(()),
    "make_pos": st.tuples(numbers),
    "make_hpr": st.tuples(vectors(-180, 180)),
    "make_scale": st.tuples(positive_scales | float32s(0.25, 4)),
    "make_shear": st.tuples(vectors(-1, 1)),
    "make_pos_hpr": st.tuples(numbers, vectors(-180, 180)),
    "make_pos_hpr_scale": st.tuples(numbers, vectors(-180, 180), positive_scales),
}
makers = st.sampled_from(sorted(MAKERS)).flatmap(lambda name: st.tuples(st.just(name), MAKERS[name]))
QUESTIONS = [
    "is_identity",
    "components_given",
    "hpr_given",
    "quat_given",
    "has_components",
    "has_pos",
    "has_hpr",
    "has_quat",
    "has_scale",
    "has_shear",
    "has_mat",
    "has_uniform_scale",
    "has_identity_scale",
    "has_nonzero_shear",
    "is_singular",
]


def matrix(state):
    if isinstance(state, TransformState):
        return state.get_mat()
    return np.array([[state.get_mat().get_cell(row, column) for column in range(4)] for row in range(4)])


def norm(state):
    return np.linalg.norm(state.get_mat(), 2)


@given(makers)
def test_makers(made):
    name, arguments = made
    flat = [number for argument in arguments for number in np.ravel(argument).tolist()]
    assume(all(number == 0 or abs(number) > 1e-4 for number in flat))  # Panda3D takes 1e-6 for 0
    assume(all(number == 1 or abs(number - 1) > 1e-4 for number in flat))
    ours, theirs = (getattr(library, name)(*arguments) for library in (TransformState, panda.TransformState))
    bound = INTERNED + ROUNDINGS * EPS32 * norm(ours)
    np.testing.assert_allclose(matrix(ours), matrix(theirs), rtol=0, atol=bound)
    for question in QUESTIONS:
        assert getattr(ours, question)() == getattr(theirs, question)(), question
    for getter in ("get_pos", "get_hpr", "get_scale", "get_shear"):
        assert getattr(ours, getter)() == tuple(getattr(theirs, getter)()), getter
    assert getattr(TransformState, name)(*(np.array(argument) for argument in arguments)) == ours


@given(makers, makers)
def test_inverses(a, b):
    ours, theirs = (
        [getattr(library, name)(*arguments) for name, arguments in (a, b)]
        for library in (TransformState, panda.TransformState)
    )
    first, second = ours
    inverse, relative, both = first.get_inverse(), first.invert_compose(second), first.compose(second)
    unit = ROUNDINGS * EPS32
    # first order in eps: see `tests.unit.panda_twins`
    for found, expected, bound in (
        (inverse, theirs[0].get_inverse(), norm(inverse) * (norm(first) * norm(inverse) + 1)),
        (
            relative,
            theirs[0].invert_compose(theirs[1]),
            norm(inverse) * (norm(first) * norm(relative) + norm(second)),
        ),
        (both, theirs[0].compose(theirs[1]), 2 * norm(first) * norm(second)),
    ):
        np.testing.assert_allclose(matrix(found), matrix(expected), rtol=0, atol=INTERNED + unit * bound)
    same = (ours[0].get_inverse().compose(ours[0])).get_mat()
    np.testing.assert_allclose(same, np.eye(4), atol=1e-12)


def test_a_flat_transform_has_no_inverse():
    flat = TransformState.make_scale((1, 0, 1))
    assert flat.is_singular()
    assert panda.TransformState.make_scale((1, 0, 1)).is_singular()
    with pytest.raises(SingularTransformError):
        flat.get_inverse()


@pytest.mark.parametrize("pos", [(1, 2), "abc", 3, (1, 2, math.nan), None])
def test_makers_refuse_what_is_no_vector(pos):
    with pytest.raises(NodeError, match="a transform's pos"):
        TransformState.make_pos(pos)


def test_nodes_have_transforms():
    for library, states in ((PandaNode, TransformState), (panda.PandaNode, panda.TransformState)):
        node = library("a")
        assert node.get_transform().is_identity()
        node.setTransform(states.make_pos((1, 2, 3)))
        assert node.getTransform().get_pos() == (1, 2, 3)
        assert node.transform == node.get_transform()
        node.clear_transform()
        assert node.transform.is_identity()
    path, other = NodePath("a"), panda.NodePath("a")
    for each in (path, other):
        each.set_fluid_pos(1, 2, 3)
        each.set_fluid_y(5)
        assert each.get_pos() == (1, 5, 3)
    assert TransformState.make_identity() is IDENTITY
