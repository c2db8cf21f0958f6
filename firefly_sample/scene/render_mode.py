"""The render mode of nodes: surfaces filled or as wireframes, and the size of points.

The rules are those of Panda3D's RenderModeAttrib (found by testing its classes): a node's own mode and
thickness replace both of those above, unless these have a higher priority.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, Protocol

from firefly_sample.errors import NodeError
from firefly_sample.scene.node import PandaNode
from firefly_sample.settings import to_number, to_whole

Mode = Literal["filled", "wireframe"]
_NUMBERS: dict[int, Mode] = {1: "filled", 2: "wireframe"}
"""Panda3D's, of its RenderModeAttrib."""

LARGEST_THICKNESS = 2048.0
"""Pixels; drivers draw smaller points where they have a limit of their own."""


class RenderMode(NamedTuple):
    """The ways to draw geometry.

    Attributes
    ----------
    mode : {"filled", "wireframe"}
    thickness : float
        Width and height of points in pixels of the picture. Lines are one pixel wide, whatever it is.
    """

    mode: Mode = "filled"
    thickness: float = 1.0


PLAIN = RenderMode()
"""The mode of a scene whose nodes set none."""


class _HasNode(Protocol):
    def node(self) -> PandaNode: ...


class RenderModes:
    """The methods of a `NodePath` that set its node's render mode, by Panda3D's names."""

    def set_render_mode(self: _HasNode, mode: Mode | int, thickness: float, priority: int = 0) -> None:
        """Set both parts of the render mode of this node and those below it.

        Parameters
        ----------
        mode : {"filled", "wireframe"} or {1, 2}
            The numbers are Panda3D's `RenderModeAttrib.M_filled` and `M_wireframe`.
        thickness : float
            Width and height of points in pixels: above 0, up to 2048. Lines are one pixel wide; a warning
            names those for which another thickness is set.
        priority : int
            A mode of a higher priority above this node wins.

        Raises
        ------
        NodeError
            If there is no such mode, or a number is wrong.
        """
        found = next((name for number, name in _NUMBERS.items() if mode in (number, name)), None)
        if found is None:
            raise NodeError(
                f"node {self.node().name!r}: a render mode must be 'filled' or 'wireframe', or 1 or 2, "
                f"got {mode!r}"
            )
        _set(self.node(), found, thickness, priority)

    def set_render_mode_wireframe(self: _HasNode, priority: int = 0) -> None:
        """Draw only the edges of triangles at this node and below it, as lines of one pixel."""
        _set(self.node(), "wireframe", priority=priority)

    def set_render_mode_filled(self: _HasNode, priority: int = 0) -> None:
        """Fill the triangles at this node and below it, which is the default."""
        _set(self.node(), "filled", priority=priority)

    def set_render_mode_thickness(self: _HasNode, thickness: float, priority: int = 0) -> None:
        """Set the width and height of points at this node and below it, in pixels: above 0, up to 2048.

        As in Panda3D, a node without a mode of its own then fills triangles. Lines are one pixel wide; a
        warning names those for which another thickness is set.
        """
        _set(self.node(), None, thickness, priority)

    def clear_render_mode(self: _HasNode) -> None:
        """Remove this node's own render mode; it inherits again."""
        node = self.node()
        node.render_mode, node.render_mode_priority = None, 0
        node.mark_changed()

    def has_render_mode(self: _HasNode) -> bool:
        """Return whether this node itself has a render mode."""
        return self.node().render_mode is not None

    def get_render_mode(self: _HasNode) -> Mode | Literal["unchanged"]:
        """Return this node's own mode: "filled", "wireframe", or "unchanged" if it has none."""
        own = self.node().render_mode
        return "unchanged" if own is None else own.mode

    def get_render_mode_thickness(self: _HasNode) -> float:
        """Return this node's own size of points in pixels, 1 if it has none."""
        own = self.node().render_mode
        return 1.0 if own is None else own.thickness


def _set(node: PandaNode, mode: Mode | None, thickness: float | None = None, priority: int = 0) -> None:
    """Change the parts of a node's own render mode that are not None."""
    whole = to_whole(priority)
    if whole is None:
        raise NodeError(f"node {node.name!r}: a priority must be a whole number, got {priority!r}")
    own = node.render_mode or PLAIN
    given = own.thickness if thickness is None else to_number(thickness)
    if not 0.0 < given <= LARGEST_THICKNESS:
        raise NodeError(
            f"node {node.name!r}: a thickness must be a number of pixels above 0, at most "
            f"{LARGEST_THICKNESS:g}, got {thickness!r}"
        )
    node.render_mode = RenderMode(mode or own.mode, given)
    node.render_mode_priority = whole
    node.mark_changed()
