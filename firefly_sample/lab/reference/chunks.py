"""Work on many pixels in parallel, in chunks that fit a processor's cache.

NumPy releases Python's lock while it works on arrays, so threads are enough. Chunks do not depend on the
number of threads, so the results do not either, to the last bit.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Progress = Callable[[int, int], object]
"""``progress(done, total)`` is called as work goes on, from the thread that started it."""

_Part = TypeVar("_Part")


def chunks_of(items: NDArray[Any], size: int) -> list[NDArray[Any]]:
    """Split items into slices of at most `size`."""
    return [items[first : first + size] for first in range(0, len(items), size)]


def tiles_of(shape: tuple[int, ...], tile: tuple[int, int]) -> list[NDArray[np.intp]]:
    """Return the flat indices of pixels by tiles; for other than two dimensions, by slices of that size."""
    pixels = np.arange(int(np.prod(shape)))
    if len(shape) != 2:
        return chunks_of(pixels, tile[0] * tile[1])
    rows = chunks_of(pixels.reshape(shape), tile[0])
    return [part[:, x : x + tile[1]].reshape(-1) for part in rows for x in range(0, shape[1], tile[1])]


def run_all(
    work: Callable[[_Part], object],
    parts: Sequence[_Part],
    threads: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Call ``work(part)`` for each part.

    Parameters
    ----------
    work : callable
        Writes its results to a place of its own.
    threads : int, optional
        As many as processors when absent.
    """
    threads = threads or os.cpu_count() or 1
    if threads == 1 or len(parts) < 2:
        for done, part in enumerate(parts, 1):
            work(part)
            if progress is not None:
                progress(done, len(parts))
        return
    with ThreadPoolExecutor(threads) as pool:
        futures = [pool.submit(work, part) for part in parts]
        try:
            for done, future in enumerate(as_completed(futures), 1):
                future.result()
                if progress is not None:
                    progress(done, len(parts))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
