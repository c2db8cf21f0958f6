"""PLY files as tables of numbers.

This reader is our own: trimesh refuses binary files whose faces have different numbers of corners, as Blender
writes them, and leaves out strips. The format: G. Turk, "The PLY Polygon File Format", 1994.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

_TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_LONGEST_HEADER = 2**20

Column = NDArray[Any] | list[NDArray[Any]]
"""The values of a property: (n,); of a list (n, k), or arrays of different lengths."""


@dataclass
class PlyProperty:
    """A column of an element; of a list, `length` is the type of its length."""

    name: str
    type: str
    length: str | None = None


@dataclass
class PlyElement:
    """A table: its name, number of rows and columns, and once it is read their values."""

    name: str
    count: int
    properties: list[PlyProperty] = field(default_factory=list)
    columns: dict[str, Column] = field(default_factory=dict)


@dataclass
class PlyFile:
    """The tables of a file by name, and the textures that its comments name."""

    elements: dict[str, PlyElement]
    textures: list[str]


def parse_ply(data: bytes) -> PlyFile:
    """Return all tables of a PLY file.

    Raises
    ------
    ValueError
        If the header cannot be read, or the file does not hold what it announces.
    """
    order, elements, textures, start = _read_header(data)
    reader = _Binary(data, start, order) if order else _Text(data[start:])
    for element in elements:
        least = sum(reader.size(made.length or made.type) for made in element.properties)
        if element.count * least > reader.left():
            raise ValueError(f"cut short: its header promises {element.count} of {element.name!r}")
        if element.count:
            element.columns = _read_rows(reader, element)
    return PlyFile({element.name: element for element in elements}, textures)


def _read_header(data: bytes) -> tuple[str, list[PlyElement], list[str], int]:
    """Return the byte order ("" of text), the empty tables, the textures, and where the values begin."""
    end = data.find(b"end_header", 0, _LONGEST_HEADER)
    if not data.startswith(b"ply") or end < 0:
        raise ValueError("not a PLY file, or its header has no end")
    newline = data.find(b"\n", end)
    order: str | None = None
    elements: list[PlyElement] = []
    textures = []
    for line in data[:end].decode("latin-1").splitlines()[1:]:
        words = line.split()
        match words:
            case ["format", name, *_] if name in _ORDERS:
                order = _ORDERS[name]
            case ["element", name, count]:
                elements.append(PlyElement(name, int(count)))
            case ["property", "list", length, kind, name] if elements:
                elements[-1].properties.append(PlyProperty(name, _TYPES[kind], _TYPES[length]))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties.append(PlyProperty(name, _TYPES[kind]))
            case ["comment", word, *_] if word.lower() == "texturefile":
                textures.append(line.split(None, 2)[2].strip() if len(words) > 2 else "")
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                raise ValueError(f"this line of its header cannot be read: {line[:60]}")
    if order is None or any(element.count < 0 for element in elements):
        raise ValueError("its header lacks a format, or has a negative count")
    return order, elements, textures, newline + 1 if newline >= 0 else len(data)


class _Binary:
    """Reads values of their types, one after another."""

    def __init__(self, data: bytes, start: int, order: str) -> None:
        self.data, self.place, self.order = data, start, order

    def size(self, kind: str) -> int:
        return np.dtype(kind).itemsize

    def left(self) -> int:
        return len(self.data) - self.place

    def take(self, kind: str, count: int) -> NDArray[Any]:
        dtype = np.dtype(self.order + kind)
        if count < 0 or count * dtype.itemsize > self.left():
            raise ValueError("cut short, or a list's length is wrong")
        values = np.frombuffer(self.data, dtype, count, self.place)
        self.place += count * dtype.itemsize
        return values

    def take_rows(self, layout: list[tuple[str, str, int]], count: int) -> dict[str, NDArray[Any]] | None:
        """Return columns of rows that all have this layout, None if there are not so many values."""
        dtype = np.dtype([(name, self.order + kind, (length,)) for name, kind, length in layout])
        if count * dtype.itemsize > self.left():
            return None
        rows = np.frombuffer(self.data, dtype, count, self.place)
        self.place += count * dtype.itemsize
        return {name: rows[name] for name, _, _ in layout}


class _Text:
    """Reads values as numbers, one after another."""

    def __init__(self, data: bytes) -> None:
        self.values = np.array(data.split(), dtype=np.float64)
        self.place = 0

    def size(self, kind: str) -> int:
        return 1

    def left(self) -> int:
        return len(self.values) - self.place

    def take(self, kind: str, count: int) -> NDArray[Any]:
        if count < 0 or count > self.left():
            raise ValueError("cut short, or a list's length is wrong")
        self.place += count
        return _converted(self.values[self.place - count : self.place], kind)

    def take_rows(self, layout: list[tuple[str, str, int]], count: int) -> dict[str, NDArray[Any]] | None:
        width = sum(length for _, _, length in layout)
        if count * width > self.left():
            return None
        rows = self.values[self.place : self.place + count * width].reshape(count, width)
        self.place += count * width
        ends = np.cumsum([length for _, _, length in layout]).tolist()
        return {
            name: _converted(rows[:, end - length : end], kind)
            for (name, kind, length), end in zip(layout, ends, strict=True)
        }


def _converted(values: NDArray[Any], kind: str) -> NDArray[Any]:
    """Return numbers of a text as a type, if they are such numbers."""
    if kind.startswith("f"):
        return values
    limits = np.iinfo(kind)
    if not ((values >= limits.min) & (values <= limits.max)).all():
        raise ValueError(f"a number is not of {limits.min} to {limits.max}")
    return values.astype(kind)


def _read_rows(reader: _Binary | _Text, element: PlyElement) -> dict[str, Column]:
    """Return the columns of an element: at once if its lists are all as long as those of its first row."""
    start = reader.place
    first = _read_row(reader, element)
    reader.place = start
    layout = []
    for made, value in zip(element.properties, first, strict=True):
        if made.length is not None:
            layout.append((f"{made.name} length", made.length, 1))
        layout.append((made.name, made.type, len(value)))
    if len({name for name, _, _ in layout}) < len(layout):
        raise ValueError(f"its header names a property of {element.name!r} twice")
    columns = reader.take_rows(layout, element.count)
    if columns is not None and all(
        (columns[f"{made.name} length"] == columns[made.name].shape[1]).all()
        for made in element.properties
        if made.length is not None
    ):
        return {
            made.name: columns[made.name] if made.length is not None else columns[made.name][:, 0]
            for made in element.properties
        }
    reader.place = start
    rows = [_read_row(reader, element) for _ in range(element.count)]
    return {
        made.name: [row[place] for row in rows]
        if made.length is not None
        else np.array([row[place][0] for row in rows])
        for place, made in enumerate(element.properties)
    }


def _read_row(reader: _Binary | _Text, element: PlyElement) -> list[NDArray[Any]]:
    return [
        reader.take(made.type, 1 if made.length is None else int(reader.take(made.length, 1)[0]))
        for made in element.properties
    ]


def strips_to_triangles(strip: Sequence[int]) -> list[tuple[int, int, int]]:
    """Return the triangles of strips in one list, which -1 separates; every second one is turned."""
    triangles = []
    start = 0
    for place in range(2, len(strip)):
        a, b, c = strip[place - 2 : place + 1]
        if -1 in (a, b, c):
            start = place + 1 if c == -1 else start
        else:
            triangles.append((a, b, c) if (place - start) % 2 == 0 else (b, a, c))
    return triangles
