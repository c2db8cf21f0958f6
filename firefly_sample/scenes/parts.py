"""What scenes are put together with: parts of model files, and what is seen of them."""

from __future__ import annotations

from firefly_sample.errors import ModelError
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.nodepath import NodePath

__all__ = ["find_part", "set_visible"]


def find_part(file: NodePath, name: str) -> GeomNode:
    """All Geoms at and below the node `name` of a file that `load_model` read, as one node to copy.

    Raises
    ------
    ModelError
        If there is no such node; it names file and node.
    """
    part = file.find(f"**/{name}")
    if part.is_empty():
        raise ModelError(
            f"model {file.get_name()}.glb: has no node {name!r}: make it again with models/make_models.py"
        )
    merged = GeomNode(name)
    for path in [part, *part.find_all_matches("**")]:
        node = path.node()
        if isinstance(node, GeomNode):
            for geom, material in node.geoms:
                merged.add_geom(geom, material)
    return merged


def set_visible(path: NodePath, visible: bool) -> None:
    """Show what is at and below `path`, or hide it."""
    if visible:
        path.show()
    else:
        path.hide()
