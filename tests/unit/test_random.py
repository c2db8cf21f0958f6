"""The counter-based generator against its authors' known answers and against plain integer arithmetic."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.errors import ParameterError
from firefly_sample.scene.random import philox4x32, uniform

ALL = 0xFFFFFFFF
uint32 = st.integers(0, ALL)
uint64 = st.integers(0, 2**64 - 1)


def philox(counter: list[int], key: list[int]) -> list[int]:
    """Philox4x32-10 as the paper's figure has it, on Python's integers."""
    x, (a, b) = list(counter), key
    for _ in range(10):
        left, right = x[0] * 0xD2511F53, x[2] * 0xCD9E8D57
        x = [right >> 32 ^ x[1] ^ a, right % 2**32, left >> 32 ^ x[3] ^ b, left % 2**32]
        a, b = (a + 0x9E3779B9) % 2**32, (b + 0xBB67AE85) % 2**32
    return x


def vectorised(counter: list[int], key: list[int]) -> list[int]:
    words = tuple(np.array([word], dtype=np.uint64) for word in counter)
    return [int(word[0]) for word in philox4x32(words, (key[0], key[1]))]


@pytest.mark.parametrize(
    ("counter", "key", "answer"),
    [
        ([0] * 4, [0] * 2, "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
        ([ALL] * 4, [ALL] * 2, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
        (
            [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344],
            [0xA4093822, 0x299F31D0],
            "d16cfe09 94fdcceb 5001e420 24126ea1",
        ),
    ],
)
def test_published_answers(counter: list[int], key: list[int], answer: str) -> None:
    assert " ".join(f"{word:08x}" for word in vectorised(counter, key)) == answer
    assert philox(counter, key) == vectorised(counter, key)


@given(st.lists(uint32, min_size=4, max_size=4), st.lists(uint32, min_size=2, max_size=2))
def test_every_counter_and_key(counter: list[int], key: list[int]) -> None:
    assert vectorised(counter, key) == philox(counter, key)


@given(uint64, uint64, uint64)
def test_uniform_is_the_first_53_bits(seed: int, stream: int, index: int) -> None:
    words = philox([index % 2**32, index >> 32, stream % 2**32, stream >> 32], [seed % 2**32, seed >> 32])
    bits = words[0] << 32 | words[1]
    # The lowest 5 and 6 bits of the words are dropped, then 53 remain.
    expected = ((bits >> 37 << 26) | (words[1] >> 6)) / 2**53
    assert uniform(seed, stream, index) == expected
    assert 0 <= expected < 1


def test_shapes_broadcast_and_values_stay() -> None:
    table = uniform(7, np.arange(5)[:, np.newaxis], np.arange(9))
    assert table.shape == (5, 9)
    assert table.dtype == np.float64
    assert table[3, 8] == uniform(7, 3, 8)
    assert uniform(7, 0, np.arange(0)).shape == (0,)
    assert len(np.unique(table)) == 45


def test_moments_and_independence() -> None:
    """Bounds of six standard errors, which chance passes once in 5e8."""
    n = 200_000
    u = uniform(1, np.arange(4)[:, np.newaxis], np.arange(n))
    assert np.abs(u.mean(axis=1) - 1 / 2).max() < 6 * np.sqrt(1 / 12 / n)
    assert np.abs(u.var(axis=1) - 1 / 12).max() < 6 * np.sqrt(1 / 180 / n)
    correlation = np.corrcoef(u) - np.eye(4)
    assert np.abs(correlation).max() < 6 / np.sqrt(n)


@pytest.mark.parametrize("seed", [-1, 2**64, 1.5, "7", None])
def test_seeds_out_of_range(seed: object) -> None:
    with pytest.raises(ParameterError, match=r"seed must be a whole number from 0 to 2\*\*64 - 1, got"):
        uniform(seed, 0, 0)  # type: ignore[arg-type]


@pytest.mark.parametrize(("stream", "index"), [(-1, 0), (0, -1), (0.5, 0), (0, [1.0]), (0, 2**64)])
def test_streams_and_indices_out_of_range(stream: object, index: object) -> None:
    with pytest.raises(ParameterError, match="must be whole numbers"):
        uniform(0, stream, index)  # type: ignore[arg-type]
