"""One way down to a node: the steps that NodePaths share.

A node may hang under several parents, so a place in the graph is not a node but a chain of steps from a
top node down to it. There is one step object for each (parent step, node), so that every NodePath to the
same place sees it when that place moves.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from typing import Any

from firefly_sample.errors import NodeError
from firefly_sample.scene.node import PandaNode


class PathStep:
    """A node as reached through a parent step, or as the top of its path."""

    __slots__ = ("__weakref__", "_below", "node", "parent")

    def __init__(self, node: PandaNode, parent: PathStep | None) -> None:
        self.node = node
        self.parent: PathStep | None = None
        self._below: weakref.WeakValueDictionary[PandaNode, PathStep] | None = None
        node._steps.add(self)
        if parent is not None:
            self.move_below(parent)

    def move_below(self, parent: PathStep | None) -> None:
        """Continue upwards through `parent` from now on, or be a top."""
        siblings = self.parent._below if self.parent is not None else None
        if siblings is not None and siblings.get(self.node) is self:
            del siblings[self.node]
        self.parent = parent
        if parent is not None:
            if parent._below is None:
                parent._below = weakref.WeakValueDictionary()
            parent._below[self.node] = self

    def child(self, node: PandaNode) -> PathStep:
        """The step from here to a child node."""
        step = self._below.get(node) if self._below is not None else None
        return step if step is not None else PathStep(node, self)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copied and pickled with all that is above, so that paths into one tree lead into one copy of it."""
        return _copied_step, (self.node, self.parent)

    def upwards(self) -> Iterator[PathStep]:
        """Begin here, then the parent, and so on to the top."""
        step: PathStep | None = self
        while step is not None:
            yield step
            step = step.parent

    def names(self) -> str:
        """The names from the top down to here, joined by slashes."""
        return "/".join(step.node.name for step in reversed(list(self.upwards())))


def _top_step(node: PandaNode) -> PathStep:
    """The step of a path that begins at `node`."""
    return next((step for step in node._steps if step.parent is None), None) or PathStep(node, None)


def _copied_step(node: PandaNode, parent: PathStep | None) -> PathStep:
    return _top_step(node) if parent is None else parent.child(node)


def step_to(node: PandaNode) -> PathStep:
    """A path down to `node`: through the oldest parent wherever there are several."""
    nodes = [node]
    while parents := nodes[-1].parents:
        nodes.append(parents[0])
    step = _top_step(nodes.pop())
    while nodes:
        step = step.child(nodes.pop())
    return step


def same_path(a: PathStep | None, b: PathStep | None) -> bool:
    """Whether two chains go through the same nodes."""
    while a is not b:
        if a is None or b is None or a.node is not b.node:
            return False
        a, b = a.parent, b.parent
    return True


def attach(parent: PathStep, node: PandaNode, sort: int) -> PathStep:
    """Put `node` below `parent`; paths that began at `node` now come down through `parent`."""
    tops = [step for step in node._steps if step.parent is None]
    parent.node.add_child(node, sort)
    existing = parent._below.get(node) if parent._below is not None else None
    if existing is not None:
        return existing
    for step in tops:
        step.move_below(parent)
    return tops[0] if tops else parent.child(node)


def instance(parent: PathStep, node: PandaNode, sort: int) -> PathStep:
    """Put `node` below `parent` as well as wherever it is; existing paths stay as they are.

    Where it is a child already it stays in its place, as in Panda3D.
    """
    if parent.node not in node.parents:
        parent.node.add_child(node, sort)
    return parent.child(node)


def reparent(step: PathStep, parent: PathStep, sort: int) -> None:
    """Move the place `step` below `parent`, away from its old parent; other instances stay.

    Raises
    ------
    NodeError
        On a cycle, or if another instance of the node hangs below `parent` already.
    """
    node = step.node
    old = step.parent
    if (old is None or old.node is not parent.node) and parent.node in node.parents:
        raise NodeError(
            f"node {step.names()!r} cannot move below {parent.names()!r}: another instance of it is there"
        )
    parent.node.add_child(node, sort)  # First what may fail, so that a refused move leaves all in place.
    if old is not None and old.node is not parent.node:
        old.node.remove_child(node)
    step.move_below(parent)


def detach(step: PathStep) -> None:
    """Take the place `step` out of the graph; it becomes the top of its own path."""
    if step.parent is not None:
        step.parent.node.remove_child(step.node)


def common_ancestor(a: PathStep, b: PathStep) -> PathStep | None:
    """The lowest step that both paths go through, None if they have different tops."""
    chain_a, chain_b = list(a.upwards()), list(b.upwards())
    common = None
    for step_a, step_b in zip(reversed(chain_a), reversed(chain_b), strict=False):
        if step_a.node is not step_b.node:
            break
        common = step_a
    return common
