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


class Steps:
    """The steps of some work; each is reported to a `Progress`, if there is one."""

    def __init__(self, total: int, progress: Progress | None) -> None:
        self.done, self.total, self._progress = 0, total, progress

    def add(self, steps: int = 1) -> None:
        """Report that some more steps are done."""
        self.to(self.done + steps)

    def to(self, done: int) -> None:
        """Report that this many of all steps are done, if they are more than before."""
        done = min(done, self.total)
        if done > self.done and self._progress is not None:
            self._progress(done, self.total)
        self.done = max(done, self.done)


def chunks_of(items: NDArray[Any], size: int) -> list[NDArray[Any]]:
    """Split items into slices of at most `size`."""
    return [items[first : first + size] for first in range(0, len(items), size)]


def tiles_of(shape: tuple[int, ...], tile: tuple[int, int]) -> list[NDArray[np.intp]]:
    """Return the flat indices of pixels by tiles; unless there are two dimensions, by slices of that size."""
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
    """Call ``work(part)`` for each part, which writes its results to a place of its own.

    There are as many threads as processors when `threads` is absent.
    """
    threads = min(threads or os.cpu_count() or 1, len(parts))
    steps = Steps(len(parts), progress)
    if threads < 2:
        for part in parts:
            work(part)
            steps.add()
        return
    with ThreadPoolExecutor(threads) as pool:
        futures = [pool.submit(work, part) for part in parts]
        try:
            for future in as_completed(futures):
                future.result()
                steps.add()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
