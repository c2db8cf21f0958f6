"""Another processor: the last digits of functions of NumPy and `math` differ from this one's."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np
import pytest

_NUMPY = (
    *("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2"),
    *("exp", "log", "power", "hypot", "einsum", "dot"),
)
_MATH = ("sin", "cos", "tan", "asin", "acos", "atan2", "exp", "log", "pow", "hypot")
_STEPS = np.random.default_rng(1).integers(-1, 2, 4099)
"""Units in the last place by which values are moved, in turn."""


def move_last_digits(patch: pytest.MonkeyPatch) -> None:
    """Give the functions of NumPy and `math` results that are off by -1, 0 or 1 unit in the last place.

    The exact results 0, 1 and -1 stay.
    """
    for name in _NUMPY:
        patch.setattr(np, name, _moved(getattr(np, name)))
    patch.setattr(np.linalg, "norm", _moved(np.linalg.norm))
    patch.setattr(np.fft, "irfft2", _moved(np.fft.irfft2))
    for name in _MATH:
        patch.setattr(math, name, _moved(getattr(math, name)))


def _moved(function: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(function)
    def other(*arguments: Any, **options: Any) -> Any:
        result = function(*arguments, **options)
        if not isinstance(result, float | np.ndarray) or np.asarray(result).dtype != np.float64:
            return result
        values = np.array(result)
        exact = (values == 0.0) | (np.abs(values) == 1.0)
        steps = np.resize(_STEPS, values.shape)
        moved = np.where(exact, values, (values.view(np.int64) + steps).view(np.float64))
        return moved if isinstance(result, np.ndarray) else type(result)(moved)

    return other
