"""The colour and the material of a `firefly_sample.scene.nodepath.NodePath`'s node."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import as_color, as_colors
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import Color, PandaNode, inherit
from firefly_sample.scene.path_base import PathBase
from firefly_sample.settings import number_or_none, to_whole

_Value = TypeVar("_Value")


class PathColors(PathBase):
    """The methods of a `NodePath` that set its node's colour and material."""

    __slots__ = ()

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
