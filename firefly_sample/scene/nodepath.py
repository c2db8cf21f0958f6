"""NodePath: the handle to a place in the scene graph, with Panda3D's names and semantics."""

from __future__ import annotations

import copy
from typing import Any, Self

from firefly_sample.scene import path as paths
from firefly_sample.scene.find import find_paths
from firefly_sample.scene.node import PandaNode, tight_bounds
from firefly_sample.scene.path_attributes import PathAttributes
from firefly_sample.scene.path_components import PathComponents
from firefly_sample.scene.transforms import Float64


class NodePath(PathComponents, PathAttributes):
    """A place in the scene graph: a node, and the way down to it from a top node.

    A node that hangs under several parents has several NodePaths. Transforms and attributes belong to
    the node and are seen from all of them; the parent, and with it everything net or relative, belongs
    to the path. Paths to one place stay equal when the place is moved; equal paths have equal hashes.

    ``copy.deepcopy(path)`` gives the path to a copy of the node and of all below it, without parents, and
    ``copy.copy(path)`` one to a second node with the same children, both as in Panda3D. Paths within
    something else that is copied, a Scene or a list, and paths that are pickled bring the whole tree that
    they are in: they lead to the same places of one copy of it. See `PandaNode`.

    Parameters
    ----------
    name_or_node : str, PandaNode or None
        A new node of this name; or a node that exists, reached through its oldest parents; or nothing:
        an empty path, which is false, and most of whose methods raise NodeError.
    """

    __slots__ = ()

    def __init__(self, name_or_node: str | PandaNode | None = None) -> None:
        if name_or_node is None:
            self._step = None
        else:
            node = name_or_node if isinstance(name_or_node, PandaNode) else PandaNode(name_or_node)
            self._step = paths.step_to(node)

    # --- Python's copies ---

    def __copy__(self) -> Self:
        return self._at(None if self._step is None else paths.step_to(copy.copy(self._step.node)))

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        if memo or self._step is None:
            return self._at(copy.deepcopy(self._step, memo))
        return self._at(paths.step_to(copy.deepcopy(self._step.node, memo)))

    # --- Building ---

    def attach_new_node(self, node: str | PandaNode, sort: int = 0) -> Self:
        """Put a node below this one: a new one of that name, or one that exists.

        Children are kept in the order of `sort`, equal ones in the order of their coming. A node that
        hangs elsewhere already hangs there still: it is instanced. An empty path makes a new root.

        Raises
        ------
        NodeError
            If `node` is this node or above it.
        """
        if not isinstance(node, PandaNode):
            node = PandaNode(node)
        if self._step is None:
            return self._at(paths.step_to(node))
        return self._at(paths.attach(self._step, node, sort))

    def reparent_to(self, other: NodePath, sort: int = 0) -> None:
        """Move this place below `other`; the local transform stays, so the node may jump.

        An empty `other` detaches.

        Raises
        ------
        NodeError
            On a cycle, or if another instance of the node is below `other` already.
        """
        step = self._place()
        if other._step is None:
            paths.detach(step)
        else:
            paths.reparent(step, other._step, sort)

    def wrt_reparent_to(self, other: NodePath, sort: int = 0) -> None:
        """Move this place below `other` and change the local transform so that the net one stays.

        Raises
        ------
        NodeError
            As `reparent_to`, or if the two have no common root or `other` flattens space.
        """
        transform = self.get_transform(other)
        self.reparent_to(other, sort)
        self.node().set_transform(transform)

    def instance_to(self, other: NodePath, sort: int = 0) -> Self:
        """Let the node hang below `other` as well, and give the path there.

        Raises
        ------
        NodeError
            On a cycle.
        """
        return self._at(paths.instance(other._place(), self.node(), sort))

    def copy_to(self, other: NodePath, sort: int = 0) -> Self:
        """Put a copy of the node and of everything below it under `other`.

        Nodes are copied, each once, so that what is instanced within the copy is so again; Geoms,
        textures, materials and lenses are shared.
        """
        copies: dict[PandaNode, PandaNode] = {}
        originals = list(self.node().iter_descendants())
        for original in originals:
            copies[original] = original.make_copy()
        for original in originals:
            for child in original.children:
                copies[original].add_child(copies[child], original.get_child_sort(child))
        if other._step is None:
            return self._at(paths.step_to(copies[self.node()]))
        return self._at(paths.instance(other._step, copies[self.node()], sort))

    def detach_node(self) -> None:
        """Take this place out of the graph and keep the node; the path now leads to it as a root."""
        paths.detach(self._place())

    def remove_node(self) -> None:
        """Take this place out of the graph and empty this path."""
        paths.detach(self._place())
        self._step = None

    # --- Looking around ---

    def get_parent(self) -> Self:
        """The path to the parent; empty at a root."""
        return self._at(self._step.parent if self._step is not None else None)

    def has_parent(self) -> bool:
        """Whether there is a node above."""
        return self._step is not None and self._step.parent is not None

    def get_top(self) -> Self:
        """The path to the root of this tree."""
        return self.get_ancestors()[-1] if self._step is not None else self._at(None)

    def get_ancestors(self) -> list[Self]:
        """The paths to this node, its parent, and so on up to the root."""
        return [self._at(step) for step in self._step.upwards()] if self._step is not None else []

    def is_ancestor_of(self, other: NodePath) -> bool:
        """Whether the way down to `other` goes through this place; true of itself."""
        node = self.node()
        return any(place.node() is node and place == self for place in other.get_ancestors())

    def get_common_ancestor(self, other: NodePath) -> Self:
        """The lowest place that both paths go through; empty if they are in different trees."""
        if self._step is None or other._step is None:
            return self._at(None)
        return self._at(paths.common_ancestor(self._step, other._step))

    def get_children(self) -> list[Self]:
        """The paths to the children, in order."""
        step = self._place()
        return [self._at(step.child(node)) for node in step.node.children]

    def get_num_children(self) -> int:
        """How many children the node has."""
        return len(self.node().children)

    def get_child(self, index: int) -> Self:
        """The path to the child number `index`, from 0.

        Raises
        ------
        NodeError
            If there is no such child.
        """
        step = self._place()
        if not 0 <= index < len(step.node.children):
            raise self._error(f"has {len(step.node.children)} children, there is no number {index}")
        return self._at(step.child(step.node.children[index]))

    def get_sort(self) -> int:
        """The sort number under which the node hangs in its parent; 0 at a root."""
        step = self._place()
        return step.parent.node.get_child_sort(step.node) if step.parent is not None else 0

    def find(self, pattern: str) -> Self:
        """The first of `find_all_matches`; an empty path if nothing matches."""
        return self._at(next(find_paths(self._place(), pattern), None))

    def find_all_matches(self, pattern: str) -> list[Self]:
        """Every place below this one that a pattern describes; see `firefly_sample.scene.find`.

        Raises
        ------
        NodeError
            If the pattern has an element that is not supported; it names the element.
        """
        return [self._at(step) for step in find_paths(self._place(), pattern)]

    def get_tight_bounds(self, other: NodePath | None = None) -> tuple[Float64, Float64] | None:
        """The box (minimum, maximum) of the vertices at and below this node, hidden ones too.

        In the parent's space, or in that of `other`; None where there are no vertices.
        """
        return tight_bounds(self.node(), self.get_transform(other).get_mat())
