"""TransformState: a node's transform to its parent's space, as an immutable value."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import Float64, as_numbers, read_only
from firefly_sample.scene.camel_case import CamelCase
from firefly_sample.scene.transforms import (
    Quat,
    Vec3,
    compose_matrix,
    decompose_matrix,
    hpr_from_quat,
    multiply_quats,
    quat_from_hpr,
    rotate_by_quat,
    rows_from_hpr,
    rows_from_quat,
)

_ZERO: Vec3 = (0.0, 0.0, 0.0)
_ONE: Vec3 = (1.0, 1.0, 1.0)
_PANDA_ZERO = 1e-6
"""Panda3D ignores a shear below this, which decides the signs of a composed scale."""
_SINGULAR_CONDITION = 1.0 / (8 * 2.0**-52)
"""The condition number from which an inverse in float64 has no correct digit."""


class SingularTransformError(ArithmeticError):
    """The transform flattens space, so it has no inverse. Callers that know the node raise a NodeError."""


class TransformState(CamelCase):
    """Position, rotation, scale and shear; see `firefly_sample.scene.transforms` for the conventions.

    As in Panda3D, a state remembers how it was made. Made from components, it returns exactly those, and
    changing one keeps the others: a scale of -1 along x stays one. Made from a matrix, it is decomposed when
    components are read. All methods return a new state.
    """

    __slots__ = (
        "_given",
        "_hpr",
        "_identity",
        "_mat",
        "_pos",
        "_quat",
        "_quat_given",
        "_scale",
        "_shear",
    )

    def __init__(
        self,
        pos: Vec3,
        hpr: Vec3 | None,
        quat: Quat | None,
        scale: Vec3 | None,
        shear: Vec3,
        mat: Float64 | None = None,
    ) -> None:
        """Take components, or a position and a matrix; the class methods below are plainer."""
        self._pos, self._hpr, self._quat = pos, hpr, quat
        self._scale, self._shear, self._mat = scale, shear, mat
        self._given, self._quat_given = mat is None, quat is not None
        if mat is not None:
            self._identity = bool((mat == _IDENTITY_MATRIX).all())
        else:
            self._identity = (
                pos == _ZERO
                and scale == _ONE
                and shear == _ZERO
                and (hpr == _ZERO if hpr is not None else quat == (1.0, 0.0, 0.0, 0.0))
            )

    def __copy__(self) -> TransformState:
        return self

    def __deepcopy__(self, _: dict[int, Any]) -> TransformState:
        return self

    def __setstate__(self, state: tuple[None, dict[str, Any]]) -> None:
        for name, value in state[1].items():
            setattr(self, name, value)
        if self._mat is not None:
            read_only(self._mat)

    @classmethod
    def make_identity(cls) -> TransformState:
        """Return the state that changes nothing."""
        return IDENTITY

    @classmethod
    def make_pos(cls, pos: ArrayLike) -> TransformState:
        """Return a translation (x, y, z)."""
        return cls(_vec3("pos", pos), _ZERO, None, _ONE, _ZERO)

    @classmethod
    def make_hpr(cls, hpr: ArrayLike) -> TransformState:
        """Return a rotation (heading, pitch, roll), in degrees."""
        return cls(_ZERO, _vec3("hpr", hpr), None, _ONE, _ZERO)

    @classmethod
    def make_scale(cls, scale: ArrayLike) -> TransformState:
        """Return a scale, one number or one for each axis."""
        return cls(_ZERO, _ZERO, None, _scale(scale), _ZERO)

    @classmethod
    def make_shear(cls, shear: ArrayLike) -> TransformState:
        """Return a shear (xy, xz, yz)."""
        return cls(_ZERO, _ZERO, None, _ONE, _vec3("shear", shear))

    @classmethod
    def make_pos_hpr(cls, pos: ArrayLike, hpr: ArrayLike) -> TransformState:
        """Return a state from a position and a rotation in degrees."""
        return cls(_vec3("pos", pos), _vec3("hpr", hpr), None, _ONE, _ZERO)

    @classmethod
    def make_pos_hpr_scale(cls, pos: ArrayLike, hpr: ArrayLike, scale: ArrayLike) -> TransformState:
        """Return a state from a position, a rotation in degrees, and a scale."""
        return cls(_vec3("pos", pos), _vec3("hpr", hpr), None, _scale(scale), _ZERO)

    @classmethod
    def make_pos_hpr_scale_shear(
        cls, pos: Vec3 = _ZERO, hpr: Vec3 = _ZERO, scale: Vec3 = _ONE, shear: Vec3 = _ZERO
    ) -> TransformState:
        """Return a state from components; `hpr` in degrees, `shear` as (xy, xz, yz)."""
        return cls(pos, hpr, None, scale, shear)

    @classmethod
    def make_pos_quat_scale_shear(
        cls, pos: Vec3, quat: Quat, scale: Vec3 = _ONE, shear: Vec3 = _ZERO
    ) -> TransformState:
        """Return a state from components; `quat` is a unit quaternion (w, x, y, z)."""
        return cls(pos, None, quat, scale, shear)

    @classmethod
    def make_mat(cls, matrix: Float64) -> TransformState:
        """Return a state from an affine 4x4 matrix (last column 0, 0, 0, 1), which is copied."""
        own = read_only(np.array(matrix, dtype=np.float64))
        x, y, z = own[3, :3].tolist()
        return cls((x, y, z), None, None, None, _ZERO, own)

    def get_pos(self) -> Vec3:
        """Return the translation (x, y, z)."""
        return self._pos

    def get_hpr(self) -> Vec3:
        """Return (heading, pitch, roll) in degrees."""
        if self._hpr is None:
            if self._quat is not None:
                self._hpr = hpr_from_quat(self._quat)
            else:
                self._decompose()
        assert self._hpr is not None
        return self._hpr

    def get_quat(self) -> Quat:
        """Return the unit quaternion (w, x, y, z) of the rotation."""
        if self._quat is None:
            self._quat = quat_from_hpr(self.get_hpr())
        return self._quat

    def get_scale(self) -> Vec3:
        """Return the scale along x, y, z; negative where it mirrors."""
        if self._scale is None:
            self._decompose()
        assert self._scale is not None
        return self._scale

    def get_shear(self) -> Vec3:
        """Return the shear (xy, xz, yz)."""
        if self._scale is None:
            self._decompose()
        return self._shear

    def get_mat(self) -> Float64:
        """Return the 4x4 float64 matrix, child to parent; read-only, computed once."""
        if self._mat is None:
            # from the rotation as it was given: reading the other form before must not change a digit
            rows = rows_from_quat(self.get_quat()) if self._quat_given else rows_from_hpr(self.get_hpr())
            self._mat = read_only(compose_matrix(self._pos, rows, self.get_scale(), self._shear))
        return self._mat

    def is_identity(self) -> bool:
        """Return whether the state changes nothing."""
        return self._identity

    def has_components(self) -> bool:
        """Return True, as Panda3D does of all states but its invalid one, which is not here."""
        return True

    has_pos = has_hpr = has_quat = has_scale = has_shear = has_mat = has_components

    def components_given(self) -> bool:
        """Return whether the state was made from components, not from a matrix; False of the identity."""
        return self._given and not self._identity

    def hpr_given(self) -> bool:
        """Return whether the state was made from components, with angles."""
        return self.components_given() and not self._quat_given

    def quat_given(self) -> bool:
        """Return whether the state was made from components, with a quaternion."""
        return self.components_given() and self._quat_given

    def has_uniform_scale(self) -> bool:
        """Return whether the scale is the same along all axes."""
        sx, sy, sz = self.get_scale()
        return sx == sy == sz

    def has_identity_scale(self) -> bool:
        """Return whether the scale is 1 along all axes."""
        return self.get_scale() == _ONE

    def has_nonzero_shear(self) -> bool:
        """Return whether there is a shear."""
        return self.get_shear() != _ZERO

    def is_singular(self) -> bool:
        """Return whether the state flattens space, so that it has no inverse."""
        try:
            self.invert()
        except SingularTransformError:
            return True
        return False

    def get_inverse(self) -> TransformState:
        """Return the inverse, or raise SingularTransformError if this state flattens space."""
        return self.invert()

    def _decompose(self) -> None:
        assert self._mat is not None
        x_row, y_row, z_row = (tuple(row) for row in self._mat[:3, :3].tolist())
        self._hpr, self._scale, self._shear = decompose_matrix((x_row, y_row, z_row))

    def set_pos(self, pos: Vec3) -> TransformState:
        """Return the state with a different position."""
        if self._given:
            return TransformState(pos, *self._rotation(), self.get_scale(), self._shear)
        matrix = np.array(self.get_mat())
        matrix[3, :3] = pos
        return self.make_mat(matrix)

    def set_hpr(self, hpr: Vec3) -> TransformState:
        """Return the state with a different rotation, in degrees."""
        return TransformState(self._pos, hpr, None, self.get_scale(), self.get_shear())

    def set_quat(self, quat: Quat) -> TransformState:
        """Return the state with a different rotation, a unit quaternion."""
        return TransformState(self._pos, None, quat, self.get_scale(), self.get_shear())

    def set_scale(self, scale: Vec3) -> TransformState:
        """Return the state with a different scale."""
        return TransformState(self._pos, *self._rotation(), scale, self.get_shear())

    def set_shear(self, shear: Vec3) -> TransformState:
        """Return the state with a different shear."""
        return TransformState(self._pos, *self._rotation(), self.get_scale(), shear)

    def _rotation(self) -> tuple[Vec3 | None, Quat | None]:
        """Return the rotation in the form in which it was given."""
        return (None, self._quat) if self._quat_given else (self.get_hpr(), None)

    def _is_uniform(self) -> bool:
        """Return whether it was made from components with one scale for all axes and no shear."""
        if not self._given:
            return False
        sx, sy, sz = self.get_scale()
        return sx == sy == sz and self._shear == _ZERO

    def _is_unsheared(self) -> bool:
        """Return whether its components define it, without a shear that Panda3D would notice."""
        return max(map(abs, self.get_shear())) < _PANDA_ZERO and (self._given or 0.0 not in self.get_scale())

    def compose(self, child: TransformState) -> TransformState:
        """Return `child`, a transform to this state's space, as one to the space that this state leads to.

        The matrix is ``child.get_mat() @ self.get_mat()``. If this state's scale is uniform and neither has
        shear, components are composed one by one, which keeps signs and round numbers in the scale; otherwise
        the result may have shear.
        """
        if self._identity:
            return child
        if child._identity:
            return self
        if self._is_uniform() and child._is_unsheared():
            scale = self.get_scale()[0]
            x, y, z = child._pos
            dx, dy, dz = rotate_by_quat((x * scale, y * scale, z * scale), self.get_quat())
            px, py, pz = self._pos
            sx, sy, sz = child.get_scale()
            return TransformState(
                (px + dx, py + dy, pz + dz),
                None,
                multiply_quats(child.get_quat(), self.get_quat()),
                (sx * scale, sy * scale, sz * scale),
                child.get_shear(),  # unchanged by a rotation and a uniform scale
            )
        with np.errstate(over="ignore", invalid="ignore"):
            return self.make_mat(child.get_mat() @ self.get_mat())

    def invert(self) -> TransformState:
        """Return the inverse, or raise SingularTransformError if this state flattens space."""
        if self._identity:
            return self
        if self._is_uniform():
            scale = self.get_scale()[0]
            if scale == 0.0 or math.isinf(1.0 / scale):
                raise SingularTransformError
            w, qx, qy, qz = self.get_quat()
            back = (w, -qx, -qy, -qz)
            x, y, z = self._pos
            inverse = 1.0 / scale
            pos = rotate_by_quat((-x * inverse, -y * inverse, -z * inverse), back)
            return TransformState(pos, None, back, (inverse, inverse, inverse), _ZERO)
        return self.make_mat(invert_matrix(self.get_mat()))

    def invert_compose(self, other: TransformState) -> TransformState:
        """Return `other` relative to this state; both must lead to the same space. Raise as `invert`."""
        if self == other:
            return IDENTITY
        return self.invert().compose(other)

    def __eq__(self, other: object) -> bool:
        """Return whether the matrices are equal, number by number."""
        if not isinstance(other, TransformState):
            return NotImplemented
        return self is other or bool((self.get_mat() == other.get_mat()).all())

    def __hash__(self) -> int:
        return hash(self._pos)

    def described(self) -> str:
        """Return the components that are not those of the identity, as text."""
        scale = self.get_scale()
        parts = (
            ("pos", self._pos, _ZERO),
            ("hpr", self.get_hpr(), _ZERO),
            ("scale", scale[:1] if self.has_uniform_scale() else scale, _ONE[:1]),
            ("shear", self.get_shear(), _ZERO),
        )
        return " ".join(
            f"{name} " + " ".join(f"{number:g}" for number in value)
            for name, value, default in parts
            if value != default
        )

    def __repr__(self) -> str:
        return f"TransformState({self.described() or 'identity'})"


def _vec3(what: str, numbers: ArrayLike) -> Vec3:
    array = as_numbers(f"a transform's {what}", numbers, NodeError, "three finite numbers")
    if array.shape != (3,) or not np.isfinite(array).all():
        raise NodeError(f"a transform's {what} must be three finite numbers, got {numbers!r}")
    x, y, z = array.tolist()
    return x, y, z


def _scale(numbers: ArrayLike) -> Vec3:
    return _vec3("scale", np.repeat(numbers, 3) if np.ndim(numbers) == 0 else numbers)


def invert_matrix(matrix: Float64) -> Float64:
    """Return the inverse of an affine 4x4 matrix.

    Raise SingularTransformError if the upper 3x3, with rows scaled to length 1, has a condition number above
    1/(8 eps): then no digit of the inverse would be correct.
    """
    upper = matrix[:3, :3]
    lengths = np.abs(upper).max(axis=1, keepdims=True)
    if not (lengths > 0).all():
        raise SingularTransformError
    rows = upper / lengths
    try:
        inverse = np.linalg.inv(rows)
    except np.linalg.LinAlgError:
        raise SingularTransformError from None
    condition = math.sqrt(float((rows * rows).sum()) * float((inverse * inverse).sum()))
    with np.errstate(over="ignore", invalid="ignore"):
        result = np.zeros((4, 4))
        result[:3, :3] = inverse / lengths.T
        result[3, :3] = -matrix[3, :3] @ result[:3, :3]
    result[3, 3] = 1.0
    if not condition < _SINGULAR_CONDITION or not np.isfinite(result).all():
        raise SingularTransformError
    return result


_IDENTITY_MATRIX: Float64 = np.eye(4)
IDENTITY = TransformState.make_pos_hpr_scale_shear()
"""The state that changes nothing."""
