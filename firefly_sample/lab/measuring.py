"""Helpers that measurements share: needed packages, statistics, axes of plots, files of results."""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

from firefly_sample.errors import MissingPackageError
from firefly_sample.extras import install_command
from firefly_sample.whole_files import open_whole

_Item = TypeVar("_Item")


def require(*modules: str) -> None:
    """Raise `MissingPackageError`, which says how to install it, if a package for measuring is missing."""
    for module in modules:
        if find_spec(module) is None:
            package = module.replace("_", "-")
            raise MissingPackageError(f"measuring needs {package}: run {install_command('measure')}")


def quartile_spread(values: Sequence[float]) -> float:
    """Return the interquartile range over the median; 0 of fewer than two values."""
    if len(values) < 2:
        return 0.0
    first, median, third = statistics.quantiles(values, n=4, method="inclusive")
    return (third - first) / median if median else 0.0


def pareto_front(
    items: Iterable[_Item], time_and_error: Callable[[_Item], tuple[float, float]]
) -> list[_Item]:
    """Return the items that no other item beats in both time and error, fastest first."""
    front: list[_Item] = []
    least = math.inf
    for item in sorted(items, key=time_and_error):
        error = time_and_error(item)[1]
        if error < least:
            front.append(item)
            least = error
    return front


def logarithmic_axes(axes: Any) -> None:
    """Give both axes of a plot logarithmic scales, and a light grid behind the data."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True, which="major", color="#dddddd", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def write_json(path: Path, result: dict[str, Any]) -> None:
    """Write a result as JSON, whole or not at all."""
    with open_whole(path) as file:
        file.write(json.dumps(result, indent=1, allow_nan=False).encode() + b"\n")
