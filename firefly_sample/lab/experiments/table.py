"""A table of figures: rows of plain values under named columns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

Value = str | float | int | None

EPS = 2.0**-24
"""Half the distance of 1 and the next float32: what one rounding errs by, relatively."""


@dataclass(frozen=True)
class Table:
    """What was measured of one question.

    Attributes
    ----------
    name : str
    about : str
        A sentence: what the numbers are.
    columns : tuple of str
        A column called "bound", or ending in " bound", holds what theory allows the figure before it where
        arithmetic rounds as IEEE 754 has it.
    rows : list of tuple
        A text, a number, or None where there is nothing to tell; the first value names the row.
    """

    name: str
    about: str
    columns: tuple[str, ...]
    rows: list[tuple[Value, ...]]

    def value(self, row: str, column: str) -> Any:
        """The value in a row, by its first value, and a column."""
        return next(values for values in self.rows if values[0] == row)[self.columns.index(column)]

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON values; what is infinite is the text "inf"."""
        rows = [["inf" if value == math.inf else value for value in row] for row in self.rows]
        return {"name": self.name, "about": self.about, "columns": list(self.columns), "rows": rows}

    def as_text(self) -> list[tuple[str, ...]]:
        """Head and rows as cells, for `firefly_sample.columns.align`."""
        return [self.columns, *(tuple(map(_cell, row)) for row in self.rows)]


def _cell(value: Value) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}" if 0.1 <= abs(value) < 1e4 else f"{value:.2g}"
    return f"{value:,}" if isinstance(value, int) else value
