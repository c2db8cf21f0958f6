"""The tags of a `firefly_sample.scene.nodepath.NodePath`'s node, and of those above it."""

from __future__ import annotations

from typing import Any, Self

from firefly_sample.scene.path_base import PathBase


class PathTags(PathBase):
    """The methods of a `NodePath` that read and set its node's tags."""

    __slots__ = ()

    @property
    def tags(self) -> dict[str, str]:
        """The texts of this node, by key."""
        return self.node().tags

    @property
    def python_tags(self) -> dict[str, Any]:
        """The values of Python of this node, by key."""
        return self.node().python_tags

    def set_tag(self, key: str, value: str = "") -> None:
        """Store text under a key; `find` can search for it."""
        self.node().set_tag(key, value)

    def get_tag(self, key: str) -> str:
        """Return the text under a key at this node, "" if there is none."""
        return self.node().get_tag(key)

    def has_tag(self, key: str) -> bool:
        """Return whether this node itself has the key."""
        return self.node().has_tag(key)

    def clear_tag(self, key: str) -> None:
        """Remove a key, if it is there."""
        self.node().clear_tag(key)

    def get_tag_keys(self) -> tuple[str, ...]:
        """Return the keys at this node, in the order in which they were first set."""
        return self.node().get_tag_keys()

    def get_net_tag(self, key: str) -> str:
        """Return the text under a key at the nearest node that has it, here or above; "" if none has."""
        found = self.find_net_tag(key)
        return "" if found.is_empty() else found.get_tag(key)

    def has_net_tag(self, key: str) -> bool:
        """Return whether this node or one above it has the key."""
        return not self.find_net_tag(key).is_empty()

    def find_net_tag(self, key: str) -> Self:
        """Return the path to the nearest node that has the key, here or above; empty if none has."""
        return self._at(next((step for step in self._existing().upwards() if step.node.has_tag(key)), None))

    def set_python_tag(self, key: str, value: Any) -> None:
        """Store any value of Python under a key."""
        self.node().set_python_tag(key, value)

    def get_python_tag(self, key: str) -> Any:
        """Return the value of Python under a key at this node, None if there is none."""
        return self.node().get_python_tag(key)

    def has_python_tag(self, key: str) -> bool:
        """Return whether this node itself has a value of Python under the key."""
        return self.node().has_python_tag(key)

    def clear_python_tag(self, key: str) -> None:
        """Remove the value of Python under a key, if there is one."""
        self.node().clear_python_tag(key)

    def get_python_tag_keys(self) -> tuple[str, ...]:
        """Return the keys of this node's values of Python, in the order in which they were first set."""
        return self.node().get_python_tag_keys()

    def get_net_python_tag(self, key: str) -> Any:
        """Return the value under a key at the nearest node that has one, here or above; None if none has."""
        found = self.find_net_python_tag(key)
        return None if found.is_empty() else found.get_python_tag(key)

    def has_net_python_tag(self, key: str) -> bool:
        """Return whether this node or one above it has a value of Python under the key."""
        return not self.find_net_python_tag(key).is_empty()

    def find_net_python_tag(self, key: str) -> Self:
        """Return the path to the nearest node with a value of Python under the key; empty if none has."""
        steps = self._existing().upwards()
        return self._at(next((step for step in steps if step.node.has_python_tag(key)), None))
