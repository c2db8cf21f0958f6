"""The bases of all lights: colours, shadows, and fading with distance."""

from __future__ import annotations

import math
from enum import Enum
from typing import ClassVar, Literal, NamedTuple

from numpy.typing import ArrayLike

from firefly_sample.errors import LightError
from firefly_sample.scene.arrays import LARGEST, Float64, as_color, as_colors, as_numbers
from firefly_sample.scene.camel_case import attribute
from firefly_sample.scene.node import ALL_CAMERAS, PandaNode
from firefly_sample.settings import SHADOW_RESOLUTIONS, to_number, to_whole

LightKind = Literal["point", "spot", "directional"]


class Falloff(Enum):
    """The function by which a light fades with the distance d."""

    RAMP_SQUARED = "ramp_squared"
    """(1 - d/R)^2 within the radius R, 0 beyond: the fireflies' own, smooth at R."""
    ATTENUATION = "attenuation"
    """1/(constant + linear*d + quadratic*d^2), times a smooth window where the light has a max distance."""


class _Coefficients(NamedTuple):
    constant: float
    linear: float
    quadratic: float


class Attenuation(_Coefficients):
    """The three coefficients of 1/(constant + linear*d + quadratic*d^2), d in scene units.

    Any three numbers of 0 or more, not all 0, are allowed; these are well-known ones.

    Attributes
    ----------
    ENDLESS
        (1, 0, 0), Panda3D's default: no fading. Such a light reaches every pixel, so it is drawn over the
        full screen unless it has a max distance.
    FIFTY_UNITS
        (1, 0.09, 0.032): from the light-volume slides, for lights with a range of about 50 units.
    INVERSE_SQUARE
        (1, 0, 1): 1 at the light and inverse-square far away; from the shader-lighting chapter.
    """

    __slots__ = ()

    ENDLESS: ClassVar[Attenuation]
    FIFTY_UNITS: ClassVar[Attenuation]
    INVERSE_SQUARE: ClassVar[Attenuation]


Attenuation.ENDLESS = Attenuation(1.0, 0.0, 0.0)
Attenuation.FIFTY_UNITS = Attenuation(1.0, 0.09, 0.032)
Attenuation.INVERSE_SQUARE = Attenuation(1.0, 0.0, 1.0)


def check_attenuation(light: str, value: ArrayLike) -> Attenuation:
    """Return `value` as an `Attenuation`, or raise LightError; the message names the light."""
    low, high = 1e-30, 1e30  # float32 holds few numbers outside
    what = f"light {light!r}: attenuation"
    expected = (
        f"three numbers of 0 or more (constant, linear, quadratic), the largest of them {low:g} to {high:g}"
    )
    given = as_numbers(what, value, LightError, expected)
    if given.shape != (3,) or not given.min() >= 0 or not low <= given.max() <= high:
        raise LightError(f"{what} must be {expected}, got {value!r}")
    return Attenuation(*given.tolist())


def light_color(name: str, color: ArrayLike) -> Float64:
    """Return a light's colour, shape (3,), or raise LightError; Panda3D's alpha is ignored."""
    what = f"light {name!r}: color"
    rgb = as_colors(what, color, LightError, "three numbers of 0 or more")
    return as_color(what, rgb[:3] if rgb.shape == (4,) else rgb, 3, LARGEST, LightError)


class ShadowCaster(PandaNode):
    """A node of one or more lights that may cast shadows.

    The setters of all lights raise LightError if a value is out of its range, and then change nothing.

    Attributes
    ----------
    kind : {"point", "spot", "directional"}
        The shape of the light.
    camera_mask : int
        Bits, as of a `Camera`: nodes that ``path.hide(mask)`` hides cast no shadows of this light if `mask`
        has all of these bits.
    """

    kind: ClassVar[LightKind]
    camera_mask = ALL_CAMERAS
    _casts = False
    _resolution = 1024

    def set_shadow_caster(
        self, caster: bool, resolution: int | None = None, height: int | None = None
    ) -> None:
        """Choose whether the light casts shadows.

        `resolution` is the number of texels along each side of the shadow map, 16 to 16384; unchanged when
        absent, 1024 at first. A point light has six such maps. They are square: `height`, Panda3D's second
        number, must be the same.
        """
        if height is not None and height != resolution:
            raise self._error(f"a shadow map is square, got {resolution!r} x {height!r} texels")
        if resolution is not None:
            low, high = SHADOW_RESOLUTIONS
            texels = to_whole(resolution)
            if texels is None or not low <= texels <= high:
                raise self._error(
                    f"a shadow map's resolution must be a whole number of {low} to {high} texels, "
                    f"got {resolution!r}"
                )
            self._resolution = texels
        self._casts = bool(caster)
        self.mark_changed()

    def is_shadow_caster(self) -> bool:
        """Return whether this light casts shadows."""
        return self._casts

    def get_shadow_resolution(self) -> int:
        """Return the texels along each side of the light's shadow map."""
        return self._resolution

    def _error(self, message: str) -> LightError:
        return LightError(f"light {self.name!r}: {message}")


class _Fading(ShadowCaster):
    """A node of one or more lights that fade with the distance from them."""

    _attenuation: Attenuation | None

    @property
    def falloff(self) -> Falloff:
        """The function by which the lights fade."""
        return Falloff.RAMP_SQUARED if self._attenuation is None else Falloff.ATTENUATION

    def get_attenuation(self) -> Attenuation | None:
        """Return (constant, linear, quadratic), or None if the lights fade over their radii."""
        return self._attenuation


class _Colored(PandaNode):
    """A node of light of one colour.

    Parameters
    ----------
    name : str
    color : sequence of 3 floats
        Linear radiance scale; finite numbers of 0 or more, which may exceed 1. A fourth number, Panda3D's
        alpha, is ignored.
    """

    color = attribute("color")

    def __init__(self, name: str, color: ArrayLike = (1.0, 1.0, 1.0)) -> None:
        super().__init__(name)
        self._color = light_color(name, color)

    def set_color(self, color: ArrayLike) -> None:
        """Set the linear colour (r, g, b)."""
        self._color = light_color(self.name, color)
        self.mark_changed()

    def get_color(self) -> Float64:
        """Return the linear colour, shape (3,)."""
        return self._color.copy()


class Light(_Colored, ShadowCaster):
    """One light, which has a position or a direction. `_Colored` has its parameters."""

    _specular: Float64 | None = None
    specular_color = attribute("specular_color")

    def set_specular_color(self, color: ArrayLike) -> None:
        """Set the linear colour of highlights, which otherwise have the light's colour."""
        self._specular = light_color(self.name, color)
        self.mark_changed()

    def get_specular_color(self) -> Float64:
        """Return the linear colour of highlights, shape (3,)."""
        return self.get_color() if self._specular is None else self._specular.copy()

    def has_specular_color(self) -> bool:
        """Return whether highlights have a colour of their own."""
        return self._specular is not None

    def clear_specular_color(self) -> None:
        """Give highlights the light's colour again."""
        self._specular = None
        self.mark_changed()


class FadingLight(Light, _Fading):
    """A light that shines from a position and fades with the distance from it.

    By default it is Panda3D's, with attenuation (1, 0, 0) and no end. With a radius it fades as the fireflies
    do, by (1 - d/radius)^2.

    Parameters
    ----------
    name, color : see `_Colored`
    radius : float, optional
        Reach in scene units, finite and 0 or more.
    """

    attenuation = attribute("attenuation")
    max_distance = attribute("max_distance")

    def __init__(self, name: str, color: ArrayLike = (1.0, 1.0, 1.0), radius: float | None = None) -> None:
        super().__init__(name, color)
        self._attenuation = Attenuation.ENDLESS
        self._end = math.inf
        if radius is not None:
            self.set_radius(radius)

    def set_radius(self, radius: float) -> None:
        """Let the light fade by (1 - d/radius)^2; the radius is in scene units, finite and 0 or more."""
        end = self._length("radius", radius)
        if math.isinf(end):
            raise self._error("radius must be finite: for a light without an end use set_attenuation")
        self._attenuation, self._end = None, end
        self.mark_changed()

    def set_attenuation(self, attenuation: ArrayLike) -> None:
        """Let the light fade by 1/(constant + linear*d + quadratic*d^2).

        `attenuation` is (constant, linear, quadratic), none of them negative, the largest 1e-30 to 1e30;
        `Attenuation` has well-known ones. A max distance is kept; a radius is dropped.
        """
        checked = check_attenuation(self.name, attenuation)
        if self._attenuation is None:
            self._end = math.inf
        self._attenuation = checked
        self.mark_changed()

    def set_max_distance(self, distance: float) -> None:
        """Let the light end at a distance in scene units, with a smooth window (`Settings.range_falloff`).

        The distance is 0 or more; infinity removes the window. Raise LightError if the light fades over a
        radius, where it ends.
        """
        if self._attenuation is None:
            raise LightError(
                f"light {self.name!r} fades over its radius and ends there: use set_radius, or "
                "set_attenuation first"
            )
        self._end = self._length("max distance", distance)
        self.mark_changed()

    def get_max_distance(self) -> float:
        """Return the distance at which the light ends: its radius or max distance, or infinity."""
        return self._end

    def _length(self, what: str, value: float) -> float:
        length = to_number(value)
        if not length >= 0.0:
            raise self._error(f"{what} must be a number of 0 or more, got {value!r}")
        return length
