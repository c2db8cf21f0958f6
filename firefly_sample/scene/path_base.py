"""What all parts of NodePath build on: the path itself, its errors, and how their arguments are read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Self

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import as_numbers
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.path import PathStep, same_path
from firefly_sample.scene.transforms import Vec3
from firefly_sample.settings import number_or_none


class PathBase:
    """A place in the graph, or none (an empty path)."""

    __slots__ = ("_step",)

    _step: PathStep | None

    @classmethod
    def _at(cls, step: PathStep | None) -> Self:
        path = cls.__new__(cls)
        path._step = step
        return path

    def is_empty(self) -> bool:
        """Whether this path leads to no node."""
        return self._step is None

    def node(self) -> PandaNode:
        """The node that the path leads to.

        Raises
        ------
        NodeError
            If the path is empty.
        """
        if self._step is None:
            raise NodeError("this NodePath is empty: it was removed, not found, or made without a node")
        return self._step.node

    def _place(self) -> PathStep:
        """The step that the path leads to, or NodeError if there is none."""
        self.node()
        assert self._step is not None
        return self._step

    def _error(self, message: str) -> NodeError:
        return NodeError(f"node {str(self)!r}: {message}")

    def _numbers(self, what: str, count: int, arguments: Sequence[Any]) -> tuple[float, ...]:
        """`count` finite floats, given one by one or as one sequence.

        Raises
        ------
        NodeError
            If there are more or fewer, or one is no finite number.
        """
        values = arguments[0] if len(arguments) == 1 and count != 1 else arguments
        if hasattr(values, "__array__"):
            values = as_numbers(f"node {str(self)!r}: {what}", values, NodeError).tolist()
        try:
            found = tuple(map(number_or_none, values))
        except TypeError:
            found = ()
        numbers = tuple([number for number in found if number is not None])
        if not len(numbers) == len(found) == count:
            shown = ", ".join(map(repr, arguments)) or "nothing"
            raise self._error(f"{what} takes {count} {'number' if count == 1 else 'numbers'}, got {shown}")
        if not all(map(math.isfinite, numbers)):
            raise self._error(f"{what} takes finite numbers, got {', '.join(map(str, numbers))}")
        return numbers

    def _vec3(self, what: str, arguments: Sequence[Any]) -> Vec3:
        x, y, z = self._numbers(what, 3, arguments)
        return x, y, z

    def _vectors(self, what: str, count: int, arguments: Sequence[Any]) -> list[Vec3]:
        """`count` vectors, given as so many sequences or as one long row of numbers."""
        if len(arguments) == 3 * count:
            arguments = [arguments[index : index + 3] for index in range(0, 3 * count, 3)]
        if len(arguments) != count:
            raise self._error(
                f"{what} takes {count} vectors or {3 * count} numbers, got {len(arguments)} of them"
            )
        return [self._vec3(what, (vector,)) for vector in arguments]

    def __bool__(self) -> bool:
        return self._step is not None

    def __eq__(self, other: object) -> bool:
        """Equal paths lead through the same nodes; two instances of one node are not equal."""
        if not isinstance(other, PathBase):
            return NotImplemented
        return same_path(self._step, other._step)

    def __hash__(self) -> int:
        # Not the whole path: a path must stay in its dict when something above it is moved.
        return 0 if self._step is None else hash(self._step.node)

    def __str__(self) -> str:
        return "(empty)" if self._step is None else self._step.names()

    def __repr__(self) -> str:
        return f"NodePath({self})"
