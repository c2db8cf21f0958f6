"""The visibility of a `firefly_sample.scene.nodepath.NodePath`'s node."""

from __future__ import annotations

from typing import Self

from firefly_sample.scene.node import ALL_CAMERAS, OVERALL_BIT
from firefly_sample.scene.path_base import PathBase
from firefly_sample.settings import to_whole


class PathVisibility(PathBase):
    """The methods of a `NodePath` that hide and show its node."""

    __slots__ = ()

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
