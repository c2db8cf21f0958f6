"""Lights. Each lights every model under the same root: there is nothing to switch on per model.

Many point lights are one node, `PointLights`, that holds arrays (or a function of time that yields
them); a single `PointLight` feeds the same arrays. A light is taken out by detaching or hiding it.
Colours are linear radiance scales; positions are in the node's space. As in Panda3D, a node's scale
moves positions but never stretches a light's radius.
"""

from __future__ import annotations

from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import LightError
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.points import PointFunction, PointsNode

__all__ = ["AmbientLight", "Falloff", "PointLight", "PointLights"]

Float64 = NDArray[np.float64]


class Falloff(Enum):
    """How a light fades with the distance d, up to its radius R."""

    RAMP_SQUARED = "ramp_squared"
    """(1 - d/R)^2 within R and 0 beyond: the fireflies' own, smooth at R, with no truncation error."""


class PointLights(PointsNode):
    """Any number of point lights in one node.

    Parameters
    ----------
    name, positions, colors, radii, function
        See `PointsNode`; a radius is a light's reach.
    falloff : Falloff
        Shared by all lights of the node.

    Raises
    ------
    LightError
        If the arrays are wrong; see `PointsNode`.
    """

    KIND = "light"
    ERROR = LightError

    def __init__(
        self,
        name: str,
        positions: ArrayLike = (),
        colors: ArrayLike = (1.0, 1.0, 1.0),
        radii: ArrayLike = 1.0,
        falloff: Falloff = Falloff.RAMP_SQUARED,
        function: PointFunction | None = None,
    ) -> None:
        super().__init__(name, positions, colors, radii, function)
        if falloff not in tuple(Falloff):
            kinds = ", ".join(str(kind) for kind in Falloff)
            raise LightError(f"light {name!r}: falloff must be one of {kinds}, got {falloff!r}")
        self.falloff = falloff

    def make_copy(self) -> PointLights:
        """A new node with the same lights, transform and attributes, without children."""
        copy = PointLights(self.name, falloff=self.falloff)
        self._copy_points_to(copy)
        return copy


class PointLight(PointLights):
    """One point light at its node's origin.

    Parameters
    ----------
    name : str
        The node's name.
    color : sequence of 3 floats
        Linear.
    radius : float
        Reach in scene units.
    """

    def __init__(
        self,
        name: str,
        color: ArrayLike = (1.0, 1.0, 1.0),
        radius: float = 1.0,
        falloff: Falloff = Falloff.RAMP_SQUARED,
    ) -> None:
        super().__init__(name, np.zeros((1, 3)), _one_color(name, color), [radius], falloff)

    def set_color(self, color: ArrayLike) -> None:
        """Set the linear colour (r, g, b)."""
        self.set_arrays(self.arrays.positions, _one_color(self.name, color), self.arrays.radii)

    def set_radius(self, radius: float) -> None:
        """Set the reach in scene units."""
        self.set_arrays(self.arrays.positions, self.arrays.colors, [radius])

    def make_copy(self) -> PointLight:
        """A new light with the same colour, radius, transform and attributes, without children."""
        copy = PointLight(self.name, falloff=self.falloff)
        self._copy_points_to(copy)
        return copy


class AmbientLight(PandaNode):
    """Light that comes from everywhere. Several add up.

    Parameters
    ----------
    name : str
        The node's name.
    color : sequence of 3 floats
        Linear radiance scale; black costs nothing, not even a pass.
    """

    def __init__(self, name: str, color: ArrayLike = (0.2, 0.2, 0.2)) -> None:
        super().__init__(name)
        self.set_color(color)

    def set_color(self, color: ArrayLike) -> None:
        """Set the linear colour (r, g, b), each finite and 0 or more."""
        self._light_color = _one_color(self.name, color)[0]
        self.mark_changed()

    def get_color(self) -> Float64:
        """The linear colour, shape (3,)."""
        return np.array(self._light_color, dtype=np.float64)

    def make_copy(self) -> AmbientLight:
        """A new light with the same colour, transform and attributes, without children."""
        copy = AmbientLight(self.name, self._light_color)
        self._copy_state_to(copy)
        return copy


def _one_color(name: str, color: ArrayLike) -> Float64:
    """A checked colour as shape (1, 3)."""
    rgb = np.array(color, dtype=np.float64)
    if rgb.shape != (3,) or not np.isfinite(rgb).all() or rgb.min() < 0:
        raise LightError(f"light {name!r}: color must be three finite numbers of 0 or more, got {color!r}")
    return np.asarray(rgb[None])
