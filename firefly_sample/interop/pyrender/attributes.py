"""Make the arrays of a pyrender primitive such as a Geom takes: finite, with colours from 0 to 1.

pyrender hands every number to OpenGL. Its pictures lack the triangles and points of a vertex that is not
finite, as those of a depth sensor often are; so do ours.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.losses import Losses

_NO_PLACES = "triangles, lines and points at vertices that are not finite are left out"
_NO_NORMALS = "normals that are not finite become 0, which is lit as if it faced the camera"
_NO_TEXCOORDS = "texture coordinates that are not finite become 0"
_OTHER_COLORS = "vertex colours are clipped to 0 to 1"


class Attributes(NamedTuple):
    """The arrays of a primitive, in pyrender's axes, and its corners, shape (m, 1), (m, 2) or (m, 3)."""

    positions: NDArray[Any]
    normals: NDArray[Any] | None
    texcoords: NDArray[Any] | None
    texcoords_1: NDArray[Any] | None
    colors: NDArray[Any] | None
    corners: NDArray[np.int64]


def usable_attributes(primitive: Any, corners: NDArray[np.int64], name: str, losses: Losses) -> Attributes:
    """Return the arrays of a primitive without what a Geom refuses, which is noted as a loss of that name."""
    positions, colors = primitive.positions, primitive.color_0
    finite = np.isfinite(positions).all(axis=1)
    if not finite.all():
        losses.add(_NO_PLACES, name)
        corners = corners[finite.take(corners, mode="clip").all(axis=1)]
        # the others are moved to one that is, so that the bounds stay
        positions = np.where(finite[:, None], positions, positions[finite][:1] if finite.any() else 0.0)
    if colors is not None and not ((colors >= 0.0) & (colors <= 1.0)).all():
        losses.add(_OTHER_COLORS, name)
        colors = np.nan_to_num(colors, nan=0.0).clip(0.0, 1.0)

    def replaced(array: NDArray[Any] | None, loss: str) -> NDArray[Any] | None:
        if array is None or np.isfinite(array).all():
            return array
        losses.add(loss, name)
        return np.where(np.isfinite(array).all(axis=1, keepdims=True), array, 0.0)

    return Attributes(
        positions,
        replaced(primitive.normals, _NO_NORMALS),
        replaced(primitive.texcoord_0, _NO_TEXCOORDS),
        replaced(primitive.texcoord_1, _NO_TEXCOORDS),
        colors,
        corners,
    )
