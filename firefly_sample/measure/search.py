"""Which settings are worth a measurement: predicted from each choice alone, the most promising first.

Errors of independent choices add up at most, and the times that they save multiply about. Both are only a
prediction: what is chosen in the end was drawn and timed as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

from firefly_sample.measure.variations import Variation

__all__ = ["Option", "Prediction", "options_of", "predictions"]

DIMENSIONS: tuple[tuple[str, ...], ...] = (
    ("position",),
    ("normals",),
    ("albedo",),
    ("accumulation",),
    ("cutoff_budget", "cutoff_threshold"),
    ("volume_proxy",),
    ("light_resolution",),
    ("shadow_taps",),
    ("shadow_resolution",),
)
"""Settings that are one decision together."""


@dataclass(frozen=True)
class Option:
    """One choice of a dimension, measured alone.

    Attributes
    ----------
    changes : dict
        Empty for the base's own.
    error : float
        What it adds to the error of the finest choice of its dimension, 0 or more.
    ratio : float
        Its time over the base's; 1 where the difference is within the spread.
    """

    changes: dict[str, Any]
    error: float
    ratio: float


@dataclass(frozen=True)
class Prediction:
    """Choices together: what they should err and take."""

    changes: dict[str, Any]
    error: float
    ratio: float


def options_of(
    singles: list[tuple[Variation, float, float, float]], base_error: float, fixed: Collection[str]
) -> list[list[Option]]:
    """The choices of each dimension that no other choice of it beats in both error and time.

    Parameters
    ----------
    singles : list of (Variation, error, ratio, spread)
        Each choice alone; errors are of whole frames.
    base_error : float
        The error of the base.
    fixed : collection of str
        Settings that stay.
    """
    dimensions = []
    for names in DIMENSIONS:
        if set(names) & set(fixed):
            continue
        mine = [entry for entry in singles if next(iter(entry[0].changes)) in names]
        finest = min([base_error, *(error for _, error, _, _ in mine)])
        options = [Option({}, base_error - finest, 1.0)]
        for variation, error, ratio, spread in mine:
            told_apart = abs(ratio - 1.0) > max(spread, 0.02)
            options.append(Option(variation.changes, error - finest, ratio if told_apart else 1.0))
        dimensions.append(_unbeaten(options))
    return dimensions


def _unbeaten(options: list[Option]) -> list[Option]:
    kept: list[Option] = []
    least = math.inf
    for option in sorted(options, key=lambda option: (option.ratio, option.error)):
        if option.error < least:
            kept.append(option)
            least = option.error
    return kept


def predictions(dimensions: list[list[Option]], finest: float) -> Iterator[Prediction]:
    """All combinations; `finest` is the error that is left when every choice is the finest."""
    for chosen in product(*dimensions):
        changes: dict[str, Any] = {}
        for option in chosen:
            changes |= option.changes
        yield Prediction(
            changes,
            finest + sum(option.error for option in chosen),
            math.prod(option.ratio for option in chosen),
        )
