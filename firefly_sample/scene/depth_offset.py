"""The depth offset of nodes: which of two surfaces in one plane is seen.

The rules are those of Panda3D's DepthOffsetAttrib (found by testing its classes): offsets on the way down to
a node add up, and one is left out if one above it has a higher priority. Its renderer hands an offset n to
OpenGL as ``glPolygonOffset(-n, -n)``, for filled triangles alone.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

from firefly_sample.errors import NodeError
from firefly_sample.scene.node import PandaNode
from firefly_sample.settings import to_whole

LARGEST_BIAS = 2**31 - 1
"""Panda3D's limit, either way."""


class DepthOffset(NamedTuple):
    """An offset, and its priority.

    Attributes
    ----------
    bias : int
        Steps towards the camera. A step is what a surface's depth changes by from one pixel to the next, and
        the least step of the depth buffer.
    priority : int
    """

    bias: int
    priority: int = 0


def combined(above: DepthOffset | None, own: DepthOffset) -> DepthOffset:
    """Return the offset at a node with an offset of its own, from that above it, if there is one."""
    if above is None:
        return own
    if above.priority > own.priority:
        return above
    return DepthOffset(above.bias + own.bias, own.priority)


class _HasNode(Protocol):
    def node(self) -> PandaNode: ...


class DepthOffsets:
    """The methods of a `NodePath` that set its node's depth offset, by Panda3D's names."""

    def set_depth_offset(self: _HasNode, bias: int, priority: int = 0) -> None:
        """Move the depths of filled triangles at this node and below it by `bias` steps towards the camera.

        With 1, a decal hides the surface that it lies on. The offset adds to those of the nodes above, but
        for one with a higher priority, which replaces it. Only the order of surfaces changes: the outputs
        "depth" and "position" stay those of the surface, and so does the light that it gets.
        """
        node = self.node()
        steps, whole = to_whole(bias), to_whole(priority)
        if steps is None or abs(steps) > LARGEST_BIAS:
            raise NodeError(
                f"node {node.name!r}: a depth offset must be a whole number of steps, at most "
                f"{LARGEST_BIAS} either way, got {bias!r}"
            )
        if whole is None:
            raise NodeError(f"node {node.name!r}: a priority must be a whole number, got {priority!r}")
        node.depth_offset = DepthOffset(steps, whole)
        node.mark_changed()

    def clear_depth_offset(self: _HasNode) -> None:
        """Remove this node's own depth offset."""
        node = self.node()
        node.depth_offset = None
        node.mark_changed()

    def has_depth_offset(self: _HasNode) -> bool:
        """Return whether this node itself has a depth offset."""
        return self.node().depth_offset is not None

    def get_depth_offset(self: _HasNode) -> int:
        """Return this node's own depth offset, 0 if it has none."""
        own = self.node().depth_offset
        return 0 if own is None else own.bias
