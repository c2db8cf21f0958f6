"""Walking what a camera sees: one quick pass over the nodes, without making a NodePath for each."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from firefly_sample.scene.material import Material
from firefly_sample.scene.node import ALL_CAMERAS, OVERALL_BIT, Color, PandaNode
from firefly_sample.scene.path_attributes import inherit
from firefly_sample.scene.path_base import PathBase
from firefly_sample.scene.transform_state import IDENTITY
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
        Names from the root down, joined by slashes. No two visits of a walk have the same: the second of a
        name below its parent has "#2" after it, the third "#3". What is hidden counts, so that hiding a
        node renames no other.
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
    state = _START
    met: dict[str, int] = {}
    for step in reversed(list(root._place().upwards())):
        above, state = state, _enter(state, step.node, {})
    waiting = [(root.node(), above)]
    while waiting:
        node, above = waiting.pop()
        here = _enter(above, node, met)
        if here.mask & OVERALL_BIT and here.mask & camera_mask & ALL_CAMERAS:
            yield Visit(node, here.net, here.color, here.material, here.path)
        elif not _shows_through(node):
            continue
        waiting.extend([(child, here) for child in reversed(node.children)])


class _State(NamedTuple):
    """What a node hands down to its children."""

    net: Float64
    mask: int
    color: Color | None
    color_priority: int
    material: Material | None
    material_priority: int
    path: str


_START = _State(IDENTITY.get_mat(), OVERALL_BIT | ALL_CAMERAS, None, 0, None, 0, "")


def _enter(above: _State, node: PandaNode, met: dict[str, int]) -> _State:
    """What holds at `node`; `met` is how often each path was met, and is kept up to date."""
    net, mask, color, color_priority, material, material_priority, path = above
    if not node.transform.is_identity:
        net = node.transform.get_mat() @ net
    if node.draw_control:
        mask = (mask & ~node.draw_control) | (node.draw_show & node.draw_control)
    if node.flat_color is not None:
        color, color_priority = inherit(color, color_priority, node.flat_color, node.flat_color_priority)
    if node.material is not None:
        material, material_priority = inherit(
            material, material_priority, node.material, node.material_priority
        )
    path = f"{path}/{node.name}" if path else node.name
    if path in met:
        path = _numbered(path, met)
    met[path] = 1
    return _State(net, mask, color, color_priority, material, material_priority, path)


def _numbered(path: str, met: dict[str, int]) -> str:
    """A path that was not met yet: `path` with the next number, which `met` keeps."""
    count = met[path] + 1
    while f"{path}#{count}" in met:
        count += 1
    met[path] = count
    return f"{path}#{count}"


def _shows_through(node: PandaNode) -> bool:
    """Whether a node at or below a hidden one may force itself to be seen. Asked of hidden nodes only."""
    return any(below.draw_control & below.draw_show for below in node.iter_descendants())
