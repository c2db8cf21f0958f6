"""Find the lens of a projection matrix, for cameras of classes that are not pyrender's own.

Such a camera is known by what its `get_projection_matrix` returns: an OpenGL matrix for column vectors and a
view along -z with y up. For row vectors in our axes, it must be the matrix of a lens, as
`firefly_sample.scene.lens_constants` has it, times a number above 0. Its planes are where clip z is -w and w:

    perspective     near = -D / (B + 1)    far = D / (1 - B), infinite where B = 1
    orthographic    near = (-1 - D) / B    far = (1 - D) / B
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LensError
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens

Float64 = NDArray[np.float64]

_ERROR = 1e-6
"""The most by which a lens's matrix may differ from the camera's, over the largest number of its column."""


def has_own_projection(camera: Any) -> bool:
    """Return True if a pyrender camera's projection is not one of pyrender's own three."""
    import pyrender

    own = pyrender.PerspectiveCamera, pyrender.OrthographicCamera, pyrender.IntrinsicsCamera
    method = getattr(camera.get_projection_matrix, "__func__", None)
    return all(method is not kind.get_projection_matrix for kind in own)


def lens_of_projection(camera: Any, size: tuple[int, int]) -> PerspectiveLens | OrthographicLens | None:
    """Return the lens of a pyrender camera's matrix for pictures of a size, or None if no lens has it."""
    matrix = _in_our_axes(camera.get_projection_matrix(width=size[0], height=size[1]))
    if matrix is None:
        return None
    perspective = matrix[3, 3] == 0.0
    a, b, c, d = matrix[0, 0], matrix[1, 2], matrix[2, 1], matrix[3, 2]
    x_offset, z_offset = matrix[1 if perspective else 3, :2]
    try:
        with np.errstate(divide="ignore", invalid="ignore"):
            near, far = (-d / (b + 1.0), d / (1.0 - b)) if perspective else ((-1.0 - d) / b, (1.0 - d) / b)
        if perspective and abs(1.0 - b) <= np.finfo(np.float32).eps:
            far = math.inf
        width, height = size
        lens = (PerspectiveLens if perspective else OrthographicLens).from_intrinsics(
            fx=0.5 * a * width,
            fy=0.5 * c * height,
            cx=0.5 * width * (1.0 + x_offset),
            cy=0.5 * height * (1.0 - z_offset),
            width=width,
            height=height,
            near=float(near),
            far=float(far),
            pixel_center=0.5,
        )
    except LensError:
        return None
    error = np.abs(lens.get_projection_mat() - matrix)
    return lens if (error <= _ERROR * np.abs(matrix).max(axis=0)).all() else None


def _in_our_axes(given: Any) -> Float64 | None:
    """Return an OpenGL matrix in our axes for row vectors, w being y or 1; None if it cannot be a lens's."""
    found = np.asarray(given, dtype=np.float64)
    if found.shape != (4, 4) or not np.isfinite(found).all():
        return None
    x, up, back, one = found.T
    matrix = np.array([x, -back, up, one])
    weight = matrix[1, 3] + matrix[3, 3]
    return np.asarray(matrix / weight) if weight > 0.0 else None
