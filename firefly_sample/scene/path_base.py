"""The base of `firefly_sample.scene.nodepath.NodePath`: the path itself, and the reading of arguments."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from typing import Any, Self

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import as_numbers
from firefly_sample.scene.camel_case import CamelCase
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.path_step import PathStep, step_to
from firefly_sample.scene.transforms import Vec3
from firefly_sample.settings import number_or_none


class PathBase(CamelCase):
    """A path to a node, or an empty one; see `firefly_sample.scene.nodepath.NodePath`."""

    __slots__ = ("_step",)

    _step: PathStep | None

    def __init__(self, name_or_node: str | PandaNode | None = None) -> None:
        self._step = None
        if name_or_node is not None:
            node = name_or_node if isinstance(name_or_node, PandaNode) else PandaNode(name_or_node)
            self._step = step_to(node)

    def is_empty(self) -> bool:
        """Return whether this path leads to no node."""
        return self._step is None

    def node(self) -> PandaNode:
        """Return the node that the path leads to."""
        return self._existing().node

    def __bool__(self) -> bool:
        return self._step is not None

    def __eq__(self, other: object) -> bool:
        """Return whether both lead through the same nodes; two instances of one node are not equal."""
        if not isinstance(other, PathBase):
            return NotImplemented
        a, b = self._step, other._step
        while a is not b:
            if a is None or b is None or a.node is not b.node:
                return False
            a, b = a.parent, b.parent
        return True

    def __hash__(self) -> int:
        # Only the node: a path must stay in its dict when a node above it is moved.
        return 0 if self._step is None else hash(self._step.node)

    def __str__(self) -> str:
        if self._step is None:
            return "(empty)"
        return "/".join(step.node.name for step in reversed(list(self._step.upwards())))

    def __repr__(self) -> str:
        return f"NodePath({self})"

    # --- Python's copies ---

    def __copy__(self) -> Self:
        return self._at(None if self._step is None else step_to(copy.copy(self._step.node)))

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        if memo or self._step is None:
            return self._at(copy.deepcopy(self._step, memo))
        return self._at(step_to(copy.deepcopy(self._step.node, memo)))

    def get_parent(self) -> Self:
        """Return the path to the parent; empty at a root."""
        return self._at(self._step.parent if self._step is not None else None)

    # --- Private ---

    @classmethod
    def _at(cls, step: PathStep | None) -> Self:
        path = cls.__new__(cls)
        path._step = step
        return path

    def _existing(self) -> PathStep:
        """Return the step that the path leads to; raise NodeError if the path is empty."""
        if self._step is None:
            raise NodeError("this NodePath is empty: it was removed, not found, or made without a node")
        return self._step

    def _error(self, message: str) -> NodeError:
        return NodeError(f"node {str(self)!r}: {message}")

    def _numbers(self, what: str, count: int, arguments: Sequence[Any]) -> tuple[float, ...]:
        """Return `count` finite floats that were given one by one or as one sequence."""
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
        """Return `count` vectors that were given as sequences or as one long row of numbers."""
        if len(arguments) == 3 * count:
            arguments = [arguments[index : index + 3] for index in range(0, 3 * count, 3)]
        if len(arguments) != count:
            raise self._error(
                f"{what} takes {count} vectors or {3 * count} numbers, got {len(arguments)} of them"
            )
        return [self._vec3(what, (vector,)) for vector in arguments]

    def _split(self, arguments: tuple[Any, ...]) -> tuple[Self | None, tuple[Any, ...]]:
        """Return (other, the rest) if the first argument is a path, else (None, all)."""
        is_path = bool(arguments) and isinstance(arguments[0], PathBase)
        return (arguments[0], arguments[1:]) if is_path else (None, arguments)
