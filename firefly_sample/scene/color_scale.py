"""The colour scale of nodes: factors of all that their geometry shows but highlights.

The rules are those of Panda3D's ColorScaleAttrib (found by testing its classes): the scales of a node and of
those above are multiplied if their priorities are equal; else the one of the higher priority counts alone.
Panda3D rounds scales to 1024ths, which this package does not.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

from firefly_sample.errors import NodeError
from firefly_sample.scene.arrays import LARGEST, as_color
from firefly_sample.scene.node import Color, PandaNode
from firefly_sample.settings import number_or_none, to_whole

UNSCALED: Color = (1.0, 1.0, 1.0, 1.0)
"""The scale of a scene whose nodes set none."""
_RED, _GREEN, _BLUE, _ALPHA = range(4)


class ColorScale(NamedTuple):
    """A node's own colour scale, or that of all nodes down to it.

    Attributes
    ----------
    scale : (r, g, b, a)
        Numbers of 0 or more, which may exceed 1.
    off : bool
        True if the scales above do not count.
    priority : int
    """

    scale: Color = UNSCALED
    off: bool = False
    priority: int = 0


def scaled_further(above: ColorScale | None, own: ColorScale) -> ColorScale:
    """Return the scale at a node, from that above it and its own."""
    if above is None or own.priority > above.priority or (own.off and own.priority == above.priority):
        return own
    if above.priority > own.priority:
        return above
    return ColorScale(_product(above.scale, own.scale), above.off, own.priority)


class _HasNode(Protocol):
    def node(self) -> PandaNode: ...


class ColorScales:
    """The methods of a `NodePath` that set its node's colour scale, by Panda3D's names.

    A scale multiplies base colours, the reflectance of ambient light, emission and opacity of this node and
    everything below it, not highlights. A priority that was given stays with the node's scale until another
    one is higher or the scale is cleared.
    """

    def set_color_scale(self: _HasNode, *arguments: Any) -> None:
        """Set this node's own colour scale: ``set_color_scale(r, g, b, a[, priority])``.

        Or ``set_color_scale(scale[, priority])`` with 4 numbers, each 0 or more.
        """
        scale, priority = _arguments(self.node(), "set_color_scale", arguments)
        _set(self.node(), scale, priority)

    def compose_color_scale(self: _HasNode, *arguments: Any) -> None:
        """Multiply this node's own colour scale; the arguments are those of `set_color_scale`."""
        scale, priority = _arguments(self.node(), "compose_color_scale", arguments)
        _set(self.node(), _product(_own(self.node()), scale), priority)

    def set_all_color_scale(self: _HasNode, scale: float, priority: int = 0) -> None:
        """Set red, green and blue of this node's own colour scale to one number of 0 or more."""
        changed = dict.fromkeys((_RED, _GREEN, _BLUE), scale)
        _set(self.node(), _changed(self.node(), changed), priority)

    def set_alpha_scale(self: _HasNode, scale: float, priority: int = 0) -> None:
        """Set the factor of opacity of this node's own colour scale, a number of 0 or more.

        Only surfaces whose material has the alpha mode "mask" or "blend" have opacity.
        """
        _set(self.node(), _changed(self.node(), {_ALPHA: scale}), priority)

    def set_color_scale_off(self: _HasNode, priority: int = 0) -> None:
        """Let no scale from above count at this node and below it, and remove its own."""
        node = self.node()
        node.color_scale = ColorScale(off=True, priority=_priority(node, priority))
        node.mark_changed()

    def clear_color_scale(self: _HasNode) -> None:
        """Remove this node's own colour scale; those above count."""
        node = self.node()
        node.color_scale = None
        node.mark_changed()

    def has_color_scale(self: _HasNode) -> bool:
        """Return whether this node itself has a colour scale, or turns those above off."""
        return self.node().color_scale is not None

    def get_color_scale(self: _HasNode) -> Color:
        """Return this node's own colour scale (r, g, b, a), ones if it has none."""
        return _own(self.node())

    def set_sr(self: _HasNode, scale: float) -> None:
        """Set the factor of red of this node's own colour scale."""
        _set(self.node(), _changed(self.node(), {_RED: scale}))

    def set_sg(self: _HasNode, scale: float) -> None:
        """Set the factor of green of this node's own colour scale."""
        _set(self.node(), _changed(self.node(), {_GREEN: scale}))

    def set_sb(self: _HasNode, scale: float) -> None:
        """Set the factor of blue of this node's own colour scale."""
        _set(self.node(), _changed(self.node(), {_BLUE: scale}))

    def set_sa(self: _HasNode, scale: float) -> None:
        """Set the factor of opacity of this node's own colour scale."""
        _set(self.node(), _changed(self.node(), {_ALPHA: scale}))

    def get_sr(self: _HasNode) -> float:
        """Return the factor of red of this node's own colour scale."""
        return _own(self.node())[_RED]

    def get_sg(self: _HasNode) -> float:
        """Return the factor of green of this node's own colour scale."""
        return _own(self.node())[_GREEN]

    def get_sb(self: _HasNode) -> float:
        """Return the factor of blue of this node's own colour scale."""
        return _own(self.node())[_BLUE]

    def get_sa(self: _HasNode) -> float:
        """Return the factor of opacity of this node's own colour scale."""
        return _own(self.node())[_ALPHA]


def _own(node: PandaNode) -> Color:
    return UNSCALED if node.color_scale is None else node.color_scale.scale


def _changed(node: PandaNode, numbers: dict[int, float]) -> Color:
    """Return a node's own scale with some numbers changed."""
    red, green, blue, alpha = (numbers.get(index, own) for index, own in enumerate(_own(node)))
    return red, green, blue, alpha


def _product(one: Color, other: Color) -> Color:
    return one[0] * other[0], one[1] * other[1], one[2] * other[2], one[3] * other[3]


def _arguments(node: PandaNode, what: str, arguments: tuple[Any, ...]) -> tuple[Any, int]:
    """Return the scale and the priority of arguments that name the scale as one or as four."""
    one_by_one = bool(arguments) and number_or_none(arguments[0]) is not None
    count = 4 if one_by_one else 1
    scale, rest = (arguments[:4] if one_by_one else arguments[:1]), arguments[count:]
    if len(scale) < count or not arguments or len(rest) > 1:
        raise NodeError(f"node {node.name!r}: {what} takes four numbers, then a whole number as priority")
    return (scale if one_by_one else scale[0]), _priority(node, *rest)


def _priority(node: PandaNode, priority: int = 0) -> int:
    whole = to_whole(priority)
    if whole is None:
        raise NodeError(f"node {node.name!r}: a priority must be a whole number, got {priority!r}")
    return whole


def _set(node: PandaNode, scale: Any, priority: int = 0) -> None:
    """Set a node's own scale, and its priority if that is higher than before."""
    numbers = as_color(f"node {node.name!r}: color scale", scale, 4, LARGEST, NodeError)
    red, green, blue, alpha = numbers.tolist()
    own = node.color_scale or ColorScale(priority=_priority(node, priority))
    highest = max(own.priority, _priority(node, priority))
    node.color_scale = ColorScale((red, green, blue, alpha), own.off, highest)
    node.mark_changed()
