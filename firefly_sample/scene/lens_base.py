"""What both kinds of lens share: planes, the projection matrix, and points to and from the film.

View space is right-handed, X right, Y forward, Z up, in scene units; film size, film offset and focal
length share one unit of their own. NDC run from -1 to 1, x to the right and y up. The formulas are in
`firefly_sample.scene.lens_constants`.
"""

from __future__ import annotations

import copy
import math
from abc import ABC, abstractmethod
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import LensError
from firefly_sample.scene.arrays import as_numbers
from firefly_sample.scene.lens_checks import finite, number, positive
from firefly_sample.scene.lens_constants import Clip, LensConstants
from firefly_sample.scene.lens_shape import Shape, ratio_shape

Float64 = NDArray[np.float64]

NEAR, FAR = 1.0, 100000.0
"""Panda3D's planes, where nobody sets others."""
SAME_SHAPE = 1e-5
"""Relative difference up to which a lens keeps the aspect ratio it has: two angles may have been rounded."""


class Lens(ABC):
    """What both kinds of lens share. A setter that raises leaves the lens as it was.

    Attributes
    ----------
    revision : int
        Grows with each change.
    near_given, far_given : bool
        False as long as nobody has set this plane.
    """

    def __init__(self) -> None:
        self.revision = 0
        self.near_given = self.far_given = False
        self._near, self._far = NEAR, FAR
        self._shape = Shape()
        self._film_offset = (0.0, 0.0)

    # What a kind of lens defines

    @abstractmethod
    def is_perspective(self) -> bool:
        """Whether things shrink with distance."""

    @abstractmethod
    def get_film_size(self) -> tuple[float, float]:
        """Width and height of the film."""

    @abstractmethod
    def set_film_size(self, width: float, height: float | None = None) -> None:
        """Set the film's width and, with `height`, fix its aspect ratio too."""

    @abstractmethod
    def _reshape(self, shape: Shape) -> None:
        """Take a shape; what was set of one side stays. Raise LensError where the lens cannot have it."""

    @abstractmethod
    def _scales(self) -> tuple[float, float]:
        """A and C."""

    @abstractmethod
    def _check_planes(self, near: float, far: float) -> None:
        """Raise LensError where this kind of lens cannot have these planes."""

    # Shape

    def is_orthographic(self) -> bool:
        """Whether things keep their size at every distance."""
        return not self.is_perspective()

    def set_aspect_ratio(self, aspect_ratio: float | None) -> None:
        """Fix width over height, as by two angles; what was set of one side stays.

        Parameters
        ----------
        aspect_ratio : float or None
            None lets each picture's shape decide again; until then the lens keeps the ratio it has.

        Raises
        ------
        LensError
            If it is not above 0.
        """
        if aspect_ratio is None:
            self._reshape(Shape(self._shape.ratio))
        else:
            self._reshape(ratio_shape(positive("aspect ratio", aspect_ratio)))

    @property
    def shape(self) -> Shape:
        """Width over height, and what fixed it."""
        return self._shape

    def get_aspect_ratio(self) -> float:
        """Width over height."""
        return self._shape.ratio

    def with_aspect_ratio(self, aspect_ratio: float) -> Self:
        """Return a copy after `set_aspect_ratio`."""
        lens = self.make_copy()
        lens.set_aspect_ratio(aspect_ratio)
        return lens

    def for_picture(self, width: int, height: int) -> Self:
        """Return the lens that a picture of this size in pixels is drawn with.

        A lens takes the picture's aspect ratio, and what was set of one side stays, just as in Panda3D's
        window. Where the aspect ratio was set, or follows from two angles, two film sizes or intrinsics, the
        picture must have that shape, to the nearest whole pixel: exactly this lens is drawn then.

        Raises
        ------
        LensError
            If the picture has another shape than the one that was set; the message names both.
        """
        if self._shape.fixed_by:
            if not self._shape.fits(width, height):
                raise LensError(self._shape.refusal(width, height))
            return self
        ratio = width / height
        if abs(self._shape.ratio / ratio - 1.0) < SAME_SHAPE:
            return self
        lens = self.make_copy()
        lens._reshape(Shape(ratio))
        return lens

    def set_film_offset(self, x: float, y: float) -> None:
        """Move the film's centre off the view axis, right and up, in units of the film size.

        Raises
        ------
        LensError
            If a number is not finite.
        """
        self._film_offset = (finite("film offset x", x), finite("film offset y", y))
        self.revision += 1

    def get_film_offset(self) -> tuple[float, float]:
        """Offset of the film's centre, right and up."""
        return self._film_offset

    # Near and far

    def set_near_far(self, near: float, far: float) -> None:
        """Set both clipping planes, as distances along the view axis in scene units.

        Parameters
        ----------
        near : float
            Above 0 for a perspective lens; any finite number for an orthographic one.
        far : float
            Beyond `near`; may be ``math.inf`` for a perspective lens.

        Raises
        ------
        LensError
            If this kind of lens cannot have these planes.
        """
        self._set_planes(number("near", near), number("far", far))

    def set_near(self, near: float) -> None:
        """Set the near plane alone; see `set_near_far`."""
        self._set_planes(number("near", near), None)

    def set_far(self, far: float) -> None:
        """Set the far plane alone; see `set_near_far`."""
        self._set_planes(None, number("far", far))

    def _set_planes(self, near: float | None, far: float | None) -> None:
        """Set the planes that are given; None leaves one as it is."""
        given = near is not None, far is not None
        near = self._near if near is None else number("near", near)
        far = self._far if far is None else number("far", far)
        if not math.isfinite(near):
            raise LensError(f"near must be a finite number, got {near:g}")
        if not far > near:
            raise LensError(
                f"far must be beyond near, got near {near:g} and far {far:g}: "
                "set both at once with set_near_far(near, far)"
            )
        self._check_planes(near, far)
        self._near, self._far = near, far
        self.near_given, self.far_given = self.near_given or given[0], self.far_given or given[1]
        self.revision += 1

    def get_near(self) -> float:
        """Distance of the near plane."""
        return self._near

    def get_far(self) -> float:
        """Distance of the far plane, perhaps ``math.inf``."""
        return self._far

    # Projection

    def constants(self, clip: Clip = "gl", reverse: bool = False) -> LensConstants:
        """A, B, C, D and what belongs to them.

        Parameters
        ----------
        clip : {"gl", "zero_to_one"}
            Range of z_ndc: -1..1, or 0..1 as glClipControl(GL_ZERO_TO_ONE) has it.
        reverse : bool
            Depth 1 at the near plane and 0 at the far plane.

        Raises
        ------
        LensError
            If `clip` is neither, or the film is so small beside the offset that a number overflows.
        """
        x, y = self._film_offset
        width, height = self.get_film_size()
        small = min(width, height)
        if small == 0.0 or not math.isfinite(2.0 * max(abs(x), abs(y)) / small):
            raise LensError(
                f"a film of {width:g} x {height:g} with offset ({x:g}, {y:g}) is too extreme for float64: "
                "choose a film size and an offset nearer to each other"
            )
        # `0.0 -` keeps a centred film at +0, not -0.
        offsets = (0.0 - 2.0 * x / width, 0.0 - 2.0 * y / height)
        make = LensConstants.for_perspective if self.is_perspective() else LensConstants.for_orthographic
        return make(self._scales(), offsets, self._near, self._far, clip, reverse)

    def get_projection_mat(self, clip: Clip = "gl", reverse: bool = False) -> Float64:
        """The 4x4 matrix from view to clip space for row vectors, float64; the default is Panda3D's."""
        return self.constants(clip, reverse).matrix()

    def project(self, point: ArrayLike) -> Any:
        """Where view-space points fall on the film.

        As in Panda3D, near and far do not matter: only points behind the eye or beside the film are lost.

        Parameters
        ----------
        point : array_like, shape (3,) or (..., 3)

        Returns
        -------
        tuple of 2 floats, or None, or ndarray of shape (..., 2)
            NDC of the one point, None where it is not on the film; for many points an array, with NaN
            for those that are not.
        """
        p = _points(point, 3)
        in_front = p[..., 1] > 0.0 if self.is_perspective() else np.ones(p.shape[:-1], dtype=bool)
        safe = np.where(in_front[..., None], p, (0.0, 1.0, 0.0))
        ndc = self.constants().ndc_from_view(safe)[..., :2]
        seen = in_front & (np.abs(ndc) <= 1.0).all(axis=-1)
        if p.ndim == 1:
            return (float(ndc[0]), float(ndc[1])) if seen else None
        return np.where(seen[..., None], ndc, np.nan)

    def extrude(self, point: ArrayLike) -> tuple[Float64, Float64]:
        """The view-space points on the near and the far plane behind NDC of shape (2,) or (..., 2).

        Raises
        ------
        LensError
            If the far plane is at infinity.
        """
        if math.isinf(self._far):
            raise LensError(
                "a lens whose far plane is at infinity has no far point: set a finite far, or use "
                "constants().view_from_distance(x, y, distance)"
            )
        ndc = _points(point, 2)
        k = self.constants()
        return (
            k.view_from_distance(ndc[..., 0], ndc[..., 1], self._near),
            k.view_from_distance(ndc[..., 0], ndc[..., 1], self._far),
        )

    def extrude_depth(self, point: ArrayLike) -> Float64:
        """The view-space points behind NDC (x, y, z) of shape (3,) or (..., 3), z -1 at near and 1 at far.

        The inverse of `get_projection_mat` followed by the division by w.
        """
        ndc = _points(point, 3)
        return self.constants().view_from_depth(ndc[..., 0], ndc[..., 1], 0.5 * ndc[..., 2] + 0.5)

    def frustum_planes(self) -> Float64:
        """The view volume's planes: left, right, bottom, top, near and, unless infinite, far.

        Returns
        -------
        ndarray of float64, shape (6, 4) or (5, 4)
            Rows (nx, ny, nz, d) with a unit normal; nx*x + ny*y + nz*z + d >= 0 inside, in view space.
        """
        k = self.constants()
        rows = []
        # +-ndc <= 1 times w: w*(1 +- offset) +- scale*coordinate >= 0, with w = y or w = 1.
        w_column = 1 if k.perspective else 3
        for axis, scale, offset in ((0, k.a, k.x_offset), (2, k.c, k.z_offset)):
            for sign in (1.0, -1.0):
                row = np.zeros(4)
                row[axis] = sign * scale
                row[w_column] = 1.0 + sign * offset
                rows.append(row / math.hypot(*row[:3]))
        rows.append(np.array([0.0, 1.0, 0.0, -self._near]))
        if math.isfinite(self._far):
            rows.append(np.array([0.0, -1.0, 0.0, self._far]))
        return np.array(rows)

    def make_copy(self) -> Self:
        """An independent lens with the same values."""
        return copy.deepcopy(self)


def _points(value: ArrayLike, size: int) -> Float64:
    points = as_numbers("points", value, LensError)
    if points.ndim == 0 or points.shape[-1] != size:
        raise LensError(f"points must have shape ({size},) or (..., {size}), got {points.shape}")
    return points
