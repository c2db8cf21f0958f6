"""Tables as plain text."""

from __future__ import annotations

from firefly_sample.columns import align

ROWS = [("a", "1", "Which of the two it is."), ("bcd", "22", "How many."), ("e", "3", "")]


def test_columns_are_two_spaces_apart() -> None:
    assert align(ROWS) == "a    1   Which of the two it is.\nbcd  22  How many.\ne    3"


def test_the_last_column_is_wrapped() -> None:
    wrapped = "a    1   Which of the two it\n         is.\nbcd  22  How many.\ne    3"
    assert align(ROWS, 30) == wrapped
    assert align(ROWS, 5) == wrapped  # 20 characters are always left
