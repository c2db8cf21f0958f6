"""The extremes that `firefly_sample.lab.stability` measures, a module for each idea.

The list is open: a module has a tuple `CASES` of `Case`, and is named here.
"""

from __future__ import annotations

from firefly_sample.lab.stability_cases import (
    cones,
    crowds,
    distances,
    ends,
    fading,
    lenses,
    particles,
    pictures,
    places,
    surfaces,
    volumes,
    warnings,
)
from firefly_sample.lab.stability_cases.case import Case

__all__ = ["ALL_CASES"]

ALL_CASES: tuple[Case, ...] = (
    *distances.CASES,
    *lenses.CASES,
    *places.CASES,
    *volumes.CASES,
    *fading.CASES,
    *crowds.CASES,
    *surfaces.CASES,
    *cones.CASES,
    *particles.CASES,
    *pictures.CASES,
    *warnings.CASES,
    *ends.CASES,
)
"""In the order in which they are measured and shown."""
