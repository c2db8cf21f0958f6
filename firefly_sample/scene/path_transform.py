"""The part of NodePath that moves and measures: pos, hpr, quat, scale, shear, mat, each relative or not."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import as_numbers
from firefly_sample.scene.path import PathStep, common_ancestor
from firefly_sample.scene.path_base import PathBase
from firefly_sample.scene.transform_state import (
    IDENTITY,
    SingularTransformError,
    TransformState,
    invert_matrix,
)
from firefly_sample.scene.transforms import Float64, Quat, look_at_quat

_Part = TypeVar("_Part")


class PathTransform(PathBase):
    """Transforms of a NodePath.

    Every setter takes its numbers one by one or as one sequence, and an optional NodePath before them:
    then the numbers are meant in that node's space. As in Panda3D a relative setter keeps the other
    local components, so ``set_pos(other, p)`` does not turn the node.

    Getters give float64 arrays, in the parent's space or in that of the NodePath given. Angles are
    degrees, quaternions (w, x, y, z). An empty NodePath as the other one stands for the space above the
    root. All raise NodeError, naming the node, if this path is empty, if a number is not finite, if the
    two nodes have no common root, or if a singular matrix would have to be inverted.
    """

    __slots__ = ()

    # --- Whole transforms ---

    def get_transform(self, other: PathTransform | None = None) -> TransformState:
        """The transform from this node's space to its parent's, or to that of `other`."""
        if other is None:
            return self.node().transform
        common = None
        if self._step is not None and other._step is not None:
            common = common_ancestor(self._step, other._step)
            if common is None:
                raise self._error(f"has no common root with {str(other)!r}; attach both to one tree first")
        down = _transform_from(common, self._step)
        try:
            return _transform_from(common, other._step).invert_compose(down)
        except SingularTransformError:
            raise other._flattened() from None

    def get_net_transform(self) -> TransformState:
        """The transform from this node's space to the root's."""
        return _transform_from(None, self._step)

    def get_mat(self, other: PathTransform | None = None) -> Float64:
        """The 4x4 matrix from this node's space to its parent's, or to that of `other`; row vectors."""
        return np.array(self.get_transform(other).get_mat())

    def get_net_mat(self) -> Float64:
        """The 4x4 matrix from this node's space to the root's; row vectors."""
        return np.array(net_matrix(self))

    def set_transform(self, *arguments: Any) -> None:
        """``set_transform([other,] transform)`` with a TransformState."""
        other, rest = self._split(arguments)
        if len(rest) != 1 or not isinstance(rest[0], TransformState):
            raise self._error("set_transform takes a TransformState, and a NodePath before it if relative")
        self._set_whole(other, rest[0])

    def set_mat(self, *arguments: Any) -> None:
        """``set_mat([other,] matrix)`` with a 4x4 matrix whose last column is (0, 0, 0, 1)."""
        other, rest = self._split(arguments)
        matrix = as_numbers(
            f"node {str(self)!r}: set_mat's matrix", rest[0] if len(rest) == 1 else (), NodeError
        )
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
        """Put the node at its parent's origin, not turned and not scaled."""
        self.node().set_transform(IDENTITY)

    # --- Components ---

    def get_pos(self, other: PathTransform | None = None) -> Float64:
        """Position (x, y, z)."""
        return np.array(self.get_transform(other).get_pos())

    def set_pos(self, *arguments: Any) -> None:
        """``set_pos([other,] x, y, z)`` or ``set_pos([other,] point)``."""
        other, rest = self._split(arguments)
        pos = self._vec3("set_pos", rest)
        self._set_part(other, TransformState.get_pos, TransformState.set_pos, pos)

    def get_hpr(self, other: PathTransform | None = None) -> Float64:
        """(heading, pitch, roll) in degrees."""
        return np.array(self.get_transform(other).get_hpr())

    def set_hpr(self, *arguments: Any) -> None:
        """``set_hpr([other,] h, p, r)`` or ``set_hpr([other,] hpr)``, degrees."""
        other, rest = self._split(arguments)
        hpr = self._vec3("set_hpr", rest)
        self._set_part(other, TransformState.get_hpr, TransformState.set_hpr, hpr)

    def get_quat(self, other: PathTransform | None = None) -> Float64:
        """The unit quaternion (w, x, y, z) of the rotation; of the two signs, either."""
        return np.array(self.get_transform(other).get_quat())

    def set_quat(self, *arguments: Any) -> None:
        """``set_quat([other,] w, x, y, z)`` or ``set_quat([other,] quat)``; brought to length 1."""
        other, rest = self._split(arguments)
        w, x, y, z = self._numbers("set_quat", 4, rest)
        length = math.hypot(w, x, y, z)
        if length == 0.0:
            raise self._error("set_quat takes a quaternion that is not zero")
        quat: Quat = (w / length, x / length, y / length, z / length)
        self._set_part(other, TransformState.get_quat, TransformState.set_quat, quat)

    def get_scale(self, other: PathTransform | None = None) -> Float64:
        """Scale along x, y, z."""
        return np.array(self.get_transform(other).get_scale())

    def set_scale(self, *arguments: Any) -> None:
        """``set_scale([other,] s)``, ``set_scale([other,] sx, sy, sz)`` or ``set_scale([other,] scale)``."""
        other, rest = self._split(arguments)
        scale = self._vec3("set_scale", rest * 3 if len(rest) == 1 and np.ndim(rest[0]) == 0 else rest)
        self._set_part(other, TransformState.get_scale, TransformState.set_scale, scale)

    def get_shear(self, other: PathTransform | None = None) -> Float64:
        """Shear (xy, xz, yz): what a non-uniform scale above a rotation leaves behind."""
        return np.array(self.get_transform(other).get_shear())

    def set_shear(self, *arguments: Any) -> None:
        """``set_shear([other,] xy, xz, yz)`` or ``set_shear([other,] shear)``."""
        other, rest = self._split(arguments)
        shear = self._vec3("set_shear", rest)
        self._set_part(other, TransformState.get_shear, TransformState.set_shear, shear)

    def set_pos_hpr(self, *arguments: Any) -> None:
        """``set_pos_hpr([other,] x, y, z, h, p, r)`` or ``set_pos_hpr([other,] pos, hpr)``."""
        other, rest = self._split(arguments)
        pos, hpr = self._vectors("set_pos_hpr", 2, rest)
        prefix = () if other is None else (other,)
        self.set_hpr(*prefix, hpr)
        self.set_pos(*prefix, pos)

    def set_pos_hpr_scale(self, *arguments: Any) -> None:
        """``set_pos_hpr_scale([other,] pos, hpr, scale)``, or nine numbers; the shear becomes zero."""
        other, rest = self._split(arguments)
        pos, hpr, scale = self._vectors("set_pos_hpr_scale", 3, rest)
        self._set_whole(other, TransformState.make_pos_hpr_scale_shear(pos, hpr, scale))

    # --- Looking and measuring ---

    def look_at(self, *arguments: Any) -> None:
        """Turn the node's +Y axis to a point.

        ``look_at(point[, up])`` with a point in the parent's space, also as ``look_at(x, y, z)``, or
        ``look_at(other[, point[, up]])`` with a point in the space of `other`, its origin if not given.
        `up` is a direction in the parent's space, (0, 0, 1) if not given. Scale and shear stay.
        """
        other, rest = self._split(arguments)
        if len(rest) == 3 and np.ndim(rest[0]) == 0:
            rest = (rest,)
        if len(rest) > 2 or (other is None and not rest):
            raise self._error("look_at takes a point or another NodePath, then a point, then an up vector")
        point = np.array(self._vec3("look_at", rest[0:1] or ((0.0, 0.0, 0.0),)))
        up = self._vec3("look_at's up", rest[1:2] or ((0.0, 0.0, 1.0),))
        if other is not None:
            point = _move(point, other.get_transform(self._above()))
        x, y, z = (point - self.node().transform.get_pos()).tolist()
        self.set_quat(look_at_quat((x, y, z), up))

    def get_relative_point(self, other: PathTransform, point: Any) -> Float64:
        """A point given in the space of `other`, in this node's space."""
        return _move(np.array(self._vec3("get_relative_point", (point,))), other.get_transform(self))

    def get_relative_vector(self, other: PathTransform, vector: Any) -> Float64:
        """A direction given in the space of `other`, in this node's space; scaled with it, not moved."""
        turn = other.get_transform(self).get_mat()[:3, :3]
        return np.array(self._vec3("get_relative_vector", (vector,))) @ turn

    def get_distance(self, other: PathTransform) -> float:
        """How far this node's origin is from that of `other`, in the units of `other`."""
        return math.hypot(*self.get_transform(other).get_pos())

    # --- Shared by the setters ---

    def _above(self) -> PathTransform:
        return PathTransform._at(self._place().parent)

    def _split(self, arguments: tuple[Any, ...]) -> tuple[PathTransform | None, tuple[Any, ...]]:
        """(other, the rest) if the first argument is a NodePath, else (None, all)."""
        if arguments and isinstance(arguments[0], PathTransform):
            return arguments[0], arguments[1:]
        return None, arguments

    def _in_parent(self, other: PathTransform, transform: TransformState) -> TransformState:
        """What `transform`, meant in the space of `other`, is in the parent's."""
        result = other.get_transform(self._above()).compose(transform)
        if not np.isfinite(result.get_mat()).all():
            raise self._error(f"what was given relative to {str(other)!r} is too large a number here")
        return result

    def _set_whole(self, other: PathTransform | None, transform: TransformState) -> None:
        node = self.node()
        node.set_transform(transform if other is None else self._in_parent(other, transform))

    def _set_part(
        self,
        other: PathTransform | None,
        get: Callable[[TransformState], _Part],
        set_: Callable[[TransformState, _Part], TransformState],
        value: _Part,
    ) -> None:
        """Set one component, and keep the other local ones to the last digit."""
        node = self.node()
        if other is not None:
            value = get(self._in_parent(other, set_(self.get_transform(other), value)))
        node.set_transform(set_(node.transform, value))

    def _flattened(self) -> NodeError:
        """The error for a transform that has no inverse, naming the highest node that is to blame."""
        culprit = self._step
        for step in self._step.upwards() if self._step is not None else ():
            try:
                invert_matrix(step.node.transform.get_mat())
            except SingularTransformError:
                culprit = step
        return PathTransform._at(culprit)._error(
            "its scale flattens space, so nothing can be had relative to it or to what is below it; "
            "give it a scale without zeros"
        )


def _transform_from(top: PathStep | None, step: PathStep | None) -> TransformState:
    """The transform from the space of `step` to that of `top` above it, or to the space above the root."""
    chain: list[TransformState] = []
    while step is not None and (top is None or step.node is not top.node):
        if not step.node.transform.is_identity:
            chain.append(step.node.transform)
        step = step.parent
    result = IDENTITY
    for transform in reversed(chain):
        result = result.compose(transform)
    return result


def _move(point: Float64, transform: TransformState) -> Float64:
    matrix = transform.get_mat()
    return np.asarray(point @ matrix[:3, :3] + matrix[3, :3])


def net_matrix(path: PathBase) -> Float64:
    """The 4x4 float64 matrix from a path's space to its root's; identity for an empty path. Read-only."""
    result: Float64 | None = None
    step = path._step
    while step is not None:
        transform = step.node.transform
        if not transform.is_identity:
            result = transform.get_mat() if result is None else result @ transform.get_mat()
        step = step.parent
    return IDENTITY.get_mat() if result is None else result
