"""The graph below a node as text, in Panda3D's format."""

from __future__ import annotations

from collections.abc import Iterator

from firefly_sample.scene.node import PandaNode


def tree_lines(top: PandaNode) -> Iterator[str]:
    """Yield a line for each node at and below `top`, indented by 2 for each level.

    A line has the class, the name, the number of Geoms, the keys of tags, the transform, and after "S:" the
    attributes that are set. A node is listed once for each path to it.
    """
    waiting = [(top, 0)]
    while waiting:
        node, depth = waiting.pop()
        yield "  " * depth + _described(node)
        waiting += [(child, depth + 1) for child in reversed(node.children)]


def _described(node: PandaNode) -> str:
    parts = [type(node).__name__, node.name]
    geoms = getattr(node, "geoms", None)
    if geoms is not None:
        parts.append(f"({len(geoms)} geoms)")
    if node.tags:
        parts.append(f"[{' '.join(node.tags)}]")
    if not node.transform.is_identity():
        parts.append(f"T:({node.transform.described()})")
    own = {
        "color": node.flat_color,
        "material": node.material,
        "overrides": node.overrides,
        "render mode": node.render_mode,
        "depth offset": node.depth_offset,
        "color scale": node.color_scale,
    }
    names = [name for name, value in own.items() if value is not None]
    return " ".join([*parts, *([f"S:({', '.join(names)})"] if names else [])])
