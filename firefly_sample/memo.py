"""Values that are kept as long as what they were made from stays the same."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

Value = TypeVar("Value")


class Memo(Generic[Value]):
    """The values of the last few keys, by default of the last one."""

    def __init__(self, most: int = 1) -> None:
        self._most = most
        self._kept: list[tuple[Any, Value]] = []

    def get(self, key: object, make: Callable[[], Value]) -> Value:
        """Return what `make()` gave for an equal key, remade when the key is none of the last ones."""
        for kept, value in self._kept:
            if kept == key:
                return value
        value = make()
        self._kept = [(key, value), *self._kept[: self._most - 1]]
        return value
