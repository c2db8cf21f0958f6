"""Vectors as the getters of a `firefly_sample.scene.nodepath.NodePath` return them."""

from __future__ import annotations

import math
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.scene.camel_case import CamelCase
from firefly_sample.scene.transforms import Vec3

_FLOAT64 = np.dtype(np.float64)


class Vector(CamelCase, np.ndarray[Any, np.dtype[np.float64]]):
    """A float64 array of three numbers with the most used methods of Panda3D's LVector3.

    ``==`` and ``!=`` compare whole vectors and return one bool: ``path.get_pos() == (1, 2, 3)``. For one bool
    a number, use ``numpy.equal``. The rest is as of any array; results that are not vectors of three floats
    are plain arrays.

    Parameters
    ----------
    *numbers : float
        Three of them, or one sequence of three.
    """

    def __new__(cls, *numbers: Any) -> Self:
        """Return a new vector."""
        values = numbers[0] if len(numbers) == 1 else numbers
        array = np.array(values, dtype=np.float64)
        if array.shape != (3,):
            raise ValueError(f"a vector has three numbers, got {', '.join(map(repr, numbers)) or 'nothing'}")
        return array.view(cls)

    @classmethod
    def of(cls, numbers: Vec3) -> Self:
        """Return a new vector of three floats, which are not checked."""
        return np.array(numbers, _FLOAT64).view(cls)

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        """Return results of NumPy's functions as vectors if they are, or else as plain arrays."""
        if array.shape == (3,) and array.dtype is _FLOAT64:
            return array.view(type(self))
        return array[()] if return_scalar or array.ndim == 0 else array.view(np.ndarray)

    def __eq__(self, other: object) -> Any:
        """Return whether `other` has the same three numbers."""
        if self.shape != (3,):
            return super().__eq__(other)  # a part of a vector, or a view of another shape
        try:
            given = np.asarray(other, dtype=np.float64)
        except (TypeError, ValueError):
            return NotImplemented
        return np.bool_(given.shape == (3,) and self.tolist() == given.tolist())

    def __ne__(self, other: object) -> Any:
        """Return whether `other` is not the same vector."""
        equal = self.__eq__(other)
        return equal if equal is NotImplemented else np.logical_not(equal)

    __hash__ = None  # its numbers can change

    @property
    def x(self) -> float:
        """The first number."""
        return float(self[0])

    @x.setter
    def x(self, value: float) -> None:
        self[0] = value

    @property
    def y(self) -> float:
        """The second number."""
        return float(self[1])

    @y.setter
    def y(self, value: float) -> None:
        self[1] = value

    @property
    def z(self) -> float:
        """The third number."""
        return float(self[2])

    @z.setter
    def z(self, value: float) -> None:
        self[2] = value

    def get_x(self) -> float:
        """Return the first number."""
        return self.x

    def get_y(self) -> float:
        """Return the second number."""
        return self.y

    def get_z(self) -> float:
        """Return the third number."""
        return self.z

    def set_x(self, value: float) -> None:
        """Change the first number of this vector."""
        self.x = value

    def set_y(self, value: float) -> None:
        """Change the second number of this vector."""
        self.y = value

    def set_z(self, value: float) -> None:
        """Change the third number of this vector."""
        self.z = value

    def length(self) -> float:
        """Return the length."""
        return math.hypot(*self.tolist())

    def length_squared(self) -> float:
        """Return the square of the length."""
        return float(np.dot(self, self))

    def normalize(self) -> bool:
        """Give this vector the length 1, and return True; one of length 0 stays, and the result is False."""
        length = self.length()
        if length == 0.0:
            return False
        self /= length
        return True

    def normalized(self) -> Self:
        """Return the vector of length 1 in this direction; zeros for one of length 0."""
        result = self.copy()
        result.normalize()
        return result

    def cross(self, other: ArrayLike) -> Self:
        """Return the cross product with another vector."""
        return type(self)(np.cross(self, np.asarray(other, dtype=np.float64)))
