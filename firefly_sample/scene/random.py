"""Counter-based random numbers: number `index` of stream `stream` of a seed, without drawing earlier ones.

The generator is Philox4x32-10 of J. K. Salmon, M. A. Moraes, R. O. Dror and D. E. Shaw, "Parallel random
numbers: as easy as 1, 2, 3", SC 2011: ten rounds of multiplying and mixing turn a 128-bit counter and a
64-bit key into 128 random bits. The seed is the key; index and stream fill the counter. Turning bits into
floats is done here as well, so a seed gives the same numbers with every version of NumPy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import ParameterError
from firefly_sample.settings import to_whole

UInt64 = NDArray[np.uint64]

_MULTIPLIERS = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_KEY_STEPS = 0x9E3779B9, 0xBB67AE85
_LOW_32_BITS = 0xFFFFFFFF


def check_seed(seed: int) -> int:
    """Return `seed` as a Python int, or raise ParameterError if it is not 0 to 2**64 - 1."""
    number = to_whole(seed)
    if number is None or not 0 <= number < 2**64:
        raise ParameterError(f"seed must be a whole number from 0 to 2**64 - 1, got {seed!r}")
    return number


def philox4x32(
    counter: tuple[UInt64, UInt64, UInt64, UInt64], key: tuple[int, int]
) -> tuple[UInt64, UInt64, UInt64, UInt64]:
    """Turn four 32-bit counter words and two 32-bit key words into four random 32-bit words.

    Each counter word is an array, least significant first, of shapes that broadcast. All values, also of the
    result, are below 2**32.
    """
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(10):
        high0, low0 = _halves(c0 * _MULTIPLIERS[0])
        high1, low1 = _halves(c2 * _MULTIPLIERS[1])
        c0, c1, c2, c3 = high1 ^ c1 ^ np.uint64(k0), low1, high0 ^ c3 ^ np.uint64(k1), low0
        k0 = (k0 + _KEY_STEPS[0]) & _LOW_32_BITS
        k1 = (k1 + _KEY_STEPS[1]) & _LOW_32_BITS
    return c0, c1, c2, c3


def uniform(seed: int, stream: ArrayLike, index: ArrayLike) -> NDArray[np.float64]:
    """Return uniform numbers in [0, 1), multiples of 2**-53; each depends on (seed, stream, index) alone.

    All three are whole numbers from 0 to 2**64 - 1, or ParameterError is raised. `stream` and `index`,
    typically which quantity and of which item, have shapes that broadcast to that of the result.
    """
    key = check_seed(seed)
    index_high, index_low = _halves(_whole("index", index))
    stream_high, stream_low = _halves(_whole("stream", stream))
    w0, w1, _, _ = philox4x32(
        (index_low, index_high, stream_low, stream_high), (key & _LOW_32_BITS, key >> 32)
    )
    # 27 bits of one word and 26 of the other fill a float64's mantissa.
    bits = ((w0 >> np.uint64(5)) << np.uint64(26)) | (w1 >> np.uint64(6))
    return np.asarray(bits * 2.0**-53, dtype=np.float64)


def _halves(words: UInt64) -> tuple[UInt64, UInt64]:
    return words >> np.uint64(32), words & np.uint64(_LOW_32_BITS)


def _whole(what: str, values: ArrayLike) -> UInt64:
    array = np.asarray(values)
    if array.dtype.kind not in "iu" or (array.size and array.min() < 0):
        raise ParameterError(f"random {what} must be whole numbers from 0 to 2**64 - 1, got {values!r}")
    return array.astype(np.uint64)
