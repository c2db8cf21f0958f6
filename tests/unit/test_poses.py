"""Poses in three conventions, on cameras whose axes are known, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.camera import CONVENTIONS, matrix_from_pose, pose_from_matrix
from firefly_sample.errors import SceneError
from firefly_sample.scene.nodepath import NodePath

# a camera at (1, 2, 3) that looks along -X, with Z up: its right is +Y
RIGHT, FORWARD, UP, EYE = (0, 1, 0), (-1, 0, 0), (0, 0, 1), (1, 2, 3)


def pose_of(*columns) -> np.ndarray:
    pose = np.eye(4)
    pose[:3] = np.transpose(columns)
    return pose


def negative(axis) -> tuple[int, ...]:
    return tuple(-number for number in axis)


POSES = {
    "panda3d": pose_of(RIGHT, FORWARD, UP, EYE),
    "opengl": pose_of(RIGHT, UP, negative(FORWARD), EYE),
    "opencv": pose_of(RIGHT, negative(UP), FORWARD, EYE),
}


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_axes_of_a_camera_that_looks_along_minus_x(convention):
    camera = NodePath("camera")
    camera.set_pos(EYE)
    camera.set_hpr(90, 0, 0)
    np.testing.assert_allclose(pose_from_matrix(camera.get_mat(), convention), POSES[convention], atol=1e-15)
    other = NodePath("other")
    other.set_mat(matrix_from_pose(POSES[convention], convention))
    np.testing.assert_allclose(other.get_mat(), camera.get_mat(), atol=1e-15)
    straight = pose_from_matrix(np.eye(4), convention)
    assert not np.signbit(straight[straight == 0]).any()


@given(
    st.tuples(*[st.floats(-360, 360)] * 3),
    st.tuples(*[st.floats(-1e6, 1e6)] * 3),
    st.sampled_from(CONVENTIONS),
)
def test_there_and_back_is_exact(hpr, pos, convention):
    path = NodePath("camera")
    path.set_hpr(*hpr)
    path.set_pos(*pos)
    matrix = path.get_mat()
    pose = pose_from_matrix(matrix, convention)
    np.testing.assert_array_equal(matrix_from_pose(pose, convention), matrix)
    # numbers were only moved, so that each convention has the same ones
    np.testing.assert_array_equal(np.sort(np.abs(pose[:3]), axis=1), np.sort(np.abs(matrix.T[:3]), axis=1))


ROUNDED = np.round(pose_of((0.8, 0.6, 0), (-0.36, 0.48, 0.8), (0.48, -0.64, 0.6), EYE) + 4e-7, 6)


def test_a_pose_of_six_decimals_is_taken_as_it_is():
    np.testing.assert_array_equal(matrix_from_pose(ROUNDED, "panda3d"), ROUNDED.T)


@pytest.mark.parametrize(
    ("pose", "convention", "says"),
    [
        (
            np.eye(4),
            "open_cv",
            r"no convention 'open_cv' of poses \(did you mean 'opencv'\?\): choose",
        ),
        (np.eye(4), None, "no convention None of poses"),
        (np.eye(3), "opencv", r"the opencv pose must have shape \(4, 4\), got \(3, 3\)"),
        (np.full((4, 4), np.nan), "opengl", "the opengl pose must be of finite numbers"),
        (POSES["opengl"].T, "opengl", r"its last row must be 0, 0, 0, 1, got 1, 2, 3, 1"),
        (np.diag([1, 1, 1.001, 1]), "opengl", r"the opengl pose scales or shears: its upper left 3x3"),
        (np.diag([1e200, 1, 1, 1]), "opengl", "the opengl pose scales or shears"),
        (np.diag([1, 1, -1, 1]), "panda3d", "the panda3d pose mirrors"),
        ([["x"] * 4] * 4, "panda3d", "the panda3d pose must be a 4x4 matrix of numbers"),
        ([[1, 0], [0]], "panda3d", "the panda3d pose must be a 4x4 matrix of numbers"),
    ],
)
def test_what_is_no_pose_is_refused(pose, convention, says):
    with pytest.raises(SceneError, match=says):
        matrix_from_pose(pose, convention)
