"""Tight bounds: the box of all vertices below a node."""

from __future__ import annotations

import numpy as np

from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.transforms import Float64


def tight_bounds(top: PandaNode, matrix: Float64) -> tuple[Float64, Float64] | None:
    """The axis-aligned box (minimum, maximum) of every vertex at and below `top`; None without any.

    Parameters
    ----------
    top : PandaNode
        Hidden nodes count, as in Panda3D.
    matrix : ndarray of float64, shape (4, 4)
        From the space of `top` to the space that the box is wanted in.
    """
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    waiting = [(top, matrix)]
    while waiting:
        node, net = waiting.pop()
        for points in node.iter_local_points():
            if len(points):
                moved = points @ net[:3, :3] + net[3, :3]
                low = np.minimum(low, moved.min(axis=0))
                high = np.maximum(high, moved.max(axis=0))
        for child in node.children:
            local = child.transform
            waiting.append((child, net if local.is_identity else local.get_mat() @ net))
    return (low, high) if np.isfinite(low).all() else None
