"""NodePath: the handle to a node in the scene graph, with Panda3D's names and semantics."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any, Self, TypeVar

import numpy as np

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import Float64, as_color, as_colors, as_numbers
from firefly_sample.scene.find import find_paths
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import (
    ALL_CAMERAS,
    OVERALL_BIT,
    Color,
    PandaNode,
    PathStep,
    copy_nodes,
    inherit,
    step_to,
)
from firefly_sample.scene.render_mode import RenderModes
from firefly_sample.scene.transform_state import (
    IDENTITY,
    SingularTransformError,
    TransformState,
    invert_matrix,
)
from firefly_sample.scene.transforms import Vec3, look_at_quat
from firefly_sample.settings import number_or_none, to_whole

_Value = TypeVar("_Value")


class NodePath(RenderModes):
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
        if not isinstance(other, NodePath):
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

    def get_parent(self) -> Self:
        """Return the path to the parent; empty at a root."""
        return self._at(self._step.parent if self._step is not None else None)

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
        return self._at(_common_step(self._step, other._step))

    def get_children(self) -> list[Self]:
        """Return the paths to the children, in order."""
        step = self._existing()
        return [self._at(step.child(node)) for node in step.node.children]

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

    def find_all_matches(self, pattern: str) -> list[Self]:
        """Return all paths that begin here and match a pattern; see `firefly_sample.scene.find`."""
        return [self._at(step) for step in find_paths(self._existing(), pattern)]

    def get_tight_bounds(self, other: NodePath | None = None) -> tuple[Float64, Float64] | None:
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
                waiting.append((child, net if local.is_identity else local.get_mat() @ net))
        return (low, high) if np.isfinite(low).all() else None

    # --- Name and visibility ---

    def get_name(self) -> str:
        """Return the node's name."""
        return self.node().name

    def set_name(self, name: str) -> None:
        """Rename the node."""
        if not isinstance(name, str):
            raise self._error(f"set_name takes text, got {name!r}")
        node = self.node()
        node.name = name
        node.mark_changed()

    def hide(self, camera_mask: int | None = None) -> None:
        """Hide the node and everything below it from every camera, or from the cameras of a mask.

        With a mask, a camera no longer sees the node once all of the camera's own bits are hidden. A new
        `Camera` has all bits and, as in Panda3D, still sees a node of which only some are hidden: to hide
        nodes from some cameras, give each camera a mask of one bit. A node below may still be shown with
        `show_through`.
        """
        self._set_bits(camera_mask, decided=True, shown=False)

    def show(self, camera_mask: int | None = None) -> None:
        """Undo `hide` or `show_through` with the same mask; the node is shown where its parent is."""
        self._set_bits(camera_mask, decided=False, shown=True)

    def show_through(self, camera_mask: int | None = None) -> None:
        """Show the node and everything below it even if a node above is hidden with the same mask."""
        self._set_bits(camera_mask, decided=True, shown=True)

    def _set_bits(self, camera_mask: int | None, decided: bool, shown: bool) -> None:
        """Set the bits of a mask, or the overall bit, in the node's `draw_control` and `draw_show`."""
        node, bits = self.node(), OVERALL_BIT
        if camera_mask is not None:
            whole = to_whole(camera_mask)
            if whole is None or not 0 <= whole < 2**32:
                raise self._error(f"a camera mask is a whole number of 32 bits, got {camera_mask!r}")
            bits = whole & ALL_CAMERAS
        node.draw_control = node.draw_control | bits if decided else node.draw_control & ~bits
        node.draw_show = node.draw_show | bits if shown else node.draw_show & ~bits
        node.mark_changed()

    def is_hidden(self, camera_mask: int = ALL_CAMERAS) -> bool:
        """Return whether this node or one above it is hidden from all cameras of the mask.

        As in Panda3D, `show_through` is not considered.
        """
        return not self.get_hidden_ancestor(camera_mask).is_empty()

    def get_hidden_ancestor(self, camera_mask: int = ALL_CAMERAS) -> Self:
        """Return the path to the lowest hidden node, this one or one above; empty if none is hidden."""
        for step in self._existing().upwards():
            shown = step.node.draw_show
            if not shown & OVERALL_BIT or not shown & camera_mask & ALL_CAMERAS:
                return self._at(step)
        return self._at(None)

    # --- Colour and material ---

    def set_color(self, *arguments: Any) -> None:
        """Give this node and everything below it one colour: ``set_color(r, g, b[, a[, priority]])``.

        Or ``set_color(color[, priority])`` with 3 or 4 numbers. Linear, 0 to 1; for arrays of uint8 or uint16
        see `firefly_sample.scene.arrays`. The colour nearest to the geometry counts, except that a higher
        priority above wins over a lower one below.
        """
        what = f"node {str(self)!r}: set_color's color"
        numbers, rest = arguments[:4], arguments[4:]
        if arguments and number_or_none(arguments[0]) is None:
            given = as_colors(what, arguments[0], NodeError)
            numbers, rest = tuple(given.tolist()) if given.ndim == 1 else (), arguments[1:]
        numbers = self._numbers("set_color", 4, (*numbers, 1.0) if len(numbers) == 3 else numbers)
        r, g, b, a = as_color(what, numbers, 4, 1.0, NodeError).tolist()
        priority = to_whole(rest[0]) if len(rest) == 1 else 0
        if len(rest) > 1 or priority is None:
            raise self._error("set_color takes a colour, then a whole number as priority")
        node = self.node()
        node.flat_color, node.flat_color_priority = (r, g, b, a), priority
        node.mark_changed()

    def clear_color(self) -> None:
        """Remove this node's own colour; it inherits again."""
        node = self.node()
        node.flat_color, node.flat_color_priority = None, 0
        node.mark_changed()

    def has_color(self) -> bool:
        """Return whether this node itself has a colour."""
        return self.node().flat_color is not None

    def get_color(self) -> Color:
        """Return this node's own colour (r, g, b, a), white if it has none."""
        return self.node().flat_color or (1.0, 1.0, 1.0, 1.0)

    def get_net_color(self) -> Color | None:
        """Return the colour at this node after inheriting, None if there is none."""
        return self._inherited(lambda node: (node.flat_color, node.flat_color_priority))

    def set_material(self, material: Material, priority: int = 0) -> None:
        """Give this node and everything below it one material; priority as with `set_color`."""
        if not isinstance(material, Material):
            raise self._error(f"set_material takes a Material, got {material!r}")
        node = self.node()
        whole = to_whole(priority)
        if whole is None:
            raise self._error(f"set_material takes a whole number as priority, got {priority!r}")
        node.material, node.material_priority = material, whole
        node.mark_changed()

    def clear_material(self) -> None:
        """Remove this node's own material; it inherits again."""
        node = self.node()
        node.material, node.material_priority = None, 0
        node.mark_changed()

    def has_material(self) -> bool:
        """Return whether this node itself has a material."""
        return self.node().material is not None

    def get_material(self) -> Material | None:
        """Return this node's own material, None if it has none."""
        return self.node().material

    def get_net_material(self) -> Material | None:
        """Return the material at this node after inheriting, None if Geoms keep their own."""
        return self._inherited(lambda node: (node.material, node.material_priority))

    def _inherited(self, read: Callable[[PandaNode], tuple[_Value | None, int]]) -> _Value | None:
        value: _Value | None = None
        priority = 0
        for step in reversed(list(self._existing().upwards())):
            value, priority = inherit(value, priority, *read(step.node))
        return value

    # --- Tags ---

    def set_tag(self, key: str, value: str = "") -> None:
        """Store text under a key; `find` can search for it."""
        if not (isinstance(key, str) and isinstance(value, str)):
            raise self._error(f"set_tag takes text, got {key!r} and {value!r}")
        node = self.node()
        node.tags[key] = value
        node.mark_changed()

    def get_tag(self, key: str) -> str:
        """Return the text under a key at this node, "" if there is none."""
        return self.node().tags.get(key, "")

    def has_tag(self, key: str) -> bool:
        """Return whether this node itself has the key."""
        return key in self.node().tags

    def clear_tag(self, key: str) -> None:
        """Remove a key, if it is there."""
        node = self.node()
        if node.tags.pop(key, None) is not None:
            node.mark_changed()

    def get_tag_keys(self) -> tuple[str, ...]:
        """Return the keys at this node, in the order in which they were first set."""
        return tuple(self.node().tags)

    def get_net_tag(self, key: str) -> str:
        """Return the text under a key at the nearest node that has it, here or above; "" if none has."""
        found = self.find_net_tag(key)
        return "" if found.is_empty() else found.get_tag(key)

    def has_net_tag(self, key: str) -> bool:
        """Return whether this node or one above it has the key."""
        return not self.find_net_tag(key).is_empty()

    def find_net_tag(self, key: str) -> Self:
        """Return the path to the nearest node that has the key, here or above; empty if none has."""
        return self._at(next((step for step in self._existing().upwards() if key in step.node.tags), None))

    # --- Transforms ---

    def get_transform(self, other: NodePath | None = None) -> TransformState:
        """Return the transform from this node's space to its parent's, or to that of `other`."""
        if other is None:
            return self.node().transform
        common = None
        if self._step is not None and other._step is not None:
            common = _common_step(self._step, other._step)
            if common is None:
                raise self._error(f"has no common root with {str(other)!r}; attach both to one tree first")
        down = _transform_between(common, self._step)
        try:
            return _transform_between(common, other._step).invert_compose(down)
        except SingularTransformError:
            raise other._flattened() from None

    def get_net_transform(self) -> TransformState:
        """Return the transform from this node's space to the world."""
        return _transform_between(None, self._step)

    def get_mat(self, other: NodePath | None = None) -> Float64:
        """Return the 4x4 matrix to the parent's space, or to that of `other`; row vectors."""
        return np.array(self.get_transform(other).get_mat())

    def get_net_mat(self) -> Float64:
        """Return the 4x4 matrix from this node's space to the world; row vectors."""
        steps = self._step.upwards() if self._step is not None else ()
        transforms = [step.node.transform for step in steps if not step.node.transform.is_identity]
        matrices = [transform.get_mat() for transform in transforms]
        return np.array(reduce(np.matmul, matrices) if matrices else IDENTITY.get_mat())

    def set_transform(self, *arguments: Any) -> None:
        """Set the transform: ``set_transform([other,] transform)`` with a TransformState."""
        other, rest = self._split(arguments)
        if len(rest) != 1 or not isinstance(rest[0], TransformState):
            raise self._error("set_transform takes a TransformState, and a NodePath before it if relative")
        self._set_whole(other, rest[0])

    def set_mat(self, *arguments: Any) -> None:
        """Set the matrix: ``set_mat([other,] matrix)``, 4x4, with the last column (0, 0, 0, 1)."""
        other, rest = self._split(arguments)
        given = rest[0] if len(rest) == 1 else ()
        matrix = as_numbers(f"node {str(self)!r}: set_mat's matrix", given, NodeError)
        if matrix.shape != (4, 4):
            raise self._error(
                "set_mat takes one matrix of shape (4, 4), and a NodePath before it if relative"
            )
        if not np.isfinite(matrix).all():
            raise self._error("set_mat takes finite numbers only")
        if matrix[:, 3].tolist() != [0.0, 0.0, 0.0, 1.0]:
            raise self._error(
                "set_mat takes an affine matrix for row vectors, whose last column is 0, 0, 0, 1; got "
                f"{', '.join(f'{number:g}' for number in matrix[:, 3])} (a transposed matrix?)"
            )
        self._set_whole(other, TransformState.make_mat(matrix))

    def clear_transform(self) -> None:
        """Reset the transform to the identity."""
        self.node().set_transform(IDENTITY)

    def get_pos(self, other: NodePath | None = None) -> Float64:
        """Return the position (x, y, z)."""
        return np.array(self.get_transform(other).get_pos())

    def set_pos(self, *arguments: Any) -> None:
        """Set the position: ``set_pos([other,] x, y, z)`` or ``set_pos([other,] point)``."""
        other, rest = self._split(arguments)
        self._set_part("pos", other, self._vec3("set_pos", rest))

    def get_hpr(self, other: NodePath | None = None) -> Float64:
        """Return (heading, pitch, roll) in degrees."""
        return np.array(self.get_transform(other).get_hpr())

    def set_hpr(self, *arguments: Any) -> None:
        """Set the rotation: ``set_hpr([other,] h, p, r)`` or ``set_hpr([other,] hpr)``, in degrees."""
        other, rest = self._split(arguments)
        self._set_part("hpr", other, self._vec3("set_hpr", rest))

    def get_quat(self, other: NodePath | None = None) -> Float64:
        """Return the unit quaternion (w, x, y, z) of the rotation; its sign is not defined."""
        return np.array(self.get_transform(other).get_quat())

    def set_quat(self, *arguments: Any) -> None:
        """Set the rotation to a quaternion of any length but 0: ``set_quat([other,] w, x, y, z)``."""
        other, rest = self._split(arguments)
        w, x, y, z = self._numbers("set_quat", 4, rest)
        length = math.hypot(w, x, y, z)
        if length == 0.0:
            raise self._error("set_quat takes a quaternion that is not zero")
        self._set_part("quat", other, (w / length, x / length, y / length, z / length))

    def get_scale(self, other: NodePath | None = None) -> Float64:
        """Return the scale along x, y, z."""
        return np.array(self.get_transform(other).get_scale())

    def set_scale(self, *arguments: Any) -> None:
        """Set the scale: ``set_scale([other,] s)``, or ``sx, sy, sz``, or a sequence of three."""
        other, rest = self._split(arguments)
        uniform = len(rest) == 1 and np.ndim(rest[0]) == 0
        self._set_part("scale", other, self._vec3("set_scale", rest * 3 if uniform else rest))

    def get_shear(self, other: NodePath | None = None) -> Float64:
        """Return the shear (xy, xz, yz), which comes from a non-uniform scale above a rotation."""
        return np.array(self.get_transform(other).get_shear())

    def set_shear(self, *arguments: Any) -> None:
        """Set the shear: ``set_shear([other,] xy, xz, yz)`` or ``set_shear([other,] shear)``."""
        other, rest = self._split(arguments)
        self._set_part("shear", other, self._vec3("set_shear", rest))

    def set_pos_hpr(self, *arguments: Any) -> None:
        """Set position and rotation: ``set_pos_hpr([other,] pos, hpr)``, or six numbers."""
        other, rest = self._split(arguments)
        pos, hpr = self._vectors("set_pos_hpr", 2, rest)
        self._set_part("hpr", other, hpr)
        self._set_part("pos", other, pos)

    def set_pos_hpr_scale(self, *arguments: Any) -> None:
        """Set position, rotation and scale, and remove the shear.

        ``set_pos_hpr_scale([other,] pos, hpr, scale)``, or nine numbers.
        """
        other, rest = self._split(arguments)
        pos, hpr, scale = self._vectors("set_pos_hpr_scale", 3, rest)
        self._set_whole(other, TransformState.make_pos_hpr_scale_shear(pos, hpr, scale))

    def look_at(self, *arguments: Any) -> None:
        """Turn the node so that its +Y axis points at a point.

        ``look_at(point[, up])`` with a point in the parent's space, also as ``look_at(x, y, z)``, or
        ``look_at(other[, point[, up]])`` with a point in the space of `other`, by default its origin.
        `up` is a direction in the parent's space, by default (0, 0, 1). Scale and shear stay.
        """
        other, rest = self._split(arguments)
        if len(rest) == 3 and np.ndim(rest[0]) == 0:
            rest = (rest,)
        if len(rest) > 2 or (other is None and not rest):
            raise self._error("look_at takes a point or another NodePath, then a point, then an up vector")
        point = np.array(self._vec3("look_at", rest[0:1] or ((0.0, 0.0, 0.0),)))
        up = self._vec3("look_at's up", rest[1:2] or ((0.0, 0.0, 1.0),))
        if other is not None:
            point = _move(point, other.get_transform(self.get_parent()))
        x, y, z = (point - self.node().transform.get_pos()).tolist()
        self.set_quat(look_at_quat((x, y, z), up))

    def get_relative_point(self, other: NodePath, point: Any) -> Float64:
        """Convert a point from the space of `other` to this node's space."""
        return _move(np.array(self._vec3("get_relative_point", (point,))), other.get_transform(self))

    def get_relative_vector(self, other: NodePath, vector: Any) -> Float64:
        """Convert a vector from the space of `other` to this node's space: turn and scale it."""
        turn = other.get_transform(self).get_mat()[:3, :3]
        return np.array(self._vec3("get_relative_vector", (vector,))) @ turn

    def get_distance(self, other: NodePath) -> float:
        """Return the distance of this node's origin from that of `other`, in the units of `other`."""
        return math.hypot(*self.get_transform(other).get_pos())

    # --- Single numbers of the transform: ``set_x([other,] value)`` keeps y and z, and so on ---

    def get_x(self, other: NodePath | None = None) -> float:
        """Return the position along x."""
        return self.get_transform(other).get_pos()[0]

    def set_x(self, *arguments: Any) -> None:
        """Set the position along x."""
        self._set_one("pos", 0, "set_x", arguments)

    def get_y(self, other: NodePath | None = None) -> float:
        """Return the position along y."""
        return self.get_transform(other).get_pos()[1]

    def set_y(self, *arguments: Any) -> None:
        """Set the position along y."""
        self._set_one("pos", 1, "set_y", arguments)

    def get_z(self, other: NodePath | None = None) -> float:
        """Return the position along z."""
        return self.get_transform(other).get_pos()[2]

    def set_z(self, *arguments: Any) -> None:
        """Set the position along z."""
        self._set_one("pos", 2, "set_z", arguments)

    def get_h(self, other: NodePath | None = None) -> float:
        """Return the heading in degrees."""
        return self.get_transform(other).get_hpr()[0]

    def set_h(self, *arguments: Any) -> None:
        """Set the heading in degrees."""
        self._set_one("hpr", 0, "set_h", arguments)

    def get_p(self, other: NodePath | None = None) -> float:
        """Return the pitch in degrees."""
        return self.get_transform(other).get_hpr()[1]

    def set_p(self, *arguments: Any) -> None:
        """Set the pitch in degrees."""
        self._set_one("hpr", 1, "set_p", arguments)

    def get_r(self, other: NodePath | None = None) -> float:
        """Return the roll in degrees."""
        return self.get_transform(other).get_hpr()[2]

    def set_r(self, *arguments: Any) -> None:
        """Set the roll in degrees."""
        self._set_one("hpr", 2, "set_r", arguments)

    def get_sx(self, other: NodePath | None = None) -> float:
        """Return the scale along x."""
        return self.get_transform(other).get_scale()[0]

    def set_sx(self, *arguments: Any) -> None:
        """Set the scale along x."""
        self._set_one("scale", 0, "set_sx", arguments)

    def get_sy(self, other: NodePath | None = None) -> float:
        """Return the scale along y."""
        return self.get_transform(other).get_scale()[1]

    def set_sy(self, *arguments: Any) -> None:
        """Set the scale along y."""
        self._set_one("scale", 1, "set_sy", arguments)

    def get_sz(self, other: NodePath | None = None) -> float:
        """Return the scale along z."""
        return self.get_transform(other).get_scale()[2]

    def set_sz(self, *arguments: Any) -> None:
        """Set the scale along z."""
        self._set_one("scale", 2, "set_sz", arguments)

    def get_shxy(self, other: NodePath | None = None) -> float:
        """Return the shear of x by y."""
        return self.get_transform(other).get_shear()[0]

    def set_shxy(self, *arguments: Any) -> None:
        """Set the shear of x by y."""
        self._set_one("shear", 0, "set_shxy", arguments)

    def get_shxz(self, other: NodePath | None = None) -> float:
        """Return the shear of x by z."""
        return self.get_transform(other).get_shear()[1]

    def set_shxz(self, *arguments: Any) -> None:
        """Set the shear of x by z."""
        self._set_one("shear", 1, "set_shxz", arguments)

    def get_shyz(self, other: NodePath | None = None) -> float:
        """Return the shear of y by z."""
        return self.get_transform(other).get_shear()[2]

    def set_shyz(self, *arguments: Any) -> None:
        """Set the shear of y by z."""
        self._set_one("shear", 2, "set_shyz", arguments)

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

    def _split(self, arguments: tuple[Any, ...]) -> tuple[NodePath | None, tuple[Any, ...]]:
        """Return (other, the rest) if the first argument is a NodePath, else (None, all)."""
        if arguments and isinstance(arguments[0], NodePath):
            return arguments[0], arguments[1:]
        return None, arguments

    def _in_parent(self, other: NodePath, transform: TransformState) -> TransformState:
        """Convert a transform from the space of `other` to the parent's."""
        result = other.get_transform(self.get_parent()).compose(transform)
        if not np.isfinite(result.get_mat()).all():
            raise self._error(
                f"what was given relative to {str(other)!r} is too large a number in the parent's space"
            )
        return result

    def _set_whole(self, other: NodePath | None, transform: TransformState) -> None:
        node = self.node()
        node.set_transform(transform if other is None else self._in_parent(other, transform))

    def _set_part(self, name: str, other: NodePath | None, value: tuple[float, ...]) -> None:
        """Set one component of the transform and keep the other local ones to the last digit."""
        node, change = self.node(), getattr(TransformState, f"set_{name}")
        if other is not None:
            in_parent = self._in_parent(other, change(self.get_transform(other), value))
            value = getattr(in_parent, f"get_{name}")()
        node.set_transform(change(node.transform, value))

    def _set_one(self, name: str, index: int, what: str, arguments: tuple[Any, ...]) -> None:
        other, rest = self._split(arguments)
        (value,) = self._numbers(what, 1, rest)
        numbers = list(getattr(self.get_transform(other), f"get_{name}")())
        numbers[index] = value
        self._set_part(name, other, self._vec3(what, (numbers,)))

    def _flattened(self) -> NodeError:
        """Return the error for a transform without an inverse; it names the highest node that has one."""
        culprit = self._step
        for step in self._step.upwards() if self._step is not None else ():
            try:
                invert_matrix(step.node.transform.get_mat())
            except SingularTransformError:
                culprit = step
        return NodePath._at(culprit)._error(
            "its scale flattens space, so nothing can be had relative to it or to what is below it; "
            "give it a scale without zeros"
        )


def _move(point: Float64, transform: TransformState) -> Float64:
    matrix = transform.get_mat()
    return np.asarray(point @ matrix[:3, :3] + matrix[3, :3])


def _common_step(a: PathStep, b: PathStep) -> PathStep | None:
    """Return the lowest step that both paths go through, None if they have different roots."""
    common = None
    for step_a, step_b in zip(reversed(list(a.upwards())), reversed(list(b.upwards())), strict=False):
        if step_a.node is not step_b.node:
            break
        common = step_a
    return common


def _transform_between(top: PathStep | None, step: PathStep | None) -> TransformState:
    """Return the transform from the space of `step` to that of `top` above it; None is the world."""
    chain = []
    while step is not None and (top is None or step.node is not top.node):
        chain.append(step.node.transform)
        step = step.parent
    return reduce(TransformState.compose, reversed(chain), IDENTITY)
