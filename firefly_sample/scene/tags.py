"""The tags of a node: text under keys, and any values of Python under keys."""

from __future__ import annotations

from typing import Any, Protocol

from firefly_sample.errors import NodeError


class _Tagged(Protocol):
    name: str
    tags: dict[str, str]
    python_tags: dict[str, Any]

    def mark_changed(self) -> None: ...


class Tags:
    """The methods of a `PandaNode` that read and set tags, by Panda3D's names.

    A copy of a node has the same tags; values of Python are shared with it.
    """

    def set_tag(self: _Tagged, key: str, value: str = "") -> None:
        """Store text under a key; `NodePath.find` can search for it. NodeError if either is not text."""
        if not (isinstance(key, str) and isinstance(value, str)):
            raise NodeError(f"node {self.name!r}: set_tag takes text, got {key!r} and {value!r}")
        self.tags[key] = value
        self.mark_changed()

    def get_tag(self: _Tagged, key: str) -> str:
        """Return the text under a key, "" if there is none."""
        return self.tags.get(key, "")

    def has_tag(self: _Tagged, key: str) -> bool:
        """Return whether there is text under a key."""
        return key in self.tags

    def clear_tag(self: _Tagged, key: str) -> None:
        """Remove the text under a key, if there is some."""
        if self.tags.pop(key, None) is not None:
            self.mark_changed()

    def get_tag_keys(self: _Tagged) -> tuple[str, ...]:
        """Return the keys of texts, in the order in which they were first set."""
        return tuple(self.tags)

    def has_tags(self: _Tagged) -> bool:
        """Return whether there is any tag, of text or of Python."""
        return bool(self.tags or self.python_tags)

    def set_python_tag(self: _Tagged, key: str, value: Any) -> None:
        """Store any value of Python under a key. NodeError if the key is not text."""
        if not isinstance(key, str):
            raise NodeError(f"node {self.name!r}: set_python_tag takes text as its key, got {key!r}")
        self.python_tags[key] = value  # what is drawn does not change

    def get_python_tag(self: _Tagged, key: str) -> Any:
        """Return the value of Python under a key, None if there is none."""
        return self.python_tags.get(key)

    def has_python_tag(self: _Tagged, key: str) -> bool:
        """Return whether there is a value of Python under a key."""
        return key in self.python_tags

    def clear_python_tag(self: _Tagged, key: str) -> None:
        """Remove the value of Python under a key, if there is one."""
        self.python_tags.pop(key, None)

    def get_python_tag_keys(self: _Tagged) -> tuple[str, ...]:
        """Return the keys of values of Python, in the order in which they were first set."""
        return tuple(self.python_tags)
