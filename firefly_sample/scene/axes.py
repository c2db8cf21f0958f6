"""From glTF's axes to ours and back: the one place that knows both.

glTF, and with it pyrender, has Y up; its cameras look and its lights shine along -Z, and its matrices are for
column vectors. Here Z is up, cameras look and lights shine along +Y, and matrices are for row vectors. One
quarter turn about X, (x, y, z) there is (x, -z, y) here, serves points, normals and the own axes of nodes,
cameras and lights alike. It only moves numbers and changes their signs, so nothing is rounded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float64 = NDArray[np.float64]

_FROM_GLTF = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
"""For row vectors."""


def vectors_from_gltf(vectors: ArrayLike) -> Float64:
    """Points or directions, shape (..., 3), from glTF's axes to ours; float64."""
    return np.asarray(np.asarray(vectors, dtype=np.float64) @ _FROM_GLTF[:3, :3])


def vectors_to_gltf(vectors: ArrayLike) -> Float64:
    """Points or directions, shape (..., 3), from our axes to glTF's; float64."""
    return np.asarray(np.asarray(vectors, dtype=np.float64) @ _FROM_GLTF[:3, :3].T)


def matrix_from_gltf(matrix: ArrayLike) -> Float64:
    """Our matrix of a transform, for row vectors, from glTF's, for column vectors; shape (4, 4), float64."""
    return np.asarray(_FROM_GLTF.T @ np.asarray(matrix, dtype=np.float64).T @ _FROM_GLTF)


def matrix_to_gltf(matrix: ArrayLike) -> Float64:
    """The matrix of a transform in glTF, for column vectors, from ours, for row vectors; (4, 4), float64."""
    return np.asarray((_FROM_GLTF @ np.asarray(matrix, dtype=np.float64) @ _FROM_GLTF.T).T)
