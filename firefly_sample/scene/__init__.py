"""The scene: what there is, in float64 and without any OpenGL."""

from __future__ import annotations

from firefly_sample.scene.node import ALL_CAMERAS, PandaNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.path_transform import net_matrix
from firefly_sample.scene.transform_state import TransformState
from firefly_sample.scene.traversal import Visit, iter_visible

__all__ = ["ALL_CAMERAS", "NodePath", "PandaNode", "TransformState", "Visit", "iter_visible", "net_matrix"]
