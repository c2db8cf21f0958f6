"""A value that is kept as long as what it was made from stays the same."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

Value = TypeVar("Value")


class Memo(Generic[Value]):
    """One value, kept with the key that it was made for."""

    def __init__(self) -> None:
        self._kept: tuple[Any, Value] | None = None

    def get(self, key: object, make: Callable[[], Value]) -> Value:
        """Return what `make()` gave for an equal key, remade when the key changed."""
        if self._kept is None or self._kept[0] != key:
            self._kept = (key, make())
        return self._kept[1]
