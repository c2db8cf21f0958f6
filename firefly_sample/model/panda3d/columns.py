"""Columns of Panda3D's vertex data as arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64


class Rows(NamedTuple):
    """Some rows of vertex data: those of `span` that `kept` picks; all of them if it is None."""

    span: slice
    kept: NDArray[np.intp] | None

    @property
    def number(self) -> int:
        """The number of these rows."""
        return self.span.stop - self.span.start if self.kept is None else len(self.kept)


def read_column(data: Any, name: str, rows: Rows) -> Float64 | None:
    """Return a column as Panda3D's shaders get it, shape (n, 1) to (n, 4); None if there is none.

    Numbers are not changed, except that integers of colours are divided by the largest number of their type.
    """
    layout = data.get_format()
    number = layout.get_array_with(name)
    if number < 0:
        return None
    raw = _bytes(data, number)[rows.span]
    return _decoded(raw if rows.kept is None else raw[rows.kept], layout.get_column(name))


def _bytes(data: Any, number: int) -> NDArray[np.uint8]:
    """Return the bytes of an array of vertex data, shape (rows, stride)."""
    view = memoryview(data.get_array(number))
    if not view.c_contiguous:  # rows have a gap at their end
        view = memoryview(data.get_array_handle(number).get_data())
    stride = data.get_format().get_array(number).get_stride()
    return np.frombuffer(view, dtype=np.uint8).reshape(-1, stride)


def _decoded(raw: NDArray[np.uint8], column: Any) -> Float64:
    """Return the numbers of a column, from the bytes of its rows, shape (n, stride)."""
    from panda3d import core

    enums = core.GeomEnums
    kind, count = column.get_numeric_type(), column.get_num_components()
    if kind in (enums.NT_packed_dcba, enums.NT_packed_dabc):
        order = [0, 1, 2, 3] if kind == enums.NT_packed_dcba else [2, 1, 0, 3]
        codes = _view(raw, column, "u4", 1).astype("<u4").view(np.uint8)[:, order]
        return _scaled(codes, column)
    if kind == enums.NT_packed_ufloat:
        words = _view(raw, column, "u4", 1)[:, 0]
        # floats of 11, 11 and 10 bits have the exponents of float16, no sign, and fewer digits
        bits = [(words & 0x7FF) << 4, (words >> 11 & 0x7FF) << 4, words >> 22 << 5]
        halves = np.column_stack(bits).astype(np.uint16).view(np.float16)
        return halves.astype(np.float64)
    types = {
        enums.NT_uint8: "u1",
        enums.NT_uint16: "u2",
        enums.NT_uint32: "u4",
        enums.NT_int8: "i1",
        enums.NT_int16: "i2",
        enums.NT_int32: "i4",
        enums.NT_float32: "f4",
        enums.NT_float64: "f8",
    }
    return _scaled(_view(raw, column, types[kind], count), column)


def _view(raw: NDArray[np.uint8], column: Any, dtype: str, count: int) -> NDArray[Any]:
    """Return `count` numbers at a column's place in each row, shape (n, count)."""
    size = count * np.dtype(dtype).itemsize
    start = column.get_start()
    return np.ascontiguousarray(raw[:, start : start + size]).view(dtype)


def _scaled(values: NDArray[Any], column: Any) -> Float64:
    """Return numbers as float64; integers of a colour are 1 at the largest number of their type."""
    from panda3d import core

    numbers = values.astype(np.float64)
    if column.get_contents() == core.GeomEnums.C_color and values.dtype.kind == "u":
        numbers /= np.iinfo(values.dtype).max
    return numbers
