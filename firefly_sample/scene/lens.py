"""Lenses, perspective and orthographic, with Panda3D's names and rules, in float64.

A single number, an angle or a film size, is kept for pictures of every shape, and the other side follows. Two
numbers, an aspect ratio or intrinsics fix the shape; otherwise each picture has its own, with square pixels.
``docs/lenses.md`` has the rules.
"""

from __future__ import annotations

import math
from typing import Self

from firefly_sample.errors import LensError
from firefly_sample.scene.camel_case import attribute
from firefly_sample.scene.intrinsics import Intrinsics
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lens_constants import Pair
from firefly_sample.scene.lens_numbers import finite, number, one_or_two
from firefly_sample.scene.lens_shape import Shape


class PerspectiveLens(Lens):
    """A lens with a vanishing point.

    Field of view, film width and focal length depend on each other: width = 2 * focal * tan(fov/2). As in
    Panda3D, the two that were set last are kept, and the third follows.

    Parameters
    ----------
    fov : float or (float, float), optional
        Horizontal angle, kept for pictures of every shape, or horizontal and vertical, in degrees. When
        absent, the narrower side has Panda3D's 30 degrees, unless film size and focal length are both given.
    aspect_ratio : float, optional
        Width over height; the picture's when absent, unless two angles or sizes fix it.
    near, far : float, optional
        Clipping planes in scene units; `far` may be ``math.inf``. Panda3D's 1 and 100,000 when absent.
    film_size : float or (float, float), optional
        Width, or width and height, in any unit; 1 wide when absent.
    film_offset : (float, float)
        Offset of the film's centre, right and up, in the film's unit.
    focal_length : float, optional
        In the film's unit.
    vfov : float, optional
        Vertical angle, kept for pictures of every shape, in degrees, instead of `fov`.

    Raises
    ------
    LensError
        If a value is impossible, or two of them set the same thing.
    """

    _PERSPECTIVE = True
    _EXCLUSIVE = ("fov", "min_fov", "vfov")
    _min_ratio = 1.0
    """Width over height of the rectangle that "min_fov" keeps in view; the angle is its vertical one."""
    fov, min_fov = attribute("fov", numbers=True), attribute("min_fov", numbers=True)
    focal_length = attribute("focal_length")

    def __init__(
        self,
        fov: float | tuple[float, float] | None = None,
        aspect_ratio: float | None = None,
        near: float | None = None,
        far: float | None = None,
        film_size: float | tuple[float, float] | None = None,
        film_offset: tuple[float, float] = (0.0, 0.0),
        focal_length: float | None = None,
        vfov: float | None = None,
    ) -> None:
        super().__init__(min_fov=30.0, film_width=1.0)
        if fov is not None and vfov is not None:
            raise LensError("fov and vfov set the same thing: give one of them")
        angle = "fov" if fov is not None else "vfov"
        if not (fov is vfov is None or film_size is None or focal_length is None):
            raise LensError(f"{angle}, film_size and focal_length fix each other: give any two of the three")
        self._set_given(
            near,
            far,
            film_offset,
            film_size=film_size,
            focal_length=focal_length,
            fov=fov,
            vfov=vfov,
            aspect_ratio=aspect_ratio,
        )

    @classmethod
    def from_intrinsics(
        cls,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        width: int,
        height: int,
        near: float | None = None,
        far: float | None = None,
        *,
        pixel_center: float = 0.0,
    ) -> Self:
        """Return the lens of a calibrated pinhole camera.

        A view-space point (x, y, z), y forward and z up, has the image coordinates u = fx * x / y + cx to the
        right and v = cy - fy * z / y downwards. The lens fits pictures of this size and, at a different
        resolution, of this shape.

        Parameters
        ----------
        fx, fy, cx, cy : float
            Focal length in widths and in heights of a pixel; image coordinates of the principal point.
        width, height : int
            Size in pixels of the pictures that these numbers belong to.
        near, far : float, optional
            As for `PerspectiveLens`.
        pixel_center : float
            Image coordinate of the first pixel's centre: 0 in OpenCV, where (u, v) are a pixel's column and
            row; 0.5 in COLMAP, OpenGL and pyrender, where (0, 0) is the picture's corner.
        """
        given = Intrinsics("perspective", width, height, fx, fy, cx, cy, 1.0, 2.0, pixel_center)
        pixel_height = given.fx / given.fy  # the film is measured in widths of a pixel
        lens = cls(
            near=near,
            far=far,
            film_size=(given.width, given.height * pixel_height),
            film_offset=(given.offset[0], given.offset[1] * pixel_height),
            focal_length=given.fx,
        )
        lens._shape = _calibrated(lens, given)
        return lens

    def set_fov(self, horizontal: float | Pair, vertical: float | None = None) -> None:
        """Set the horizontal field of view in degrees and, with `vertical`, fix the aspect ratio too.

        The two may be one pair.
        """
        across, upright = one_or_two("field of view", horizontal, vertical)
        a = _cot_half("the horizontal field of view", across)
        shape = None
        if upright is not None:
            ratio = _cot_half("the vertical field of view", upright) / a
            shape = Shape(ratio, f"field of view of {across:g} x {upright:g} degrees", measure="fov")
        self._set_measure("fov", float(across), shape)

    def set_vfov(self, vertical: float) -> None:
        """Set the vertical field of view in degrees, kept for every aspect ratio; not in Panda3D."""
        _cot_half("the vertical field of view", vertical)
        self._set_measure("vfov", float(vertical))

    def set_min_fov(self, angle: float, vertical: float | None = None) -> None:
        """Set the field of view of the narrower side in degrees, kept for every aspect ratio.

        With `vertical`, not in Panda3D, a picture of any shape shows at least `angle` horizontally and
        `vertical` vertically, and no more than one of them needs.
        """
        upright = angle if vertical is None else vertical
        c = _cot_half("the field of view", upright)
        before, self._min_ratio = self._min_ratio, c / _cot_half("the field of view", angle)
        try:
            self._set_measure("min_fov", float(upright))
        except LensError:
            self._min_ratio = before
            raise

    def set_focal_length(self, focal_length: float) -> None:
        """Set the distance from eye to film, in the film's unit."""
        self._set_measure("focal_length", finite("focal length", focal_length, above=0.0))

    def get_fov(self) -> tuple[float, float]:
        """Return the horizontal and vertical field of view in degrees."""
        a, c = self._scales()
        return 2.0 * math.degrees(math.atan2(1.0, a)), 2.0 * math.degrees(math.atan2(1.0, c))

    def get_hfov(self) -> float:
        """Return the horizontal field of view in degrees."""
        return self.get_fov()[0]

    def get_vfov(self) -> float:
        """Return the vertical field of view in degrees."""
        return self.get_fov()[1]

    def get_min_fov(self) -> float:
        """Return the field of view of the narrower side in degrees."""
        return min(self.get_fov())

    def get_focal_length(self) -> float:
        """Return the distance from eye to film, in the film's unit."""
        focal = self._measures.get("focal_length")
        return 0.5 * self._measures["film_width"] * self._scales()[0] if focal is None else focal

    def _scales(self) -> tuple[float, float]:
        """Return the cotangents of half the horizontal and half the vertical field of view."""
        measures, ratio = self._measures, self.shape.ratio
        angle = next((name for name in self._EXCLUSIVE if name in measures), None)
        if angle is None:
            scale = 2.0 * measures["focal_length"] / measures["film_width"]
        else:
            scale = _cot_half("the field of view", measures[angle])
        if angle == "vfov" or (angle == "min_fov" and ratio >= self._min_ratio):
            return scale / ratio, scale
        if angle == "min_fov":
            scale /= self._min_ratio
        return scale, scale * ratio


class OrthographicLens(Lens):
    """A lens of parallel rays; its film size is the size of the view in scene units.

    Parameters
    ----------
    film_size : float or (float, float), optional
        Width, kept for pictures of every shape, or width and height; 1 wide when absent.
    aspect_ratio : float, optional
        Width over height; the picture's when absent.
    near, far : float, optional
        Clipping planes in scene units, both finite; `near` may be negative. 1 and 100,000 when absent.
    film_offset : (float, float)
        Offset of the film's centre, right and up.
    film_height : float, optional
        Height, kept for pictures of every shape, instead of `film_size`.

    Raises
    ------
    LensError
        If a value is impossible, or two of them set the same thing.
    """

    _PERSPECTIVE = False
    _EXCLUSIVE = ("film_width", "film_height")

    def __init__(
        self,
        film_size: float | tuple[float, float] | None = None,
        aspect_ratio: float | None = None,
        near: float | None = None,
        far: float | None = None,
        film_offset: tuple[float, float] = (0.0, 0.0),
        film_height: float | None = None,
    ) -> None:
        super().__init__(film_width=1.0)
        if film_size is not None and film_height is not None:
            raise LensError("film_size and film_height set the same thing: give one of them")
        self._set_given(
            near, far, film_offset, film_size=film_size, film_height=film_height, aspect_ratio=aspect_ratio
        )

    @classmethod
    def from_intrinsics(
        cls,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        width: int,
        height: int,
        near: float | None = None,
        far: float | None = None,
        *,
        pixel_center: float = 0.0,
    ) -> Self:
        """Return the lens of a calibrated camera with parallel rays.

        A view-space point (x, y, z), y forward and z up, has the image coordinates u = fx * x + cx to the
        right and v = cy - fy * z downwards. The lens fits pictures of this size and, at a different
        resolution, of this shape.

        Parameters
        ----------
        fx, fy : float
            Pixels per scene unit, across and down.
        cx, cy, width, height, pixel_center
            As for `PerspectiveLens.from_intrinsics`.
        near, far : float, optional
            As for `OrthographicLens`.
        """
        given = Intrinsics("orthographic", width, height, fx, fy, cx, cy, 1.0, 2.0, pixel_center)
        lens = cls(given.film_size, near=near, far=far, film_offset=given.film_offset or (0.0, 0.0))
        lens._shape = _calibrated(lens, given)
        return lens

    def set_film_height(self, height: float) -> None:
        """Set the height of the view in scene units, kept for every aspect ratio; not in Panda3D."""
        self._set_measure("film_height", finite("film height", height, above=0.0))

    def scale_film(self, factor: float) -> None:
        """Multiply the size of the view; its shape stays."""
        ((name, length),) = self._measures.items()
        self._set_measure(name, length * finite("factor", factor, above=0.0))

    def _scales(self) -> tuple[float, float]:
        width, height = self.get_film_size()
        return 2.0 / width, 2.0 / height


def lens_from_intrinsics(intrinsics: Intrinsics) -> PerspectiveLens | OrthographicLens:
    """Return the lens of these intrinsics: the inverse of `Lens.intrinsics`, to a few roundings."""
    made = PerspectiveLens if intrinsics.is_perspective() else OrthographicLens
    i = intrinsics
    return made.from_intrinsics(i.fx, i.fy, i.cx, i.cy, *i.size, i.near, i.far, pixel_center=i.pixel_center)


def _calibrated(lens: Lens, given: Intrinsics) -> Shape:
    """Return the shape of a lens that was made from intrinsics."""
    fixed_by = f"calibration for pictures of {given.width}x{given.height}"
    return Shape(lens.shape.ratio, fixed_by, given.fy / given.fx, calibrated=True)


def _cot_half(name: str, degrees: float) -> float:
    """Return the cotangent of half an angle between 0 and 180 degrees, accurate to a few ulp."""
    degrees = number(name, degrees)
    if not 0.0 < degrees < 180.0:
        raise LensError(
            f"{name} must be above 0 and below 180 degrees, got {degrees:g}: for parallel rays use an "
            "OrthographicLens, for more than half a turn several cameras"
        )
    if degrees > 90.0:
        # 180 - degrees is exact here; the tangent near its pole would lose digits.
        return math.tan(math.radians(180.0 - degrees) / 2.0)
    tangent = math.tan(math.radians(degrees) / 2.0)
    return 1.0 / tangent if tangent > 0.0 else math.inf
