"""PandaNode, a node of the scene graph.

Users handle nodes through `firefly_sample.scene.nodepath.NodePath`.
"""

from __future__ import annotations

import copy
import weakref
from bisect import bisect, bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self, TypeVar

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.camel_case import CamelCase
from firefly_sample.scene.material import Material
from firefly_sample.scene.tags import Tags
from firefly_sample.scene.transform_state import IDENTITY, TransformState

if TYPE_CHECKING:
    from firefly_sample.scene.color_scale import ColorScale
    from firefly_sample.scene.depth_offset import DepthOffset
    from firefly_sample.scene.path_step import PathStep
    from firefly_sample.scene.render_mode import RenderMode
    from firefly_sample.scene.surface_overrides import SurfaceOverrides

Color = tuple[float, float, float, float]

OVERALL_BIT = 1 << 31
"""The bit that ``hide()`` without a mask uses: hidden from every camera, whatever its mask."""
ALL_CAMERAS = OVERALL_BIT - 1
"""The 31 bits by which nodes are hidden from some cameras and not from others."""
_ALL_BITS = OVERALL_BIT | ALL_CAMERAS
_LINKS = {"_children", "_sorts", "_parents", "_steps", "_ranks"}
"""Attributes that link a node to other nodes and to paths."""
_Value = TypeVar("_Value")


class PandaNode(Tags, CamelCase):
    """A node with a name, which need not be unique, a transform, attributes, and any number of parents.

    Attributes
    ----------
    transform : TransformState
        To the space of each parent; change it with `set_transform`.
    flat_color, flat_color_priority : (r, g, b, a) or None, int
        Linear colour that replaces those of this node and below; see `NodePath.set_color`.
    color_scale : ColorScale or None
        See `firefly_sample.scene.color_scale`.
    material, material_priority : Material or None, int
        A material that replaces those of the Geoms at this node and below.
    render_mode, render_mode_priority : RenderMode or None, int
        See `firefly_sample.scene.render_mode`.
    depth_offset : DepthOffset or None
        See `firefly_sample.scene.depth_offset`.
    overrides : SurfaceOverrides or None
        Parts of materials that this node replaces; see `firefly_sample.scene.surface_overrides`.
    draw_control, draw_show : int
        Camera bits that this node decides, and of those the ones that see it; see `NodePath.hide`.
    tags : dict of str to str
    python_tags : dict of str to any value
    warnings : tuple of str
        A line for each thing about this node that is not drawn, which every frame with the node repeats.
    revision, subtree_revision : int
        Grow with each change of the node itself, and of it or any node below it: transforms, attributes,
        contents, children.

    Raises
    ------
    NodeError
        By methods, if a node is not a child of this one, or if adding a child would make a cycle.

    Notes
    -----
    ``copy.deepcopy`` and ``pickle`` copy the node, without parents, and everything below it, including Geoms,
    materials, textures and lenses. ``copy.copy`` returns a second node with the same children, as in Panda3D.
    `NodePath.copy_to` copies nodes only. A function that a node calls is shared by all copies, and pickle
    must be able to find it by its name; for a bound method, the object is copied. Pickle recurses down the
    tree: one that is deeper than 150 nodes needs ``sys.setrecursionlimit``.
    """

    warnings: tuple[str, ...] = ()
    overrides: SurfaceOverrides | None = None
    _parents: list[weakref.ref[PandaNode]]
    _steps: weakref.WeakSet[PathStep]

    def __new__(cls, *_: Any, **__: Any) -> Self:
        """Create a node that can be linked before it has contents, as needed while a graph is copied."""
        node = super().__new__(cls)
        # Strong references downwards and weak ones upwards, so that an unused scene is freed at once,
        # including its textures, without waiting for the cycle collector.
        node._parents = []
        node._steps = weakref.WeakSet()
        return node

    def __init__(self, name: str) -> None:
        if not isinstance(name, str):
            raise NodeError(f"a node's name must be text, got {name!r}")
        self.name = name
        self.transform: TransformState = IDENTITY
        self.flat_color: Color | None = None
        self.flat_color_priority = 0
        self.color_scale: ColorScale | None = None
        self.material: Material | None = None
        self.material_priority = 0
        self.render_mode: RenderMode | None = None
        self.render_mode_priority = 0
        self.depth_offset: DepthOffset | None = None
        self.draw_control = 0
        self.draw_show = _ALL_BITS
        self.tags: dict[str, str] = {}
        self.python_tags: dict[str, Any] = {}
        self.revision = 0
        self.subtree_revision = 0
        self._children: list[PandaNode] = []
        self._sorts: list[int] = []

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r})"

    @property
    def children(self) -> Sequence[PandaNode]:
        """The children, ordered by `sort` and then by when they were added."""
        return self._children

    @property
    def parents(self) -> list[PandaNode]:
        """The parents, oldest first; several if the node is instanced."""
        return [parent for reference in self._parents if (parent := reference()) is not None]

    def get_name(self) -> str:
        """Return the name."""
        return self.name

    def set_name(self, name: str) -> None:
        """Rename the node. NodeError if the name is not text."""
        if not isinstance(name, str):
            raise NodeError(f"node {self.name!r}: set_name takes text, got {name!r}")
        self.name = name
        self.mark_changed()

    def get_children(self) -> tuple[PandaNode, ...]:
        """Return the children, in order."""
        return tuple(self._children)

    def get_num_children(self) -> int:
        """Return the number of children."""
        return len(self._children)

    def get_child(self, index: int) -> PandaNode:
        """Return the child number `index`, from 0. IndexError if there is none."""
        return self._children[index]

    def find_child(self, child: PandaNode) -> int:
        """Return the number of a child among the children, -1 if it is none."""
        return self._children.index(child) if child in self._children else -1

    def get_parents(self) -> tuple[PandaNode, ...]:
        """Return the parents, oldest first."""
        return tuple(self.parents)

    def get_num_parents(self) -> int:
        """Return the number of parents."""
        return len(self.parents)

    def get_parent(self, index: int) -> PandaNode:
        """Return the parent number `index`, from 0, oldest first. IndexError if there is none."""
        return self.parents[index]

    def get_child_sort(self, child: PandaNode) -> int:
        """Return the sort number with which `child` was added."""
        return self._sorts[self._index_of(child)]

    def add_child(self, child: PandaNode, sort: int = 0) -> None:
        """Add a child, after all children of the same or a smaller `sort`.

        A node that is a child already is moved to its new position among them. Paths that begin at `child`
        still do so afterwards; `NodePath.attach_new_node` makes them continue through this node.
        """
        if child is self or (child._children and child in self.iter_ancestors()):
            raise NodeError(
                f"node {child.name!r} cannot go below {self.name!r}, which is itself or below it: "
                "that would be a cycle"
            )
        if self in child.parents:
            self._unlink(child)
        index = bisect_right(self._sorts, sort)
        self._children.insert(index, child)
        self._sorts.insert(index, sort)
        child._parents.append(weakref.ref(self))
        self.mark_changed()

    def remove_child(self, child: PandaNode) -> None:
        """Remove a child. Paths through this node to `child` now begin at `child`."""
        self._unlink(child)
        for step in list(child._steps):
            if step.parent is not None and step.parent.node is self:
                step.move_below(None)
        self.mark_changed()

    def remove_all_children(self) -> None:
        """Remove all children."""
        for child in list(self._children):
            self.remove_child(child)

    def _unlink(self, child: PandaNode) -> None:
        index = self._index_of(child)
        del self._children[index], self._sorts[index]
        child._parents = [reference for reference in child._parents if reference() not in (self, None)]

    def _index_of(self, child: PandaNode) -> int:
        try:
            return self._children.index(child)
        except ValueError:
            raise NodeError(f"node {child.name!r} is not a child of {self.name!r}") from None

    def iter_ancestors(self) -> Iterator[PandaNode]:
        """Return an iterator over every node above this one, by any path, each once."""
        return _each_once(self.parents, lambda node: node.parents)

    def iter_descendants(self) -> Iterator[PandaNode]:
        """Return an iterator over every node at and below this one, depth first, each once."""
        return _each_once([self], lambda node: reversed(node._children))

    def count_num_descendants(self) -> int:
        """Return the number of nodes at and below this one, each as often as paths lead to it."""
        count, waiting = 0, [self]
        while waiting:
            count += 1
            waiting.extend(waiting.pop()._children)
        return count

    def get_transform(self) -> TransformState:
        """Return the transform to the parents' space."""
        return self.transform

    def clear_transform(self) -> None:
        """Reset the transform to the identity."""
        self.set_transform(IDENTITY)

    def set_transform(self, transform: TransformState) -> None:
        """Set the transform to the parents' space."""
        self.transform = transform
        self.mark_changed()

    def mark_changed(self) -> None:
        """Raise the revisions of this node and its ancestors; subclasses call this when they change."""
        self.revision += 1
        node = self
        while True:  # nodes with one parent need no sets
            node.subtree_revision += 1
            if not node._parents:
                return
            if len(node._parents) != 1:
                break
            parent = node._parents[0]()
            if parent is None:
                return
            node = parent
        for ancestor in node.iter_ancestors():
            ancestor.subtree_revision += 1

    def make_copy(self) -> Self:
        """Return a new node of the same class with the same attributes, without children.

        The attributes' values are shared; only lists, dicts and sets are copied.
        """
        node = type(self).__new__(type(self))
        for name, value in self.__dict__.items():
            if name not in _LINKS:
                node.__dict__[name] = copy.copy(value) if isinstance(value, dict | list | set) else value
        node._children, node._sorts = [], []
        node.revision = node.subtree_revision = 0
        return node

    # --- Python's copies: see the class ---

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes and the links: child, sort number, and position among the child's parents."""
        state = {name: value for name, value in self.__dict__.items() if name not in _LINKS}
        state["_links"] = [
            (child, sort, child.parents.index(self))
            for child, sort in zip(self._children, self._sorts, strict=True)
        ]
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        links = state["_links"]
        self.__dict__.update({name: value for name, value in state.items() if name != "_links"})
        self._children = [child for child, _, _ in links]
        self._sorts = [sort for _, sort, _ in links]
        for child, _, rank in links:
            child._link_parent(self, rank)

    def _link_parent(self, parent: PandaNode, rank: int) -> None:
        """Link a copied parent; parents are copied in any order, and `rank` restores the original one."""
        ranks = self.__dict__.setdefault("_ranks", [])
        index = bisect(ranks, rank)
        ranks.insert(index, rank)
        self._parents.insert(index, weakref.ref(parent))

    def __copy__(self) -> PandaNode:
        node = self.make_copy()
        for child, sort in zip(self._children, self._sorts, strict=True):
            node.add_child(child, sort)
        return node

    def __deepcopy__(self, memo: dict[int, Any]) -> PandaNode:
        # one by one, not by recursion, so that no tree is too deep
        originals = [node for node in self.iter_descendants() if id(node) not in memo]
        copies = {node: type(node).__new__(type(node)) for node in originals}
        memo.update({id(node): made for node, made in copies.items()})
        for node, made in copies.items():
            made.__setstate__(copy.deepcopy(node.__getstate__(), memo))
        return copies[self]

    def link_copy(self, made: PandaNode, copies: Mapping[PandaNode, PandaNode]) -> None:
        """Make `made`, the copy of this node, refer to copies where this node refers to other nodes.

        `copy_nodes` calls it once all nodes are copied; `copies` has the copy of each. A plain node does
        nothing.
        """

    def animate(self, time: float) -> None:
        """Set what moves by itself at and below this node to its state at `time`, in seconds.

        `Scene.update` calls it for the nodes of classes that override it. The state must not depend on
        earlier calls, and no nodes may be added. A plain node does nothing.
        """

    def iter_local_points(self) -> list[Float64]:
        """Return arrays of shape (n, 3): points in this node's space whose hull contains its own contents."""
        return []


def copy_nodes(top: PandaNode) -> dict[PandaNode, PandaNode]:
    """Return a copy of a node and of each node below it, by original; what nodes share is shared.

    Each node is copied once, so nodes that are instanced below `top` are instanced in the copy too.
    """
    copies = {original: original.make_copy() for original in top.iter_descendants()}
    # the lowest first: a node tells all nodes above it of each new child
    for original, made in reversed(copies.items()):
        for child, sort in zip(original._children, original._sorts, strict=True):
            made.add_child(copies[child], sort)
    for original, made in copies.items():
        if len(made._parents) > 1:  # in the order of the original
            made._parents = [weakref.ref(copies[node]) for node in original.parents if node in copies]
    for original, made in copies.items():
        original.link_copy(made, copies)
    return copies


def _each_once(
    waiting: list[PandaNode], following: Callable[[PandaNode], Iterable[PandaNode]]
) -> Iterator[PandaNode]:
    seen: set[PandaNode] = set()
    while waiting:
        node = waiting.pop()
        if node not in seen:
            seen.add(node)
            yield node
            waiting.extend(following(node))


def inherit(
    above: _Value | None, above_priority: int, own: _Value | None, own_priority: int
) -> tuple[_Value | None, int]:
    """Return an attribute and its priority at a node, from those above it and its own.

    The node's own value wins, unless the one from above has a higher priority.
    """
    if own is None or (above is not None and above_priority > own_priority):
        return above, above_priority
    return own, own_priority
