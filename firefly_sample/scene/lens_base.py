"""The base of both kinds of lens: film, planes, the projection matrix, and points to and from the film.

View space is right-handed, X right, Y forward, Z up, in scene units; film size, film offset and focal length
share one unit of their own. The formulas are in `firefly_sample.scene.lens_constants`.
"""

from __future__ import annotations

import copy
import math
from abc import abstractmethod
from typing import ClassVar, Self

import numpy as np

from firefly_sample.errors import LensError
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.camel_case import CamelCase, attribute
from firefly_sample.scene.intrinsics import Intrinsics
from firefly_sample.scene.lens_constants import Clip, LensConstants, Pair
from firefly_sample.scene.lens_numbers import finite, number, one_or_two, pair, pixels, planes
from firefly_sample.scene.lens_points import LensPoints
from firefly_sample.scene.lens_shape import Shape, lens_for_picture

_SAME_SHAPE = 1e-5
"""Relative difference up to which a lens keeps its aspect ratio: two angles may have been rounded."""


class Lens(CamelCase, LensPoints):
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
    near, far, aspect_ratio = attribute("near"), attribute("far"), attribute("aspect_ratio")
    film_size, film_offset = attribute("film_size", numbers=True), attribute("film_offset", numbers=True)

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
            getattr(self, f"set_{name}")(*(pair(name, value) if name in pairs else (value,)))
        self.set_film_offset(*pair("film_offset", film_offset))
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

    def set_film_size(self, width: float | Pair, height: float | None = None) -> None:
        """Set the film's width and, with `height`, fix the aspect ratio too; the two may be one pair."""
        across, upright = one_or_two("film size", width, height)
        across, shape = finite("film width", across, above=0.0), None
        if upright is not None:
            ratio = across / finite("film height", upright, above=0.0)
            shape = Shape(ratio, f"film size of {across:g} x {upright:g}", measure="film_width")
        self._set_measure("film_width", across, shape)

    def get_film_size(self) -> tuple[float, float]:
        """Return the width and height of the film."""
        measures, ratio = self._measures, self._shape.ratio
        if "film_height" in measures:
            return measures["film_height"] * ratio, measures["film_height"]
        width = measures.get("film_width")
        if width is None:
            width = 2.0 * measures["focal_length"] / self._scales()[0]
        return width, width / ratio

    def set_film_offset(self, x: float | Pair, y: float | None = None) -> None:
        """Move the film's centre off the view axis, right and up, in units of the film size."""
        right, up = pair("film offset", x if y is None else (x, y))
        self._film_offset = (finite("film offset x", right), finite("film offset y", up))
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
        pixel; then this very lens is returned, unless its near plane is at infinity. The LensError for a
        different shape names both.
        """
        if self._shape.fixed_by:
            if not self._shape.fits(width, height):
                raise LensError(self._shape.refusal(width, height))
            return self.near_first()
        ratio = width / height
        if abs(self._shape.ratio / ratio - 1.0) < _SAME_SHAPE:
            return self.near_first()
        lens = self.near_first().make_copy()
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

        As in Panda3D, a perspective lens with an infinite `near` has the same view as with the two exchanged
        and the opposite depth: `get_projection_mat` is for a reversed depth buffer. Pictures are the same.
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
        if self._PERSPECTIVE and near == math.inf:
            far, near = planes(True, far, near)
        else:
            near, far = planes(self._PERSPECTIVE, near, far)
        self._near, self._far = near, far
        self.near_given |= near_given is not None
        self.far_given |= far_given is not None
        self.revision += 1

    def get_near(self) -> float:
        """Return the distance of the near plane, which may be ``math.inf``; see `set_near_far`."""
        return self._near

    def get_far(self) -> float:
        """Return the distance of the far plane, which may be ``math.inf``."""
        return self._far

    def near_first(self) -> Self:
        """Return the lens, or a copy with the planes exchanged if the near one is at infinity."""
        if self._near < self._far:
            return self
        lens = self.make_copy()
        lens._near, lens._far = self._far, self._near
        lens.near_given, lens.far_given = self.far_given, self.near_given
        return lens

    # --- Projection ---

    def constants(self, clip: Clip = "gl", reverse: bool = False) -> LensConstants:
        """Return the entries A, B, C, D of the projection matrix, and the constants to undo it.

        Parameters
        ----------
        clip : {"gl", "zero_to_one"}
            Range of z_ndc: -1..1, or 0..1 as with glClipControl(GL_ZERO_TO_ONE).
        reverse : bool
            Depth 1 at the near plane and 0 at the far plane, which are `get_near` and `get_far`.

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
        planes = min(self._near, self._far), max(self._near, self._far)
        reverse = reverse != (self._near > self._far)
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
        width, height = pair("size", size)
        size = pixels("width", width), pixels("height", height)
        lens, _ = lens_for_picture(self, size)
        return Intrinsics.of(lens.constants(), size, (lens._near, lens._far), pixel_center)

    def get_projection_mat(self, clip: Clip = "gl", reverse: bool = False) -> Float64:
        """Return the 4x4 matrix from view to clip space for row vectors; the default is Panda3D's."""
        return self.constants(clip, reverse).matrix()

    def frustum_planes(self) -> Float64:
        """Return the view volume's planes: left, right, bottom, top, near and, unless infinite, far.

        Rows (nx, ny, nz, d), shape (6, 4) or (5, 4), with a unit normal; inside, in view space,
        nx*x + ny*y + nz*z + d >= 0.
        """
        near, far = sorted((self._near, self._far))
        found = [*self.constants().side_planes(), (0.0, 1.0, 0.0, -near)]
        if math.isfinite(far):
            found.append((0.0, -1.0, 0.0, far))
        return np.array(found)

    def make_copy(self) -> Self:
        """Return an independent lens with the same values."""
        return copy.deepcopy(self)


def _ratio_shape(ratio: float) -> Shape:
    return Shape(ratio, f"aspect ratio of {ratio:.5g}")
