"""Plain functions on the steps of paths: what `NodePath` does to the graph.

A node may have several parents, so a path is not a node but a chain of `PathStep`s from a root down to one.
"""

from __future__ import annotations

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.node import PandaNode, PathStep, root_step
from firefly_sample.scene.transform_state import IDENTITY, TransformState


def step_to(node: PandaNode) -> PathStep:
    """Return the path down to `node`, through the oldest parent wherever there are several."""
    nodes = [node]
    while parents := nodes[-1].parents:
        nodes.append(parents[0])
    step = root_step(nodes.pop())
    while nodes:
        step = step.child(nodes.pop())
    return step


def same_path(a: PathStep | None, b: PathStep | None) -> bool:
    """Return whether two paths go through the same nodes."""
    while a is not b:
        if a is None or b is None or a.node is not b.node:
            return False
        a, b = a.parent, b.parent
    return True


def common_ancestor(a: PathStep, b: PathStep) -> PathStep | None:
    """Return the lowest step that both paths go through, None if they have different roots."""
    common = None
    for step_a, step_b in zip(reversed(list(a.upwards())), reversed(list(b.upwards())), strict=False):
        if step_a.node is not step_b.node:
            break
        common = step_a
    return common


def attach(parent: PathStep, node: PandaNode, sort: int) -> PathStep:
    """Put `node` below `parent`; paths that began at `node` now come down through `parent`."""
    roots = [step for step in node._steps if step.parent is None]
    parent.node.add_child(node, sort)
    existing = parent.known_child(node)
    if existing is not None:
        return existing
    for step in roots:
        step.move_below(parent)
    return roots[0] if roots else parent.child(node)


def instance(parent: PathStep, node: PandaNode, sort: int) -> PathStep:
    """Put `node` below `parent` in addition to its other parents; existing paths stay as they are.

    If it is a child of `parent` already, it keeps its sort number, as in Panda3D.
    """
    if parent.node not in node.parents:
        parent.node.add_child(node, sort)
    return parent.child(node)


def reparent(step: PathStep, parent: PathStep, sort: int) -> None:
    """Move the node at `step` from its old parent to `parent`; its other parents keep it.

    Raises
    ------
    NodeError
        On a cycle, or if another instance of the node is below `parent` already.
    """
    node, old = step.node, step.parent
    if (old is None or old.node is not parent.node) and parent.node in node.parents:
        raise NodeError(
            f"node {step.names()!r} cannot move below {parent.names()!r}: another instance of it is there"
        )
    parent.node.add_child(node, sort)  # this may raise, so it comes first: then nothing has changed
    if old is not None and old.node is not parent.node:
        old.node.remove_child(node)
    step.move_below(parent)


def detach(step: PathStep) -> None:
    """Remove the node at `step` from its parent; `step` becomes the root of its own path."""
    if step.parent is not None:
        step.parent.node.remove_child(step.node)


def transform_between(top: PathStep | None, step: PathStep | None) -> TransformState:
    """Return the transform from the space of `step` to that of `top` above it; None is the world."""
    chain: list[TransformState] = []
    while step is not None and (top is None or step.node is not top.node):
        if not step.node.transform.is_identity:
            chain.append(step.node.transform)
        step = step.parent
    result = IDENTITY
    for transform in reversed(chain):
        result = result.compose(transform)
    return result


def net_matrix(step: PathStep | None) -> Float64:
    """Return the 4x4 matrix from the space of `step` to the world; identity for None. Read only."""
    result: Float64 | None = None
    while step is not None:
        transform = step.node.transform
        if not transform.is_identity:
            result = transform.get_mat() if result is None else result @ transform.get_mat()
        step = step.parent
    return IDENTITY.get_mat() if result is None else result
