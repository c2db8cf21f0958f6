"""Many points in one node, lights or dots, as arrays or a function of time: as many nodes would be slow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import SceneError
from firefly_sample.scene.arrays import LARGEST, Fault, Float64, ReadOnlyArrays, checked_rows
from firefly_sample.scene.node import PandaNode

_COLOR_FAULTS: tuple[Fault, ...] = (
    ("color is negative or not finite", lambda c: ~(np.isfinite(c) & (c >= 0))),
    ("color is above 1e30", lambda c: c > LARGEST),
)
_NEGATIVE_OR_NAN: Fault = ("radius is negative or no number", lambda r: ~(r >= 0))
_NEGATIVE_OR_ENDLESS: Fault = ("radius is negative or not finite", lambda r: ~(np.isfinite(r) & (r >= 0)))

PointFunction = Callable[[float], tuple[ArrayLike, ArrayLike, ArrayLike]]
"""``function(time)``, time in seconds, returns (positions, colors, radii) as for `PointsNode`."""


@dataclass(frozen=True)
class PointArrays(ReadOnlyArrays):
    """The state of n points at one time.

    Positions are in the node's space, up to 1e18 from its origin. Colours are linear, 0 to 1e30. Radii are in
    scene units, 0 or more; finite except for lights without an end.
    """

    positions: Float64  # shape (n, 3)
    colors: Float64  # shape (n, 3)
    radii: Float64  # shape (n,)

    def __len__(self) -> int:
        return len(self.positions)


class PointsNode(PandaNode):
    """The base of `PointLights` and `Sprites`.

    Parameters
    ----------
    name : str
    positions, colors, radii : array_like
        Shapes (n, 3), (n, 3) or (3,), and (n,) or (); a single value is used for every point. Copied.
    function : callable, optional
        See `PointFunction`; it replaces the arrays. It is evaluated for each frame, and its result is not
        written back.

    Raises
    ------
    SceneError
        If shapes disagree or a number is out of range; the message names the node and the index of the first
        bad entry.
    """

    NOUN: ClassVar = "points"
    ERROR: type[SceneError] = SceneError

    def __init__(
        self,
        name: str,
        positions: ArrayLike = (),
        colors: ArrayLike = (1.0, 1.0, 1.0),
        radii: ArrayLike = 1.0,
        function: PointFunction | None = None,
    ) -> None:
        super().__init__(name)
        self.function = function
        self.arrays = self._checked(positions, colors, radii)

    @property
    def endless(self) -> bool:
        """True if a radius may be infinite."""
        return False

    def set_arrays(self, positions: ArrayLike, colors: ArrayLike, radii: ArrayLike) -> None:
        """Replace all points; their number may change."""
        self.arrays = self._checked(positions, colors, radii)
        self.mark_changed()

    def evaluate(self, time: float) -> PointArrays:
        """Return the points at `time` (seconds)."""
        if self.function is None:
            return self.arrays
        given = self.function(time)
        if not (isinstance(given, tuple) and len(given) == 3):
            raise self.ERROR(
                f"{self.NOUN} {self.name!r}: its function must return (positions, colors, radii), "
                f"got {type(given).__name__}"
            )
        return self._checked(*given)

    def _checked(self, positions: ArrayLike, colors: ArrayLike, radii: ArrayLike) -> PointArrays:
        where = f"{self.NOUN} {self.name!r}"
        columns = (
            ("colors", colors, 3, _COLOR_FAULTS),
            ("radii", radii, 0, (_NEGATIVE_OR_NAN if self.endless else _NEGATIVE_OR_ENDLESS,)),
        )
        return PointArrays(*checked_rows(where, self.ERROR, positions, columns))


class Sprites(PointsNode):
    """Any number of round, soft dots that face the camera and are added to the picture: glow, haze, sparks.

    Surfaces in front hide them. Their radiance is color * (1 - (r/radius)^2)^2 at the distance r from the
    centre; a dot smaller than a pixel is drawn a pixel wide and correspondingly fainter, so that distant dots
    neither vanish nor flicker. Parameters and errors are those of `PointsNode`.
    """

    NOUN = "sprites"
