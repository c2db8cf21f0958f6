"""A scene that is seen by a camera other than its own, and the point that such a camera turns around."""

from __future__ import annotations

import math

import numpy as np

from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Scene


class SceneWithCamera(Scene):
    """A scene with a camera in place of its own, which its `update` may continue to move.

    The camera has a root of its own, so that moving it does not change the scene's graph.
    """

    def __init__(self, scene: Scene, camera: NodePath) -> None:
        super().__init__(scene.root, camera, scene.background, scene.exposure, scene.focus)
        self._scene = scene

    def update(self, time: float) -> None:
        """Update the original scene."""
        self._scene.update(time)
        self.background, self.exposure = self._scene.background, self._scene.exposure
        self.focus = self._scene.focus


def focus_of(scene: Scene) -> Float64 | None:
    """Return the scene's focus or, without one, the centre of what is drawn; None if that is nothing."""
    if scene.focus is not None:
        return np.array(scene.focus, dtype=np.float64)
    bounds = scene.root.get_tight_bounds()
    return None if bounds is None else 0.5 * (bounds[0] + bounds[1])


def pivot_distance(scene: Scene, focus: Float64 | None, eye: Float64, forward: Float64) -> float:
    """Return the distance of a focus along a view axis, or a guess by the lens if it is not in front."""
    lens = scene.lens.near_first()
    near, far = lens.get_near(), lens.get_far()
    if focus is not None:
        ahead = float((focus - eye) @ forward)
        if ahead > max(near, 0.0):
            return ahead
    if lens.is_perspective():
        return math.sqrt(near * min(far, 1e3 * near))
    return lens.get_film_size()[1]
