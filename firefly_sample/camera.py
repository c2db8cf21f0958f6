"""The camera of a picture: intrinsics and pose, to turn a depth image into points of the world.

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

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import SceneError, did_you_mean
from firefly_sample.scene.arrays import Float64, ReadOnlyArrays, as_numbers, read_only
from firefly_sample.scene.intrinsics import Intrinsics
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens, lens_from_intrinsics

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
_POSES = "camera_to_world"
"""The key of the poses in `FrameCamera.as_dict`."""


@dataclass(frozen=True, eq=False)
class FrameCamera(ReadOnlyArrays):
    """The camera that one picture was drawn with.

    Attributes
    ----------
    intrinsics : Intrinsics
        For the picture's size in pixels.
    view_to_world : ndarray of float64, shape (4, 4)
        Rigid, read-only, for row vectors, with Panda3D's axes of the camera: ``path.set_mat(view_to_world)``
        puts a camera below the scene's root there. Its rows are right, forward, up and the position.

    Raises
    ------
    SceneError
        If the matrix is not rigid.
    """

    intrinsics: Intrinsics
    view_to_world: Float64

    def __post_init__(self) -> None:
        if not isinstance(self.intrinsics, Intrinsics):
            raise SceneError(f"a FrameCamera takes Intrinsics, got {self.intrinsics!r}")
        matrix = as_numbers("view_to_world", self.view_to_world, SceneError, "a 4x4 matrix of numbers")
        check_rigid("view_to_world, transposed,", matrix.T)
        object.__setattr__(self, "view_to_world", read_only(matrix))

    def pose(self, convention: str) -> Float64:
        """Return the pose, camera to world for column vectors, shape (4, 4).

        Parameters
        ----------
        convention : {"panda3d", "opengl", "opencv"}
            The camera's axes: see the table of this module.
        """
        return pose_from_matrix(self.view_to_world, convention)

    def lens(self) -> PerspectiveLens | OrthographicLens:
        """Return a lens that draws this picture, for a `Camera` node of a scene."""
        return lens_from_intrinsics(self.intrinsics)

    def world_points(self, depth: ArrayLike) -> Float64:
        """Return the point of the world in each pixel's centre.

        Parameters
        ----------
        depth : array of shape (height, width)
            Distance along the view axis in scene units, as in the output "depth"; the first row is the top.

        Returns
        -------
        ndarray of float64, shape (height, width, 3)
            NaN where nothing was drawn: see `Intrinsics.view_points`.
        """
        return np.asarray(
            self.intrinsics.view_points(depth) @ self.view_to_world[:3, :3] + self.view_to_world[3, :3]
        )

    def project(self, points: ArrayLike) -> tuple[Float64, Float64, Float64]:
        """Return u, v and the distance along the view axis of points of the world.

        Parameters
        ----------
        points : array of shape (..., 3)

        Returns
        -------
        tuple of three arrays of float64, shape (...)
            Image coordinates to the right and downwards, NaN where a perspective camera has the point at or
            behind its eye, and the distance. The nearest pixel has the column
            ``round(u - pixel_center)`` and the row ``round(v - pixel_center)``, which may be off the picture.
        """
        given = as_numbers("points", points, SceneError)
        if given.ndim == 0 or given.shape[-1] != 3:
            raise SceneError(f"points must have shape (..., 3), got {given.shape}")
        # the position first: the difference of near numbers loses nothing
        turned = (given - self.view_to_world[3, :3]) @ np.linalg.inv(self.view_to_world[:3, :3])
        return self.intrinsics.project(turned)

    def as_dict(self) -> dict[str, Any]:
        """Return everything as a dict for JSON: the intrinsics' keys, and the poses in all conventions.

        ``camera_to_world`` has a matrix for column vectors, a list of rows, for each convention.
        """
        poses = {name: self.pose(name).tolist() for name in CONVENTIONS}
        return self.intrinsics.as_dict() | {_POSES: poses}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> FrameCamera:
        """Return the camera that `as_dict` wrote; SceneError names a key that is missing or wrong.

        One pose is enough. Poses that contradict each other by more than 1e-5, or by more than 1e-5 of the
        distance from the origin, are refused.
        """
        if not isinstance(values, Mapping):
            raise SceneError(f"a camera must be a dict, got {values!r}")
        poses = values.get(_POSES)
        if not isinstance(poses, Mapping) or not poses:
            raise SceneError(
                f"a camera needs {_POSES!r}, a dict with a pose by the name of its convention "
                f"({', '.join(CONVENTIONS)}), got {poses!r}"
            )
        try:
            matrix = matrix_from_poses(poses)
        except SceneError as error:
            raise SceneError(f"{_POSES}: {error}") from None
        rest = {key: value for key, value in values.items() if key != _POSES}
        return cls(Intrinsics.from_dict(rest), matrix)


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


def matrix_from_poses(poses: Mapping[str, ArrayLike]) -> Float64:
    """Return what `matrix_from_pose` does for the first of some poses, after comparing the others with it.

    Parameters
    ----------
    poses : mapping
        One pose or more, by convention.

    Raises
    ------
    SceneError
        As `matrix_from_pose`, or if two poses differ by more than 1e-5, positions relative to the distance
        from the origin.
    """
    matrices = {name: matrix_from_pose(pose, name) for name, pose in poses.items()}
    (first, matrix), *others = matrices.items()
    allowed = np.full((4, 1), _RIGID)
    allowed[3] *= max(1.0, np.abs(matrix[3]).max())
    for name, other in others:
        if not (np.abs(other - matrix) <= allowed).all():
            raise SceneError(f"the {name} pose contradicts the {first} pose")
    return matrix


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
    hint = did_you_mean(str(convention).lower(), CONVENTIONS)
    raise SceneError(
        f"there is no convention {convention!r} of poses{hint}: choose from {', '.join(CONVENTIONS)}"
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
