"""What lights have in common: colours, shadows, and how they fade."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import LightError
from firefly_sample.scene.arrays import LARGEST, as_color, as_colors
from firefly_sample.scene.falloff import Attenuation, Falloff, check_attenuation
from firefly_sample.scene.node import ALL_CAMERAS, PandaNode
from firefly_sample.settings import SHADOW_RESOLUTIONS, to_number, to_whole

Float64 = NDArray[np.float64]

SHADOW_RESOLUTION = 1024


class ShadowCaster(PandaNode):
    """A node of one or more lights that may cast shadows.

    Attributes
    ----------
    camera_mask : int
        Bits, as of a `Camera`: ``path.hide(mask)`` keeps what is below `path` from casting this light's
        shadows, if `mask` has all of these bits.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.camera_mask = ALL_CAMERAS
        self._casts = False
        self._resolution = SHADOW_RESOLUTION

    def set_shadow_caster(self, caster: bool, resolution: int | None = None) -> None:
        """Choose whether what the light meets first keeps it from what is behind.

        Parameters
        ----------
        caster : bool
        resolution : int, optional
            Texels along each side of the shadow map, 16 to 16384; the one there is when absent, 1024 at
            first. A point light has six such maps.

        Raises
        ------
        LightError
            If the resolution is not such a number.
        """
        if resolution is not None:
            low, high = SHADOW_RESOLUTIONS
            texels = to_whole(resolution)
            if texels is None or not low <= texels <= high:
                raise LightError(
                    f"light {self.name!r}: a shadow map's resolution must be a whole number of {low} to "
                    f"{high} texels, got {resolution!r}"
                )
            self._resolution = texels
        self._casts = bool(caster)
        self.mark_changed()

    def is_shadow_caster(self) -> bool:
        """Whether this light casts shadows."""
        return self._casts

    def get_shadow_resolution(self) -> int:
        """Texels along each side of the light's shadow map."""
        return self._resolution


class Light(ShadowCaster):
    """One light, of one colour.

    Parameters
    ----------
    name : str
        The node's name.
    color : sequence of 3 floats
        Linear radiance scale; any finite numbers of 0 or more, also above 1. A fourth, Panda3D's alpha, means
        nothing for a light and is left out.
    """

    def __init__(self, name: str, color: ArrayLike = (1.0, 1.0, 1.0)) -> None:
        super().__init__(name)
        self._color = light_color(name, color)
        self._specular: Float64 | None = None

    def set_color(self, color: ArrayLike) -> None:
        """Set the linear colour (r, g, b)."""
        self._color = light_color(self.name, color)
        self.mark_changed()

    def get_color(self) -> Float64:
        """The linear colour, shape (3,)."""
        return self._color.copy()

    def set_specular_color(self, color: ArrayLike) -> None:
        """Set the linear colour of highlights; they have the light's colour otherwise."""
        self._specular = light_color(self.name, color)
        self.mark_changed()

    def get_specular_color(self) -> Float64:
        """The linear colour of highlights, shape (3,)."""
        return self.get_color() if self._specular is None else self._specular.copy()

    def has_specular_color(self) -> bool:
        """Whether highlights have a colour of their own."""
        return self._specular is not None

    def clear_specular_color(self) -> None:
        """Let highlights have the light's colour again."""
        self._specular = None
        self.mark_changed()


class FadingLight(Light):
    """A light that shines from a place and fades with the distance from it.

    Without more, it is Panda3D's: attenuation (1, 0, 0) and no end. With a radius it fades as the fireflies
    do, by (1 - d/radius)^2.

    Parameters
    ----------
    name, color : see `Light`
    radius : float, optional
        Reach in scene units, finite and 0 or more.
    """

    def __init__(self, name: str, color: ArrayLike = (1.0, 1.0, 1.0), radius: float | None = None) -> None:
        super().__init__(name, color)
        self._attenuation: Attenuation | None = Attenuation.ENDLESS
        self._end = math.inf
        if radius is not None:
            self.set_radius(radius)

    @property
    def falloff(self) -> Falloff:
        """How the light fades."""
        return Falloff.RAMP_SQUARED if self._attenuation is None else Falloff.ATTENUATION

    def set_radius(self, radius: float) -> None:
        """Let the light fade by (1 - d/radius)^2, in scene units; finite, 0 or more."""
        end = self._length("radius", radius)
        if math.isinf(end):
            raise LightError(
                f"light {self.name!r}: radius must be finite: a light without end has an attenuation"
            )
        self._attenuation, self._end = None, end
        self.mark_changed()

    def set_attenuation(self, attenuation: ArrayLike) -> None:
        """Let the light fade by 1/(constant + linear*d + quadratic*d^2).

        A max distance stays as it was; a radius is forgotten.

        Parameters
        ----------
        attenuation : sequence of 3 floats
            (constant, linear, quadratic); see `Attenuation` for some with names.

        Raises
        ------
        LightError
            If a number is negative, or the largest is not one of 1e-30 to 1e30.
        """
        checked = check_attenuation(self.name, attenuation)
        if self._attenuation is None:
            self._end = math.inf
        self._attenuation = checked
        self.mark_changed()

    def get_attenuation(self) -> Attenuation | None:
        """(constant, linear, quadratic); None if the light fades over its radius."""
        return self._attenuation

    def set_max_distance(self, distance: float) -> None:
        """Let the light end at a distance in scene units, with a smooth window (`Settings.range_falloff`).

        Infinity takes the window away.

        Raises
        ------
        LightError
            If the distance is negative or no number, or the light fades over a radius, which is its end.
        """
        if self._attenuation is None:
            raise LightError(
                f"light {self.name!r} fades over its radius and ends there: use set_radius, or "
                "set_attenuation first"
            )
        self._end = self._length("max distance", distance)
        self.mark_changed()

    def get_max_distance(self) -> float:
        """Where the light ends, in scene units: its radius or max distance; infinity if nowhere."""
        return self._end

    def _length(self, what: str, value: float) -> float:
        length = to_number(value)
        if not length >= 0.0:
            raise LightError(f"light {self.name!r}: {what} must be a number of 0 or more, got {value!r}")
        return length


def light_color(name: str, color: ArrayLike) -> Float64:
    """A light's colour, checked, shape (3,).

    Raises
    ------
    LightError
        If it is not three (or, as Panda3D has it, four) numbers from 0 to 1e30; it names the light.
    """
    what = f"light {name!r}: color"
    rgb = as_colors(what, color, LightError, "three numbers of 0 or more")
    return as_color(what, rgb[:3] if rgb.shape == (4,) else rgb, 3, LARGEST, LightError)
