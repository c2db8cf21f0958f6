"""A memo makes its value anew only when its key changed."""

from __future__ import annotations

import pytest

from firefly_sample.memo import Memo


def test_a_value_is_made_once_for_equal_keys_and_anew_for_another():
    made = []
    memo: Memo[list[int]] = Memo()

    def get(key: tuple[int, ...]) -> list[int]:
        return memo.get(key, lambda: made.append(key) or [*key])

    first = get((1, 2))
    assert get((1, 2)) is first
    assert get((3,)) == [3]
    assert get((1, 2)) == [1, 2]
    assert made == [(1, 2), (3,), (1, 2)]


def test_values_of_the_last_two_keys_are_kept():
    made = []
    memo: Memo[str] = Memo(2)
    for key in "ababcbc":
        assert memo.get(key, lambda key=key: made.append(key) or key.upper()) == key.upper()
    assert made == ["a", "b", "c"]
    memo.get("a", lambda: made.append("a again") or "A")
    assert made[3:] == ["a again"]


def test_none_is_a_key_and_a_value_like_any_other():
    memo: Memo[None] = Memo()
    made = []
    for _ in range(2):
        assert memo.get(None, lambda: made.append(1)) is None
    assert made == [1]


def test_a_failure_keeps_the_value_before():
    memo: Memo[int] = Memo()
    value = memo.get("a", lambda: 1)
    with pytest.raises(ZeroDivisionError):
        memo.get("b", lambda: 1 // 0)
    assert memo.get("a", lambda: 2) == value
