"""Points to and from a lens's film, as in Panda3D: in space, on the film, and on the near and far planes.

Space is that of the lens, X right, Y forward, Z up. A point on the film has NDC from -1 to 1, x to the right
and y up; a third number is -1 on the near plane and 1 on the far one. As in Panda3D, a method may be given an
object to write to, one of Panda3D's, an array or a list, and returns a bool then.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import LensError
from firefly_sample.scene.arrays import Float64, as_numbers
from firefly_sample.scene.lens_constants import LensConstants

FILM_EDGE = 1.0 + 1e-6
"""The NDC up to which a point is on the film, as in Panda3D: its edges belong to it."""
ENDLESS = 1e7
"""The distance of the point that `LensPoints.extrude` returns on a plane at infinity, as in Panda3D."""


class LensPoints(ABC):
    """The part of a lens that brings points to its film and back."""

    _PERSPECTIVE: ClassVar[bool]
    _near: float
    _far: float

    @abstractmethod
    def constants(self) -> LensConstants:
        """Return the constants of the projection."""

    def project(self, point: ArrayLike, out: Any = None) -> Any:
        """Return the NDC of view-space points of shape (3,) or (..., 3).

        One point gives a tuple of two floats, or None if it is off the film; many give an array of shape
        (..., 2), with NaN for those that are off the film. As in Panda3D, near and far do not matter: a point
        is off the film only behind the eye or outside its edges.

        With `out`, which takes two or three numbers, return whether one point is on the film. The numbers are
        written wherever it is in front of the eye, and are 0 elsewhere.
        """
        p = _points(point, 3)
        in_front = p[..., 1] > 0.0 if self._PERSPECTIVE else np.ones(p.shape[:-1], dtype=bool)
        safe = np.where(in_front[..., None], p, (0.0, 1.0, 0.0))
        ndc = self.constants().ndc_from_view(safe)
        seen = in_front & (np.abs(ndc[..., :2]) <= FILM_EDGE).all(axis=-1)
        if out is not None:
            ndc[..., 2] = 2.0 * ndc[..., 2] - 1.0
            _write(out, ndc if in_front.all() else np.zeros_like(ndc))
            return bool(seen)
        ndc = ndc[..., :2]
        if p.ndim == 1:
            return (float(ndc[0]), float(ndc[1])) if seen else None
        return np.where(seen[..., None], ndc, np.nan)

    def extrude(self, point: ArrayLike, near: Any = None, far: Any = None) -> Any:
        """Return the view-space points on the near and the far plane at NDC of shape (2,) or (..., 2).

        On a plane at infinity, the point at the distance `ENDLESS` is returned. With `near` and `far`, which
        take three numbers each, return True for one point; as in Panda3D, a third number of it is ignored.
        """
        if (near is None) != (far is None):
            raise LensError("extrude writes to two objects or to none: give both near and far, or neither")
        if near is not None and np.shape(point) == (3,):
            point = np.asarray(point)[:2]
        x, y = np.moveaxis(_points(point, 2), -1, 0)
        k = self.constants()
        found = [
            k.view_from_distance(x, y, plane if math.isfinite(plane) else ENDLESS)
            for plane in (self._near, self._far)
        ]
        if near is None:
            return found[0], found[1]
        _write(near, found[0])
        _write(far, found[1])
        return True

    def extrude_depth(self, point: ArrayLike, out: Any = None) -> Any:
        """Return the view-space points at NDC (x, y, z) of shape (3,) or (..., 3), z -1 at near and 1 at far.

        The inverse of `get_projection_mat` followed by the division by w. With `out`, which takes three
        numbers, return True for one point.
        """
        x, y, z = np.moveaxis(_points(point, 3), -1, 0)
        return _result(out, self.constants().view_from_depth(x, y, 0.5 * z + 0.5))

    def extrude_vec(self, point: ArrayLike, out: Any = None) -> Any:
        """Return the normals of the far plane at NDC of shape (2,) or (..., 2): the view axis, everywhere.

        With `out`, which takes three numbers, return True for one point.
        """
        points = as_numbers("points", point, LensError)
        points = _points(points, 3 if points.shape == (3,) else 2)
        return _result(out, np.broadcast_to((0.0, 1.0, 0.0), (*points.shape[:-1], 3)).copy())


def _points(value: ArrayLike, size: int) -> Float64:
    points = as_numbers("points", value, LensError)
    if points.ndim == 0 or points.shape[-1] != size:
        raise LensError(f"points must have shape ({size},) or (..., {size}), got {points.shape}")
    return points


def _result(out: Any, points: Float64) -> Any:
    """Return points, or write one of them and return True."""
    if out is None:
        return points
    _write(out, points)
    return True


def _write(out: Any, point: Float64) -> None:
    """Write a point to an object of as many numbers, or of fewer."""
    if point.ndim != 1:
        raise LensError(f"one point at a time is written to an object, got points of shape {point.shape}")
    try:
        for index in range(min(len(out), 3)):
            out[index] = float(point[index])
    except TypeError:
        raise LensError(
            f"a point is written to one of Panda3D's, an array or a list, got {out!r}: leave it out, and the "
            "point is returned"
        ) from None
