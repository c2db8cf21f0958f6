"""The part of NodePath that dresses a node: name, visibility, colour, material, tags."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self, TypeVar

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import as_color, as_colors
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import ALL_CAMERAS, OVERALL_BIT, Color, PandaNode
from firefly_sample.scene.path_base import PathBase
from firefly_sample.settings import number_or_none, to_whole

_Value = TypeVar("_Value")


def inherit(
    above: _Value | None, above_priority: int, own: _Value | None, own_priority: int
) -> tuple[_Value | None, int]:
    """An attribute and its priority at a node, from those above it and its own.

    The node's own value wins, unless what comes from above has a higher priority.
    """
    if own is None or (above is not None and above_priority > own_priority):
        return above, above_priority
    return own, own_priority


class PathAttributes(PathBase):
    """Attributes of a NodePath. All raise NodeError if the path is empty."""

    __slots__ = ()

    def get_name(self) -> str:
        """The node's name."""
        return self.node().name

    def set_name(self, name: str) -> None:
        """Rename the node."""
        if not isinstance(name, str):
            raise self._error(f"set_name takes text, got {name!r}")
        node = self.node()
        node.name = name
        node.mark_changed()

    # --- Visibility ---

    def hide(self, camera_mask: int | None = None) -> None:
        """Hide the node and what is below it from every camera, or from those cameras that the mask names.

        Each bit of `camera_mask` hides from the cameras that have that bit. A camera sees the node as long as
        one of its own bits is not hidden: as in Panda3D, a camera with all bits, as a `Camera` has at first,
        sees a node that is hidden with one of them. Give cameras masks of a bit each to hide things from
        some.

        A node below may still force itself to be seen with `show_through`.
        """
        node, bits = self.node(), self._bits(camera_mask)
        node.draw_control |= bits
        node.draw_show &= ~bits
        node.mark_changed()

    def show(self, camera_mask: int | None = None) -> None:
        """Undo `hide` or `show_through` with the same mask; the node is seen where its parent is."""
        node, bits = self.node(), self._bits(camera_mask)
        node.draw_control &= ~bits
        node.draw_show |= bits
        node.mark_changed()

    def show_through(self, camera_mask: int | None = None) -> None:
        """Show the node and what is below it even where a node above is hidden with the same mask."""
        node, bits = self.node(), self._bits(camera_mask)
        node.draw_control |= bits
        node.draw_show |= bits
        node.mark_changed()

    def _bits(self, camera_mask: int | None) -> int:
        if camera_mask is None:
            return OVERALL_BIT
        bits = to_whole(camera_mask)
        if bits is None or not 0 <= bits < 2**32:
            raise self._error(f"a camera mask is a whole number of 32 bits, got {camera_mask!r}")
        return bits & ALL_CAMERAS

    def is_hidden(self, camera_mask: int = ALL_CAMERAS) -> bool:
        """Whether this node or one above it is hidden, from all cameras of the mask.

        As in Panda3D, `show_through` is not looked at.
        """
        return not self.get_hidden_ancestor(camera_mask).is_empty()

    def get_hidden_ancestor(self, camera_mask: int = ALL_CAMERAS) -> Self:
        """The lowest of this node and those above it that is hidden; empty if none is."""
        for step in self._place().upwards():
            shown = step.node.draw_show
            if not shown & OVERALL_BIT or not shown & camera_mask & ALL_CAMERAS:
                return self._at(step)
        return self._at(None)

    # --- Colour and material ---

    def set_color(self, *arguments: Any) -> None:
        """Give this node and what is below it one colour: ``set_color(r, g, b[, a[, priority]])``.

        Or ``set_color(color[, priority])`` with 3 or 4 numbers. Linear, 0 to 1; an array of uint8 or uint16
        as `firefly_sample.scene.arrays` says. The colour nearest to the geometry counts, except that a higher
        priority above wins over a lower one below.
        """
        numbers, rest = arguments[:4], arguments[4:]
        if arguments and number_or_none(arguments[0]) is None:
            what = f"node {str(self)!r}: set_color's color"
            given = as_colors(what, arguments[0], NodeError)
            numbers, rest = tuple(given.tolist()) if given.ndim == 1 else (), arguments[1:]
        numbers = self._numbers("set_color", 4, (*numbers, 1.0) if len(numbers) == 3 else numbers)
        r, g, b, a = as_color(f"node {str(self)!r}: set_color's color", numbers, 4, 1.0, NodeError).tolist()
        priority = to_whole(rest[0]) if len(rest) == 1 else 0
        if len(rest) > 1 or priority is None:
            raise self._error("set_color takes a colour, then a whole number as priority")
        node = self.node()
        node.flat_color, node.flat_color_priority = (r, g, b, a), priority
        node.mark_changed()

    def clear_color(self) -> None:
        """Take this node's own colour away; it inherits again."""
        node = self.node()
        node.flat_color, node.flat_color_priority = None, 0
        node.mark_changed()

    def has_color(self) -> bool:
        """Whether this very node has a colour."""
        return self.node().flat_color is not None

    def get_color(self) -> Color:
        """Return this very node's colour (r, g, b, a), white if it has none."""
        return self.node().flat_color or (1.0, 1.0, 1.0, 1.0)

    def get_net_color(self) -> Color | None:
        """The colour that holds at this node after inheriting, None if there is none."""
        return self._inherited(lambda node: (node.flat_color, node.flat_color_priority))

    def set_material(self, material: Material, priority: int = 0) -> None:
        """Give everything at this node and below one material; priority as with `set_color`."""
        if not isinstance(material, Material):
            raise self._error(f"set_material takes a Material, got {material!r}")
        node = self.node()
        whole = to_whole(priority)
        if whole is None:
            raise self._error(f"set_material takes a whole number as priority, got {priority!r}")
        node.material, node.material_priority = material, whole
        node.mark_changed()

    def clear_material(self) -> None:
        """Take this node's own material away; it inherits again."""
        node = self.node()
        node.material, node.material_priority = None, 0
        node.mark_changed()

    def has_material(self) -> bool:
        """Whether this very node has a material."""
        return self.node().material is not None

    def get_material(self) -> Material | None:
        """Return this very node's material, None if it has none."""
        return self.node().material

    def get_net_material(self) -> Material | None:
        """The material that holds at this node after inheriting, None if Geoms keep their own."""
        return self._inherited(lambda node: (node.material, node.material_priority))

    def _inherited(self, read: Callable[[PandaNode], tuple[_Value | None, int]]) -> _Value | None:
        value: _Value | None = None
        priority = 0
        for step in reversed(list(self._place().upwards())):
            value, priority = inherit(value, priority, *read(step.node))
        return value

    # --- Tags ---

    def set_tag(self, key: str, value: str = "") -> None:
        """Keep text under a key; `find` can look for it."""
        if not (isinstance(key, str) and isinstance(value, str)):
            raise self._error(f"set_tag takes text, got {key!r} and {value!r}")
        node = self.node()
        node.tags[key] = value
        node.mark_changed()

    def get_tag(self, key: str) -> str:
        """The text under a key at this very node, "" if there is none."""
        return self.node().tags.get(key, "")

    def has_tag(self, key: str) -> bool:
        """Whether this very node has the key."""
        return key in self.node().tags

    def clear_tag(self, key: str) -> None:
        """Forget a key; nothing happens if it is not there."""
        node = self.node()
        if node.tags.pop(key, None) is not None:
            node.mark_changed()

    def get_tag_keys(self) -> tuple[str, ...]:
        """The keys at this very node, in the order in which they were first set."""
        return tuple(self.node().tags)

    def get_net_tag(self, key: str) -> str:
        """The text under a key at the nearest node that has it, here or above; "" if none has."""
        found = self.find_net_tag(key)
        return "" if found.is_empty() else found.get_tag(key)

    def has_net_tag(self, key: str) -> bool:
        """Whether this node or one above it has the key."""
        return not self.find_net_tag(key).is_empty()

    def find_net_tag(self, key: str) -> Self:
        """The nearest node that has the key, here or above; empty if none has."""
        for step in self._place().upwards():
            if key in step.node.tags:
                return self._at(step)
        return self._at(None)
