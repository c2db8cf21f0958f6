"""Poses of cameras in three conventions, to and from the matrices of the scene graph.

A pose is a rigid 4x4 matrix from the camera's space to the world, for column vectors: ``world = pose @ (x, y,
z, 1)``. The world is the scene's, with Z up, in all three; they differ in the axes of the camera:

==========  =======  =========  ==========
convention  X        Y          Z
==========  =======  =========  ==========
panda3d     right    forward    up
opengl      right    up         backward
opencv      right    down       forward
==========  =======  =========  ==========

A matrix of the scene graph is for row vectors, and its camera has Panda3D's axes. The conversions only move
numbers and change their signs, so nothing is rounded.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import SceneError, did_you_mean
from firefly_sample.scene.arrays import Float64, as_numbers

Convention = Literal["panda3d", "opengl", "opencv"]
CONVENTIONS: tuple[Convention, ...] = get_args(Convention)

_RIGID = 1e-5
"""Difference from a rotation up to which numbers count as rounded: text with six decimals has 3e-6."""
_AXES: dict[Convention, tuple[tuple[int, float], ...]] = {
    "panda3d": ((0, 1.0), (1, 1.0), (2, 1.0)),
    "opengl": ((0, 1.0), (2, 1.0), (1, -1.0)),
    "opencv": ((0, 1.0), (2, -1.0), (1, 1.0)),
}
"""X, Y and Z of a camera by convention: each is an axis of Panda3D's camera, times a sign."""


def matrix_from_pose(pose: ArrayLike, convention: str) -> Float64:
    """Return the matrix from a camera to the world, for row vectors, that `NodePath.set_mat` takes.

    Parameters
    ----------
    pose : array of shape (4, 4)
        From the camera's space to the world, for column vectors; see the table of this module.
    convention : {"panda3d", "opengl", "opencv"}
        The camera's axes.

    Raises
    ------
    SceneError
        If there is no such convention, or the pose is not rigid: the upper left 3x3 must be a rotation to
        1e-5, and the last row 0, 0, 0, 1.
    """
    axes = _AXES[check_convention(convention)]
    given = check_rigid(f"the {convention} pose", pose)
    matrix = np.zeros((4, 4))
    for column, (axis, sign) in enumerate(axes):
        matrix[axis] = sign * given[:, column]
    matrix[3] = given[:, 3]
    return matrix + 0.0  # +0, not -0


def pose_from_matrix(matrix: ArrayLike, convention: str) -> Float64:
    """Return the pose of a rigid matrix from a camera to the world for row vectors, shape (4, 4).

    The inverse of `matrix_from_pose`; scale and shear, which a camera's parents may have, must be gone.
    """
    axes = _AXES[check_convention(convention)]
    given = np.asarray(matrix, dtype=np.float64)
    pose = np.zeros((4, 4))
    for column, (axis, sign) in enumerate(axes):
        pose[:, column] = sign * given[axis]
    pose[:, 3] = given[3]
    return pose + 0.0


def check_convention(convention: object) -> Convention:
    """Return the name of a convention, or raise SceneError."""
    for name in CONVENTIONS:
        if convention == name:
            return name
    raise SceneError(
        f"there is no convention {convention!r} of poses{did_you_mean(str(convention), CONVENTIONS)}: choose "
        f"from {', '.join(CONVENTIONS)}"
    )


def check_rigid(what: str, pose: ArrayLike) -> Float64:
    """Return a pose for column vectors, shape (4, 4), or raise SceneError if it is not rigid."""
    matrix = as_numbers(what, pose, SceneError, "a 4x4 matrix of numbers")
    if matrix.shape != (4, 4):
        raise SceneError(f"{what} must have shape (4, 4), got {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise SceneError(f"{what} must be of finite numbers")
    if matrix[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        row = ", ".join(f"{number:g}" for number in matrix[3])
        raise SceneError(f"{what} is for column vectors: its last row must be 0, 0, 0, 1, got {row}")
    turn = matrix[:3, :3]
    with np.errstate(over="ignore", invalid="ignore"):  # enormous numbers are no rotation either
        error = np.abs(turn @ turn.T - np.eye(3)).max()
    if not error <= _RIGID or np.linalg.det(turn) < 0.0:
        fault = "mirrors" if error <= _RIGID else "scales or shears"
        raise SceneError(
            f"{what} {fault}: its upper left 3x3 must be a rotation (scale the scene, not the camera)"
        )
    return matrix
