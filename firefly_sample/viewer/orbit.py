"""A camera that the mouse moves around a pivot, starting at the scene's own camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lens_constants import LensConstants
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.other_camera import focus_of, pivot_distance
from firefly_sample.scene.scene import Camera, Scene
from firefly_sample.scene.transforms import rows_from_hpr

Float64 = NDArray[np.float64]

TURN = 180.0
"""Degrees by which a drag over the window's height turns."""
ZOOM = 0.9
"""Factor of the distance per step of the wheel."""
RANGE = 1e4
"""The largest factor by which zooming can change the first distance."""


class OrbitCamera:
    """A camera with a heading, a pitch and a distance from a pivot; its roll is the scene's camera's.

    At first the pivot is on the view axis, at the distance of the scene's focus or centre, so that the first
    picture is the scene's own. Drags are measured in heights of the window, right and down.

    Attributes
    ----------
    path : NodePath
        To the `Camera`. It has a root of its own, so that moving it does not change the scene's graph.
    pivot : ndarray of float64, shape (3,), world space
    """

    def __init__(self, scene: Scene) -> None:
        net = scene.camera.get_net_transform()
        self._lens = scene.lens.near_first().make_copy()
        self._first_lens = self._lens.make_copy()
        self.path = NodePath(Camera("orbit camera", self._lens))
        self._heading, self._pitch, self._roll = net.get_hpr()
        eye, forward = np.array(net.get_pos()), self._axes()[1]
        self._first_distance = pivot_distance(scene, focus_of(scene), eye, forward)
        self._zoom = 1.0
        self.pivot: Float64 = eye + self._first_distance * forward
        self._place()

    @property
    def distance(self) -> float:
        """Distance from the camera to the pivot in scene units, always above 0."""
        return self._first_distance * (self._zoom if self._lens.is_perspective() else 1.0)

    def turn(self, right: float, down: float) -> None:
        """Turn around the pivot; the pitch stops at straight up and straight down."""
        self._heading -= TURN * right
        self._pitch = min(max(self._pitch - TURN * down, -90.0), 90.0)
        self._place()

    def pan(self, right: float, down: float, lens: LensConstants) -> None:
        """Shift the view so that surfaces at the pivot's distance follow the mouse.

        `lens` has the constants of the lens with which the window's picture is drawn.
        """
        across, _, up = self._axes()
        height = 2.0 / lens.c * (self.distance if lens.perspective else 1.0)
        self.pivot = self.pivot + height * (down * up - right * across)
        self._place()

    def zoom(self, steps: float) -> None:
        """Move towards the pivot, or away from it if `steps` is negative, but never through it.

        The near and far planes follow, so that they do not clip the scene. An orthographic lens, for which
        distance changes nothing, scales its film instead.
        """
        self._zoom = min(max(self._zoom * ZOOM**steps, 1.0 / RANGE), RANGE)
        first = self._first_lens
        if isinstance(self._lens, OrthographicLens):
            self._lens.scale_film(first.get_film_size()[0] / self._lens.get_film_size()[0] * self._zoom)
        else:
            further = max(0.0, self.distance - self._first_distance)
            self._lens.set_near_far(first.get_near() * min(1.0, self._zoom), first.get_far() + further)
            self._place()

    def _axes(self) -> Float64:
        """Return right, forward and up in world space, the rows of an array of shape (3, 3)."""
        return np.array(rows_from_hpr((self._heading, self._pitch, self._roll)))

    def _place(self) -> None:
        self.path.set_hpr(self._heading, self._pitch, self._roll)
        self.path.set_pos(self.pivot - self.distance * self._axes()[1])
