"""Lights. Each lights every model under the same root: there is nothing to switch on per model.

Many point lights are one node, `PointLights`, that holds arrays (or a function of time that yields
them); a single `PointLight` feeds the same arrays. A light is taken out by detaching or hiding it.
Colours are linear radiance scales; positions are in the node's space. As in Panda3D, a node's scale
moves positions but never stretches a light's radius.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import LightError
from firefly_sample.scene.node import PandaNode

__all__ = ["AmbientLight", "Falloff", "LightArrays", "PointLight", "PointLights"]

Float64 = NDArray[np.float64]


class Falloff(Enum):
    """How a light fades with the distance d, up to its radius R."""

    RAMP_SQUARED = "ramp_squared"
    """(1 - d/R)^2 within R and 0 beyond: the fireflies' own, smooth at R, with no truncation error."""


@dataclass(frozen=True)
class LightArrays:
    """The state of n point lights at one time.

    Attributes
    ----------
    positions : ndarray of float64, shape (n, 3)
        In the space of the node that holds the lights.
    colors : ndarray of float64, shape (n, 3)
        Linear; above 1 is allowed, negative is not.
    radii : ndarray of float64, shape (n,)
        Reach in scene units, 0 or more; infinity is not allowed with `Falloff.RAMP_SQUARED`.
    """

    positions: Float64
    colors: Float64
    radii: Float64

    def __len__(self) -> int:
        return len(self.positions)

    @classmethod
    def checked(cls, name: str, positions: ArrayLike, colors: ArrayLike, radii: ArrayLike) -> LightArrays:
        """Arrays from anything array-like; a colour or radius given once is used for every light.

        Raises
        ------
        LightError
            If shapes disagree, or a number is not finite or is negative where it may not be; it names
            the light `name` and the index of the first bad entry.
        """
        p = np.asarray(positions, dtype=np.float64)
        if p.size == 0:
            p = p.reshape(0, 3)
        if p.ndim != 2 or p.shape[1] != 3:
            raise LightError(f"light {name!r}: positions must have shape (n, 3), got {p.shape}")
        n = len(p)
        try:
            c = np.array(np.broadcast_to(np.asarray(colors, dtype=np.float64), (n, 3)))
            r = np.array(np.broadcast_to(np.asarray(radii, dtype=np.float64), (n,)))
        except ValueError:
            raise LightError(
                f"light {name!r}: {n} positions need colors of shape ({n}, 3) and radii of shape ({n},), "
                f"got {np.shape(colors)} and {np.shape(radii)}"
            ) from None
        for what, bad in (
            ("position is not finite", ~np.isfinite(p).all(axis=1)),
            ("color is negative or not finite", ~(np.isfinite(c) & (c >= 0)).all(axis=1)),
            ("radius is negative or not finite", ~(np.isfinite(r) & (r >= 0))),
        ):
            if bad.any():
                raise LightError(f"light {name!r}: entry {int(np.argmax(bad))}: its {what}")
        return cls(p, c, r)


LightFunction = Callable[[float], tuple[ArrayLike, ArrayLike, ArrayLike]]


class PointLights(PandaNode):
    """Any number of point lights in one node.

    Parameters
    ----------
    name : str
        The node's name.
    positions, colors, radii : array_like
        Shapes (n, 3), (n, 3) or (3,), and (n,) or (); see `LightArrays`.
    falloff : Falloff
        Shared by all lights of the node.
    function : callable, optional
        ``function(time)`` yields (positions, colors, radii) instead: animation is evaluated for each
        frame and never written back.

    Raises
    ------
    LightError
        If the arrays are wrong; see `LightArrays.checked`.
    """

    def __init__(
        self,
        name: str,
        positions: ArrayLike = (),
        colors: ArrayLike = (1.0, 1.0, 1.0),
        radii: ArrayLike = 1.0,
        falloff: Falloff = Falloff.RAMP_SQUARED,
        function: LightFunction | None = None,
    ) -> None:
        super().__init__(name)
        self.falloff = falloff
        self.function = function
        self.arrays = LightArrays.checked(name, positions, colors, radii)

    def set_arrays(self, positions: ArrayLike, colors: ArrayLike, radii: ArrayLike) -> None:
        """Replace the lights; any count."""
        self.arrays = LightArrays.checked(self.name, positions, colors, radii)
        self.mark_changed()

    def evaluate(self, time: float) -> LightArrays:
        """The lights at `time` (seconds)."""
        if self.function is None:
            return self.arrays
        return LightArrays.checked(self.name, *self.function(time))

    def make_copy(self) -> PointLights:
        """A new node with the same lights, transform and attributes, without children."""
        copy = PointLights(self.name, falloff=self.falloff, function=self.function)
        copy.arrays = self.arrays
        self._copy_state_to(copy)
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
        copy = PointLight(self.name, self.arrays.colors[0], float(self.arrays.radii[0]), self.falloff)
        self._copy_state_to(copy)
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
