"""JSON objects of a glTF file, whose properties are checked when they are read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar, overload

from firefly_sample.errors import ModelError

if TYPE_CHECKING:
    from firefly_sample.model.gltf.document import Document

Default = TypeVar("Default")


class _Required:
    """The default of a property without one, which must be there."""


REQUIRED = _Required()


class JsonObject:
    """One JSON object of a file, and its place there, such as "meshes[0].primitives[1]".

    Each getter returns a property of one type. Without a default the property is required. All raise
    `ModelError`, which names the file and the place, if the property is missing, of a wrong type or out of
    range.
    """

    def __init__(self, document: Document, json: Mapping[str, Any], where: str) -> None:
        self.document = document
        self.json = json
        self.where = where

    def __contains__(self, key: str) -> bool:
        return key in self.json

    def place(self, key: str) -> str:
        """Return the place of a property, for messages."""
        return f"{self.where}.{key}" if self.where else key

    def error(self, key: str, what: str) -> ModelError:
        """Return an error about a property, or about the object itself if `key` is empty."""
        return self.document.error(self.place(key) if key else self.where, what)

    @overload
    def whole(self, key: str, *, least: int = 0, most: int | None = None) -> int: ...
    @overload
    def whole(
        self, key: str, default: Default, *, least: int = 0, most: int | None = None
    ) -> int | Default: ...
    def whole(self, key: str, default: Any = REQUIRED, *, least: int = 0, most: int | None = None) -> Any:
        """Return a whole number of `least` to `most`."""
        if self._is_absent(key, default):
            return default
        return self.document.as_whole(self.json[key], self.place(key), least, most)

    @overload
    def number(self, key: str, *, least: float = -math.inf, most: float = math.inf) -> float: ...
    @overload
    def number(
        self, key: str, default: Default, *, least: float = -math.inf, most: float = math.inf
    ) -> float | Default: ...
    def number(
        self, key: str, default: Any = REQUIRED, *, least: float = -math.inf, most: float = math.inf
    ) -> Any:
        """Return a finite number of `least` to `most`."""
        if self._is_absent(key, default):
            return default
        return self.document.as_number(self.json[key], self.place(key), least, most)

    @overload
    def numbers(
        self, key: str, count: int | None, *, least: float = -math.inf, most: float = math.inf
    ) -> tuple[float, ...]: ...
    @overload
    def numbers(
        self,
        key: str,
        count: int | None,
        default: Default,
        *,
        least: float = -math.inf,
        most: float = math.inf,
    ) -> tuple[float, ...] | Default: ...
    def numbers(
        self,
        key: str,
        count: int | None,
        default: Any = REQUIRED,
        *,
        least: float = -math.inf,
        most: float = math.inf,
    ) -> Any:
        """Return a list of `count` finite numbers (None: any number of them) of `least` to `most`."""
        if self._is_absent(key, default):
            return default
        entries = self._list(key)
        if count is not None and len(entries) != count:
            raise self.error(key, f"must be {count} numbers, got {len(entries)}")
        where = self.place(key)
        return tuple(
            self.document.as_number(entry, f"{where}[{i}]", least, most) for i, entry in enumerate(entries)
        )

    @overload
    def text(self, key: str) -> str: ...
    @overload
    def text(self, key: str, default: Default) -> str | Default: ...
    def text(self, key: str, default: Any = REQUIRED) -> Any:
        """Return a text; halves of characters, which no file can be written with, become "?"."""
        if self._is_absent(key, default):
            return default
        value = self.json[key]
        if not isinstance(value, str):
            raise self.error(key, f"must be a text, got {shown(value)}")
        return value.encode("utf-8", "replace").decode("utf-8")

    @overload
    def flag(self, key: str) -> bool: ...
    @overload
    def flag(self, key: str, default: Default) -> bool | Default: ...
    def flag(self, key: str, default: Any = REQUIRED) -> Any:
        """Return true or false."""
        if self._is_absent(key, default):
            return default
        value = self.json[key]
        if not isinstance(value, bool):
            raise self.error(key, f"must be true or false, got {shown(value)}")
        return value

    def object(self, key: str) -> JsonObject | None:
        """Return an object, None if there is none."""
        if key not in self.json:
            return None
        return self.document.as_object(self.json[key], self.place(key))

    def required_object(self, key: str) -> JsonObject:
        """Return an object that must be there."""
        if key not in self.json:
            raise self.error(key, "is missing")
        return self.document.as_object(self.json[key], self.place(key))

    def objects(self, key: str) -> list[JsonObject]:
        """Return a list of objects, which is empty if there is none."""
        where = self.place(key)
        return [
            self.document.as_object(entry, f"{where}[{i}]")
            for i, entry in enumerate(self._list(key) if key in self.json else [])
        ]

    def extension(self, name: str) -> JsonObject | None:
        """Return the object's extension of this name, None if it has none."""
        extensions = self.object("extensions")
        return extensions.object(name) if extensions is not None else None

    def index(self, key: str, kind: str) -> int | None:
        """Return an index into a list of the file, for example "meshes"; None if there is none."""
        if key not in self.json:
            return None
        return self.document.as_index(self.json[key], kind, self.place(key))

    def indices(self, key: str, kind: str) -> tuple[int, ...]:
        """Return a list of indices into a list of the file, which is empty if there is none."""
        where = self.place(key)
        return tuple(
            self.document.as_index(entry, kind, f"{where}[{i}]")
            for i, entry in enumerate(self._list(key) if key in self.json else [])
        )

    def accessors(self) -> dict[str, int]:
        """Return the object itself as names and indices of accessors, as a primitive's attributes are."""
        return {
            name: self.document.as_index(value, "accessors", self.place(name))
            for name, value in self.json.items()
        }

    def _is_absent(self, key: str, default: Any) -> bool:
        if key in self.json:
            return False
        if default is REQUIRED:
            raise self.error(key, "is missing")
        return True

    def _list(self, key: str) -> list[Any]:
        value = self.json[key]
        if not isinstance(value, list):
            raise self.error(key, f"must be a list, got {shown(value)}")
        return value


def shown(value: object) -> str:
    """Return a JSON value for a message, on one short line."""
    if isinstance(value, list | dict):
        return f"{'a list' if isinstance(value, list) else 'an object'} of {len(value)}"
    if isinstance(value, int) and abs(value) > 10**20:
        return "a number above 1e20" if value > 0 else "a number below -1e20"
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
