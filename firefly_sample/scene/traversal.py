"""Walking what a camera sees: one quick pass over the nodes, without making a NodePath for each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from firefly_sample.scene.material import Material
from firefly_sample.scene.node import ALL_CAMERAS, OVERALL_BIT, Color, PandaNode
from firefly_sample.scene.path_attributes import inherit
from firefly_sample.scene.path_base import PathBase
from firefly_sample.scene.transform_state import IDENTITY
from firefly_sample.scene.transforms import Float64


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
        Names from the root down, joined by slashes. The second node of a name below its parent has "#2"
        after it, the third "#3", so that paths differ (unless names hold slashes themselves). Hidden nodes
        count, so that hiding one renames no other.
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
    for step in reversed(list(root._place().upwards())):
        above, state = state, _enter(state, step.node, step.node.name)
    waiting = [(root.node(), above, root.node().name)]
    while waiting:
        node, above, label = waiting.pop()
        here = _enter(above, node, label)
        if here.mask & OVERALL_BIT and here.mask & camera_mask & ALL_CAMERAS:
            yield Visit(node, here.net, here.color, here.material, here.path)
        elif not _shows_through(node):
            continue
        if children := node.children:
            labels = _labels(children)
            waiting.extend([(child, here, labels.pop()) for child in reversed(children)])


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


def _enter(above: _State, node: PandaNode, label: str) -> _State:
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
    path = f"{path}/{label}" if path else label
    return _State(net, mask, color, color_priority, material, material_priority, path)


def _labels(children: Sequence[PandaNode]) -> list[str]:
    """Return the names of one parent's children, with numbers where they are equal."""
    names = [child.name for child in children]
    taken = set(names)
    if len(taken) == len(names):
        return names
    counts = dict.fromkeys(taken, 0)
    labels = []
    for name in names:
        counts[name] += 1
        label = name
        if counts[name] > 1:
            while (label := f"{name}#{counts[name]}") in taken:
                counts[name] += 1
        labels.append(label)
    return labels


def _shows_through(node: PandaNode) -> bool:
    """Whether a node at or below a hidden one may force itself to be seen. Asked of hidden nodes only."""
    return any(below.draw_control & below.draw_show for below in node.iter_descendants())
