"""Lenses: what a camera sees, in Panda3D's names and with its rules, in float64.

A lens says how wide the view is, and the picture says its shape. One number, be it an angle or a film size,
stays at every picture's shape and the other side follows, as in Panda3D's window. Two numbers, an aspect
ratio or intrinsics fix the shape: a picture of another one gives a warning, and with intrinsics an error.
"""

from __future__ import annotations

import math
from typing import Self

from firefly_sample.errors import LensError
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lens_checks import (
    cot_half,
    finite,
    one_of,
    one_or_two,
    one_shape,
    pair,
    positive,
    whole,
)
from firefly_sample.scene.lens_shape import Shape, film_shape

_ANGLES = ("fov", "min_fov", "vfov")


class PerspectiveLens(Lens):
    """A lens with a vanishing point.

    Field of view, film width and focal length hang together: width = 2 * focal * tan(fov/2). As in
    Panda3D, the two that were set last stand, and the third follows.

    The aspect ratio is the picture's, with square pixels, unless `set_aspect_ratio`, `set_film_size` with a
    height, `set_fov` with two angles or `from_intrinsics` has fixed another.

    Parameters
    ----------
    fov : float or (float, float), optional
        Horizontal angle at every picture's shape, or horizontal and vertical, in degrees. When absent, the
        narrower side has Panda3D's 30 degrees, unless film size and focal length are both given.
    aspect_ratio : float, optional
        Width over height; the picture's when absent.
    near, far : float, optional
        Clipping planes in scene units; `far` may be ``math.inf``. Panda3D's 1 and 100,000 when absent.
    film_size : float or (float, float), optional
        Width, or width and height, in any unit; 1 wide when absent.
    film_offset : (float, float)
        Offset of the film's centre, right and up, in the film's unit.
    focal_length : float, optional
        In the film's unit.
    vfov : float, optional
        Vertical angle at every picture's shape, in degrees, instead of `fov`.

    Raises
    ------
    LensError
        If a value is impossible, or two of them say the same thing twice.
    """

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
        super().__init__()
        # The two measures set last, the older one first. The angles share a place.
        self._given: dict[str, float] = {"min_fov": 30.0, "film_width": 1.0}
        angle = one_of(fov=fov, vfov=vfov)
        if angle and film_size is not None and focal_length is not None:
            raise LensError(f"{angle}, film_size and focal_length fix each other: give any two of the three")
        one_shape(aspect_ratio=aspect_ratio, fov=fov, film_size=film_size)
        if film_size is not None:
            self.set_film_size(*one_or_two("film_size", film_size))
        if focal_length is not None:
            self.set_focal_length(focal_length)
        if fov is not None:
            self.set_fov(*one_or_two("fov", fov))
        if vfov is not None:
            self.set_vfov(vfov)
        if aspect_ratio is not None:
            self.set_aspect_ratio(aspect_ratio)
        self.set_film_offset(*pair("film_offset", film_offset))
        self._set_planes(near, far)

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
        right and v = cy - fy * z / y downwards. The lens fits pictures of this size and, at another
        resolution, of this shape.

        Parameters
        ----------
        fx, fy : float
            Focal length in widths and in heights of a pixel.
        cx, cy : float
            Image coordinates of the principal point.
        width, height : int
            Size in pixels of the pictures that these numbers belong to.
        near, far : float, optional
            As for `PerspectiveLens`.
        pixel_center : float
            Image coordinate of the first pixel's centre: 0 in OpenCV, so that (u, v) are a pixel's column and
            row; 0.5 in COLMAP, OpenGL and pyrender, where (0, 0) is the picture's corner.

        Raises
        ------
        LensError
            If a number is impossible.
        """
        fx, fy = positive("fx", fx), positive("fy", fy)
        width, height = whole("width", width), whole("height", height)
        corner = 0.5 - finite("pixel_center", pixel_center)
        cx, cy = finite("cx", cx) + corner, finite("cy", cy) + corner
        # The film is measured in widths of a pixel; that is how high a pixel is.
        pixel_height = fx / fy
        lens = cls(
            near=near,
            far=far,
            film_size=(width, height * pixel_height),
            film_offset=(0.5 * width - cx, (cy - 0.5 * height) * pixel_height),
            focal_length=fx,
        )
        fixed_by = f"calibration for pictures of {width}x{height}"
        lens._shape = lens._shape._replace(
            fixed_by=fixed_by, pixel=1.0 / pixel_height, calibrated=True, measure=""
        )
        return lens

    def is_perspective(self) -> bool:
        """True."""
        return True

    def set_fov(self, horizontal: float, vertical: float | None = None) -> None:
        """Set the horizontal field of view in degrees and, with `vertical`, fix the aspect ratio too.

        Raises
        ------
        LensError
            If an angle is not between 0 and 180.
        """
        a = cot_half("the horizontal field of view", horizontal)
        shape = None
        if vertical is not None:
            ratio = cot_half("the vertical field of view", vertical) / a
            words = f"field of view of {horizontal:g} x {vertical:g} degrees"
            shape = Shape(ratio, words, measure="fov")
        self._change("fov", float(horizontal), shape)

    def set_vfov(self, vertical: float) -> None:
        """Set the vertical field of view in degrees; it stays so when the aspect ratio changes.

        Panda3D has no such setter.

        Raises
        ------
        LensError
            If the angle is not between 0 and 180.
        """
        cot_half("the vertical field of view", vertical)
        self._change("vfov", float(vertical), None)

    def set_min_fov(self, angle: float) -> None:
        """Set the field of view of the narrower side in degrees; it stays so when the aspect changes.

        Raises
        ------
        LensError
            If the angle is not between 0 and 180.
        """
        cot_half("the field of view", angle)
        self._change("min_fov", float(angle), None)

    def set_film_size(self, width: float, height: float | None = None) -> None:
        """Set the film's width and, with `height`, fix the aspect ratio too.

        Raises
        ------
        LensError
            If a size is not above 0.
        """
        width = positive("film width", width)
        self._change("film_width", width, None if height is None else film_shape(width, height))

    def set_focal_length(self, focal_length: float) -> None:
        """Set the distance from eye to film, in the film's unit.

        Raises
        ------
        LensError
            If it is not above 0.
        """
        self._change("focal_length", positive("focal length", focal_length), None)

    def get_fov(self) -> tuple[float, float]:
        """Horizontal and vertical field of view in degrees."""
        a, c = self._scales()
        return 2.0 * math.degrees(math.atan2(1.0, a)), 2.0 * math.degrees(math.atan2(1.0, c))

    def get_hfov(self) -> float:
        """Horizontal field of view in degrees."""
        return self.get_fov()[0]

    def get_vfov(self) -> float:
        """Vertical field of view in degrees."""
        return self.get_fov()[1]

    def get_min_fov(self) -> float:
        """Field of view of the narrower side in degrees."""
        return min(self.get_fov())

    def get_film_size(self) -> tuple[float, float]:
        """Width and height of the film."""
        width = self._given.get("film_width")
        if width is None:
            width = 2.0 * self._given["focal_length"] / self._scales()[0]
        return width, width / self._shape.ratio

    def get_focal_length(self) -> float:
        """Distance from eye to film, in the film's unit."""
        focal = self._given.get("focal_length")
        return 0.5 * self._given["film_width"] * self._scales()[0] if focal is None else focal

    def _scales(self) -> tuple[float, float]:
        return _perspective_scales(self._given, self._shape.ratio)

    def _change(self, name: str, value: float, shape: Shape | None) -> None:
        """Set one measure; of angle, film width and focal length the one set longest ago falls out."""
        same = _ANGLES if name in _ANGLES else (name,)
        given = {key: old for key, old in self._given.items() if key not in same}
        given[name] = value
        if len(given) == 3:
            del given[next(iter(given))]
        self._commit(given, self._shape.after(self._given, given) if shape is None else shape)

    def _reshape(self, shape: Shape) -> None:
        self._commit(self._given, shape)

    def _commit(self, given: dict[str, float], shape: Shape) -> None:
        scales = _perspective_scales(given, shape.ratio)
        if not all(math.isfinite(scale) and scale > 0.0 for scale in scales):
            said = ", ".join(f"{name} {value:g}" for name, value in given.items())
            raise LensError(
                f"this lens is too extreme for float64 ({said}, aspect ratio {shape.ratio:g}): "
                "choose a less extreme value"
            )
        self._given, self._shape = given, shape
        self.revision += 1

    def _check_planes(self, near: float, far: float) -> None:
        if near <= 0.0:
            raise LensError(
                f"near of a perspective lens must be above 0, got {near:g}: move the near plane in front "
                "of the eye, or use an OrthographicLens"
            )


def _perspective_scales(given: dict[str, float], aspect_ratio: float) -> tuple[float, float]:
    """A and C: the cotangents of half the horizontal and half the vertical field of view."""
    if "vfov" in given:
        c = cot_half("the field of view", given["vfov"])
        return c / aspect_ratio, c
    if "fov" in given:
        a = cot_half("the field of view", given["fov"])
    elif "min_fov" in given:
        cot = cot_half("the field of view", given["min_fov"])
        return (cot / aspect_ratio, cot) if aspect_ratio >= 1.0 else (cot, cot * aspect_ratio)
    else:
        a = 2.0 * given["focal_length"] / given["film_width"]
    return a, a * aspect_ratio
