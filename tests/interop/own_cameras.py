"""Cameras with projections of their own, as scripts that draw body models have them."""

from __future__ import annotations

import numpy as np
import pyrender


class WeakPerspective(pyrender.Camera):
    """Parallel rays that start one unit behind the camera and end one in front: a scale and a shift."""

    def __init__(self, scale, shift):
        super().__init__(znear=0.05, zfar=1000.0)
        self.scale, self.shift = np.array(scale), np.array(shift)

    def get_projection_matrix(self, width=None, height=None):
        matrix = np.diag([*self.scale, -1.0, 1.0])
        matrix[:2, 3] = self.shift * self.scale * (1.0, -1.0)
        return matrix


class Calibrated(pyrender.Camera):
    """A pinhole camera by its matrix of intrinsics, as float32 and not of weight 1."""

    def __init__(self, intrinsics):
        super().__init__(znear=0.5, zfar=50.0)
        self.intrinsics = np.array(intrinsics)

    def get_projection_matrix(self, width=None, height=None):
        (fx, _, cx), (_, fy, cy), _ = self.intrinsics
        near, far = self.znear, self.zfar
        matrix = np.zeros((4, 4), dtype=np.float32)
        matrix[0, 0], matrix[0, 2] = 2.0 * fx / width, 1.0 - 2.0 * cx / width
        matrix[1, 1], matrix[1, 2] = 2.0 * fy / height, 2.0 * cy / height - 1.0
        matrix[2, 2:] = (far + near) / (near - far), 2.0 * far * near / (near - far)
        matrix[3, 2] = -1.0
        return 3.0 * matrix


class Shifted(pyrender.PerspectiveCamera):
    """One of pyrender's own, with an infinite far plane, whose matrix is changed."""

    def get_projection_matrix(self, width=None, height=None):
        matrix = super().get_projection_matrix(width, height)
        matrix[0, 0] *= 0.8
        matrix[0, 2] = 0.2
        return matrix


class Fixed(pyrender.Camera):
    """Any matrix."""

    def __init__(self, matrix):
        super().__init__()
        self.matrix = matrix

    def get_projection_matrix(self, width=None, height=None):
        return self.matrix
