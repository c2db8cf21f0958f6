"""Axes and colours of formats other than glTF, turned into those of this package."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.model.formats import Up
from firefly_sample.scene.arrays import Float64
from firefly_sample.srgb import srgb_to_linear

_TURNS = {
    "x": [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]],
    "y": [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
    "z": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
}
"""Matrices for row vectors, from the axes of a file with this axis up to ours.

A file's right, up and front (the side that is looked at) become X, Z and -Y. They are its X, Y and Z if Y is
up, its X, Z and -Y if Z is, and its -Y, X and Z if X is (COLLADA 1.5, "up_axis").
"""


def turn(up: Up) -> Float64:
    """Return the rotation (3, 3), for row vectors, from a file's axes to Z up; it only moves and negates."""
    return np.array(_TURNS[up])


def turn_matrix(up: Up, matrix: Float64) -> Float64:
    """Return a 4x4 matrix for row vectors in our axes that does what `matrix` does in the file's."""
    turned = np.eye(4)
    turned[:3, :3] = turn(up)
    return np.asarray(turned.T @ matrix @ turned) + 0.0  # no negative zeros


def linear_color(display: ArrayLike) -> tuple[float, float, float]:
    """Return a linear colour of display codes, which are clipped to 0..1."""
    red, green, blue = srgb_to_linear(np.clip(np.asarray(display, dtype=np.float64), 0.0, 1.0)).tolist()
    return (red, green, blue)


def linear_colors(display: NDArray[Any]) -> Float64:
    """Return linear colours (n, 4) of display codes (n, 3) or (n, 4); alpha is linear as it is.

    Codes are whole numbers, whose largest is white, or floats of 0 to 1.
    """
    white = np.iinfo(display.dtype).max if display.dtype.kind == "u" else 1
    codes = np.clip(display.astype(np.float64) / white, 0.0, 1.0)
    alpha = codes[:, 3:4] if codes.shape[1] == 4 else np.ones((len(codes), 1))
    return np.concatenate([srgb_to_linear(codes[:, :3]), alpha], axis=1)
