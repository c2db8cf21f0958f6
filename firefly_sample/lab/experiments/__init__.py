"""The extremes that `firefly_sample.lab.stability` measures, a module for each idea.

The list is open: a module has a tuple `CASES` of `Case`, and is named here.
"""

from __future__ import annotations

from firefly_sample.lab.experiments import (
    coordinates,
    distances,
    fading,
    lenses,
    limits,
    many_lights,
    particles,
    pictures,
    spotlights,
    surfaces,
    volumes,
    warnings,
)
from firefly_sample.lab.experiments.case import Case

__all__ = ["ALL_CASES"]

ALL_CASES: tuple[Case, ...] = (
    *distances.CASES,
    *lenses.CASES,
    *coordinates.CASES,
    *volumes.CASES,
    *fading.CASES,
    *many_lights.CASES,
    *surfaces.CASES,
    *spotlights.CASES,
    *particles.CASES,
    *pictures.CASES,
    *warnings.CASES,
    *limits.CASES,
)
"""In the order in which they are measured and shown."""
