"""Equal rows of an array, and numbers that links connect."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Int = NDArray[np.int64]


def row_ids(rows: NDArray[Any]) -> Int:
    """Return a number for each row of an array (n, k), 0 and up; equal rows have equal numbers."""
    order = np.lexsort(rows.T)
    ordered = rows[order]
    differs = (ordered[1:] != ordered[:-1]).any(axis=1)
    ids = np.empty(len(rows), dtype=np.int64)
    ids[order] = np.concatenate([np.zeros(min(len(rows), 1), dtype=np.int64), np.cumsum(differs)])
    return ids


def connected(count: int, one: Int, other: Int) -> Int:
    """Return the smallest number that each of 0 to `count` - 1 is linked with, over any number of links."""
    least = np.arange(count)
    while True:
        a, b = least[one], least[other]
        apart = a != b
        if not apart.any():
            return least
        np.minimum.at(least, np.maximum(a, b)[apart], np.minimum(a, b)[apart])
        while (least[least] != least).any():
            least = least[least]
