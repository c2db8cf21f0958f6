"""Helpers that measurements share: packages that they need, the spread of times, files of results."""

from __future__ import annotations

import json
import statistics
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from firefly_sample.capture.writers import open_whole
from firefly_sample.errors import MissingPackageError
from firefly_sample.extras import install_command

_PACKAGES = {"embreex": "embreex", "flip_evaluator": "flip-evaluator", "matplotlib": "matplotlib"}


def require(*modules: str) -> None:
    """Check that the packages that a measurement needs are installed.

    Raises
    ------
    MissingPackageError
        If one is not; the message says how to install it.
    """
    for module in modules:
        if find_spec(module) is None:
            raise MissingPackageError(
                f"measuring needs {_PACKAGES[module]}: run {install_command('measure')}"
            )


def quartile_spread(values: Sequence[float]) -> float:
    """Return the interquartile range over the median; 0 of fewer than two values."""
    if len(values) < 2:
        return 0.0
    first, median, third = statistics.quantiles(values, n=4, method="inclusive")
    return (third - first) / median if median else 0.0


def write_json(path: Path, result: dict[str, Any]) -> None:
    """Write a result as JSON, whole or not at all."""
    with open_whole(path) as file:
        file.write(json.dumps(result, indent=1, allow_nan=False).encode() + b"\n")
