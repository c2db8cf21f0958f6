"""The point that the cameras of a capture look at, and their distance from it."""

from __future__ import annotations

from typing import Any

import numpy as np

from firefly_sample.capture.datasets.dataset import Matrix

_SPREAD = 0.01
"""Mean square of the axes' sines from which on they fix a point: axes that differ by six degrees."""
DISTANCE = 1.32
"""Units of instant-ngp from the cameras to what they look at: 4 times 0.33, as in the first NeRF scenes."""


class Surroundings:
    """The point that cameras look at, gathered pose by pose.

    It is the point with the least sum of squared distances from their axes. If these are nearly parallel, it
    is the mean of the cameras' positions. All positions are kept relative to the first one, so that a scene
    far from the origin loses no digits.
    """

    def __init__(self) -> None:
        self._count = 0
        self._first = np.zeros(3)
        self._sum, self._across = np.zeros(3), np.zeros(3)
        self._axes = np.zeros((3, 3))
        self._squares = 0.0

    def add(self, camera_to_world: Matrix) -> None:
        """Take one camera into account; its third column is its axis."""
        pose = np.array(camera_to_world)
        position, axis = pose[:3, 3], pose[:3, 2]
        if not self._count:
            self._first = position
        position = position - self._first
        across = np.eye(3) - np.outer(axis, axis)
        self._count += 1
        self._sum += position
        self._squares += float(position @ position)
        self._axes += across
        self._across += across @ position

    def as_unit_cube(self) -> dict[str, Any]:
        """Return instant-ngp's scale and offset: with p in scene units, ``p * scale + offset``.

        The point that the cameras look at becomes the middle of its unit cube, and their root mean square
        distance from it `DISTANCE`. Both are rounded to six digits.
        """
        if not self._count:
            return {}
        mean = self._sum / self._count
        fixed = np.linalg.eigvalsh(self._axes)[0] > _SPREAD * self._count
        centre = np.linalg.solve(self._axes, self._across) if fixed else mean
        square = self._squares / self._count - 2.0 * centre @ mean + centre @ centre
        # cameras that turn in one place are at no distance
        scale = DISTANCE / np.sqrt(square) if square > 1e-12 else 0.33
        scale = float(f"{scale:.6g}")
        offset = 0.5 - scale * (self._first + centre)
        return {"scale": scale, "offset": [float(f"{value:.6g}") for value in offset]}
