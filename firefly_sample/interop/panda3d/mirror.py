"""A scene of our own that follows a Panda3D scene graph, seen by one of its cameras."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.followed import Followed
from firefly_sample.model.panda3d.graph import GraphTree
from firefly_sample.model.panda3d.transforms import affine_matrix, local_transform
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Camera, Scene


class GraphMirror:
    """Follows the graph below one of Panda3D's NodePaths, see `GraphTree`, and the camera that looks at it.

    Parameters
    ----------
    root : panda3d.core.NodePath
        Nodes above it count for transforms and states, and are not drawn.
    camera : panda3d.core.NodePath, optional
        A path to a Camera of any graph; the first one below the root when absent, or else one at the origin.
    background : (float, float, float)
        The colour where nothing is drawn.
    lit : bool, optional
        Whether surfaces are lit that do not say otherwise; if the graph has a light when absent.

    Attributes
    ----------
    scene : Scene
    losses : Losses
        All that is not drawn, or drawn differently, so far.
    """

    def __init__(
        self,
        root: Any,
        camera: Any = None,
        *,
        background: tuple[float, float, float] = (0.0, 0.0, 0.0),
        lit: bool | None = None,
    ) -> None:
        self._root, self._camera = root, camera
        self.losses = Losses()
        self._tree = GraphTree(root, self.losses)
        self._tree.lit = lit
        self._spare = NodePath(Camera("camera"))  # below the root as long as the graph has no other
        self._far: Followed | None = None  # of a camera that is not below the root
        self.scene = Scene(self._tree.path, self._spare, background)

    def update(self) -> Scene:
        """Bring the scene up to date, and return it.

        Raises
        ------
        SceneError
            If there is no lens of ours for the camera's, or a transform has a number that is not finite.
        """
        cameras = self._tree.update(self._eye(), self._camera)
        if self._camera is not None and self._camera.node().get_tag_state_key():
            self.losses.add("states that a camera gives to tags are not used", self._camera.get_name())
        chosen = self._choose(cameras)
        for followed in cameras:
            if followed is not chosen:
                followed.note_fault(self.losses)
        if chosen is None:
            if not self._spare.has_parent():
                self._spare.reparent_to(self._tree.path)
            self.scene.camera = self._spare
            return self.scene
        self._spare.detach_node()
        if chosen.fault is not None:
            raise chosen.fault
        self.scene.camera = chosen.lens or chosen.path
        return self.scene

    def _eye(self) -> Float64:
        """Return the matrix from the camera to the world."""
        if self._camera is not None:
            return affine_matrix(self._camera.get_net_transform().get_mat())
        for found in self._root.find_all_matches("**/+Camera"):
            if found.node().as_light() is None:
                return affine_matrix(found.get_net_transform().get_mat())
        return np.eye(4)

    def _choose(self, cameras: Sequence[Followed]) -> Followed | None:
        """Return the camera of the scene; one that is not below the root gets a node there."""
        if self._camera is None:
            return cameras[0] if cameras else None
        node = self._camera.node()
        for followed in cameras:
            if followed.source == node:
                return followed
        top = self._tree.path
        if self._far is None:
            self._far = Followed(node, top.attach_new_node(Camera(node.get_name())))
        self._far.path.node().set_transform(local_transform(self._eye(), top.node().transform.get_mat()))
        self._tree.follow_lens(self._far)
        return self._far
