"""PathStep: a node of the scene graph as reached from a root, by one of the ways that lead to it."""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from firefly_sample.scene.node import PandaNode


class PathStep:
    """A node as reached through a parent step, or as the root of a path.

    There is one step for each (parent step, node), so every NodePath to it follows when the node is moved.
    """

    __slots__ = ("__weakref__", "_below", "node", "parent")

    def __init__(self, node: PandaNode, parent: PathStep | None) -> None:
        self.node = node
        self.parent: PathStep | None = None
        self._below: weakref.WeakValueDictionary[PandaNode, PathStep] | None = None
        node._steps.add(self)
        if parent is not None:
            self.move_below(parent)

    def move_below(self, parent: PathStep | None) -> None:
        """Make `parent` the step above this one; None makes this one a root."""
        siblings = self.parent._below if self.parent is not None else None
        if siblings is not None and siblings.get(self.node) is self:
            del siblings[self.node]
        self.parent = parent
        if parent is not None:
            if parent._below is None:
                parent._below = weakref.WeakValueDictionary()
            parent._below[self.node] = self

    def known_child(self, node: PandaNode) -> PathStep | None:
        """Return the step from here to a child node, if a path has needed it already."""
        return self._below.get(node) if self._below is not None else None

    def child(self, node: PandaNode) -> PathStep:
        """Return the step from here to a child node."""
        step = self.known_child(node)
        return step if step is not None else PathStep(node, self)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle all steps above too, so that paths into one tree lead into one copy of it."""
        return step_at, (self.node, self.parent)

    def top(self) -> PandaNode:
        """Return the root that the path leads from."""
        *_, step = self.upwards()
        return step.node

    def upwards(self) -> Iterator[PathStep]:
        """Yield this step, the one above it, and so on up to the root."""
        step: PathStep | None = self
        while step is not None:
            yield step
            step = step.parent


def step_at(node: PandaNode, parent: PathStep | None = None) -> PathStep:
    """Return the step to a node from a parent step, or that of a path which begins at the node."""
    if parent is not None:
        return parent.child(node)
    return next((step for step in node._steps if step.parent is None), None) or PathStep(node, None)


def step_to(node: PandaNode) -> PathStep:
    """Return the path down to `node`, through the oldest parent wherever there are several."""
    nodes = [node]
    while parents := nodes[-1].parents:
        nodes.append(parents[0])
    step = step_at(nodes.pop())
    while nodes:
        step = step.child(nodes.pop())
    return step
