"""The intrinsics of a camera: how a picture's pixels belong to points of the camera's space.

A view-space point (x, y, z), X right, Y forward, Z up, has the image coordinates (u, v), u to the right and v
downwards::

    perspective     u = fx * x / y + cx     v = cy - fy * z / y
    orthographic    u = fx * x + cx         v = cy - fy * z

with fx and fy in pixels, or in pixels per scene unit of an orthographic lens. The pixel in column c and row r
has its centre at u = c + pixel_center and v = r + pixel_center. From a lens's constants (see
`firefly_sample.scene.lens_constants`), for a picture of w x h pixels::

    fx = A * w / 2      cx = (1 + x_offset) * w / 2 - 1/2 + pixel_center
    fy = C * h / 2      cy = (1 - z_offset) * h / 2 - 1/2 + pixel_center
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import LensError, did_you_mean
from firefly_sample.scene.arrays import Float64, as_numbers
from firefly_sample.scene.lens_constants import LensConstants
from firefly_sample.scene.lens_numbers import finite, pixels, planes

Projection = Literal["perspective", "orthographic"]

_REQUIRED = ("projection", "width", "height", "fx", "fy", "cx", "cy", "near", "far")
_FILM = ("film_size", "film_offset")
KEYS = (*_REQUIRED, "pixel_center", *_FILM)
"""The keys of `Intrinsics.as_dict`."""
_SAME_FILM = 1e-5
"""Relative difference up to which a film agrees with fx and fy: its numbers may have been rounded."""


@dataclass(frozen=True)
class Intrinsics:
    """Focal lengths and principal point of a lens, for pictures of one size.

    Attributes
    ----------
    projection : {"perspective", "orthographic"}
    width, height : int
        Size of the picture in pixels.
    fx, fy : float
        Focal length in widths and in heights of a pixel; of an orthographic lens pixels per scene unit.
    cx, cy : float
        Image coordinates of the principal point, where the view axis meets the picture.
    near, far : float
        Distances of the clipping planes in scene units; `far` of a perspective lens may be ``math.inf``.
    pixel_center : float
        Image coordinate of the first pixel's centre: 0 in OpenCV, where (u, v) are a pixel's column and row;
        0.5 in COLMAP, OpenGL and pyrender, where (0, 0) is the picture's corner.

    Raises
    ------
    LensError
        If a number is impossible; the message names it.
    """

    projection: Projection
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    near: float
    far: float
    pixel_center: float = 0.0

    def __post_init__(self) -> None:
        if self.projection not in ("perspective", "orthographic"):
            raise LensError(
                f"projection must be 'perspective' or 'orthographic', got {self.projection!r}"
                f"{did_you_mean(str(self.projection), ('perspective', 'orthographic'))}"
            )
        checked: dict[str, float] = {name: pixels(name, getattr(self, name)) for name in ("width", "height")}
        checked |= {name: finite(name, getattr(self, name), above=0.0) for name in ("fx", "fy")}
        checked |= {name: finite(name, getattr(self, name)) for name in ("cx", "cy", "pixel_center")}
        checked["near"], checked["far"] = planes(self.is_perspective(), self.near, self.far)
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @classmethod
    def of(
        cls,
        constants: LensConstants,
        size: tuple[int, int],
        near_far: tuple[float, float],
        pixel_center: float = 0.0,
    ) -> Intrinsics:
        """Return the intrinsics of a lens's constants, of any clip range, for a picture of a size."""
        (width, height), first = size, finite("pixel_center", pixel_center) - 0.5
        return cls(
            "perspective" if constants.perspective else "orthographic",
            width,
            height,
            fx=0.5 * width * constants.a,
            fy=0.5 * height * constants.c,
            cx=0.5 * width * (1.0 + constants.x_offset) + first,
            cy=0.5 * height * (1.0 - constants.z_offset) + first,
            near=near_far[0],
            far=near_far[1],
            pixel_center=pixel_center,
        )

    def is_perspective(self) -> bool:
        """Return whether things shrink with distance."""
        return self.projection == "perspective"

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture in pixels."""
        return self.width, self.height

    @property
    def offset(self) -> tuple[float, float]:
        """Offset of the picture's middle from the principal point, right and up, in pixels."""
        corner = 0.5 - self.pixel_center
        return 0.5 * self.width - (self.cx + corner), (self.cy + corner) - 0.5 * self.height

    @property
    def film_size(self) -> tuple[float, float] | None:
        """Width and height of an orthographic lens's film in scene units; None of a perspective lens."""
        return None if self.is_perspective() else (self.width / self.fx, self.height / self.fy)

    @property
    def film_offset(self) -> tuple[float, float] | None:
        """Offset of its film's centre, right and up, in scene units; None of a perspective lens."""
        return None if self.is_perspective() else (self.offset[0] / self.fx, self.offset[1] / self.fy)

    def matrix(self) -> Float64:
        """Return K, shape (3, 3): (u, v, 1) = K @ (right, down, forward) / forward in perspective.

        For an orthographic lens it is (u, v, 1) = K @ (right, down, 1).
        """
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def view_points(self, depth: ArrayLike) -> Float64:
        """Return the view-space point in each pixel's centre: X right, Y forward, Z up.

        Parameters
        ----------
        depth : array of shape (height, width)
            Distance along the view axis in scene units, as in the output "depth"; the first row is the top.

        Returns
        -------
        ndarray of float64, shape (height, width, 3)
            NaN where nothing was drawn: where the depth is not finite or, with a perspective lens, not above
            0, as the codes 0 of a 16-bit depth are.
        """
        distance = as_numbers("depth", depth, LensError)
        if distance.shape != (self.height, self.width):
            raise LensError(
                f"depth must have shape ({self.height}, {self.width}), height and width of these intrinsics, "
                f"got {distance.shape}: take the intrinsics of its own size, lens.intrinsics((width, height))"
            )
        distance[~np.isfinite(distance)] = np.nan
        if self.is_perspective():
            distance[distance <= 0.0] = np.nan
        spread = distance if self.is_perspective() else np.where(np.isnan(distance), np.nan, 1.0)
        points = np.empty((self.height, self.width, 3))
        points[..., 0] = (np.arange(self.width) + self.pixel_center - self.cx) / self.fx * spread
        points[..., 1] = distance
        points[..., 2] = (self.cy - (np.arange(self.height)[:, None] + self.pixel_center)) / self.fy * spread
        return points

    def project(self, points: ArrayLike) -> tuple[Float64, Float64, Float64]:
        """Return u, v and the distance along the view axis of view-space points.

        Parameters
        ----------
        points : array of shape (..., 3)

        Returns
        -------
        tuple of three arrays of float64, shape (...)
            u and v are NaN where a perspective lens has the point at or behind the eye. They are not limited
            to the picture, and near and far do not matter.
        """
        given = as_numbers("points", points, LensError)
        if given.ndim == 0 or given.shape[-1] != 3:
            raise LensError(f"points must have shape (..., 3), got {given.shape}")
        right, forward, up = given[..., 0], given[..., 1], given[..., 2]
        spread = np.where(forward > 0.0, forward, np.nan) if self.is_perspective() else 1.0
        return self.fx * (right / spread) + self.cx, self.cy - self.fy * (up / spread), forward

    def as_dict(self) -> dict[str, Any]:
        """Return everything as a dict for JSON; an infinite far plane is None.

        An orthographic lens also has its film, ``film_size`` and ``film_offset``.
        """
        values: dict[str, Any] = {
            "projection": self.projection,
            "width": self.width,
            "height": self.height,
            "fx": self.fx,
            "fy": self.fy,
            "cx": self.cx,
            "cy": self.cy,
            "pixel_center": self.pixel_center,
            "near": self.near,
            "far": None if math.isinf(self.far) else self.far,
        }
        for name in _FILM:
            if (film := getattr(self, name)) is not None:
                values[name] = list(film)
        return values

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Intrinsics:
        """Return the intrinsics that `as_dict` wrote; LensError names a key that is missing or wrong.

        ``pixel_center`` is 0 when absent. The film of an orthographic lens may be absent; if it is there, it
        must agree with fx, fy, cx and cy.
        """
        if not isinstance(values, Mapping):
            raise LensError(f"intrinsics must be a dict, got {values!r}")
        for key in values:
            if key not in KEYS:
                raise LensError(f"intrinsics have no key {key!r}{did_you_mean(str(key), KEYS)}")
        missing = [key for key in _REQUIRED if key not in values]
        if missing:
            raise LensError(f"intrinsics lack {', '.join(map(repr, missing))}")
        given = {key: values[key] for key in (*_REQUIRED, "pixel_center") if key in values}
        if given["far"] is None:
            given["far"] = math.inf
        read = cls(**cast(Any, given))
        for name in _FILM:
            if name in values:
                read._check_film(name, values[name])
        return read

    def _check_film(self, name: str, given: Any) -> None:
        """Raise LensError if the film of a dict contradicts the other numbers."""
        own, film = getattr(self, name), self.film_size
        if own is None or film is None:
            raise LensError(f"{name} belongs to orthographic intrinsics, but projection is 'perspective'")
        pair = as_numbers(name, given, LensError, "two numbers")
        if pair.shape != (2,) or not (np.abs(pair - own) <= _SAME_FILM * max(film)).all():
            raise LensError(
                f"{name} contradicts fx, fy, cx and cy, which make it {own[0]:g}, {own[1]:g}: got {given!r}"
            )
