"""The base of both kinds of lens: film, planes, the projection matrix, and points to and from the film.

View space is right-handed, X right, Y forward, Z up, in scene units; film size, film offset and focal length
share one unit of their own. NDC run from -1 to 1, x to the right and y up. The formulas are in
`firefly_sample.scene.lens_constants`.
"""

from __future__ import annotations

import copy
import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import LensError
from firefly_sample.scene.arrays import Float64, as_numbers
from firefly_sample.scene.intrinsics import Intrinsics
from firefly_sample.scene.lens_constants import Clip, LensConstants
from firefly_sample.scene.lens_numbers import finite, number, pixels, planes
from firefly_sample.scene.lens_shape import Shape, lens_for_picture

_SAME_SHAPE = 1e-5
"""Relative difference up to which a lens keeps its aspect ratio: two angles may have been rounded."""


class Lens(ABC):
    """The base of both kinds of lens.

    All setters raise LensError if a value is impossible, and then leave the lens as it was.

    Attributes
    ----------
    revision : int
        Grows with each change.
    near_given, far_given : bool
        True once this plane has been set.
    """

    _PERSPECTIVE: ClassVar[bool]
    _EXCLUSIVE: ClassVar[tuple[str, ...]]
    """The measures that replace each other."""

    def __init__(self, **measures: float) -> None:
        self.revision = 0
        self.near_given = self.far_given = False
        self._near, self._far = 1.0, 100000.0  # as in Panda3D
        self._measures = measures  # angles and lengths that were set, by name, the older first
        self._shape = Shape()
        self._film_offset = (0.0, 0.0)

    def _set_given(
        self,
        near: float | None,
        far: float | None,
        film_offset: tuple[float, float],
        **given: float | tuple[float, float] | None,
    ) -> None:
        """Call the setters of what a constructor was given, in this order; refuse two aspect ratios."""
        given = {name: value for name, value in given.items() if value is not None}
        pairs = [
            name for name in ("fov", "film_size") if isinstance(given.get(name), tuple | list | np.ndarray)
        ]
        fixing = [name for name in given if name in pairs or name == "aspect_ratio"]
        if len(fixing) > 1:
            raise LensError(
                f"{' and '.join(fixing)} each fix the aspect ratio: give one pair alone, "
                "or single numbers and the ratio"
            )
        for name, value in given.items():
            getattr(self, f"set_{name}")(*(_pair(name, value) if name in pairs else (value,)))
        self.set_film_offset(*_pair("film_offset", film_offset))
        self._set_planes(near, far)

    @property
    def shape(self) -> Shape:
        """Width over height, and the setting that fixed it."""
        return self._shape

    def is_perspective(self) -> bool:
        """Return whether things shrink with distance."""
        return self._PERSPECTIVE

    def is_orthographic(self) -> bool:
        """Return whether things keep their size at every distance."""
        return not self._PERSPECTIVE

    # --- Film and shape ---

    def set_film_size(self, width: float, height: float | None = None) -> None:
        """Set the film's width and, with `height`, fix the aspect ratio too."""
        width, shape = finite("film width", width, above=0.0), None
        if height is not None:
            ratio = width / finite("film height", height, above=0.0)
            shape = Shape(ratio, f"film size of {width:g} x {height:g}", measure="film_width")
        self._set_measure("film_width", width, shape)

    def get_film_size(self) -> tuple[float, float]:
        """Return the width and height of the film."""
        measures, ratio = self._measures, self._shape.ratio
        if "film_height" in measures:
            return measures["film_height"] * ratio, measures["film_height"]
        width = measures.get("film_width")
        if width is None:
            width = 2.0 * measures["focal_length"] / self._scales()[0]
        return width, width / ratio

    def set_film_offset(self, x: float, y: float) -> None:
        """Move the film's centre off the view axis, right and up, in units of the film size."""
        self._film_offset = (finite("film offset x", x), finite("film offset y", y))
        self.revision += 1

    def get_film_offset(self) -> tuple[float, float]:
        """Return the offset of the film's centre, right and up."""
        return self._film_offset

    def set_aspect_ratio(self, aspect_ratio: float | None) -> None:
        """Fix width over height, as two angles do; the measure that was set for one side stays.

        None lets each picture's shape decide again; until then the lens keeps its ratio.
        """
        shape = Shape(self._shape.ratio)
        if aspect_ratio is not None:
            shape = _ratio_shape(finite("aspect ratio", aspect_ratio, above=0.0))
        self._commit(self._measures, shape)

    def get_aspect_ratio(self) -> float:
        """Return width over height."""
        return self._shape.ratio

    def with_aspect_ratio(self, aspect_ratio: float) -> Self:
        """Return a copy after `set_aspect_ratio`."""
        lens = self.make_copy()
        lens.set_aspect_ratio(aspect_ratio)
        return lens

    def for_picture(self, width: int, height: int) -> Self:
        """Return the lens to draw a picture of this size in pixels with.

        The lens takes the picture's aspect ratio and keeps the measure that was set for one side, as in
        Panda3D's window. If the lens's shape is fixed, the picture must have that shape, to the nearest whole
        pixel; then this very lens is returned. The LensError for a different shape names both.
        """
        if self._shape.fixed_by:
            if not self._shape.fits(width, height):
                raise LensError(self._shape.refusal(width, height))
            return self
        ratio = width / height
        if abs(self._shape.ratio / ratio - 1.0) < _SAME_SHAPE:
            return self
        lens = self.make_copy()
        lens._commit(lens._measures, Shape(ratio))
        return lens

    @abstractmethod
    def _scales(self) -> tuple[float, float]:
        """Return A and C, the scales of x and z in clip space."""

    def _set_measure(self, name: str, value: float, shape: Shape | None = None) -> None:
        """Set one measure; if there are three then, the one that was set longest ago is dropped."""
        replaced = self._EXCLUSIVE if name in self._EXCLUSIVE else (name,)
        measures = {key: old for key, old in self._measures.items() if key not in replaced}
        measures[name] = value
        if len(measures) == 3:
            del measures[next(iter(measures))]
        if shape is None:
            quoted = self._shape.measure
            stays = measures.get(quoted) == self._measures.get(quoted)
            shape = self._shape if stays else _ratio_shape(self._shape.ratio)
        self._commit(measures, shape)

    def _commit(self, measures: dict[str, float], shape: Shape) -> None:
        """Take measures and a shape, or raise LensError if float64 cannot hold their scales."""
        trial = copy.copy(self)
        trial._measures, trial._shape = measures, shape
        try:
            scales = trial._scales()
        except ZeroDivisionError:  # a size that is too small for float64
            scales = math.inf, math.inf
        if not all(math.isfinite(scale) and scale > 0.0 for scale in scales):
            given = ", ".join(f"{name} {value:g}" for name, value in measures.items())
            raise LensError(
                f"this lens is too extreme for float64 ({given}, aspect ratio {shape.ratio:g}): "
                "choose a less extreme value"
            )
        self._measures, self._shape = measures, shape
        self.revision += 1

    # --- Near and far ---

    def set_near_far(self, near: float, far: float) -> None:
        """Set both clipping planes, as distances along the view axis in scene units.

        `far` is beyond `near`. `near` is above 0 for a perspective lens, whose `far` may be ``math.inf``; an
        orthographic lens takes any finite numbers.
        """
        self._set_planes(number("near", near), number("far", far))

    def set_near(self, near: float) -> None:
        """Set the near plane alone; see `set_near_far`."""
        self._set_planes(number("near", near), None)

    def set_far(self, far: float) -> None:
        """Set the far plane alone; see `set_near_far`."""
        self._set_planes(None, number("far", far))

    def _set_planes(self, near_given: float | None, far_given: float | None) -> None:
        """Set the planes that are given; None leaves one as it is."""
        near = self._near if near_given is None else near_given
        far = self._far if far_given is None else far_given
        near, far = planes(self._PERSPECTIVE, near, far)
        self._near, self._far = near, far
        self.near_given |= near_given is not None
        self.far_given |= far_given is not None
        self.revision += 1

    def get_near(self) -> float:
        """Return the distance of the near plane."""
        return self._near

    def get_far(self) -> float:
        """Return the distance of the far plane, which may be ``math.inf``."""
        return self._far

    # --- Projection ---

    def constants(self, clip: Clip = "gl", reverse: bool = False) -> LensConstants:
        """Return the entries A, B, C, D of the projection matrix, and the constants to undo it.

        Parameters
        ----------
        clip : {"gl", "zero_to_one"}
            Range of z_ndc: -1..1, or 0..1 as with glClipControl(GL_ZERO_TO_ONE).
        reverse : bool
            Depth 1 at the near plane and 0 at the far plane.

        Raises
        ------
        LensError
            If `clip` is neither, or the film is so small beside its offset that a number overflows.
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
        planes = self._near, self._far
        return LensConstants.of(self._PERSPECTIVE, self._scales(), offsets, planes, clip, reverse)

    def intrinsics(self, size: tuple[int, int], pixel_center: float = 0.0) -> Intrinsics:
        """Return focal lengths and principal point in pixels, as a picture of `size` is drawn.

        Parameters
        ----------
        size : (int, int)
            Width and height of the picture in pixels. As when it is drawn, a picture of a shape that the lens
            does not fit takes one of the lens's two angles or film sizes; a lens of intrinsics refuses it.
        pixel_center : float
            Image coordinate of the first pixel's centre: 0 in OpenCV, 0.5 in COLMAP, OpenGL and pyrender.
        """
        width, height = _pair("size", size)
        size = pixels("width", width), pixels("height", height)
        lens, _ = lens_for_picture(self, size)
        return Intrinsics.of(lens.constants(), size, (self._near, self._far), pixel_center)

    def get_projection_mat(self, clip: Clip = "gl", reverse: bool = False) -> Float64:
        """Return the 4x4 matrix from view to clip space for row vectors; the default is Panda3D's."""
        return self.constants(clip, reverse).matrix()

    def project(self, point: ArrayLike) -> Any:
        """Return the NDC of view-space points of shape (3,) or (..., 3).

        One point gives a tuple of two floats, or None if it is off the film; many give an array of shape
        (..., 2), with NaN for those that are off the film. As in Panda3D, near and far do not matter: a point
        is off the film only behind the eye or outside its edges.
        """
        p = _points(point, 3)
        in_front = p[..., 1] > 0.0 if self._PERSPECTIVE else np.ones(p.shape[:-1], dtype=bool)
        safe = np.where(in_front[..., None], p, (0.0, 1.0, 0.0))
        ndc = self.constants().ndc_from_view(safe)[..., :2]
        seen = in_front & (np.abs(ndc) <= 1.0).all(axis=-1)
        if p.ndim == 1:
            return (float(ndc[0]), float(ndc[1])) if seen else None
        return np.where(seen[..., None], ndc, np.nan)

    def extrude(self, point: ArrayLike) -> tuple[Float64, Float64]:
        """Return the view-space points on the near and the far plane at NDC of shape (2,) or (..., 2).

        Raise LensError if the far plane is at infinity.
        """
        if math.isinf(self._far):
            raise LensError(
                "a lens whose far plane is at infinity has no far point: set a finite far, or use "
                "constants().view_from_distance(x, y, distance)"
            )
        x, y = np.moveaxis(_points(point, 2), -1, 0)
        k = self.constants()
        return k.view_from_distance(x, y, self._near), k.view_from_distance(x, y, self._far)

    def extrude_depth(self, point: ArrayLike) -> Float64:
        """Return the view-space points at NDC (x, y, z) of shape (3,) or (..., 3), z -1 at near and 1 at far.

        The inverse of `get_projection_mat` followed by the division by w.
        """
        x, y, z = np.moveaxis(_points(point, 3), -1, 0)
        return self.constants().view_from_depth(x, y, 0.5 * z + 0.5)

    def frustum_planes(self) -> Float64:
        """Return the view volume's planes: left, right, bottom, top, near and, unless infinite, far.

        Rows (nx, ny, nz, d), shape (6, 4) or (5, 4), with a unit normal; inside, in view space,
        nx*x + ny*y + nz*z + d >= 0.
        """
        found = [*self.constants().side_planes(), (0.0, 1.0, 0.0, -self._near)]
        if math.isfinite(self._far):
            found.append((0.0, -1.0, 0.0, self._far))
        return np.array(found)

    def make_copy(self) -> Self:
        """Return an independent lens with the same values."""
        return copy.deepcopy(self)


def _ratio_shape(ratio: float) -> Shape:
    return Shape(ratio, f"aspect ratio of {ratio:.5g}")


def _points(value: ArrayLike, size: int) -> Float64:
    points = as_numbers("points", value, LensError)
    if points.ndim == 0 or points.shape[-1] != size:
        raise LensError(f"points must have shape ({size},) or (..., {size}), got {points.shape}")
    return points


def _pair(name: str, value: Any) -> tuple[Any, Any]:
    """Return `value` as two numbers, still unchecked."""
    try:
        first, second = value
    except (TypeError, ValueError):
        raise LensError(f"{name} must be two numbers, got {value!r}") from None
    return first, second
