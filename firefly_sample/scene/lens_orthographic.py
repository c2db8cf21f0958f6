"""A lens of parallel rays."""

from __future__ import annotations

import math

from firefly_sample.errors import LensError
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lens_checks import one_of, one_or_two, one_shape, pair, positive
from firefly_sample.scene.lens_shape import Shape, film_shape


class OrthographicLens(Lens):
    """A lens of parallel rays; its film size is the size of what it sees, in scene units.

    Parameters
    ----------
    film_size : float or (float, float), optional
        Width at every picture's shape, or width and height; 1 wide when absent.
    aspect_ratio : float, optional
        Width over height; the picture's when absent.
    near, far : float, optional
        Clipping planes in scene units, both finite; `near` may be negative. Panda3D's 1 and 100,000 when
        absent.
    film_offset : (float, float)
        Offset of the film's centre, right and up.
    film_height : float, optional
        Height at every picture's shape, instead of `film_size`.

    Raises
    ------
    LensError
        If a value is impossible, or two of them say the same thing twice.
    """

    def __init__(
        self,
        film_size: float | tuple[float, float] | None = None,
        aspect_ratio: float | None = None,
        near: float | None = None,
        far: float | None = None,
        film_offset: tuple[float, float] = (0.0, 0.0),
        film_height: float | None = None,
    ) -> None:
        super().__init__()
        self._side, self._length = "width", 1.0  # the side of the film that stays, and how long it is
        one_of(film_size=film_size, film_height=film_height)
        one_shape(aspect_ratio=aspect_ratio, film_size=film_size)
        if film_size is not None:
            self.set_film_size(*one_or_two("film_size", film_size))
        if film_height is not None:
            self.set_film_height(film_height)
        if aspect_ratio is not None:
            self.set_aspect_ratio(aspect_ratio)
        self.set_film_offset(*pair("film_offset", film_offset))
        self._set_planes(near, far)

    def is_perspective(self) -> bool:
        """False."""
        return False

    def set_film_size(self, width: float, height: float | None = None) -> None:
        """Set the width of the view and, with `height`, fix its aspect ratio too, in scene units.

        Raises
        ------
        LensError
            If a size is not above 0.
        """
        width = positive("film width", width)
        self._change("width", width, None if height is None else film_shape(width, height))

    def set_film_height(self, height: float) -> None:
        """Set the height of the view in scene units; it stays so when the aspect ratio changes.

        Panda3D has no such setter.

        Raises
        ------
        LensError
            If it is not above 0.
        """
        self._change("height", positive("film height", height))

    def scale_film(self, factor: float) -> None:
        """Make the view larger or smaller by a factor; what was set of its shape stays.

        Raises
        ------
        LensError
            If the factor is not above 0.
        """
        self._change(self._side, self._length * positive("factor", factor))

    def get_film_size(self) -> tuple[float, float]:
        """Width and height of the view in scene units."""
        return _film(self._side, self._length, self._shape.ratio)

    def _scales(self) -> tuple[float, float]:
        width, height = self.get_film_size()
        return 2.0 / width, 2.0 / height

    def _change(self, side: str, length: float, shape: Shape | None = None) -> None:
        """Set the side that stays."""
        if shape is None:
            shape = self._shape.after({f"film_{self._side}": self._length}, {f"film_{side}": length})
        self._commit(side, length, shape)

    def _reshape(self, shape: Shape) -> None:
        self._commit(self._side, self._length, shape)

    def _commit(self, side: str, length: float, shape: Shape) -> None:
        film = _film(side, length, shape.ratio)
        if not all(size > 0.0 and math.isfinite(size) and math.isfinite(2.0 / size) for size in film):
            raise LensError(
                "this lens is too extreme for float64 "
                f"(film {side} {length:g}, aspect ratio {shape.ratio:g}): choose a less extreme value"
            )
        self._side, self._length, self._shape = side, length, shape
        self.revision += 1

    def _check_planes(self, near: float, far: float) -> None:
        if not math.isfinite(far - near):
            raise LensError(
                f"an orthographic lens spreads its depth evenly from near to far, got near {near:g} and "
                f"far {far:g}: give a finite far"
            )


def _film(side: str, length: float, ratio: float) -> tuple[float, float]:
    """Return width and height of a film of which one side is given."""
    return (length, length / ratio) if side == "width" else (length * ratio, length)
