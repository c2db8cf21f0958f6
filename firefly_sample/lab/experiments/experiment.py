"""The record of an experiment, and the table of its figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.settings import PositionMethod

Value = str | float | int | None

POSITIONS: tuple[PositionMethod, ...] = get_args(PositionMethod)
"""The methods of most cases: the choices of `Settings.position_method`."""
FLOAT64 = ("float64",)
"""The method of cases that draw nothing, but measure what is computed before a frame is drawn; and a choice
of `Settings.interpolation`."""

EPS = 2.0**-24
"""Largest relative rounding error of float32: half the distance of 1 and the next number."""


@dataclass(frozen=True)
class Table:
    """The figures of an experiment.

    Attributes
    ----------
    name : str
    about : str
        A sentence: what the figures are.
    columns : tuple of str
        A column called "bound", or ending in " bound", holds the bound that theory gives for the figure
        before it, on drivers whose arithmetic rounds as IEEE 754 has it.
    rows : list of tuple
        Texts, numbers, or None where there is no figure; the first value names the row.
    """

    name: str
    about: str
    columns: tuple[str, ...]
    rows: list[tuple[Value, ...]]

    def value(self, row: str, column: str) -> Any:
        """Return the value in a row, by its first value, and a column."""
        return next(values for values in self.rows if values[0] == row)[self.columns.index(column)]

    def as_dict(self) -> dict[str, Any]:
        """Return plain JSON values; infinity is the text "inf"."""
        rows = [["inf" if value == math.inf else value for value in row] for row in self.rows]
        return {"name": self.name, "about": self.about, "columns": list(self.columns), "rows": rows}

    def as_text(self) -> list[tuple[str, ...]]:
        """Return head and rows as cells, for `firefly_sample.columns.align`."""
        return [self.columns, *(tuple(map(_cell, row)) for row in self.rows)]


def _cell(value: Value) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}" if 0.1 <= abs(value) < 1e4 else f"{value:.2g}"
    return f"{value:,}" if isinstance(value, int) else value


@dataclass(frozen=True)
class Experiment:
    """A measurement on a driver, row by row.

    ``firefly measure numerics`` prints a row's figures as a line of a table. ``firefly measure stability``
    holds the one figure of a row, whose name is a method's, to `bound`; such an experiment is called a case.

    Attributes
    ----------
    name : str
    measure : callable
        ``measure(bench, row, **sizes)`` returns a tuple of figures, or None if the driver lacks what the row
        needs. Of a case it returns one number.
    rows : tuple of str, or mapping
        Names of the rows. A mapping also has the values that `measure` gets in place of the names.
    columns : tuple of str
        Heads of the table's columns, as `Table` has them; a case needs none.
    about : str
        A sentence on the figures, in which sizes are named in braces; a case needs none.
    sizes : mapping
        How much is measured: numbers of samples, pixels or repetitions.
    bound : float or callable, optional
        A case's: ``bound(method)`` where methods have error laws of their own.
    needs : str
        The attribute of `Capabilities` without which a driver cannot draw the case; empty if every driver
        can.
    """

    name: str
    measure: Callable[..., Any]
    rows: tuple[str, ...] | Mapping[str, Any] = POSITIONS
    columns: tuple[str, ...] = ()
    about: str = ""
    sizes: Mapping[str, Any] = field(default_factory=dict)
    bound: float | Callable[[str], float] | None = None
    needs: str = ""

    def table(self, bench: ExperimentBench, **changed_sizes: Any) -> Table:
        """Measure all rows that the driver can have."""
        sizes = {**self.sizes, **changed_sizes}
        rows = self.rows if isinstance(self.rows, Mapping) else dict(zip(self.rows, self.rows, strict=True))
        measured = ((name, self.measure(bench, value, **sizes)) for name, value in rows.items())
        return Table(
            self.name,
            self.about.format(**sizes),
            self.columns,
            [(name, *figures) for name, figures in measured if figures is not None],
        )

    def bound_for(self, method: str) -> float:
        """Return the bound that a method must hold."""
        assert self.bound is not None
        return self.bound(method) if callable(self.bound) else self.bound


def relative_error(found: NDArray[np.float64], expected: NDArray[np.float64]) -> float:
    """Return the largest difference over the largest expected value; infinite if that is 0 or not finite."""
    if not (expected.any() and np.isfinite(expected).all()):
        return math.inf
    return float(np.abs(found - expected).max() / expected.max())
