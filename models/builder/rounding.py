"""Rounding whose results are the same on every processor.

The last digit of a sine or a power depends on the processor and its library. Two kinds of values make a large
difference of it: halves between two rounded values, and what should be 0. Both come from symmetric shapes.
"""

from __future__ import annotations

import numpy as np


def rounded(values, decimals=0):
    """Values to so many decimals; what is half-way, but for the last digits, goes to the even neighbour."""
    return np.round(np.round(values, decimals + 6), decimals) + 0.0  # -0 becomes 0


def cleaned(values):
    """Values of which those that are next to nothing beside the largest are 0."""
    values = np.asarray(values, float)
    return np.where(np.abs(values) > 1e-12 * np.abs(values).max(initial=0.0), values, 0.0)
