"""The children that nodes of Panda3D show: levels of detail, switches and sequences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.transforms import affine_matrix
from firefly_sample.scene.arrays import Float64


def selected_children(
    node: Any, net: Float64, eye: Float64 | None, camera: Any, losses: Losses
) -> Sequence[Any]:
    """Return the children that a node of Panda3D shows to a camera.

    Parameters
    ----------
    node : panda3d.core.PandaNode
    net, eye : ndarray of shape (4, 4)
        From the node and from the camera to the world. Without a camera's, the most detailed level counts.
    camera : panda3d.core.NodePath or None
        Of a Camera, which may have a factor and a centre of its own for levels of detail.
    losses : Losses
    """
    from panda3d import core

    children = node.get_children()
    if isinstance(node, core.LODNode):
        if isinstance(node, core.FadeLODNode):
            losses.add("levels of detail change at once, and do not fade", node.get_name())
        if eye is None:
            return _one(children, node.get_highest_switch()) if node.get_num_switches() else []
        distance = _lod_distance(node, net, eye, camera)
        count = min(len(children), node.get_num_switches())
        return [children[i] for i in range(count) if node.get_out(i) <= distance < node.get_in(i)]
    if isinstance(node, core.SwitchNode):
        return _one(children, node.get_visible_child())
    if isinstance(node, core.SequenceNode):
        return _one(children, node.get_frame())
    return list(children)


def _one(children: Any, index: int) -> Sequence[Any]:
    return [children[index]] if 0 <= index < len(children) else []


def _lod_distance(node: Any, net: Float64, eye: Float64, camera: Any) -> float:
    """Return the distance of the centre of levels of detail from the camera, in the camera's space."""
    scale = node.get_lod_scale()
    if camera is not None:
        lens = camera.node()
        scale *= lens.get_lod_scale()
        if not lens.get_lod_center().is_empty():
            eye = affine_matrix(lens.get_lod_center().get_net_transform().get_mat())
    center = np.array([*node.get_center(), 1.0]) @ net
    return float(np.linalg.norm((center @ np.linalg.inv(eye))[:3]) * scale)
