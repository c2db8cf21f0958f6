"""Transforms: the conventions by known cases, and what holds for every position, angle, scale and shear."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from firefly_sample.scene.transform_state import (
    IDENTITY,
    SingularTransformError,
    TransformState,
    invert_matrix,
)
from firefly_sample.scene.transforms import (
    compose_matrix,
    decompose_matrix,
    hpr_from_quat,
    look_at_quat,
    multiply_quats,
    quat_from_hpr,
    quat_from_rows,
    rotate_by_quat,
    rows_from_hpr,
    rows_from_quat,
)

EPS = 2.0**-52
ZERO, ONE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

angles = st.floats(-360, 360)
sizes = st.floats(0.1, 10)
hprs = st.tuples(angles, angles, angles)
positions = st.tuples(*[st.floats(-1e3, 1e3)] * 3)
scales = st.tuples(*[sizes | sizes.map(lambda size: -size)] * 3)
shears = st.tuples(*[st.floats(-2, 2)] * 3)
vectors = st.tuples(*[st.floats(-10, 10)] * 3)
states = st.builds(TransformState.make_pos_hpr_scale_shear, positions, hprs, scales, shears | st.just(ZERO))


def turn(axis: int, degrees: float) -> np.ndarray:
    """The textbook rotation about an axis, counter-clockwise, for row vectors."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    matrix = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = s, -s
    return matrix


@pytest.mark.parametrize(
    ("hpr", "forward", "up"),
    [
        ((0, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((90, 0, 0), (-1, 0, 0), (0, 0, 1)),  # heading: from Y towards -X
        ((0, 90, 0), (0, 0, 1), (0, -1, 0)),  # pitch: from Y towards Z
        ((0, 0, 90), (0, 1, 0), (1, 0, 0)),  # roll: Z tips to the right
        ((90, 0, 90), (-1, 0, 0), (0, 1, 0)),  # roll first, then heading
    ],
)
def test_hpr_turns_the_way_that_the_conventions_say(hpr, forward, up):
    rows = np.array(rows_from_hpr(hpr))
    np.testing.assert_allclose(rows[1], forward, atol=EPS)
    np.testing.assert_allclose(rows[2], up, atol=EPS)


@given(hprs)
def test_hpr_is_roll_about_y_then_pitch_about_x_then_heading_about_z(hpr):
    h, p, r = hpr
    np.testing.assert_allclose(rows_from_hpr(hpr), turn(1, r) @ turn(0, p) @ turn(2, h), atol=4 * EPS)


@given(positions, hprs, scales, shears)
def test_a_matrix_is_scale_then_shear_then_rotation(pos, hpr, scale, shear):
    xy, xz, yz = shear
    sheared = np.array([[1, xy, 0], [0, 1, 0], [xz, yz, 1]])
    rotation = np.array(rows_from_hpr(hpr))
    matrix = compose_matrix(pos, rows_from_hpr(hpr), scale, shear)
    np.testing.assert_allclose(matrix[:3, :3], np.diag(scale) @ sheared @ rotation, atol=10 * 5 * 4 * EPS)
    assert matrix[3].tolist() == [*pos, 1.0]
    assert matrix[:3, 3].tolist() == [0, 0, 0]


@given(st.lists(vectors, min_size=3, max_size=3))
def test_a_decomposed_matrix_composes_to_itself_row_by_row(rows):
    hpr, scale, shear = decompose_matrix(tuple(rows))
    assume(abs(math.prod(scale)) > 1e-9)  # a shear along an axis without length is lost
    again = compose_matrix(ZERO, rows_from_hpr(hpr), scale, shear)[:3, :3]
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    # Each row is turned by three rotations and back: every one of them keeps its length to a few eps.
    assert (np.abs(again - rows) <= 32 * EPS * lengths).all()
    assert scale[0] >= 0
    assert scale[1] >= 0
    assert math.copysign(1, scale[2]) == np.sign(np.linalg.det(rows))


@given(hprs, st.tuples(sizes, sizes, sizes), shears)
def test_components_survive_a_matrix_where_there_is_one_answer(hpr, scale, shear):
    h, p, r = hpr
    assume(abs(math.cos(math.radians(p))) > 1e-3)
    got_hpr, got_scale, got_shear = decompose_matrix(
        tuple(map(tuple, compose_matrix(ZERO, rows_from_hpr(hpr), scale, shear)[:3, :3].tolist()))
    )
    np.testing.assert_allclose(got_scale, scale, rtol=64 * EPS)
    np.testing.assert_allclose(got_shear, shear, atol=64 * EPS * 5)
    assert -90 <= got_hpr[1] <= 90
    # Near straight up, heading and roll share the rounding of what is left of their axes: 1 / cos(pitch).
    np.testing.assert_allclose(rows_from_hpr(got_hpr), rows_from_hpr(hpr), atol=64 * EPS)
    if -90 < p < 90:
        difference = np.mod(np.subtract(got_hpr, (h, p, r)) + 180, 360) - 180
        assert np.abs(difference).max() < math.degrees(64 * EPS * 5) / math.cos(math.radians(p))


@given(hprs)
def test_a_quaternion_turns_as_its_matrix(hpr):
    rows = rows_from_hpr(hpr)
    quat = quat_from_hpr(hpr)
    assert math.hypot(*quat) == pytest.approx(1, abs=4 * EPS)
    np.testing.assert_allclose(rows_from_quat(quat), rows, atol=16 * EPS)
    np.testing.assert_allclose(rows_from_hpr(hpr_from_quat(quat)), rows, atol=32 * EPS)
    same = quat_from_rows(rows)
    assert abs(np.dot(same, quat)) == pytest.approx(1, abs=16 * EPS)
    np.testing.assert_allclose(rows_from_quat(same), rows, atol=16 * EPS)


@given(hprs, hprs, vectors)
def test_quaternions_multiply_in_the_order_of_row_vectors(first, second, vector):
    product = multiply_quats(quat_from_hpr(first), quat_from_hpr(second))
    expected = np.array(vector) @ np.array(rows_from_hpr(first)) @ np.array(rows_from_hpr(second))
    np.testing.assert_allclose(rotate_by_quat(vector, product), expected, atol=17.4 * 32 * EPS)


@given(vectors, vectors)
def test_look_at_turns_y_to_the_target_and_z_up(forward, up):
    f, u = np.array(forward), np.array(up)
    assume(np.linalg.norm(f) > 1e-3)
    assume(np.linalg.norm(u) > 1e-3)
    f, u = f / np.linalg.norm(f), u / np.linalg.norm(u)
    across = np.linalg.norm(np.cross(f, u))
    assume(across > 1e-3)
    x, y, z = rows_from_quat(look_at_quat(forward, up))
    np.testing.assert_allclose(y, f, atol=16 * EPS)
    assert np.dot(x, u) == pytest.approx(0, abs=16 * EPS / across)
    assert np.dot(z, u) == pytest.approx(across, abs=16 * EPS / across)


@pytest.mark.parametrize(
    ("forward", "up", "rows"),
    [  # what Panda3D does where the question has no single answer
        (Z, Z, (X, Z, (0, -1, 0))),
        ((0, 0, -1), Z, (X, (0, 0, -1), Y)),
        (Y, Y, (X, Y, Z)),
        (X, X, ((0, -1, 0), X, Z)),
        ((1, 2, 3), (1, 2, 3), None),
        ((-1, -2, -3), (0.1, 0.2, 0.3), None),
        (ZERO, Z, (X, Y, Z)),
        (Y, ZERO, (X, Y, Z)),
    ],
)
def test_look_at_without_a_single_answer(forward, up, rows):
    got = rows_from_quat(look_at_quat(forward, up))
    if rows is None:  # up is along the line of sight up to rounding: the world's Z serves instead
        rows = rows_from_quat(look_at_quat(forward, Z))
    np.testing.assert_allclose(got, rows, atol=4 * EPS)


@given(states, states)
def test_compose_is_the_product_of_matrices(parent, child):
    bound = 64 * EPS * np.linalg.norm(parent.get_mat()) * np.linalg.norm(child.get_mat())
    composed = parent.compose(child)
    assert np.abs(composed.get_mat() - child.get_mat() @ parent.get_mat()).max() <= bound
    if parent.is_identity():
        assert composed is child


@given(positions, hprs, sizes, positions, hprs, scales)
def test_a_uniform_scale_above_keeps_scale_and_signs_as_given(pos, hpr, size, child_pos, child_hpr, scale):
    parent = TransformState.make_pos_hpr_scale_shear(pos, hpr, (-size, -size, -size))
    child = TransformState.make_pos_hpr_scale_shear(child_pos, child_hpr, scale)
    composed = parent.compose(child)
    assert composed.get_scale() == tuple(-size * one for one in scale)
    assert composed.get_shear() == ZERO
    bound = 64 * EPS * np.linalg.norm(parent.get_mat()) * np.linalg.norm(child.get_mat())
    assert np.abs(composed.get_mat() - child.get_mat() @ parent.get_mat()).max() <= bound


@given(states)
def test_an_inverse_undoes(state):
    matrix, inverse = state.get_mat(), state.invert().get_mat()
    bound = 64 * EPS * np.linalg.norm(matrix) * np.linalg.norm(inverse)
    assert np.abs(matrix @ inverse - np.eye(4)).max() <= bound
    assert np.abs(state.invert_compose(state).get_mat() - np.eye(4)).max() == 0


@given(states, positions, hprs, scales, shears)
def test_changing_one_component_keeps_the_others_to_the_last_bit(state, pos, hpr, scale, shear):
    before = (state.get_pos(), state.get_hpr(), state.get_scale(), state.get_shear())
    for index, changed in enumerate(
        (state.set_pos(pos), state.set_hpr(hpr), state.set_scale(scale), state.set_shear(shear))
    ):
        after = [changed.get_pos(), changed.get_hpr(), changed.get_scale(), changed.get_shear()]
        assert after[index] == (pos, hpr, scale, shear)[index]
        after[index] = before[index]
        assert tuple(after) == before
    assert (state.get_pos(), state.get_hpr(), state.get_scale(), state.get_shear()) == before


@given(hprs)
def test_asking_for_the_hpr_of_a_quaternion_changes_no_digit(hpr):
    quat = quat_from_hpr(hpr)
    asked, plain = (TransformState.make_pos_quat_scale_shear(ZERO, quat) for _ in range(2))
    asked.get_hpr()
    assert asked.set_scale((2.0, 3.0, 4.0)) == plain.set_scale((2.0, 3.0, 4.0))
    assert asked == plain


def test_a_state_cannot_be_changed_through_its_matrix():
    matrix = np.eye(4)
    state = TransformState.make_mat(matrix)
    matrix[0, 0] = 5
    assert state.get_mat()[0, 0] == 1
    with pytest.raises(ValueError, match="read-only"):
        state.get_mat()[0, 0] = 2
    assert state.is_identity()


def test_equal_states_are_equal_however_they_were_made():
    moved = IDENTITY.set_pos((1.0, 2.0, 3.0))
    same = TransformState.make_mat(moved.get_mat())
    assert moved == same
    assert hash(moved) == hash(same)
    assert moved != IDENTITY
    assert repr(moved) == "TransformState(pos 1 2 3)"
    assert repr(IDENTITY) == "TransformState(identity)"


@pytest.mark.parametrize(
    "upper",
    [
        np.diag([1.0, 0.0, 1.0]),
        np.zeros((3, 3)),
        np.array([[1.0, 2, 3], [2, 4, 6], [0, 0, 1]]),  # two rows along one line
        turn(0, 33) @ turn(2, 21) @ np.diag([1, 1, 0]) @ turn(1, 12),  # flat, but no number in it is zero
        turn(0, 33) @ np.diag([1, 1, 1e-17]) @ turn(1, 12),
    ],
)
def test_a_matrix_that_flattens_space_has_no_inverse(upper):
    matrix = np.eye(4)
    matrix[:3, :3] = upper
    with pytest.raises(SingularTransformError):
        invert_matrix(matrix)


@pytest.mark.parametrize("upper", [np.diag([1e-150, 1, 1e150]), 1e-200 * turn(0, 33), np.diag([1, 1, 1e-12])])
def test_an_extreme_scale_is_not_taken_for_a_flat_one(upper):
    matrix = np.eye(4)
    matrix[:3, :3] = upper
    np.testing.assert_allclose(matrix @ invert_matrix(matrix), np.eye(4), atol=8 * EPS)


def test_a_zero_scale_as_component_has_no_inverse():
    with pytest.raises(SingularTransformError):
        TransformState.make_pos_hpr_scale_shear(scale=ZERO).invert()
