"""Small trees that several tests of the scene graph build."""

from __future__ import annotations

from firefly_sample.scene.nodepath import NodePath


def names(paths: list[NodePath]) -> list[str]:
    return [str(path) for path in paths]


def tree(*paths: str) -> dict[str, NodePath]:
    """A tree from "a", "a/b", ...: every path by its text, the root being "root"."""
    found = {"root": NodePath("root")}
    for path in paths:
        parent, _, name = path.rpartition("/")
        found[path] = found[parent or "root"].attach_new_node(name)
    return found
