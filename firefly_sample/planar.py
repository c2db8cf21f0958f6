"""Arrays of two to four channels per pixel: NumPy is fast along pixels, and slow along so short an axis."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray


def empty_planar(shape: tuple[int, ...], channels: int, dtype: DTypeLike = np.float64) -> NDArray[Any]:
    """An array of shape ``(*shape, channels)`` whose channels lie in memory one after the other.

    What NumPy computes from it lies likewise, so that its inner loops run along pixels.
    """
    return np.moveaxis(np.empty((channels, *shape), dtype), 0, -1)


def planar(values: NDArray[Any]) -> NDArray[Any]:
    """A copy of `values`, shape (..., channels), whose channels lie one after the other."""
    copy = empty_planar(values.shape[:-1], values.shape[-1], values.dtype)
    copy_channels(values, copy)
    return copy


def copy_channels(source: NDArray[Any], destination: NDArray[Any]) -> None:
    """Copy one array of shape (..., channels) into another, of any type, a channel at a time.

    Three bytes out of four of 800 by 600 pixels are there in a fifth of the time that one assignment takes.
    """
    for channel in range(source.shape[-1]):
        destination[..., channel] = source[..., channel]
