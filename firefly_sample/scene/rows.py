"""Rows of many things in one node: arrays that are given once, or for each, checked together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import SceneError
from firefly_sample.scene.arrays import LARGEST, as_colors, as_numbers, read_only

Float64 = NDArray[np.float64]
Fault = tuple[str, Callable[[Float64], NDArray[np.bool_]]]
"""What is wrong with an entry, and which numbers are."""


class Column(NamedTuple):
    """Numbers of each row.

    Attributes
    ----------
    name : str
        Plural, for messages: "radii".
    given : array_like
        Shape (n, width) or (width,); (n,) or () where `width` is 0.
    width : int
    faults : sequence of (str, callable)
        Each callable tells which numbers have the fault.
    colors : bool
        Whether they are colours: see `firefly_sample.scene.arrays`.
    """

    name: str
    given: ArrayLike
    width: int
    faults: Sequence[Fault]
    colors: bool = False


def color_faults() -> tuple[Fault, ...]:
    """What may be wrong with linear colours."""
    return (
        ("color is negative or not finite", lambda c: ~(np.isfinite(c) & (c >= 0))),
        ("color is above 1e30", lambda c: c > LARGEST),
    )


def checked_rows(
    where: str, error: type[SceneError], positions: ArrayLike, columns: Sequence[Column]
) -> tuple[Float64, ...]:
    """Positions, shape (n, 3), and each column with a row for each of them; copies, read-only.

    Raises
    ------
    SceneError
        `error`: if shapes disagree or a number is wrong; `where` begins the message, which gives the index of
        the first bad entry.
    """
    places = as_numbers(f"{where}: positions", positions, error)
    if places.size == 0:
        places = places.reshape(0, 3)
    if places.ndim != 2 or places.shape[1] != 3:
        raise error(f"{where}: positions must have shape (n, 3), got {places.shape}")
    # the GPU computes in float32, and squares distances
    faults: tuple[Fault, ...] = (
        ("position is not finite", lambda p: ~np.isfinite(p)),
        ("position is beyond 1e18", lambda p: np.abs(p) > 1e18),
    )
    _check(where, error, places, faults)
    rows, n = [places], len(places)
    for column in columns:
        values = (as_colors if column.colors else as_numbers)(f"{where}: {column.name}", column.given, error)
        shape = (n, column.width) if column.width else (n,)
        try:
            row = values if values.shape == shape else np.array(np.broadcast_to(values, shape))
        except ValueError:
            raise error(
                f"{where}: {n} positions need {column.name} of shape {shape}, got {values.shape}"
            ) from None
        _check(where, error, row, column.faults)
        rows.append(row)
    return tuple(map(read_only, rows))


def _check(where: str, error: type[SceneError], rows: Float64, faults: Sequence[Fault]) -> None:
    for what, wrong in faults:
        bad = wrong(rows)
        if bad.any():
            entry = int(np.argmax(bad.reshape(len(rows), -1).any(axis=1)))
            raise error(f"{where}: entry {entry}: its {what}")
