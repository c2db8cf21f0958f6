"""Arrays of numbers from users: the types that are accepted and refused, and how they are converted.

==================  =========================================================================================
input               result
==================  =========================================================================================
numbers             float64: from integers and floats of any width, byte order and memory layout
indices             whole numbers: from integers, and from floats that are whole
colours             float64, linear: uint8 and uint16 divided by the largest number of their type, so that
                    255 and 65535 are 1, as in glTF; signed integers and floats as they are
pixels of textures  uint8: uint8, and signed integers of 0 to 255, as they are; uint16 divided by 65535,
                    floats of 0 to 1 and bool, rounded to the nearest of 256 codes
==================  =========================================================================================

Everything that NumPy can make an array of is accepted: lists, trimesh's and pandas' arrays, tensors in main
memory. Refused are text, complex numbers, dates, objects, rows of different lengths, masked entries (of an
array, or of arrays in a list), bool except for pixels, and uint32 and uint64 as colours and pixels, whose
white is unknown. A surface's colour, and a float pixel, may leave 0..1 by 1e-6, which is rounding.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import SceneError

Float64 = NDArray[np.float64]

LARGEST = 1e30
"""Largest number that is sent to the GPU as float32; products of it still fit."""
ROUNDING = 1e-6
"""Tolerance for computed floats just below 0 or just above 1, which are taken as 0 or 1."""


def as_numbers(
    what: str, values: ArrayLike, error: type[SceneError] = SceneError, expected: str = "numbers"
) -> Float64:
    """Return numbers as a float64 array of their own, or raise `error`: "{what} must be {expected}"."""
    return np.array(_given(what, values, error, "iuf", expected), dtype=np.float64, order="C")


def as_whole(what: str, values: ArrayLike) -> NDArray[Any]:
    """Return whole numbers as an array of their own type; the caller checks their range."""
    array = _given(what, values, SceneError, "iuf", "whole numbers")
    if array.dtype.kind == "f" and not (np.isfinite(array) & (array == np.floor(array))).all():
        raise SceneError(f"{what} must be whole numbers, got {_described(array)}")
    return array


def as_colors(
    what: str, values: ArrayLike, error: type[SceneError] = SceneError, expected: str = "numbers"
) -> Float64:
    """Return linear colours as a float64 array of their own; see the module for what integers mean."""
    array = _given(what, values, error, "iuf", expected)
    return np.array(array, dtype=np.float64, order="C") / _white(what, array, error)


def as_color(
    what: str, color: ArrayLike, channels: int, largest: float = 1.0, error: type[SceneError] = SceneError
) -> Float64:
    """Return one colour, read-only, shape (channels,), each of 0 to `largest`, or raise `error`."""
    expected = f"{'three' if channels == 3 else 'four'} numbers in 0..{largest:g}"
    given = as_colors(what, color, error, expected)
    if given.shape != (channels,) or outside(given, largest).any():
        hint = hint_above_one(given) if largest <= 1.0 else ""
        raise error(f"{what} must be {expected}, got {color!r}{hint}")
    return read_only(np.clip(given, 0.0, largest))


def outside(shares: Float64, largest: float = 1.0) -> NDArray[np.bool_]:
    """Return a mask of the numbers outside 0 to `largest`, up to rounding; NaN is outside."""
    return np.asarray(~((shares >= -ROUNDING) & (shares <= largest + ROUNDING)))


def hint_above_one(values: NDArray[Any]) -> str:
    """Return the end of a message about colours whose only fault is numbers above 1; else ""."""
    if values.size and values.min() >= 0.0 and np.isfinite(top := values.max()) and top > 1.0:
        return ": divide them by the number that is white (255), or give them as uint8"
    return ""


def as_codes(what: str, values: ArrayLike) -> NDArray[np.uint8]:
    """Return pixels of 8 bits as an array of their own; see the module for what other types mean."""
    array = _given(what, values, SceneError, "iufb", "numbers")
    if array.dtype == np.uint8:
        return np.array(array, order="C")
    if array.dtype.kind == "i":
        if not ((array >= 0) & (array <= 255)).all():
            raise SceneError(f"{what} of a signed type must be 0 to 255, got {_described(array)}")
        return array.astype(np.uint8, order="C")
    if array.dtype.kind == "f":
        if outside(array).any():
            hint = hint_above_one(array)
            raise SceneError(f"{what} of floats must be 0 to 1, got {_described(array)}{hint}")
        shares = np.clip(array.astype(np.float64), 0.0, 1.0)
    else:
        shares = array / _white(what, array, SceneError)
    return np.rint(shares * 255.0).astype(np.uint8, order="C")


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Make an array read-only, so that it cannot change without a new revision, and return it."""
    array.setflags(write=False)
    return array


class ReadOnlyArrays:
    """Base of classes with read-only arrays, which NumPy and pickle would make writeable in copies."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            if isinstance(value, np.ndarray):
                read_only(value)
        self.__dict__.update(state)
        if "serial" in state:  # a copy has one of its own
            self.__dict__["serial"] = new_serial()


def _white(what: str, array: NDArray[Any], error: type[SceneError]) -> int:
    """Return the number that stands for 1 in colours of an array's type; refuse types without one."""
    if array.dtype.kind != "u":
        return 1
    if array.dtype.itemsize > 2:
        raise error(
            f"{what} of unsigned integers must be uint8 or uint16, whose largest number is white, got "
            f"{_described(array)}: divide them by the number that is white, or give them as uint8 or uint16"
        )
    return int(np.iinfo(array.dtype).max)


def _given(what: str, values: ArrayLike, error: type[SceneError], kinds: str, expected: str) -> NDArray[Any]:
    """Return an array of one of these kinds, which may be the caller's own."""
    try:
        if _is_masked(values):
            raise ValueError("some entries are masked: fill them first")
        array = np.asarray(values)
    except (TypeError, ValueError, RuntimeError) as reason:
        raise error(f"{what} must be {expected}: {reason}") from None
    if array.dtype.kind not in kinds:
        raise error(f"{what} must be {expected}, got {_described(array)}")
    return array


def _is_masked(values: ArrayLike) -> bool:
    """Return whether entries are masked, of an array or of the arrays in a list or a tuple."""
    masked = sys.modules.get("numpy.ma")  # importing it takes long, and a masked array has imported it
    if masked is None:
        return False
    parts = values if isinstance(values, list | tuple) else (values,)
    return any(isinstance(part, masked.MaskedArray) and masked.is_masked(part) for part in parts)


def _described(array: NDArray[Any]) -> str:
    """Return an array's first numbers, type and shape, for a message."""
    first = ", ".join(repr(value) for value in array.ravel()[:3].tolist())
    return f"{first}{', ...' if array.size > 3 else ''} ({array.dtype} of shape {array.shape})"


_SERIALS = itertools.count()


def new_serial() -> int:
    """Return a number by which the GPU copies of an object are cached; unlike an id, it is never reused."""
    return next(_SERIALS)


Fault = tuple[str, Callable[[Float64], NDArray[np.bool_]]]
"""A description of a fault, and a function that returns a mask of the numbers that have it."""
_POSITION_FAULTS: tuple[Fault, ...] = (  # the GPU computes in float32, and squares distances
    ("position is not finite", lambda p: ~np.isfinite(p)),
    ("position is beyond 1e18", lambda p: np.abs(p) > 1e18),
)
Column = tuple[str, ArrayLike, int, Sequence[Fault]]
"""Numbers for the rows of a node: a plural for messages, the numbers, their width, and possible faults.

Colours have the shape (n, width) or (width,); other numbers have the width 0 and the shape (n,) or ().
"""


def checked_rows(
    where: str, error: type[SceneError], positions: ArrayLike, columns: Sequence[Column]
) -> tuple[Float64, ...]:
    """Return positions, shape (n, 3), and each column with n rows; copies, read-only.

    Raise `error` if shapes disagree or a number is wrong. The message begins with `where` and gives the index
    of the first bad entry.
    """
    points = as_numbers(f"{where}: positions", positions, error)
    if points.size == 0:
        points = points.reshape(0, 3)
    if points.ndim != 2 or points.shape[1] != 3:
        raise error(f"{where}: positions must have shape (n, 3), got {points.shape}")
    _check(where, error, points, _POSITION_FAULTS)
    rows, n = [points], len(points)
    for name, given, width, faults in columns:
        values = (as_colors if width else as_numbers)(f"{where}: {name}", given, error)
        shape = (n, width) if width else (n,)
        try:
            row = values if values.shape == shape else np.array(np.broadcast_to(values, shape))
        except ValueError:
            raise error(f"{where}: {n} positions need {name} of shape {shape}, got {values.shape}") from None
        _check(where, error, row, faults)
        rows.append(row)
    return tuple(map(read_only, rows))


def _check(where: str, error: type[SceneError], rows: Float64, faults: Sequence[Fault]) -> None:
    for what, wrong in faults:
        bad = wrong(rows)
        if bad.any():
            entry = int(np.argmax(bad.reshape(len(rows), -1).any(axis=1)))
            raise error(f"{where}: entry {entry}: its {what}")
