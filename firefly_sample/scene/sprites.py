"""Soft additive dots that face the camera: the glow of the insects themselves, stars, sparks."""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import ArrayLike

from firefly_sample.scene.lights import LightArrays
from firefly_sample.scene.node import PandaNode

__all__ = ["Sprites"]


class Sprites(PandaNode):
    """Any number of round dots, added to the picture, hidden by what stands before them.

    Their radiance is color * (1 - (r/radius)^2)^2 at the distance r from the centre; a dot smaller than
    a pixel is drawn a pixel wide and as much fainter, so that far dots neither vanish nor flicker.

    Parameters
    ----------
    name : str
        The node's name.
    positions, colors, radii : array_like
        Shapes (n, 3), (n, 3) or (3,), and (n,) or (); radii in scene units, colours linear.
    function : callable, optional
        ``function(time)`` yields (positions, colors, radii) instead.

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
        function: Callable[[float], tuple[ArrayLike, ArrayLike, ArrayLike]] | None = None,
    ) -> None:
        super().__init__(name)
        self.function = function
        self.arrays = LightArrays.checked(name, positions, colors, radii)

    def evaluate(self, time: float) -> LightArrays:
        """The dots at `time` (seconds)."""
        if self.function is None:
            return self.arrays
        return LightArrays.checked(self.name, *self.function(time))

    def make_copy(self) -> Sprites:
        """A new node with the same dots, transform and attributes, without children."""
        copy = Sprites(self.name, function=self.function)
        copy.arrays = self.arrays
        self._copy_state_to(copy)
        return copy
