"""Lenses: what a camera sees, in Panda3D's names and with its rules, in float64."""

from __future__ import annotations

import math
from typing import Self

from firefly_sample.errors import LensError
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lens_checks import cot_half, one_or_two, one_shape, pair, positive

__all__ = ["Lens", "OrthographicLens", "PerspectiveLens"]


class PerspectiveLens(Lens):
    """A lens with a vanishing point.

    Field of view, film width and focal length hang together: width = 2 * focal * tan(fov/2). As in
    Panda3D, the two that were set last stand, and the third follows. The aspect ratio is what
    `set_aspect_ratio`, `set_film_size` with a height, or `set_fov` with two angles said last.

    Parameters
    ----------
    fov : float or (float, float), optional
        Horizontal angle, or horizontal and vertical, in degrees. When absent, the narrower side has
        Panda3D's 30 degrees, unless film size and focal length are both given.
    aspect_ratio : float, optional
        Width over height; 1 when nothing says otherwise.
    near, far : float
        Clipping planes in scene units; `far` may be ``math.inf``.
    film_size : float or (float, float), optional
        Width, or width and height, in any unit; 1 wide when absent.
    film_offset : (float, float)
        Offset of the film's centre, right and up, in the film's unit.
    focal_length : float, optional
        In the film's unit.

    Raises
    ------
    LensError
        If a value is impossible, or two of them say the same thing twice.
    """

    def __init__(
        self,
        fov: float | tuple[float, float] | None = None,
        aspect_ratio: float | None = None,
        near: float = 1.0,
        far: float = 100000.0,
        film_size: float | tuple[float, float] | None = None,
        film_offset: tuple[float, float] = (0.0, 0.0),
        focal_length: float | None = None,
    ) -> None:
        super().__init__()
        # The two horizontal measures set last, the older one first. "min_fov" and "fov" share a place.
        self._given: dict[str, float] = {"min_fov": 30.0, "film_width": 1.0}
        if fov is not None and film_size is not None and focal_length is not None:
            raise LensError("fov, film_size and focal_length fix each other: give any two of the three")
        one_shape(aspect_ratio=aspect_ratio, fov=fov, film_size=film_size)
        if film_size is not None:
            self.set_film_size(*one_or_two("film_size", film_size))
        if focal_length is not None:
            self.set_focal_length(focal_length)
        if fov is not None:
            self.set_fov(*one_or_two("fov", fov))
        if aspect_ratio is not None:
            self.set_aspect_ratio(aspect_ratio)
        self.set_film_offset(*pair("film_offset", film_offset))
        self.set_near_far(near, far)

    def is_perspective(self) -> bool:
        """True."""
        return True

    def set_fov(self, horizontal: float, vertical: float | None = None) -> None:
        """Set the horizontal field of view in degrees and, with `vertical`, the aspect ratio too.

        Raises
        ------
        LensError
            If an angle is not between 0 and 180.
        """
        a = cot_half("the horizontal field of view", horizontal)
        aspect_ratio = None
        if vertical is not None:
            aspect_ratio = cot_half("the vertical field of view", vertical) / a
        self._change("fov", float(horizontal), aspect_ratio)

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
        """Set the film's width and, with `height`, the aspect ratio too.

        Raises
        ------
        LensError
            If a size is not above 0.
        """
        width = positive("film width", width)
        aspect_ratio = None if height is None else width / positive("film height", height)
        self._change("film_width", width, aspect_ratio)

    def set_focal_length(self, focal_length: float) -> None:
        """Set the distance from eye to film, in the film's unit.

        Raises
        ------
        LensError
            If it is not above 0.
        """
        self._change("focal_length", positive("focal length", focal_length), None)

    def set_aspect_ratio(self, aspect_ratio: float) -> None:
        """Set width over height; what was set of the horizontal, or of the narrower side, stays.

        Raises
        ------
        LensError
            If it is not above 0.
        """
        self._commit(self._given, positive("aspect ratio", aspect_ratio))

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
        return width, width / self._aspect_ratio

    def get_focal_length(self) -> float:
        """Distance from eye to film, in the film's unit."""
        focal = self._given.get("focal_length")
        return 0.5 * self._given["film_width"] * self._scales()[0] if focal is None else focal

    def with_aspect_ratio(self, aspect_ratio: float) -> Self:
        """A copy with the same vertical field of view, film height, film offset and focal length.

        Raises
        ------
        LensError
            If the ratio is not above 0.
        """
        aspect_ratio = positive("aspect ratio", aspect_ratio)
        height, focal = self.get_film_size()[1], self.get_focal_length()
        lens = self.make_copy()
        lens._commit({"film_width": height * aspect_ratio, "focal_length": focal}, aspect_ratio)
        return lens

    def _scales(self) -> tuple[float, float]:
        return _perspective_scales(self._given, self._aspect_ratio)

    def _change(self, name: str, value: float, aspect_ratio: float | None) -> None:
        """Set one horizontal measure; of the three, the one that was set longest ago falls out."""
        same = ("fov", "min_fov") if name in ("fov", "min_fov") else (name,)
        given = {key: old for key, old in self._given.items() if key not in same}
        given[name] = value
        if len(given) == 3:
            del given[next(iter(given))]
        self._commit(given, self._aspect_ratio if aspect_ratio is None else aspect_ratio)

    def _commit(self, given: dict[str, float], aspect_ratio: float) -> None:
        scales = _perspective_scales(given, aspect_ratio)
        if not all(math.isfinite(scale) and scale > 0.0 for scale in scales):
            said = ", ".join(f"{name} {value:g}" for name, value in given.items())
            raise LensError(
                f"this lens is too extreme for float64 ({said}, aspect ratio {aspect_ratio:g}): "
                "choose a less extreme value"
            )
        self._given, self._aspect_ratio = given, aspect_ratio
        self.revision += 1

    def _check_planes(self, near: float, far: float) -> None:
        if near <= 0.0:
            raise LensError(
                f"near of a perspective lens must be above 0, got {near:g}: move the near plane in front "
                "of the eye, or use an OrthographicLens"
            )


class OrthographicLens(Lens):
    """A lens of parallel rays; its film size is the size of what it sees, in scene units.

    Parameters
    ----------
    film_size : float or (float, float), optional
        Width, or width and height; 1 wide when absent.
    aspect_ratio : float, optional
        Width over height; 1 when nothing says otherwise.
    near, far : float
        Clipping planes in scene units, both finite; `near` may be negative.
    film_offset : (float, float)
        Offset of the film's centre, right and up.

    Raises
    ------
    LensError
        If a value is impossible, or two of them say the same thing twice.
    """

    def __init__(
        self,
        film_size: float | tuple[float, float] | None = None,
        aspect_ratio: float | None = None,
        near: float = 1.0,
        far: float = 100000.0,
        film_offset: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        super().__init__()
        self._width = 1.0
        one_shape(aspect_ratio=aspect_ratio, film_size=film_size)
        if film_size is not None:
            self.set_film_size(*one_or_two("film_size", film_size))
        if aspect_ratio is not None:
            self.set_aspect_ratio(aspect_ratio)
        self.set_film_offset(*pair("film_offset", film_offset))
        self.set_near_far(near, far)

    def is_perspective(self) -> bool:
        """False."""
        return False

    def set_film_size(self, width: float, height: float | None = None) -> None:
        """Set the width of the view and, with `height`, its aspect ratio too, in scene units.

        Raises
        ------
        LensError
            If a size is not above 0.
        """
        width = positive("film width", width)
        self._commit(width, self._aspect_ratio if height is None else width / positive("film height", height))

    def set_aspect_ratio(self, aspect_ratio: float) -> None:
        """Set width over height; the width stays.

        Raises
        ------
        LensError
            If it is not above 0.
        """
        self._commit(self._width, positive("aspect ratio", aspect_ratio))

    def get_film_size(self) -> tuple[float, float]:
        """Width and height of the view in scene units."""
        return self._width, self._width / self._aspect_ratio

    def with_aspect_ratio(self, aspect_ratio: float) -> Self:
        """A copy of the same height and film offset.

        Raises
        ------
        LensError
            If the ratio is not above 0.
        """
        aspect_ratio = positive("aspect ratio", aspect_ratio)
        lens = self.make_copy()
        lens._commit(self.get_film_size()[1] * aspect_ratio, aspect_ratio)
        return lens

    def _scales(self) -> tuple[float, float]:
        return 2.0 / self._width, 2.0 / self._width * self._aspect_ratio

    def _commit(self, width: float, aspect_ratio: float) -> None:
        scales = (2.0 / width, 2.0 / width * aspect_ratio)
        if not all(math.isfinite(scale) and scale > 0.0 for scale in scales):
            raise LensError(
                "this lens is too extreme for float64 "
                f"(film width {width:g}, aspect ratio {aspect_ratio:g}): choose a less extreme value"
            )
        self._width, self._aspect_ratio = width, aspect_ratio
        self.revision += 1

    def _check_planes(self, near: float, far: float) -> None:
        if not math.isfinite(far - near):
            raise LensError(
                f"an orthographic lens spreads its depth evenly from near to far, got near {near:g} and "
                f"far {far:g}: give a finite far"
            )


def _perspective_scales(given: dict[str, float], aspect_ratio: float) -> tuple[float, float]:
    """A and C: the cotangents of half the horizontal and half the vertical field of view."""
    if "fov" in given:
        a = cot_half("the field of view", given["fov"])
    elif "min_fov" in given:
        cot = cot_half("the field of view", given["min_fov"])
        return (cot / aspect_ratio, cot) if aspect_ratio >= 1.0 else (cot, cot * aspect_ratio)
    else:
        a = 2.0 * given["focal_length"] / given["film_width"]
    return a, a * aspect_ratio
