"""The functions by which lights fade with distance, and the coefficients of the classical one."""

from __future__ import annotations

from enum import Enum
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import LightError
from firefly_sample.scene.arrays import as_numbers

Float64 = NDArray[np.float64]


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


COEFFICIENTS = (1e-30, 1e30)
"""The range of the largest coefficient; float32 holds few numbers outside it."""

Attenuation.ENDLESS = Attenuation(1.0, 0.0, 0.0)
Attenuation.FIFTY_UNITS = Attenuation(1.0, 0.09, 0.032)
Attenuation.INVERSE_SQUARE = Attenuation(1.0, 0.0, 1.0)


def check_attenuation(light: str, value: ArrayLike) -> Attenuation:
    """Return `value` as an `Attenuation`.

    Raises
    ------
    LightError
        If it is not three numbers of 0 or more, or the largest is outside `COEFFICIENTS`; the message names
        the light.
    """
    low, high = COEFFICIENTS
    what = f"light {light!r}: attenuation"
    expected = (
        f"three numbers of 0 or more (constant, linear, quadratic), the largest of them {low:g} to {high:g}"
    )
    given = as_numbers(what, value, LightError, expected)
    if given.shape != (3,) or not given.min() >= 0 or not low <= given.max() <= high:
        raise LightError(f"{what} must be {expected}, got {value!r}")
    return Attenuation(*given.tolist())
