"""Walking what a camera sees: one quick pass over the nodes, without making a NodePath for each."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from firefly_sample.scene.material import Material
from firefly_sample.scene.node import ALL_CAMERAS, OVERALL_BIT, Color, PandaNode
from firefly_sample.scene.path_attributes import inherit
from firefly_sample.scene.path_base import PathBase
from firefly_sample.scene.path_transform import net_matrix
from firefly_sample.scene.transforms import Float64

__all__ = ["Visit", "iter_visible"]


class Visit(NamedTuple):
    """A node as it is met on the way down.

    Attributes
    ----------
    node : PandaNode
        An instanced node is met once for each path down to it.
    net : ndarray of float64, shape (4, 4)
        From the node's space to the root's, for row vectors. Shared between visits and cached: read only.
    color : (r, g, b, a) or None
        The colour that holds here after inheriting.
    material : Material or None
        The material that replaces those of the Geoms here, after inheriting.
    path : str
        Names from the root down, joined by slashes.
    """

    node: PandaNode
    net: Float64
    color: Color | None
    material: Material | None
    path: str


def iter_visible(root: PathBase, camera_mask: int = ALL_CAMERAS) -> Iterator[Visit]:
    """Every node at and below `root` that a camera with this mask sees; depth first, children in order.

    What stands above `root` counts: its transform, colour, material and masks.

    Raises
    ------
    NodeError
        If `root` is empty.
    """
    root.node()
    assert root._step is not None
    *above, top = reversed(list(root._step.upwards()))
    mask, color, color_priority = _ALL_BITS, None, 0
    material, material_priority = None, 0
    for step in above:
        node = step.node
        mask = (mask & ~node.draw_control) | (node.draw_show & node.draw_control)
        color, color_priority = inherit(color, color_priority, node.flat_color, node.flat_color_priority)
        material, material_priority = inherit(
            material, material_priority, node.material, node.material_priority
        )
    prefix = "/".join(step.node.name for step in above)
    net = net_matrix(PathBase._at(top.parent))
    waiting = [(top.node, net, mask, color, color_priority, material, material_priority, prefix)]
    while waiting:
        node, net, mask, color, color_priority, material, material_priority, prefix = waiting.pop()
        if node.draw_control:
            mask = (mask & ~node.draw_control) | (node.draw_show & node.draw_control)
        seen = mask & OVERALL_BIT and mask & camera_mask & ALL_CAMERAS
        if not seen and not _shows_through(node):
            continue
        if not node.transform.is_identity:
            net = node.transform.get_mat() @ net
        if node.flat_color is not None:
            color, color_priority = inherit(color, color_priority, node.flat_color, node.flat_color_priority)
        if node.material is not None:
            material, material_priority = inherit(
                material, material_priority, node.material, node.material_priority
            )
        path = f"{prefix}/{node.name}" if prefix else node.name
        if seen:
            yield Visit(node, net, color, material, path)
        for child in reversed(node.children):
            waiting.append((child, net, mask, color, color_priority, material, material_priority, path))


_ALL_BITS = OVERALL_BIT | ALL_CAMERAS


def _shows_through(node: PandaNode) -> bool:
    """Whether a node below a hidden one forces itself to be seen. Asked of hidden nodes only."""
    return any(below.draw_control & below.draw_show for below in node.iter_descendants())
