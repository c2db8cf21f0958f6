"""Transforms of Panda3D as ours."""

from __future__ import annotations

from typing import Any

import numpy as np

from firefly_sample.errors import SceneError
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.transform_state import IDENTITY, TransformState


def node_transform(node: Any) -> Any:
    """Return a node's TransformState; a TextNode has another method of that name, for its letters."""
    from panda3d import core

    return core.PandaNode.get_transform(node)


def read_transform(transform: Any, name: str) -> TransformState:
    """Return a TransformState of Panda3D as one of ours, made of components if it was made of them there.

    Raises
    ------
    SceneError
        If a number is not finite; the message has the name.
    """
    if transform.is_identity():
        return IDENTITY
    if transform.is_invalid():
        raise SceneError(f"node {name!r}: its transform has a number that is not finite")
    if not transform.components_given():
        return TransformState.make_mat(affine_matrix(transform.get_mat()))
    pos, scale, shear = (
        tuple(vector) for vector in (transform.get_pos(), transform.get_scale(), transform.get_shear())
    )
    if not transform.quat_given():
        return TransformState.make_pos_hpr_scale_shear(pos, tuple(transform.get_hpr()), scale, shear)
    quat = np.array(tuple(transform.get_quat()))
    quat /= np.linalg.norm(quat)
    w, x, y, z = quat.tolist()
    return TransformState.make_pos_quat_scale_shear(pos, (w, x, y, z), scale, shear)


def local_transform(net: Float64, above: Float64) -> TransformState:
    """Return the transform of a node with one net matrix below a node with another, shapes (4, 4)."""
    local = net @ np.linalg.inv(above)
    local[:, 3] = 0.0, 0.0, 0.0, 1.0
    return TransformState.make_mat(local)


def affine_matrix(matrix: Any) -> Float64:
    """Return an LMatrix4 of Panda3D as float64, shape (4, 4), for row vectors."""
    return np.array([tuple(matrix.get_row(row)) for row in range(4)], dtype=np.float64)
