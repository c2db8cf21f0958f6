"""How far off a position is expected to be, by where it comes from, and whether that shows.

Depth in perspective is scale/y + offset, so an error d of the depth becomes an error of the distance y of

    dy / y = d * y * (far - near) / (far * near),

about d * y / near: what is far away has few codes, or none. d is half a code of the buffer and, in 24 bits,
twice to three times as much again: what float32 rounds of the depth that is interpolated and of the
shader's constants. Through the inverse of the view-projection matrix, homogeneous coordinates of the world
are small differences of large numbers, so the camera's distance from the world's origin is rounded, and
that is magnified by y / near, too. (The law is derived in docs/unprojection.md; the factors are the largest
errors measured on llvmpipe, by the cases "distance ..." of `firefly_sample.lab.stability`.)

Whether an error e shows is judged beside a light. Light that fades as 1/d^2 changes by 2*e/d where a
surface at distance d from the light is moved by e. A display code is worth the least relative change at
white: sRGB is 1.055*L^(1/2.4) - 0.055 there, which rises by 1.055/2.4 of dL/L, so that one code of 255 is
dL/L = 0.0089. At a level L below white it rises by L^(1/2.4) of that.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float64 = NDArray[np.float64]

CODE = 2.4 / 1.055 / 255.0
"""Relative change of radiance that is worth a display code at white, and less where it is darker."""
HALF_FLOAT_END = 65504.0
"""The largest half float."""

_DEPTH_STEP: dict[str, float] = {"depth24": 1.5e-7, "inverse_matrix": 1.8e-7, "depth16": 2.0**-17 + 1.5e-7}
"""Largest error of a depth in 0..1 by the time that a distance is made of it."""
_RELATIVE: dict[str, float] = {"linear32f": 4.5e-7, "stored32f": 4.5e-7, "depth32f": 1.8e-7}
"""Largest relative error of the methods that do not depend on near and far."""
_HALF_STEP, _SMALLEST_HALF = 2.0**-10, 2.0**-24
"""What a half float may lose where a driver cuts digits off, relative, and what the smallest ones lose at
least."""
_FLOAT = 2.0**-24
_LINEAR = 0.0031308
"""Below, sRGB is 12.92 times as much."""


def depth_error(step: float, near: float, far: float, perspective: bool, distance: ArrayLike) -> Float64:
    """The error of distances, in scene units, from an error `step` of a standard depth in 0..1.

    Parameters
    ----------
    near, far : float
        The lens's planes, scene units; `far` may be infinite in perspective.
    distance : array_like
        Along the view axis, scene units; any shape, which the result has.
    """
    y = np.asarray(distance, dtype=np.float64)
    if not perspective:
        return np.full_like(y, step * (far - near))
    share = 1.0 if math.isinf(far) else (far - near) / far
    return np.asarray(step * share * y / near * y)


def position_errors(
    method: str,
    near: float,
    far: float,
    perspective: bool,
    distance: ArrayLike,
    from_origin: float = 0.0,
    clip_control: bool = True,
) -> Float64:
    """How far off positions at some distances may be.

    Parameters
    ----------
    method : str
        A choice of `Settings.position_method`.
    near, far : float
        The lens's planes, scene units; `far` may be infinite in perspective.
    perspective : bool
    distance : array_like
        Along the view axis, scene units; any shape.
    from_origin : float
        From the camera to the world's origin, scene units: "inverse_matrix" goes through world coordinates.
    clip_control : bool
        Whether the driver has it; without, "depth32f" is a standard 24-bit depth buffer.

    Returns
    -------
    ndarray of float64, of the distances' shape
        Scene units, at least 0; may be larger than `distance`, which means noise.
    """
    y = np.asarray(distance, dtype=np.float64)
    if method == "stored16f":
        rounded = np.maximum(_HALF_STEP * np.minimum(y, HALF_FLOAT_END), _SMALLEST_HALF)
        return np.maximum(rounded, y - HALF_FLOAT_END)
    if method == "depth32f" and not clip_control:
        method = "depth24"
    if method not in _DEPTH_STEP:
        return np.asarray(_RELATIVE[method] * y)
    error = depth_error(_DEPTH_STEP[method], near, far, perspective, y)
    if method == "inverse_matrix":
        magnified = y / near if perspective else np.ones_like(y)
        error = error + _FLOAT * from_origin * np.maximum(magnified, 1.0)
    return error


def position_error(
    method: str,
    near: float,
    far: float,
    perspective: bool,
    distance: float,
    from_origin: float = 0.0,
    clip_control: bool = True,
) -> float:
    """`position_errors` of a single distance."""
    return float(position_errors(method, near, far, perspective, distance, from_origin, clip_control))


def codes_shown(error: ArrayLike, from_light: ArrayLike, level: ArrayLike = 1.0) -> Float64:
    """How many display codes a light is off by, on a surface `from_light` away that is moved by `error`.

    `level` is how bright the surface is there, 0 to 1: the same share of what is darker is fewer codes.
    """
    beside, shown = np.asarray(from_light, dtype=np.float64), np.minimum(level, 1.0)
    slope = np.where(shown > _LINEAR, shown ** (1.0 / 2.4), 12.92 * 2.4 / 1.055 * shown)
    with np.errstate(divide="ignore", invalid="ignore"):
        codes = 2.0 * np.asarray(error, dtype=np.float64) / beside / CODE * slope
    return np.where(beside > 0.0, codes, np.inf)
