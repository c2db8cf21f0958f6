"""Lists of paths, as Panda3D's NodePathCollection."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from firefly_sample.scene.camel_case import CamelCase

if TYPE_CHECKING:
    from firefly_sample.scene.nodepath import NodePath


class NodePathCollection(CamelCase, list[Any]):
    """A list of paths, with methods that do the same with each of them."""

    __slots__ = ()

    def is_empty(self) -> bool:
        """Return whether there are no paths."""
        return not self

    def get_num_paths(self) -> int:
        """Return the number of paths."""
        return len(self)

    def get_path(self, index: int) -> NodePath:
        """Return the path number `index`, from 0. IndexError if there is none."""
        path: NodePath = self[index]
        return path

    def has_path(self, path: NodePath) -> bool:
        """Return whether a path is among these."""
        return path in self

    def add_path(self, path: NodePath) -> None:
        """Add a path at the end."""
        self.append(path)

    def detach(self) -> None:
        """Remove each node from its parent."""
        for path in self:
            path.detach_node()

    def reparent_to(self, other: NodePath) -> None:
        """Make `other` the parent of each node; the local transforms stay."""
        for path in self:
            path.reparent_to(other)

    def wrt_reparent_to(self, other: NodePath) -> None:
        """Make `other` the parent of each node; the net transforms stay."""
        for path in self:
            path.wrt_reparent_to(other)

    def hide(self) -> None:
        """Hide each node."""
        for path in self:
            path.hide()

    def show(self) -> None:
        """Show each node."""
        for path in self:
            path.show()

    def set_color(self, *arguments: Any) -> None:
        """Give each node a colour; see `NodePath.set_color`."""
        for path in self:
            path.set_color(*arguments)

    def set_texture(self, *arguments: Any) -> None:
        """Give each node a texture; see `NodePath.set_texture`."""
        for path in self:
            path.set_texture(*arguments)
