"""The kinds of lights. Each lights every model under the same root; nothing is switched on per model.

Many point lights are one node, `PointLights`, that holds arrays or a function of time that returns them. To
remove a light, detach or hide it. Colours are linear radiance scales; positions are in the node's space. As
in Panda3D, a node's scale moves positions but does not change a light's reach.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import LightError
from firefly_sample.scene.arrays import Float64, as_colors, as_numbers, read_only
from firefly_sample.scene.camel_case import attribute
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.light import (
    FadingLight,
    Light,
    _Colored,
    _Fading,
    check_attenuation,
    light_color,
)
from firefly_sample.scene.points import PointArrays, PointFunction, PointsNode
from firefly_sample.settings import to_number


class PointLights(PointsNode, _Fading):
    """Any number of point lights in one node.

    Parameters
    ----------
    name, positions, colors, function
        See `PointsNode`.
    radii : array_like, shape (n,) or (), optional
        Each light's reach in scene units, over which it fades by (1 - d/radius)^2; 1 when absent. With an
        `attenuation`, the distance at which each light ends, with a smooth window; infinite when absent.
    attenuation : sequence of 3 floats, optional
        Lets all lights of the node fade by 1/(constant + linear*d + quadratic*d^2); see `Attenuation`.
    specular_colors : array_like, shape (n, 3) or (3,), optional
        Linear colours of highlights; the lights' own when absent.

    Raises
    ------
    LightError
        If the arrays or the attenuation are wrong; see `PointsNode`.
    """

    kind = "point"
    NOUN = "light"
    ERROR = LightError

    def __init__(
        self,
        name: str,
        positions: ArrayLike = (),
        colors: ArrayLike = (1.0, 1.0, 1.0),
        radii: ArrayLike | None = None,
        function: PointFunction | None = None,
        *,
        attenuation: ArrayLike | None = None,
        specular_colors: ArrayLike | None = None,
    ) -> None:
        self._attenuation = None if attenuation is None else check_attenuation(name, attenuation)
        self._specular: Float64 | None = None
        if radii is None:
            radii = math.inf if self.endless else 1.0
        super().__init__(name, positions, colors, radii, function)
        self.set_specular_colors(specular_colors)

    @property
    def endless(self) -> bool:
        """True if a radius may be infinite, because an attenuation fades the lights."""
        return self._attenuation is not None

    def set_specular_colors(self, colors: ArrayLike | None) -> None:
        """Set the linear colours of highlights, shape (n, 3) or (3,); None is the lights' own."""
        given = None
        if colors is not None:
            given = read_only(as_colors(f"light {self.name!r}: specular colors", colors, LightError))
            if given.ndim not in (1, 2) or given.shape[-1] != 3:
                raise self._error(f"specular colors must have shape (n, 3) or (3,), got {given.shape}")
            for row in given.reshape(-1, 3):
                light_color(self.name, row)
        self._specular = given
        self.mark_changed()

    def specular_colors_of(self, arrays: PointArrays) -> Float64:
        """Return the linear colours of the highlights of lights that `evaluate` returned, shape (n, 3).

        Raise LightError if the number of specular colours is neither one nor the number of lights.
        """
        if self._specular is None:
            return arrays.colors
        try:
            return np.broadcast_to(self._specular, (len(arrays), 3))
        except ValueError:
            raise self._error(
                f"{len(self._specular)} specular colors for {len(arrays)} lights: give one for each, or one "
                "for all"
            ) from None


class PointLight(FadingLight):
    """A point light at its node's origin.

    Parameters
    ----------
    name : str
    color : sequence of 3 floats
        Linear radiance scale; finite numbers of 0 or more, which may exceed 1.
    radius : float, optional
        Reach in scene units: the light fades by (1 - d/radius)^2. Without it the light has Panda3D's
        attenuation (1, 0, 0) and no end.
    """

    kind = "point"


class DirectionalLight(Light):
    """Parallel light from infinitely far away, such as the sun's. It does not fade.

    It shines along its node's +Y axis, or in the direction that `set_direction` sets in the node's space. Its
    shadow map is fitted to the camera's view, up to the shadow distance.
    """

    kind = "directional"
    _direction: Float64 = read_only(np.array([0.0, 1.0, 0.0]))
    _shadow_distance = math.inf
    direction = attribute("direction")

    def set_direction(self, direction: ArrayLike) -> None:
        """Set the direction in which the light shines, in the node's space; of any length but 0."""
        what, expected = f"light {self.name!r}: direction", "three finite numbers, not all 0"
        given = as_numbers(what, direction, LightError, expected)
        if given.shape != (3,) or not np.isfinite(given).all() or not given.any():
            raise LightError(f"{what} must be {expected}, got {direction!r}")
        given /= np.abs(given).max()
        self._direction = given / np.linalg.norm(given)
        self.mark_changed()

    def get_direction(self) -> Float64:
        """Return the direction in which the light shines, in the node's space: a unit vector, shape (3,)."""
        return self._direction.copy()

    def set_shadow_distance(self, distance: float) -> None:
        """Set the distance from the camera, along its view axis, up to which there are shadows.

        In scene units, above 0. A single map covers the whole view, so a shorter distance gives sharper
        shadows. Surfaces beyond it may be lit without shadows. Infinity, the default, includes all geometry
        in view.
        """
        given = to_number(distance)
        if not given > 0.0:
            raise self._error(f"shadow distance must be a number above 0, got {distance!r}")
        self._shadow_distance = given
        self.mark_changed()

    def get_shadow_distance(self) -> float:
        """Return the distance from the camera up to which there are shadows, in scene units."""
        return self._shadow_distance


class AmbientLight(_Colored):
    """Light that comes from everywhere; several are added up, and black ones are skipped.

    Parameters
    ----------
    name : str
    color : sequence of 3 floats
        Linear radiance; finite numbers of 0 or more, which may exceed 1.
    """


SMALLEST_CONE = 0.01
"""The narrowest half-angle in degrees: below it, float32 cannot distinguish inside from outside."""


class Cone(NamedTuple):
    """The fading of a spotlight with the angle from its axis.

    `inner` and `outer` are half-angles in degrees: full strength within `inner`, none from `outer` on, a
    smooth step of 1 - cos(angle) between. Equal ones cut hard. The strength is also multiplied by
    cos(angle)^exponent.
    """

    inner: float
    outer: float
    exponent: float


class Spotlight(FadingLight):
    """A light at its node's origin that shines along +Y into a cone.

    As in Panda3D, a lens defines the width of the cone, which has a hard edge at half of the lens's
    horizontal field of view (30 degrees by default), and an exponent (50) defines how the light fades off its
    axis. `set_cone` gives it a smooth edge between two angles instead. Diffuse light and highlights fade
    alike. `FadingLight` has its parameters.
    """

    kind = "spot"
    _exponent = 50.0
    exponent = attribute("exponent")
    _edge: tuple[float, float] | None = None

    def __init__(self, name: str, color: ArrayLike = (1.0, 1.0, 1.0), radius: float | None = None) -> None:
        super().__init__(name, color, radius)
        self._lens = PerspectiveLens(fov=30.0)

    def set_lens(self, lens: PerspectiveLens) -> None:
        """Make the cone as wide as a lens's view, with a hard edge; later changes of the lens count too."""
        if not isinstance(lens, PerspectiveLens):
            raise self._error(f"a spotlight's lens is a PerspectiveLens, got {lens!r}")
        self._lens, self._edge = lens, None
        self.mark_changed()

    def get_lens(self) -> PerspectiveLens:
        """Return the lens whose horizontal field of view is the cone's full angle without `set_cone`."""
        return self._lens

    def set_exponent(self, exponent: float) -> None:
        """Set the exponent of a lens's cone, 0 to 1e6, which fades by cos(angle)^exponent; 0 is no fading."""
        given = to_number(exponent)
        if not 0.0 <= given <= 1e6:
            raise self._error(f"exponent must be a number of 0 to 1e6, got {exponent!r}")
        self._exponent = given
        self.mark_changed()

    def get_exponent(self) -> float:
        """Return the exponent."""
        return self._exponent

    def set_cone(self, inner: float, outer: float) -> None:
        """Set a soft edge: full strength up to the inner angle, a smooth fall to 0 at the outer one.

        The angles are half-angles in degrees, 0 <= inner <= outer <= 180, outer at least 0.01; the
        light-volume slides' are 20 and 30. Lens and exponent are ignored then, until `set_lens` is called.
        """
        angles = to_number(inner), to_number(outer)
        if not (0.0 <= angles[0] <= angles[1] <= 180.0 and angles[1] >= SMALLEST_CONE):
            raise self._error(
                "a cone's half-angles must be 0 <= inner <= outer <= 180 degrees with outer at least "
                f"{SMALLEST_CONE:g}, got {inner!r} and {outer!r}"
            )
        self._edge = angles
        self.mark_changed()

    def get_cone(self) -> Cone:
        """Return the cone that `set_cone` set, or the lens's with the exponent.

        Raise LightError if the lens's field of view is below 0.02 degrees.
        """
        if self._edge is not None:
            return Cone(*self._edge, 0.0)
        half = 0.5 * self._lens.get_hfov()
        # half of twice the smallest angle may come out an ulp below it
        if half < SMALLEST_CONE * (1.0 - 1e-9):
            raise self._error(
                f"its lens sees {2.0 * half:g} degrees: a spotlight needs {2.0 * SMALLEST_CONE:g} or more"
            )
        return Cone(half, half, self._exponent)
