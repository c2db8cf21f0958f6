"""Which settings are worth a measurement: predicted from each choice alone, the most promising first.

Errors of independent choices add up at most, and the times that they save multiply about. Both are only a
prediction: what is chosen in the end was drawn and timed as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

DIMENSIONS: tuple[tuple[str, ...], ...] = (
    ("shadow_resolution",),
    ("shadow_taps",),
    ("cutoff_budget", "cutoff_threshold"),
    ("light_resolution",),
    ("accumulation",),
    ("albedo",),
    ("normals",),
    ("interpolation",),
    ("position",),
    ("volume_proxy",),
    ("particle_shadow_interpolation",),
    ("particle_shadow_slices",),
    ("particle_shadow_tile",),
    ("particle_shadow_format",),
    ("particle_shadows", "particle_shadow_reads"),
    ("particle_order", "particle_order_depths"),
)
"""Settings that are one decision together, those first that may err most."""


@dataclass(frozen=True)
class Measured:
    """One choice of a dimension: its error where all others are at their finest, its time over the base's."""

    changes: dict[str, Any]
    error: float
    ratio: float
    spread: float


@dataclass(frozen=True)
class Option:
    """One choice of a dimension.

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


def options_of(measured: list[Measured]) -> list[Option]:
    """The choices of a dimension that no other choice of it beats in both error and time, fastest first."""
    finest = min(entry.error for entry in measured)
    options = []
    for entry in measured:
        told_apart = abs(entry.ratio - 1.0) > max(entry.spread, 0.02)
        options.append(Option(entry.changes, entry.error - finest, entry.ratio if told_apart else 1.0))
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
