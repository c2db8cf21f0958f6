"""NodePath: the handle to a node in the scene graph, with Panda3D's names and semantics."""

from __future__ import annotations

from typing import Self

import numpy as np

from firefly_sample.errors import NodeError
from firefly_sample.scene.color_scale import ColorScales
from firefly_sample.scene.depth_offset import DepthOffsets
from firefly_sample.scene.find import find_paths
from firefly_sample.scene.listing import tree_lines
from firefly_sample.scene.node import PandaNode, copy_nodes
from firefly_sample.scene.path_collection import NodePathCollection
from firefly_sample.scene.path_colors import PathColors
from firefly_sample.scene.path_lights import PathLights
from firefly_sample.scene.path_notes import PathNotes
from firefly_sample.scene.path_numbers import PathNumbers
from firefly_sample.scene.path_step import step_to
from firefly_sample.scene.path_tags import PathTags
from firefly_sample.scene.path_transforms import common_step
from firefly_sample.scene.path_visibility import PathVisibility
from firefly_sample.scene.render_mode import RenderModes
from firefly_sample.scene.vector import Vector


class NodePath(
    PathNumbers,
    PathVisibility,
    PathColors,
    PathLights,
    PathTags,
    PathNotes,
    RenderModes,
    DepthOffsets,
    ColorScales,
):
    """A handle to a node, reached along one path from a root of the scene graph.

    A node with several parents has several NodePaths. Transforms and attributes belong to the node, so they
    are the same from all of them; the parent, and with it everything net or relative, belongs to the path.
    NodePaths along the same path stay equal when the node is moved; equal ones have equal hashes.

    Setters of transforms take their numbers one by one or as one sequence, and optionally a NodePath before
    them: then the numbers are in that node's space. As in Panda3D, a relative setter keeps the other local
    components, so ``set_pos(other, p)`` does not turn the node. Getters return float64 arrays, in the
    parent's space or in that of the NodePath given. Angles are degrees, quaternions (w, x, y, z). An empty
    NodePath as the other one stands for the space above the root.

    ``copy.deepcopy(path)`` returns the path to a copy of the node and of everything below it, without
    parents, and ``copy.copy(path)`` one to a second node with the same children, both as in Panda3D. A
    NodePath that is copied as part of something else, a Scene or a list, or that is pickled, brings its whole
    tree along: all of them lead into one copy of it. See `PandaNode`.

    Parameters
    ----------
    name_or_node : str, PandaNode or None
        The name of a new node; or an existing node, reached through its oldest parents; or None for an empty
        path, which is false.

    Raises
    ------
    NodeError
        By most methods if the path is empty; by those that move a node if it would come below itself; by
        transforms if a number is not finite, if the two nodes have no common root, or if a singular matrix
        would have to be inverted. The message names the node.
    """

    __slots__ = ()

    # --- Building ---

    def attach_new_node(self, node: str | PandaNode, sort: int = 0) -> Self:
        """Add a child, a new node of that name or an existing one, and return the path to it.

        Children are ordered by `sort`, and those of equal `sort` by when they were added. A node that has
        another parent keeps it: it is instanced. For an empty path the node becomes a root.
        """
        if not isinstance(node, PandaNode):
            node = PandaNode(node)
        above = self._step
        if above is None:
            return self._at(step_to(node))
        roots = [step for step in node._steps if step.parent is None]
        above.node.add_child(node, sort)
        if above.known_child(node) is None:
            for step in roots:  # paths that began at the node now come down through this one
                step.move_below(above)
        return self._at(above.child(node))

    def reparent_to(self, other: NodePath, sort: int = 0) -> None:
        """Make `other` the parent; the local transform stays, so the node may jump.

        An empty `other` detaches the node. Another instance of the node must not be below `other` already.
        """
        step, above = self._existing(), other._step
        if above is None:
            self.detach_node()
            return
        node, old = step.node, step.parent
        moves = old is None or old.node is not above.node
        if moves and above.node in node.parents:
            raise NodeError(
                f"node {str(self)!r} cannot move below {str(other)!r}: another instance of it is there"
            )
        above.node.add_child(node, sort)  # this may raise, so it comes first: then nothing has changed
        if moves and old is not None:
            old.node.remove_child(node)
        step.move_below(above)

    def wrt_reparent_to(self, other: NodePath, sort: int = 0) -> None:
        """Make `other` the parent and change the local transform so that the net one stays."""
        transform = self.get_transform(other)
        self.reparent_to(other, sort)
        self.node().set_transform(transform)

    def instance_to(self, other: NodePath, sort: int = 0) -> Self:
        """Add the node to the children of `other` as well, and return the path there.

        If it is one of them already, it keeps its sort number, as in Panda3D.
        """
        node, above = self.node(), other._existing()
        if above.node not in node.parents:
            above.node.add_child(node, sort)
        return self._at(above.child(node))

    def copy_to(self, other: NodePath, sort: int = 0) -> Self:
        """Add a copy of the node and of everything below it to `other`, and return the path to it.

        Each node is copied once, so nodes that are instanced below this one are instanced in the copy too.
        Geoms, textures, materials and lenses are shared, except for the Geoms that a copied model moves: see
        `firefly_sample.model.root.ModelRoot`.
        """
        top = self._at(step_to(copy_nodes(self.node())[self.node()]))
        return top if other._step is None else top.instance_to(other, sort)

    def detach_node(self) -> None:
        """Remove the node from its parent; the path now leads to it as a root."""
        step = self._existing()
        if step.parent is not None:
            step.parent.node.remove_child(step.node)

    def remove_node(self) -> None:
        """Remove the node from its parent and empty this path."""
        self.detach_node()
        self._step = None

    # --- Parents and children ---

    def has_parent(self) -> bool:
        """Return whether there is a parent."""
        return self._step is not None and self._step.parent is not None

    def get_top(self) -> Self:
        """Return the path to the root of this tree."""
        return self.get_ancestors()[-1] if self._step is not None else self._at(None)

    def get_ancestors(self) -> list[Self]:
        """Return the paths to this node, its parent, and so on up to the root."""
        return [self._at(step) for step in self._step.upwards()] if self._step is not None else []

    def is_ancestor_of(self, other: NodePath) -> bool:
        """Return whether the path to `other` leads through this one; true for itself."""
        node = self.node()
        return any(above.node() is node and above == self for above in other.get_ancestors())

    def get_common_ancestor(self, other: NodePath) -> Self:
        """Return the path to the lowest node that both lead through; empty if they have different roots."""
        if self._step is None or other._step is None:
            return self._at(None)
        return self._at(common_step(self._step, other._step))

    @property
    def parent(self) -> Self | None:
        """The path to the parent, None at a root."""
        return self.get_parent() if self.has_parent() else None

    @property
    def children(self) -> NodePathCollection:
        """The paths to the children, in order."""
        return self.get_children()

    @property
    def ancestors(self) -> list[Self]:
        """The paths to this node, its parent, and so on up to the root."""
        return self.get_ancestors()

    @property
    def nodes(self) -> list[PandaNode]:
        """The nodes of the path: this one, its parent, and so on up to the root."""
        return [step.node for step in self._step.upwards()] if self._step is not None else []

    @property
    def sort(self) -> int:
        """The sort number that the node has in its parent; 0 at a root."""
        return self.get_sort()

    def get_num_nodes(self) -> int:
        """Return the number of nodes of the path."""
        return len(self.nodes)

    def get_node(self, index: int) -> PandaNode:
        """Return a node of the path: 0 is this one, 1 its parent. IndexError if there is none."""
        return self.nodes[index]

    def get_ancestor(self, index: int) -> Self:
        """Return the path to a node above: 0 is this one, 1 its parent. IndexError if there is none."""
        return self.get_ancestors()[index]

    def get_top_node(self) -> PandaNode:
        """Return the root of this tree."""
        return self.get_top().node()

    def is_same_graph(self, other: NodePath) -> bool:
        """Return whether both have the same root; two empty paths have."""
        return self.get_top() == other.get_top()

    def is_singleton(self) -> bool:
        """Return whether the path is one node without a parent."""
        return self._step is not None and self._step.parent is None

    def count_num_descendants(self) -> int:
        """Return the number of nodes at and below this one, each as often as paths lead to it."""
        return self.node().count_num_descendants()

    @classmethod
    def any_path(cls, node: PandaNode) -> Self:
        """Return a path to a node, through the oldest parent wherever there are several."""
        return cls(node)

    def get_children(self) -> NodePathCollection:
        """Return the paths to the children, in order."""
        step = self._existing()
        return NodePathCollection(self._at(step.child(node)) for node in step.node.children)

    def get_num_children(self) -> int:
        """Return the number of children."""
        return len(self.node().children)

    def get_child(self, index: int) -> Self:
        """Return the path to the child number `index`, from 0."""
        step = self._existing()
        if not 0 <= index < len(step.node.children):
            raise self._error(f"has {len(step.node.children)} children, there is no number {index}")
        return self._at(step.child(step.node.children[index]))

    def get_sort(self) -> int:
        """Return the sort number that the node has in its parent; 0 at a root."""
        step = self._existing()
        return step.parent.node.get_child_sort(step.node) if step.parent is not None else 0

    def find(self, pattern: str) -> Self:
        """Return the first of `find_all_matches`; an empty path if nothing matches."""
        return self._at(next(find_paths(self._existing(), pattern), None))

    def find_all_matches(self, pattern: str) -> NodePathCollection:
        """Return all paths that begin here and match a pattern; see `firefly_sample.scene.find`."""
        return NodePathCollection(self._at(step) for step in find_paths(self._existing(), pattern))

    def get_tight_bounds(self, other: NodePath | None = None) -> tuple[Vector, Vector] | None:
        """Return the box (minimum, maximum) of the vertices at and below this node, hidden ones too.

        In the parent's space, or in that of `other`; None if there are no vertices.
        """
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        waiting = [(self.node(), self.get_transform(other).get_mat())]
        while waiting:
            node, net = waiting.pop()
            for points in node.iter_local_points():
                if len(points):
                    moved = points @ net[:3, :3] + net[3, :3]
                    low = np.minimum(low, moved.min(axis=0))
                    high = np.maximum(high, moved.max(axis=0))
            for child in node.children:
                local = child.transform
                waiting.append((child, net if local.is_identity() else local.get_mat() @ net))
        return (Vector(low), Vector(high)) if np.isfinite(low).all() else None

    def ls(self) -> None:
        """Print the graph at and below this node; see `firefly_sample.scene.listing`."""
        print("\n".join(tree_lines(self.node())))

    # --- Name ---

    @property
    def name(self) -> str:
        """The node's name."""
        return self.node().name

    @name.setter
    def name(self, name: str) -> None:
        self.node().set_name(name)

    def get_name(self) -> str:
        """Return the node's name."""
        return self.node().name

    def set_name(self, name: str) -> None:
        """Rename the node."""
        self.node().set_name(name)
