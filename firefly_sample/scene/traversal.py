"""Iterating over the nodes that a camera sees, without making a NodePath for each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeVar

from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.color_scale import UNSCALED, ColorScale, scaled_further
from firefly_sample.scene.depth_offset import DepthOffset, combined
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import ALL_CAMERAS, OVERALL_BIT, Color, PandaNode, inherit
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.render_mode import PLAIN, RenderMode
from firefly_sample.scene.surface_overrides import SurfaceOverrides, composed
from firefly_sample.scene.transform_state import IDENTITY

CATEGORY = "category"
"""The tag of a node at which an instance of a data set begins: what is at and below it is one object."""


class Visit(NamedTuple):
    """A node that a camera sees, once for each path down to it.

    Colour, colour scale and material are those after inheriting; the material, if any, replaces those of the
    node's Geoms. The path is the names from the root down, joined by slashes. If several children of one
    parent have the same name, "#2" is added to the second, "#3" to the third, so that paths differ (unless
    names contain slashes). Hidden nodes are counted, so hiding one renames no other.
    """

    node: PandaNode
    net: Float64  # shape (4, 4), from the node's space to the root's; shared between visits and cached
    color: Color | None
    material: Material | None
    path: str
    render_mode: RenderMode
    depth_offset: int
    color_scale: Color
    overrides: SurfaceOverrides | None = None  # of the material that is drawn


class InstanceRoot(NamedTuple):
    """The node at which an instance of a data set begins, as reached by one path."""

    path: str  # as `Visit.path`
    net: Float64  # shape (4, 4), from the node's space to the root's
    category: str  # the node's tag, or its name where that is empty
    tagged: bool  # False of a visible node at or above which no node has the tag


class _State(NamedTuple):
    """The state that children inherit from a node."""

    net: Float64
    mask: int
    color: Color | None
    color_priority: int
    material: Material | None
    material_priority: int
    path: str
    render_mode: RenderMode | None
    render_mode_priority: int
    depth_offset: DepthOffset | None
    color_scale: ColorScale | None
    overrides: SurfaceOverrides | None


class _Tagged(NamedTuple):
    """The state that children inherit, and the root of the instance that they belong to."""

    mask: int
    state: _State
    instance: InstanceRoot | None


_START = _State(
    IDENTITY.get_mat(), OVERALL_BIT | ALL_CAMERAS, None, 0, None, 0, "", None, 0, None, None, None
)
_Here = TypeVar("_Here", _State, _Tagged)
_Result = TypeVar("_Result")


def iter_visible(root: NodePath, camera_mask: int = ALL_CAMERAS) -> Iterator[Visit]:
    """Yield every node at and below `root` that a camera with this mask sees; depth first, children in order.

    Transforms, colours, materials and masks above `root`, which must not be empty, are inherited.
    """
    return _walk(root, camera_mask, _START, _enter, _visit)


def iter_instances(
    root: NodePath, camera_mask: int = ALL_CAMERAS
) -> Iterator[tuple[PandaNode, InstanceRoot]]:
    """Yield the nodes that `iter_visible` does, in its order, each with the root of its instance.

    That is the nearest node at or above it with the tag `CATEGORY`, or else the node itself. Nodes of one
    instance share one root.
    """
    return _walk(root, camera_mask, _Tagged(_START.mask, _START, None), _enter_tagged, _instance)


def _walk(
    root: NodePath,
    camera_mask: int,
    above: _Here,
    enter: Callable[[_Here, PandaNode, str], _Here],
    result: Callable[[PandaNode, _Here], _Result],
) -> Iterator[_Result]:
    top = root.node()
    for path in reversed(root.get_ancestors()[1:]):
        above = enter(above, path.node(), path.get_name())
    waiting = [(top, above, top.name)]
    while waiting:
        node, above, label = waiting.pop()
        here = enter(above, node, label)
        mask = here.mask
        if mask & OVERALL_BIT and mask & camera_mask & ALL_CAMERAS:
            yield result(node, here)
        elif not any(below.draw_control & below.draw_show for below in node.iter_descendants()):
            continue  # `show_through` was called for none of them
        if children := node.children:
            labels = _labels(children)
            waiting.extend([(child, here, labels.pop()) for child in reversed(children)])


def _visit(node: PandaNode, here: _State) -> Visit:
    net, _, color, _, material, _, path, mode, _, offset, scale, overrides = here
    return Visit(
        node,
        net,
        color,
        material,
        path,
        mode or PLAIN,
        0 if offset is None else offset.bias,
        UNSCALED if scale is None else scale.scale,
        overrides,
    )


def _instance(node: PandaNode, here: _Tagged) -> tuple[PandaNode, InstanceRoot]:
    return node, here.instance or InstanceRoot(here.state.path, here.state.net, node.name, tagged=False)


def _enter_tagged(above: _Tagged, node: PandaNode, label: str) -> _Tagged:
    state, instance = _enter(above.state, node, label), above.instance
    if CATEGORY in node.tags:
        instance = InstanceRoot(state.path, state.net, node.tags[CATEGORY] or node.name, tagged=True)
    return _Tagged(state.mask, state, instance)


def _enter(above: _State, node: PandaNode, label: str) -> _State:
    net, mask, color, color_rank, material, material_rank, path, mode, mode_rank, offset, scale, parts = above
    if not node.transform.is_identity():
        net = node.transform.get_mat() @ net
    if node.draw_control:
        mask = (mask & ~node.draw_control) | (node.draw_show & node.draw_control)
    if node.flat_color is not None:
        color, color_rank = inherit(color, color_rank, node.flat_color, node.flat_color_priority)
    if node.material is not None:
        material, material_rank = inherit(material, material_rank, node.material, node.material_priority)
    if node.render_mode is not None:
        mode, mode_rank = inherit(mode, mode_rank, node.render_mode, node.render_mode_priority)
    if node.depth_offset is not None:
        offset = combined(offset, node.depth_offset)
    if node.color_scale is not None:
        scale = scaled_further(scale, node.color_scale)
    if node.overrides is not None:
        parts = composed(parts, node.overrides)
    path = f"{path}/{label}" if path else label
    here = net, mask, color, color_rank, material, material_rank, path, mode, mode_rank, offset, scale, parts
    return tuple.__new__(_State, here)  # one for each node: `_State(...)` takes twice as long


def _labels(children: Sequence[PandaNode]) -> list[str]:
    """Return the names of one parent's children, numbered where they are equal."""
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
