"""Accessors of a glTF file as arrays (glTF 2.0, section 3.6.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.model.gltf.document import Bytes, Document
from firefly_sample.model.gltf.json_object import JsonObject, shown

COMPONENTS: dict[int, np.dtype[Any]] = {
    5120: np.dtype("<i1"),
    5121: np.dtype("<u1"),
    5122: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    5125: np.dtype("<u4"),
    5126: np.dtype("<f4"),
}
"""The dtype of each componentType."""
SHAPES: dict[str, tuple[int, ...]] = {
    "SCALAR": (),
    "VEC2": (2,),
    "VEC3": (3,),
    "VEC4": (4,),
    "MAT2": (2, 2),
    "MAT3": (3, 3),
    "MAT4": (4, 4),
}
"""The shape of one element of each type."""


@dataclass(frozen=True)
class Layout:
    """The type, number and layout of an accessor's elements."""

    count: int
    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    normalized: bool

    @property
    def column(self) -> int:
        """The bytes from one column of a matrix to the next, which start at multiples of four."""
        size = self.shape[0] * self.dtype.itemsize
        return size + (-size % 4 if len(self.shape) == 2 else 0)

    @property
    def size(self) -> int:
        """The bytes of an element, up to the last that counts (a last column is not padded)."""
        numbers = math.prod(self.shape)
        if len(self.shape) < 2:
            return numbers * self.dtype.itemsize
        return self.column * (self.shape[0] - 1) + self.shape[0] * self.dtype.itemsize

    @property
    def step(self) -> int:
        """The bytes from one element to the next where they are packed."""
        return self.column * self.shape[0] if len(self.shape) == 2 else self.size


def read_accessor(
    document: Document, index: object, where: str, types: tuple[str, ...] | None = None
) -> NDArray[Any]:
    """Return the elements of an accessor: shape (n,), (n, k) for vectors or (n, rows, columns) for matrices.

    Floats and normalised integers are float64, other integers keep their type. `min` and `max` are not
    trusted, and not read.

    Parameters
    ----------
    index : object
        The index in the file's list, as it is in the JSON.
    where : str
        The place in the JSON that refers to it.
    types : tuple of str, optional
        The types that are allowed there, for example ("VEC3", "VEC4").

    Raises
    ------
    ModelError
        If something is damaged, lies outside its bytes, is not finite or has another type.
    """
    accessor = document.item("accessors", index, where)
    layout = read_layout(accessor, where, types)
    return converted(accessor, layout, _stored(accessor, layout))


def read_layout(accessor: JsonObject, where: str, types: tuple[str, ...] | None = None) -> Layout:
    """Return what an accessor says about its elements; raise ModelError if its type is not allowed."""
    code = accessor.whole("componentType")
    if code not in COMPONENTS:
        known = ", ".join(map(str, COMPONENTS))
        raise accessor.error("componentType", f"must be one of {known}, got {shown(code)}")
    kind = accessor.text("type")
    if kind not in SHAPES:
        raise accessor.error("type", f"must be one of {', '.join(SHAPES)}, got {kind!r}")
    if types is not None and kind not in types:
        raise accessor.document.error(where, f"must be of type {' or '.join(types)}, got {kind}")
    normalized = accessor.flag("normalized", False)
    return Layout(accessor.whole("count"), COMPONENTS[code], SHAPES[kind], normalized)


def converted(accessor: JsonObject, layout: Layout, stored: NDArray[Any]) -> NDArray[Any]:
    """Return numbers as they are meant: normalised integers as floats, and all floats finite."""
    if stored.dtype.kind == "f":
        if not np.isfinite(stored).all():
            element = int(np.argwhere(~np.isfinite(stored))[0][0])
            raise accessor.error("", f"element {element} has a number that is not finite")
        return stored.astype(np.float64)
    if layout.normalized and stored.dtype.itemsize < 4:
        return normalised(stored, layout.dtype)
    return stored


def normalised(numbers: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[np.float64]:
    """Return normalised integers of a type as floats, by the formulas of section 3.11 ("Animations").

    Unsigned ones become c / max, and signed ones max(c / max, -1).
    """
    return np.asarray(np.maximum(numbers / np.float64(np.iinfo(dtype).max), -1.0))


def _stored(accessor: JsonObject, layout: Layout) -> NDArray[Any]:
    """Return the numbers in the type that they are stored in."""
    sparse = accessor.object("sparse")
    if "bufferView" not in accessor:
        accessor.document.claim(layout.count * math.prod(layout.shape), accessor.where)
        values = np.zeros((layout.count, *layout.shape), layout.dtype)
    else:
        values = _elements(accessor, layout)
    if sparse is not None:
        values = _with_sparse(sparse, layout, values)
    return values


def _elements(source: JsonObject, layout: Layout) -> NDArray[Any]:
    """Return the elements at the bufferView and byteOffset that an object names."""
    where = source.place("bufferView")
    if "bufferView" not in source:
        raise source.error("bufferView", "is missing")
    data, stride = source.document.read_buffer_view(source.json["bufferView"], where)
    offset = source.whole("byteOffset", 0)
    stride = stride or layout.step
    if stride < layout.size:
        raise source.error("", f"its elements have {layout.size} bytes, but its view's stride is {stride}")
    end = offset + stride * (layout.count - 1) + layout.size if layout.count else offset
    if end > len(data):
        raise source.error("", f"ends at byte {shown(end)} of a view that has {len(data)} bytes")
    return _strided(data, offset, stride, layout)


def _strided(data: Bytes, offset: int, stride: int, layout: Layout) -> NDArray[Any]:
    """Return elements that lie in bytes at a stride; matrices are stored by columns."""
    shape = (layout.count, *layout.shape)
    strides: tuple[int, ...] = (stride, layout.dtype.itemsize)[: len(shape)]
    if len(layout.shape) == 2:
        strides = (stride, layout.column, layout.dtype.itemsize)
    if not layout.count:
        return np.zeros(shape, layout.dtype)
    values = np.ndarray(shape, layout.dtype, data.data, offset, strides)
    return values.swapaxes(1, 2) if len(layout.shape) == 2 else values


def _with_sparse(sparse: JsonObject, layout: Layout, values: NDArray[Any]) -> NDArray[Any]:
    """Return a copy in which the elements of a sparse accessor replace others (section 3.6.2.3)."""
    count = sparse.whole("count", most=layout.count)
    places, replaced = sparse.required_object("indices"), sparse.required_object("values")
    code = places.whole("componentType")
    if code not in (5121, 5123, 5125):
        raise places.error("componentType", f"must be 5121, 5123 or 5125, got {shown(code)}")
    indices = _elements(places, Layout(count, COMPONENTS[code], (), False)).astype(np.int64)
    if (np.diff(indices) <= 0).any():
        raise places.error("", "must ascend strictly")
    if count and indices[-1] >= layout.count:
        raise places.error("", f"an index is {indices[-1]}, but the accessor has {layout.count} elements")
    values = np.array(values)
    values[indices] = _elements(replaced, replace(layout, count=count))
    return values
