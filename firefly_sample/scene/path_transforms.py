"""The transforms of a `firefly_sample.scene.nodepath.NodePath`: whole ones, and their components."""

from __future__ import annotations

import math
from functools import reduce
from typing import Any

import numpy as np

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import Float64, as_numbers
from firefly_sample.scene.path_base import PathBase
from firefly_sample.scene.path_step import PathStep
from firefly_sample.scene.transform_state import (
    IDENTITY,
    SingularTransformError,
    TransformState,
    invert_matrix,
)
from firefly_sample.scene.transforms import look_at_quat
from firefly_sample.scene.vector import Vector


class PathTransforms(PathBase):
    """The methods of a `NodePath` that read and set transforms."""

    __slots__ = ()

    def get_transform(self, other: PathTransforms | None = None) -> TransformState:
        """Return the transform from this node's space to its parent's, or to that of `other`."""
        if other is None:
            return self.node().transform
        common = None
        if self._step is not None and other._step is not None:
            common = common_step(self._step, other._step)
            if common is None:
                raise self._error(f"has no common root with {str(other)!r}; attach both to one tree first")
        down = _transform_between(common, self._step)
        try:
            return _transform_between(common, other._step).invert_compose(down)
        except SingularTransformError:
            raise other._flattened() from None

    def get_net_transform(self) -> TransformState:
        """Return the transform from this node's space to the world."""
        return _transform_between(None, self._step)

    def get_mat(self, other: PathTransforms | None = None) -> Float64:
        """Return the 4x4 matrix to the parent's space, or to that of `other`; row vectors."""
        return np.array(self.get_transform(other).get_mat())

    def get_net_mat(self) -> Float64:
        """Return the 4x4 matrix from this node's space to the world; row vectors."""
        steps = self._step.upwards() if self._step is not None else ()
        transforms = [step.node.transform for step in steps if not step.node.transform.is_identity()]
        matrices = [transform.get_mat() for transform in transforms]
        return np.array(reduce(np.matmul, matrices) if matrices else IDENTITY.get_mat())

    def set_transform(self, *arguments: Any) -> None:
        """Set the transform: ``set_transform([other,] transform)`` with a TransformState."""
        other, rest = self._split(arguments)
        if len(rest) != 1 or not isinstance(rest[0], TransformState):
            raise self._error("set_transform takes a TransformState, and a NodePath before it if relative")
        self._set_whole(other, rest[0])

    def set_mat(self, *arguments: Any) -> None:
        """Set the matrix: ``set_mat([other,] matrix)``, 4x4, with the last column (0, 0, 0, 1)."""
        other, rest = self._split(arguments)
        given = rest[0] if len(rest) == 1 else ()
        matrix = as_numbers(f"node {str(self)!r}: set_mat's matrix", given, NodeError)
        if matrix.shape != (4, 4):
            raise self._error(
                "set_mat takes one matrix of shape (4, 4), and a NodePath before it if relative"
            )
        if not np.isfinite(matrix).all():
            raise self._error("set_mat takes finite numbers only")
        if matrix[:, 3].tolist() != [0.0, 0.0, 0.0, 1.0]:
            raise self._error(
                "set_mat takes an affine matrix for row vectors, whose last column is 0, 0, 0, 1; got "
                f"{', '.join(f'{number:g}' for number in matrix[:, 3])} (a transposed matrix?)"
            )
        self._set_whole(other, TransformState.make_mat(matrix))

    def clear_transform(self) -> None:
        """Reset the transform to the identity."""
        self.node().set_transform(IDENTITY)

    def clear_mat(self) -> None:
        """Reset the transform to the identity."""
        self.clear_transform()

    def has_mat(self) -> bool:
        """Return whether the transform is not the identity."""
        return not self.node().transform.is_identity()

    def get_pos(self, other: PathTransforms | None = None) -> Vector:
        """Return the position (x, y, z)."""
        state = self.node().transform if other is None else self.get_transform(other)
        return Vector.of(state.get_pos())

    def set_pos(self, *arguments: Any) -> None:
        """Set the position: ``set_pos([other,] x, y, z)`` or ``set_pos([other,] point)``."""
        other, rest = self._split(arguments)
        self._set_part("pos", other, self._vec3("set_pos", rest))

    def get_hpr(self, other: PathTransforms | None = None) -> Vector:
        """Return (heading, pitch, roll) in degrees."""
        return Vector.of(self.get_transform(other).get_hpr())

    def set_hpr(self, *arguments: Any) -> None:
        """Set the rotation: ``set_hpr([other,] h, p, r)`` or ``set_hpr([other,] hpr)``, in degrees."""
        other, rest = self._split(arguments)
        self._set_part("hpr", other, self._vec3("set_hpr", rest))

    def get_quat(self, other: PathTransforms | None = None) -> Float64:
        """Return the unit quaternion (w, x, y, z) of the rotation; its sign is not defined."""
        return np.array(self.get_transform(other).get_quat())

    def set_quat(self, *arguments: Any) -> None:
        """Set the rotation to a quaternion of any length but 0: ``set_quat([other,] w, x, y, z)``."""
        other, rest = self._split(arguments)
        w, x, y, z = self._numbers("set_quat", 4, rest)
        length = math.hypot(w, x, y, z)
        if length == 0.0:
            raise self._error("set_quat takes a quaternion that is not zero")
        self._set_part("quat", other, (w / length, x / length, y / length, z / length))

    def get_scale(self, other: PathTransforms | None = None) -> Vector:
        """Return the scale along x, y, z."""
        return Vector.of(self.get_transform(other).get_scale())

    def set_scale(self, *arguments: Any) -> None:
        """Set the scale: ``set_scale([other,] s)``, or ``sx, sy, sz``, or a sequence of three."""
        other, rest = self._split(arguments)
        uniform = len(rest) == 1 and np.ndim(rest[0]) == 0
        self._set_part("scale", other, self._vec3("set_scale", rest * 3 if uniform else rest))

    def get_shear(self, other: PathTransforms | None = None) -> Vector:
        """Return the shear (xy, xz, yz), which comes from a non-uniform scale above a rotation."""
        return Vector.of(self.get_transform(other).get_shear())

    def set_shear(self, *arguments: Any) -> None:
        """Set the shear: ``set_shear([other,] xy, xz, yz)`` or ``set_shear([other,] shear)``."""
        other, rest = self._split(arguments)
        self._set_part("shear", other, self._vec3("set_shear", rest))

    def set_pos_hpr(self, *arguments: Any) -> None:
        """Set position and rotation: ``set_pos_hpr([other,] pos, hpr)``, or six numbers."""
        other, rest = self._split(arguments)
        pos, hpr = self._vectors("set_pos_hpr", 2, rest)
        self._set_part("hpr", other, hpr)
        self._set_part("pos", other, pos)

    def set_pos_hpr_scale(self, *arguments: Any) -> None:
        """Set position, rotation and scale, and remove the shear.

        ``set_pos_hpr_scale([other,] pos, hpr, scale)``, or nine numbers.
        """
        other, rest = self._split(arguments)
        pos, hpr, scale = self._vectors("set_pos_hpr_scale", 3, rest)
        self._set_whole(other, TransformState.make_pos_hpr_scale_shear(pos, hpr, scale))

    def set_hpr_scale(self, *arguments: Any) -> None:
        """Set rotation and scale: ``set_hpr_scale([other,] hpr, scale)``, or six numbers."""
        other, rest = self._split(arguments)
        hpr, scale = self._vectors("set_hpr_scale", 2, rest)
        present = self.get_transform(other)
        whole = TransformState.make_pos_hpr_scale_shear(present.get_pos(), hpr, scale, present.get_shear())
        self._set_whole(other, whole)

    def set_pos_quat(self, *arguments: Any) -> None:
        """Set position and rotation: ``set_pos_quat([other,] pos, quat)``."""
        other, rest = self._split(arguments)
        if len(rest) != 2:
            raise self._error(f"set_pos_quat takes a position and a quaternion, got {len(rest)} values")
        relative = () if other is None else (other,)
        self.set_quat(*relative, rest[1])
        self.set_pos(*relative, rest[0])

    def look_at(self, *arguments: Any) -> None:
        """Turn the node so that its +Y axis points at a point.

        ``look_at(point[, up])`` with a point in the parent's space, also as ``look_at(x, y, z)``, or
        ``look_at(other[, point[, up]])`` with a point in the space of `other`, by default its origin.
        `up` is a direction in the parent's space, by default (0, 0, 1). Scale and shear stay.
        """
        other, rest = self._split(arguments)
        if len(rest) == 3 and np.ndim(rest[0]) == 0:
            rest = (rest,)
        if len(rest) > 2 or (other is None and not rest):
            raise self._error("look_at takes a point or another NodePath, then a point, then an up vector")
        point = np.array(self._vec3("look_at", rest[0:1] or ((0.0, 0.0, 0.0),)))
        up = self._vec3("look_at's up", rest[1:2] or ((0.0, 0.0, 1.0),))
        if other is not None:
            point = _move(point, other.get_transform(self.get_parent()))
        x, y, z = (point - self.node().transform.get_pos()).tolist()
        self.set_quat(look_at_quat((x, y, z), up))

    def get_relative_point(self, other: PathTransforms, point: Any) -> Vector:
        """Convert a point from the space of `other` to this node's space."""
        return Vector(_move(np.array(self._vec3("get_relative_point", (point,))), other.get_transform(self)))

    def get_relative_vector(self, other: PathTransforms, vector: Any) -> Vector:
        """Convert a vector from the space of `other` to this node's space: turn and scale it."""
        turn = other.get_transform(self).get_mat()[:3, :3]
        return Vector(np.array(self._vec3("get_relative_vector", (vector,))) @ turn)

    def get_distance(self, other: PathTransforms) -> float:
        """Return the distance of this node's origin from that of `other`, in the units of `other`."""
        return math.hypot(*self.get_transform(other).get_pos())

    def _in_parent(self, other: PathTransforms, transform: TransformState) -> TransformState:
        """Convert a transform from the space of `other` to the parent's."""
        result = other.get_transform(self.get_parent()).compose(transform)
        if not np.isfinite(result.get_mat()).all():
            raise self._error(
                f"what was given relative to {str(other)!r} is too large a number in the parent's space"
            )
        return result

    def _set_whole(self, other: PathTransforms | None, transform: TransformState) -> None:
        node = self.node()
        node.set_transform(transform if other is None else self._in_parent(other, transform))

    def _set_part(self, name: str, other: PathTransforms | None, value: tuple[float, ...]) -> None:
        """Set one component of the transform and keep the other local ones to the last digit."""
        node, change = self.node(), getattr(TransformState, f"set_{name}")
        if other is not None:
            in_parent = self._in_parent(other, change(self.get_transform(other), value))
            value = getattr(in_parent, f"get_{name}")()
        node.set_transform(change(node.transform, value))

    def _flattened(self) -> NodeError:
        """Return the error for a transform without an inverse; it names the highest node that has one."""
        culprit = self._step
        for step in self._step.upwards() if self._step is not None else ():
            try:
                invert_matrix(step.node.transform.get_mat())
            except SingularTransformError:
                culprit = step
        return self._at(culprit)._error(
            "its scale flattens space, so nothing can be had relative to it or to what is below it; "
            "give it a scale without zeros"
        )


def _move(point: Float64, transform: TransformState) -> Float64:
    matrix = transform.get_mat()
    return np.asarray(point @ matrix[:3, :3] + matrix[3, :3])


def common_step(a: PathStep, b: PathStep) -> PathStep | None:
    """Return the lowest step that both paths go through, None if they have different roots."""
    common = None
    for step_a, step_b in zip(reversed(list(a.upwards())), reversed(list(b.upwards())), strict=False):
        if step_a.node is not step_b.node:
            break
        common = step_a
    return common


def _transform_between(top: PathStep | None, step: PathStep | None) -> TransformState:
    """Return the transform from the space of `step` to that of `top` above it; None is the world."""
    chain = []
    while step is not None and (top is None or step.node is not top.node):
        chain.append(step.node.transform)
        step = step.parent
    return reduce(TransformState.compose, reversed(chain), IDENTITY)
